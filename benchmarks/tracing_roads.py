"""Cracks in procedural roads, traced between two clicks and held against their exact truth.

    python -m benchmarks.tracing_roads [--only KIND] [--seeds FIRST COUNT] [--jobs N] [--overlays FOLDER]

Photos of fixtures.generate.road: coarse asphalt with stones of 0.3 to 2 crack widths; cracks of 8 to 40 px that go
around the stones; markings, joints, shadows, oil and debris. Each is clicked at its true ends, missed by a hand's
noise. Seeds from 51000 on judge and are not for tuning; seeds 0 to 199 are for tuning.

A mean width is an area over a length, and the length of a line as crooked as these depends on how finely it is
followed: by 3 % from 0.3 to 0.6 crack widths. Truth follows it as digitise does; the area depends on no such choice.
"""

import re
import tempfile
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Annotated

import cv2
import numpy as np
from typer import Option

from benchmarks.table import Row, one_of, run_benchmark
from benchmarks.tracing_figures import distance_mm
from digitise.crack_path.find_path import find_path
from digitise.geometry.polyline import signed_area
from digitise.outline import trace_outline
from digitise.photo import load_photo
from digitise.settings import PhotoInput
from fixtures.generate.road import Road, road
from fixtures.generate.road_recipe import KINDS, SIZE_PX
from sealtwin.core.arc_length import arc_length
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats, Outline

CLICK_PX = 3.0
"""Standard deviation, in x and in y, of a click about the true end."""
MOST_REFUSED, MOST_WIDTH = 5.0, 5.0
"""Percent."""
HELD = (92.0, 98.0)
"""Percent of the intervals of 95 % that may hold the true width."""
FAR_OFF = 15.0
"""A mean width farther off, in percent, is one that a user would call wrong."""


@dataclass(frozen=True)
class RoadFigures:
    seed: int
    kind: str
    shows: str
    true_px: float
    refusal: str = ""
    source: str = ""
    """How the width was measured."""
    width_percent: float = float("nan")
    """Signed, like the next two."""
    area_percent: float = float("nan")
    length_percent: float = float("nan")
    centreline_mm: float = float("nan")
    """RMS distance of the traced centreline from the true one."""
    holds: bool | None = None
    """Whether the stated interval holds the true mean width; None if none is stated."""

    @property
    def summary(self) -> str:
        name = f"{self.seed} {self.shows or 'plain'}, {self.true_px:.1f} px"
        if self.refusal:
            return f"{name}: refused: {self.refusal}"
        interval = {None: "no interval", True: "in its interval", False: "OUTSIDE its interval"}[self.holds]
        return (
            f"{name}: width {self.width_percent:+.1f} % ({self.source}, {interval}), area {self.area_percent:+.1f} %, "
            f"length {self.length_percent:+.1f} %, centreline {self.centreline_mm:.2f} mm"
        )


def main(
    only: Annotated[str | None, one_of(KINDS)] = None,
    seeds: Annotated[tuple[int, int], Option(metavar="FIRST COUNT")] = (51_000, 200),
    jobs: int = 1,
    overlays: Annotated[Path | None, Option(help="draw each photo with true and traced walls into this folder")] = None,
) -> list[Row]:
    first, count = seeds
    if overlays is not None:
        overlays.mkdir(parents=True, exist_ok=True)
    figures = []
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        trace = partial(trace_road, only=only, overlays=overlays)
        for one in pool.map(trace, range(first, first + count)):
            figures.append(one)
            print(one.summary, flush=True)
    _print_kinds(figures)
    _print_refusals(figures)
    return road_rows(figures)


def trace_road(seed: int, only: str | None = None, overlays: Path | None = None) -> RoadFigures:
    """Draw a road, trace its crack between its clicked ends, and compare."""
    # One process to a core.
    cv2.setNumThreads(1)
    truth = road(seed, next((kind for kind in KINDS if kind == only), None))
    first, last = clicks(seed, truth)
    refusal, outline = "", None
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        truth.write(folder)
        settings = PhotoInput(file=Path("photo.jpg"), data="synthetic", mm_per_px=truth.recipe.mm_per_px)
        try:
            photo = load_photo(settings, folder)
            outline = trace_outline(photo, find_path(photo, (first, last)), settings)
        except InputError as error:
            refusal = str(error).removeprefix(f"{folder / 'photo.jpg'}: ")
    if overlays is not None:
        cv2.imwrite(str(overlays / f"{seed}.jpg"), _overlay(truth, outline, (first, last)))
    blank = RoadFigures(seed, truth.recipe.kind, " ".join(truth.recipe.shows), truth.mean_width_px, refusal)
    return blank if outline is None else _measured(blank, truth, outline)


def clicks(seed: int, truth: Road) -> tuple[tuple[float, float], tuple[float, float]]:
    """Where a user clicks: the true ends, missed by a hand's noise, inside the photo."""
    miss_px = CLICK_PX * np.random.default_rng([seed, 52]).standard_normal((2, 2))
    (a, b), (c, d) = np.clip(truth.ends_px + miss_px, 0, np.array(SIZE_PX) - 1).tolist()
    return (a, b), (c, d)


