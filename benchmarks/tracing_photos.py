"""The tracer against photos whose cracks somebody has drawn by hand.

    python -m benchmarks.tracing_photos DIR

Scores every X.png, X.jpg or X.jpeg in DIR that has an X_mask.png of its size beside it: bright is crack, all cracks of
the photo. The map of all cracks is held against the mask, and three ways to the main crack against the longest line of
the mask's skeleton: found by itself, between its two ends, between them past its middle. A photo that is refused
counts as wrong. Of the lines that are offered where nobody has clicked, one is right that lies on cracks of the mask.
"""

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy.ndimage import distance_transform_edt
from scipy.spatial import KDTree

from benchmarks.table import Row, run_benchmark
from digitise.crack_path.crack_map import cracks_on
from digitise.crack_path.darkness import DarkMap, map_darkness
from digitise.crack_path.find_path import CrackSearch, find_path
from digitise.crack_path.hints import CrackPath
from digitise.crack_path.medial_axis import longest_line
from digitise.photo import Photo, load_photo
from digitise.settings import PhotoInput, Pixel
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats

SUFFIXES = (".png", ".jpg", ".jpeg")
TOLERANCES_PX = (2, 5)
"""Of published scores; hand-drawn masks are about 3 px wide, and their middle is off by one or two."""
CLICK_SD_PX = 3.0
"""How far a click lands from the place it is meant for, along x and along y."""
RIGHT_SHARE, RIGHT_PX = 0.8, 5.0
"""A path is right when this share of it lies this close to the true line, and this share of that so close to it."""
WORST = 5
"""Photos that are named."""
MODES = ("automatic", "two ends", "ends and middle")


@dataclass
class Score:
    """How one photo fared."""

    name: str
    precision: dict[int, float] = field(default_factory=dict)
    """By tolerance in px."""
    recall: dict[int, float] = field(default_factory=dict)
    f1: dict[int, float] = field(default_factory=dict)
    offered: list[bool] = field(default_factory=list)
    """Whether each line that is offered without clicks is right, best first."""
    right: dict[str, bool] = field(default_factory=dict)
    """By mode."""
    refused: dict[str, str] = field(default_factory=dict)
    """By mode, in the tracer's words."""
    map_s: float = 0.0
    """CPU time of the map of all cracks."""
    ends_s: float = 0.0
    """CPU time between two ends."""


def main(folder: Path) -> list[Row]:
    return score_photos(folder)


def score_photos(folder: Path) -> list[Row]:
    """Score every photo, name the worst, and give the figures with their targets.

    Raises InputError where there is no photo with a mask, or one of another size.
    """
    pairs = [(photo, mask) for photo in sorted(folder.iterdir()) if (mask := _mask_of(photo)) is not None]
    if not pairs:
        raise InputError(f"{folder}: no photo X.png with a mask X_mask.png beside it.")
    scores = []
    for number, (photo_path, mask_path) in enumerate(pairs):
        scores.append(_score(number, load_photo(_settings(photo_path), folder), _read_mask(mask_path)))
    _name_worst(scores)
    return _rows(scores)


def f1_score(precision: float, recall: float) -> float:
    return 2 * precision * recall / (precision + recall) if precision + recall > 0 else 0.0


def overlap(cracks: NDArray[np.bool_], truth: NDArray[np.bool_], tolerance_px: float) -> tuple[float, float]:
    """Precision and recall of a mask: the share of what was found that is near truth, and of truth near what was found.

    Nothing found where nothing is, is all right.
    """
    if not cracks.any() or not truth.any():
        right = float(not cracks.any() and not truth.any())
        return right, right
    to_truth, to_cracks = (np.asarray(distance_transform_edt(~mask)) for mask in (truth, cracks))
    return float(np.mean(to_truth[cracks] <= tolerance_px)), float(np.mean(to_cracks[truth] <= tolerance_px))


def is_right(path_px: Floats, truth_px: Floats) -> bool:
    """Both polylines with points about a pixel apart."""
    there = np.mean(KDTree(truth_px).query(path_px)[0] <= RIGHT_PX)
    back = np.mean(KDTree(path_px).query(truth_px)[0] <= RIGHT_PX)
    return bool(min(there, back) >= RIGHT_SHARE)


def _on_photo(mask: NDArray[np.bool_], field: DarkMap, photo: Photo) -> NDArray[np.bool_]:
    """The map's cells as pixels of the photo."""
    shift_x, shift_y = (0.5 * field.scale - 0.5 - offset_px * field.scale for offset_px in field.offset_px)
    to_map = np.array([[field.scale, 0, shift_x], [0, field.scale, shift_y]])
    how = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    return cv2.warpAffine(mask.astype(np.uint8) * 255, to_map, photo.size_px, flags=how) > 127


