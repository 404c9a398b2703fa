"""Cracks in procedural roads, traced between two clicks and held against their exact truth.

    python -m benchmarks.tracing_roads [--seeds FIRST COUNT] [--jobs N]

Photos of fixtures.generate.road: coarse asphalt with stones of 0.3 to 2 crack widths; cracks of 8 to 40 px that go
around the stones; markings, joints, shadows, oil and debris. Each is clicked at its true ends, missed by a hand's
noise. Seeds from 51000 on judge and are not for tuning; seeds 0 to 199 are for tuning.

A mean width is an area over a length, and the length of a line as crooked as these depends on how finely it is
followed: by 3 % from 0.3 to 0.6 crack widths. Truth follows it as digitise does.
"""

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from math import nan
from pathlib import Path
from typing import Annotated

import cv2
import numpy as np
from typer import Option

from benchmarks.table import Row, processes, rms, run_benchmark
from benchmarks.tracing_cases import Ends, clicked
from digitise.crack_path.find_path import find_path
from digitise.outline import trace_outline
from digitise.photo import load_photo
from digitise.settings import PhotoInput
from fixtures.generate.road import Road, road
from fixtures.generate.road_recipe import SIZE_PX
from sealtwin.core.errors import InputError
from sealtwin.core.records import Outline

CLICK_PX = 3.0
"""Standard deviation, in x and in y, of a click about the true end."""
MAX_REFUSED, MAX_WIDTH = 5.0, 5.0
"""Percent."""
HELD = (92.0, 98.0)
"""Percent of the intervals of 95 % that may hold the true width."""
FAR_OFF = 15.0
"""A mean width farther off, in percent, is one that a user would call wrong."""


@dataclass(frozen=True)
class RoadFigures:
    name: str
    refusal: str = ""
    source: str = ""
    """How the width was measured."""
    width_percent: float = nan
    """Signed."""
    holds: bool | None = None
    """Whether the stated interval holds the true mean width; None if none is stated."""

    @property
    def summary(self) -> str:
        if self.refusal:
            return f"{self.name}: refused: {self.refusal}"
        interval = {None: "no interval", True: "in its interval", False: "OUTSIDE its interval"}[self.holds]
        return f"{self.name}: width {self.width_percent:+.1f} % ({self.source}, {interval})"


def main(seeds: Annotated[tuple[int, int], Option(metavar="FIRST COUNT")] = (51_000, 200), jobs: int = 1) -> list[Row]:
    first, count = seeds
    figures = []
    with processes(jobs) as pool:
        for each in pool.map(trace_road, range(first, first + count)):
            figures.append(each)
            print(each.summary, flush=True)
    return road_rows(figures)


def trace_road(seed: int) -> RoadFigures:
    """Draw a road, trace its crack between its clicked ends, and compare."""
    # One process to a core.
    cv2.setNumThreads(1)
    truth = road(seed)
    name = f"{seed} {' '.join(truth.recipe.shows) or 'plain'}, {truth.mean_width_px:.1f} px"
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        truth.write(folder)
        settings = PhotoInput(file=Path("photo.jpg"), data="synthetic", mm_per_px=truth.recipe.mm_per_px)
        try:
            photo = load_photo(settings, folder)
            outline = trace_outline(photo, find_path(photo, clicks(seed, truth)), settings)
        except InputError as error:
            return RoadFigures(name, str(error).removeprefix(f"{folder / 'photo.jpg'}: "))
    if outline.width_source == "none":
        return RoadFigures(name, outline.warnings[0].text)
    return _measured(name, truth, outline)


def clicks(seed: int, truth: Road) -> Ends:
    """Return where a user clicks."""
    return clicked(truth.ends_px, CLICK_PX, [seed, 52], np.array(SIZE_PX))


def road_rows(figures: Sequence[RoadFigures]) -> list[Row]:
    traced = [each for each in figures if not each.refusal]
    widths = np.array([each.width_percent for each in traced] or [np.inf])
    stated = [each.holds for each in traced if each.holds is not None]
    rows = [
        Row(f"refused, of {len(figures)}", 100 * (len(figures) - len(traced)) / len(figures), "%", 0, MAX_REFUSED),
        Row(f"mean width, rms of {len(traced)}", rms(widths), "%", 0, MAX_WIDTH),
        Row("mean width, median", float(np.median(widths)), "%"),
        Row(f"mean width more than {FAR_OFF:g} % off", int((abs(widths) > FAR_OFF).sum()), ""),
        Row(f"95 % interval of the width stated, of {len(traced)}", len(stated), ""),
    ]
    if stated:
        rows.append(Row("intervals that hold the true width", 100 * float(np.mean(stated)), "%", *HELD))
    return rows


def _measured(name: str, truth: Road, outline: Outline) -> RoadFigures:
    true_mm, interval = truth.mean_width_px * truth.recipe.mm_per_px, outline.width_95_mm
    return RoadFigures(
        name,
        source=outline.width_source,
        width_percent=100 * (outline.mean_width_mm / true_mm - 1),
        holds=None if interval is None else interval[0] <= true_mm <= interval[1],
    )


if __name__ == "__main__":
    run_benchmark(main)