def road_rows(figures: Sequence[RoadFigures]) -> list[Row]:
    traced = [one for one in figures if not one.refusal]
    widths = np.array([one.width_percent for one in traced] or [np.inf])
    areas = np.array([one.area_percent for one in traced] or [np.inf])
    lengths = np.array([one.length_percent for one in traced] or [np.inf])
    lines = np.array([one.centreline_mm for one in traced] or [np.inf])
    stated = [one.holds for one in traced if one.holds is not None]
    rows = [
        Row(f"refused, of {len(figures)}", 100 * (len(figures) - len(traced)) / len(figures), "%", 0, MOST_REFUSED),
        Row(f"mean width, rms of {len(traced)}", _rms(widths), "%", 0, MOST_WIDTH),
        Row("mean width, median", float(np.median(widths)), "%"),
        Row(f"mean width more than {FAR_OFF:g} % off", int((abs(widths) > FAR_OFF).sum()), ""),
        Row("area, rms", _rms(areas), "%"),
        Row("area, median", float(np.median(areas)), "%"),
        Row("length, median", float(np.median(lengths)), "%"),
        Row("centreline, rms", _rms(lines), "mm"),
        Row("centreline, median", float(np.median(lines)), "mm"),
        Row(f"95 % interval of the width stated, of {len(traced)}", len(stated), ""),
    ]
    if stated:
        rows.append(Row("intervals that hold the true width", 100 * float(np.mean(stated)), "%", *HELD))
    return rows


def _measured(blank: RoadFigures, truth: Road, outline: Outline) -> RoadFigures:
    mm_per_px = truth.recipe.mm_per_px
    true_mm, length_mm = truth.mean_width_px * mm_per_px, mm_per_px * float(arc_length(truth.line_px)[-1])
    traced_px2 = abs(signed_area(outline.outline_px)) if outline.width_source != "none" else 0.0
    away_mm = distance_mm(outline.centreline_mm, truth.to_mm(truth.line_px))
    interval = outline.width_95_mm
    return RoadFigures(
        seed=blank.seed,
        kind=blank.kind,
        shows=blank.shows,
        true_px=blank.true_px,
        source=outline.width_source,
        width_percent=100 * (outline.mean_width_mm / true_mm - 1),
        area_percent=100 * (traced_px2 / abs(signed_area(truth.outline_px)) - 1),
        length_percent=100 * (outline.length_mm / length_mm - 1),
        centreline_mm=_rms(away_mm),
        holds=None if interval is None else interval[0] <= true_mm <= interval[1],
    )


def _print_kinds(figures: Sequence[RoadFigures]) -> None:
    print(f"\n{'kind':<10} {'photos':>7} {'refused':>8} {'width rms %':>12} {'median %':>9} {'area rms %':>11}")
    for kind in KINDS:
        own = [one for one in figures if one.kind == kind]
        traced = [one for one in own if not one.refusal]
        if traced:
            widths, areas = (
                np.array([getattr(one, name) for one in traced]) for name in ("width_percent", "area_percent")
            )
            seen = f"{_rms(widths):>12.1f} {np.median(widths):>9.1f} {_rms(areas):>11.1f}"
            print(f"{kind:<10} {len(own):>7} {len(own) - len(traced):>8} {seen}")
        elif own:
            print(f"{kind:<10} {len(own):>7} {len(own):>8}")


def _print_refusals(figures: Sequence[RoadFigures]) -> None:
    """Each sentence once, most frequent first, with its seeds; numbers as N."""
    sentences = {one.seed: re.sub(r"\d[\d.,]*", "N", one.refusal) for one in figures if one.refusal}
    for sentence, times in Counter(sentences.values()).most_common():
        seeds = " ".join(str(seed) for seed, own in sentences.items() if own == sentence)
        print(f"refused {times} times: {sentence}\n    seeds {seeds}")
    print()


def _overlay(truth: Road, outline: Outline | None, ends: Sequence[tuple[float, float]]) -> np.ndarray:
    """The photo with true walls in green, traced ones in red, and the clicks."""
    canvas = np.asarray(cv2.imdecode(np.frombuffer(truth.jpeg, np.uint8), cv2.IMREAD_COLOR), dtype=np.uint8)

    def line(points_px: Floats, colour: tuple[int, int, int]) -> None:
        cv2.polylines(canvas, [np.rint(16 * points_px).astype(np.int32)], False, colour, 1, cv2.LINE_AA, 4)

    for wall_px in (truth.left_px, truth.right_px):
        line(wall_px, (0, 220, 0))
    for wall_px in () if outline is None else (outline.left_wall_px, outline.right_wall_px):
        line(wall_px, (0, 0, 255))
    for x, y in ends:
        cv2.circle(canvas, (round(x), round(y)), 9, (255, 120, 0), 2, cv2.LINE_AA)
    return canvas


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


if __name__ == "__main__":
    run_benchmark(main)
