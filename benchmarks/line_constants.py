"""What each constant that decides a refusal, a caution or a rank changes on real photos that had no part in its choice.

    python -m benchmarks.line_constants PHOTOS [--jobs 2]

The constants were chosen on drawn photos and on the 127 photos of the first five sets of real_roads. The photos here
are of the three later sets. Each constant is made a quarter smaller and a third larger, and all others stay.
"""

import sys
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from importlib import import_module
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import cv2

from benchmarks.real_roads_photos import Listed, listed
from benchmarks.real_roads_runs import run_clicked, run_unclicked
from benchmarks.table import run_benchmark

LATER = "crackmap", "ceramic", "sut"
FACTORS = 3 / 4, 4 / 3
CRACK_PATH, WALLS = "digitise.crack_path", "digitise.walls"
RANKS = {
    f"{CRACK_PATH}.candidates": (
        *("LIKELY", "SURE", "CREST", "MIN_BONE", "MIN_LENGTH", "JOINTS", "COVERED", "LARGEST_GAP", "BESIDE_JOINT"),
        *("LONGEST_BRIDGE", "FADING", "SAME", "BEHIND", "MAX_UNLIKE"),
    ),
}
CLICKS = {
    f"{CRACK_PATH}.find_path": ("ON_CRACK", "SHARE_ON_CRACK", "SEARCH_WIDTHS"),
    f"{CRACK_PATH}.hints": ("SNAP_PX",),
    f"{WALLS}.centreline_and_walls": ("MIN_WIDTH_PX", "MAX_BLUR", "MAX_MISSING", "MIN_SLENDERNESS"),
    f"{WALLS}.doubts": ("UNKNOWN", "FITTED", "BAND_WIDTHS", "BAND_PX", "RUN", "WORTH_SAYING", "DARKER"),
    f"{WALLS}.thin_crack": ("MAX_UNLIKE", "STRICTNESS", "INNER_LIGHT"),
}


def main(photos: Path, jobs: int = 2) -> None:
    rows = [row for row in listed() if row.set in LATER]
    print(f"{len(rows)} photos of {', '.join(LATER)}\n\nwithout clicks: the first line is a crack, one of three is")
    _vary(RANKS, partial(_ranks, rows, photos, jobs))
    print("\nbetween two clicks: right, refused, right with a remark about the walls, interval holds the mask's width")
    _vary(CLICKS, partial(_clicks, rows, photos, jobs))


def _vary(constants: Mapping[str, Sequence[str]], figures: Callable[[], tuple[int, ...]]) -> None:
    """Print the figures as all constants are, and with each constant times both factors."""
    print("as they are:", *figures(), flush=True)
    for home, names in constants.items():
        for name in names:
            usual, seen = getattr(import_module(home), name), []
            for factor in FACTORS:
                _replace(name, usual, changed := _times(usual, factor))
                seen.append(f"{changed}: {' '.join(map(str, figures()))}")
                _replace(name, changed, usual)
            print(f"{home.rpartition('.')[2]}.{name} {usual}; {'; '.join(seen)}", flush=True)


def _times(usual: Any, factor: float) -> Any:
    if isinstance(usual, tuple):
        return tuple(_times(part, factor) for part in usual)
    return round(usual * factor) if isinstance(usual, int) else round(usual * factor, 4)


def _replace(name: str, usual: object, changed: object) -> None:
    """Replace a constant in its module and in every module that imports it by its name."""
    for module in [module for key, module in sys.modules.items() if key.startswith("digitise")]:
        if getattr(module, name, None) is usual:
            setattr(module, name, changed)


def _ranks(rows: Sequence[Listed], photos: Path, jobs: int) -> tuple[int, ...]:
    answers = _answers(partial(run_unclicked, photos=photos), rows, jobs)
    return sum(any(answer.hits[:1]) for answer in answers), sum(any(answer.hits[:3]) for answer in answers)


def _clicks(rows: Sequence[Listed], photos: Path, jobs: int) -> tuple[int, ...]:
    answers = _answers(partial(run_clicked, photos=photos), rows, jobs)
    right = [answer for answer in answers if answer.verdict == "right"]
    refused = sum(answer.verdict == "refused" for answer in answers)
    return len(right), refused, sum(answer.walls for answer in right), sum(bool(answer.holds) for answer in right)


def _answers(run: Callable[[Listed], Any], rows: Sequence[Listed], jobs: int) -> list[Any]:
    # Only a forked process has the changed constant.
    with ProcessPoolExecutor(jobs, get_context("fork"), cv2.setNumThreads, (1,)) as pool:
        return list(pool.map(run, rows))


if __name__ == "__main__":
    run_benchmark(main)