def _score(number: int, photo: Photo, truth: NDArray[np.bool_]) -> Score:
    if truth.shape != photo.brightness.shape:
        raise InputError(f"{photo.file}: the mask has another size than the photo.")
    score = Score(photo.file.name)
    start = time.process_time()
    search_map = map_darkness(photo)
    mask = _on_photo(cracks_on(search_map).mask, search_map, photo)
    score.map_s = time.process_time() - start
    for tolerance_px in TOLERANCES_PX:
        precision, recall = overlap(mask, truth, tolerance_px)
        score.precision[tolerance_px], score.recall[tolerance_px] = precision, recall
        score.f1[tolerance_px] = f1_score(precision, recall)
    on_crack_px = np.argwhere(truth)[:, ::-1].astype(float)
    for crack in CrackSearch.of(photo).cracks if len(on_crack_px) else ():
        away_px = KDTree(on_crack_px).query(_dense(crack.line_px))[0]
        score.offered.append(bool(np.mean(away_px <= RIGHT_PX) >= RIGHT_SHARE))
    line_px = longest_line(truth)[:, ::-1].astype(float)
    if len(line_px) < 2:
        return score
    first, middle, last = _clicks(number, line_px, photo)
    questions: dict[str, Callable[[], CrackPath]] = {
        "automatic": lambda: find_path(photo, None),
        "two ends": lambda: find_path(photo, (first, last)),
        "ends and middle": lambda: find_path(photo, (first, last), (middle,)),
    }
    for mode, ask in questions.items():
        start = time.process_time()
        try:
            score.right[mode] = is_right(_dense(ask().points_px), line_px)
        except InputError as refusal:
            score.right[mode] = False
            score.refused[mode] = str(refusal).removeprefix(f"{photo.file}: ")
        if mode == "two ends":
            score.ends_s = time.process_time() - start
    return score


def _clicks(number: int, line_px: Floats, photo: Photo) -> tuple[Pixel, Pixel, Pixel]:
    """First end, middle and last end of the true line, each as a hand would click it, inside the photo."""
    error_px = CLICK_SD_PX * np.random.default_rng(number).standard_normal((3, 2))
    clicked = np.clip(line_px[[0, len(line_px) // 2, -1]] + error_px, 0, np.array(photo.size_px) - 1)
    (x0, y0), (x1, y1), (x2, y2) = clicked.tolist()
    return (x0, y0), (x1, y1), (x2, y2)


def _dense(points_px: Floats) -> Floats:
    """A polyline with a point every half pixel, so that shares of points are shares of length."""
    step = np.linalg.norm(np.diff(points_px, axis=0), axis=1)
    s = np.concatenate([[0], np.cumsum(step)])
    stations = np.linspace(0, s[-1], max(2, round(2 * s[-1])))
    return np.column_stack([np.interp(stations, s, column) for column in points_px.T])


def _rows(scores: Sequence[Score]) -> list[Row]:
    rows = [Row("photos", len(scores), "")]
    for tolerance_px, target, goal in ((2, 0.80, "0.82"), (5, 0.85, "0.87")):
        rows += [
            Row(f"precision, {tolerance_px} px, mean", _mean(score.precision[tolerance_px] for score in scores), ""),
            Row(f"recall, {tolerance_px} px, mean", _mean(score.recall[tolerance_px] for score in scores), ""),
            Row(f"F1, {tolerance_px} px, mean", _mean(score.f1[tolerance_px] for score in scores), "", target, 1, goal),
        ]
    for name, most in (("first", 1), ("among the first three", 3)):
        share = 100 * _mean(any(score.offered[:most]) for score in scores)
        rows.append(Row(f"offered without clicks: a crack is {name}, of {len(scores)}", share, "%"))
    rows.append(Row(f"nothing offered, of {len(scores)}", 100 * _mean(not score.offered for score in scores), "%"))
    for mode, target, goal in zip(MODES, (0, 88, 91), ("", "90", "93"), strict=True):
        answered = [score for score in scores if mode in score.right]
        right = 100 * _mean(score.right[mode] for score in answered)
        refused = 100 * _mean(mode in score.refused for score in answered)
        rows += [
            Row(f"right main crack, {mode}", right, "%", target, goal=goal),
            Row(f"refused, {mode}", refused, "%"),
        ]
    for name, times in (
        ("map of all cracks", [s.map_s for s in scores]),
        ("path between ends", [s.ends_s for s in scores]),
    ):
        rows.append(Row(f"CPU time, {name}, median", float(np.median(times)), "s"))
    return rows


def _mean(values: Iterable[float]) -> float:
    return float(np.mean(list(values)))


def _name_worst(scores: Sequence[Score]) -> None:
    first = TOLERANCES_PX[0]
    print(f"{len(scores)} photos. Worst maps, F1 at {first} px:")
    for score in sorted(scores, key=lambda score: score.f1[first])[:WORST]:
        print(f"  {score.f1[first]:.2f}  {score.name}")
    for mode in MODES[1:]:
        wrong = [score for score in scores if not score.right.get(mode, True)]
        print(f"Wrong or refused, {mode}: {len(wrong)}")
        for score in wrong:
            print(f"  {score.name}: {score.refused.get(mode, 'another way')}")


def _mask_of(photo: Path) -> Path | None:
    mask = photo.with_name(f"{photo.stem}_mask.png")
    return mask if photo.suffix.lower() in SUFFIXES and mask.is_file() else None


def _read_mask(path: Path) -> NDArray[np.bool_]:
    with Image.open(path) as picture:
        grey = np.asarray(picture.convert("L"))
    # Some sets say 1 where others say 255.
    return grey > grey.max() / 2 if grey.max() > 0 else np.zeros(grey.shape, dtype=bool)


def _settings(photo: Path) -> PhotoInput:
    """No scale is known, and none matters: all scores are in pixels."""
    return PhotoInput(file=Path(photo.name), data="measured", mm_per_px=1.0, scale_is="assumed")


if __name__ == "__main__":
    run_benchmark(main)
