"""What a few strokes do for walls that debris, oil or shade mislead, on procedural roads with exact truth.

    python -m benchmarks.strokes [--cases N] [--first SEED]

Roads with debris, oil or shadow are drawn and traced between two clicks until N have doubtful walls: a mean width over
4 % off, or an area of which over 9 % is wrong. Over the three largest wrong places of each, a clumsy hand then draws a
stroke: two widths long at most, off by up to a third of the place's thickness. Seeds from 62000 on are not for tuning.
"""

import tempfile
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from benchmarks.table import Row, run_benchmark
from benchmarks.tracing_roads import clicks
from digitise.crack_path.find_path import find_path
from digitise.geometry.polyline import smoothed
from digitise.outline import trace_outline
from digitise.photo import load_photo
from digitise.settings import PhotoInput
from fixtures.generate.road import Road, road
from fixtures.generate.road_recipe import SIZE_PX, Kind
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats, Outline

MISLEADING: tuple[Kind, ...] = ("debris", "oil", "shadow")
WIDTH_OFF, AREA_OFF = 4.0, 9.0
"""Percent from which walls count as doubtful."""
MOST_STROKES = 3
LEAST_THICK_PX = 2.0
"""Half the thickness of a place that a hand can hit."""
STROKE_WIDTHS = 2.0
SLIP, MOST_SLIP_PX = 0.35, 2.5
"""Standard deviation of the hand over half the place's thickness, and the largest."""
STEP_PX = 4.0


@dataclass(frozen=True)
class Errors:
    width: float
    """Of the mean width in percent, signed."""
    area: float
    """Wrongly counted area over the true one in percent."""

    @property
    def doubtful(self) -> bool:
        return abs(self.width) > WIDTH_OFF or self.area > AREA_OFF


def main(cases: int = 20, first: int = 62_000) -> list[Row]:
    pairs, seed = list[tuple[Errors, Errors]](), first
    while len(pairs) < cases:
        kind = MISLEADING[seed % len(MISLEADING)]
        if (pair := before_and_after(seed, road(seed, kind))) is not None:
            pairs.append(pair)
            before, after = pair
            print(
                f"{seed} {kind:<7} width {before.width:+6.1f} -> {after.width:+5.1f} %, "
                f"wrong area {before.area:5.1f} -> {after.area:5.1f} %",
                flush=True,
            )
        seed += 1
    widths, areas = (
        np.abs([[getattr(errors, name) for errors in pair] for pair in pairs]).mean(axis=0)
        for name in ("width", "area")
    )
    return [
        Row(f"mean width, mean error of {cases} before strokes", widths[0], "%"),
        Row("after strokes", widths[1], "%", 0, 0.8 * widths[0]),
        Row("wrong area, mean before strokes", areas[0], "%"),
        Row("after", areas[1], "%", 0, 0.9 * areas[0]),
    ]


def before_and_after(seed: int, truth: Road) -> tuple[Errors, Errors] | None:
    """Trace a road without and with strokes; refused ones change nothing.

    None if the road is refused, has sound walls, or no place can be hit.
    """
    with tempfile.TemporaryDirectory() as name:
        truth.write(Path(name))
        settings = PhotoInput(file=Path("photo.jpg"), data="synthetic", mm_per_px=truth.recipe.mm_per_px)
        try:
            photo = load_photo(settings, Path(name))
            path = find_path(photo, clicks(seed, truth))
            plain = trace_outline(photo, path, settings)
        except InputError:
            return None
        before, strokes = errors_of(truth, plain), clumsy_strokes(seed, truth, plain)
        if not before.doubtful or not strokes:
            return None
        with_strokes = PhotoInput(**{**settings.model_dump(exclude_unset=True), **strokes})
        try:
            return before, errors_of(truth, trace_outline(photo, path, with_strokes))
        except InputError as refusal:
            print(f"{seed}: {refusal}")
            return before, before


def errors_of(truth: Road, outline: Outline) -> Errors:
    true, traced = _mask(truth.outline_px), _mask(outline.outline_px)
    true_mm = truth.mean_width_px * truth.recipe.mm_per_px
    return Errors(100 * (outline.mean_width_mm / true_mm - 1), 100 * float((true ^ traced).sum() / true.sum()))


def clumsy_strokes(seed: int, truth: Road, outline: Outline) -> dict[str, list[list[tuple[float, float]]]]:
    """Return strokes over the largest wrong places, by their settings."""
    rng, line = np.random.default_rng([seed, 53]), KDTree(truth.line_px)
    true, traced = _mask(truth.outline_px), _mask(outline.outline_px)
    places = list[tuple[int, str, NDArray[np.bool_]]]()
    for key, wrong in (("crack_strokes_px", true & ~traced), ("ground_strokes_px", traced & ~true)):
        count, label, stats, _ = cv2.connectedComponentsWithStats(wrong.astype(np.uint8), connectivity=4)
        thick = _depth_px(wrong)
        for number in range(1, count):
            if thick[label == number].max() >= LEAST_THICK_PX:
                places.append((int(stats[number, cv2.CC_STAT_AREA]), key, label == number))
    strokes = dict[str, list[list[tuple[float, float]]]]()
    for _, key, place in sorted(places, key=lambda each: -each[0])[:MOST_STROKES]:
        rows, columns = np.nonzero(place)
        pixels, depth_px = np.column_stack([columns, rows]).astype(float), _depth_px(place)[place]
        at_px = np.asarray(line.query(pixels)[1]) * 0.5  # a point of the true line each half pixel
        near = np.abs(at_px - at_px[depth_px.argmax()]) < STROKE_WIDTHS / 2 * truth.mean_width_px
        steps = [near & (at_px // STEP_PX == step) for step in np.unique(at_px[near] // STEP_PX)]
        middle = np.array([pixels[own][depth_px[own].argmax()] for own in steps])
        slip = min(SLIP * float(depth_px.max()), MOST_SLIP_PX)
        drawn = smoothed(middle, 1.0) + slip * smoothed(rng.standard_normal(middle.shape), 1.0, 0) / 0.5
        strokes.setdefault(key, []).append([(float(x), float(y)) for x, y in np.clip(drawn, 0, np.array(SIZE_PX) - 1)])
    return strokes


def _depth_px(mask: NDArray[np.bool_]) -> NDArray[np.float32]:
    return np.asarray(cv2.distanceTransform(mask.astype(np.uint8), cv2.DIST_L2, 5), dtype=np.float32)


def _mask(ring_px: Floats) -> NDArray[np.bool_]:
    mask = np.zeros(SIZE_PX[::-1], np.uint8)
    cv2.fillPoly(mask, [np.rint(16 * ring_px).astype(np.int32)], 1, cv2.LINE_8, 4)
    return mask > 0


if __name__ == "__main__":
    run_benchmark(main)
