"""Real photos of cracked roads and walls from public sets: right between two clicks, and the first line without clicks.

    python -m benchmarks.real_roads --photos PHOTOS [--only SET] [--jobs 2]

PHOTOS is made from clones of the sets (python -m benchmarks.real_roads_photos --help); none of it is in this
repository. The list was drawn by rule, and is judged by rule (real_roads_rules). Refusals, other branches and wrong
lines are listed, with the product's words.
"""

from collections import Counter
from collections.abc import Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import Annotated

import cv2
import numpy as np
from typer import Option

from benchmarks.real_roads_photos import Set, listed, read_sets
from benchmarks.real_roads_runs import Clicked, Unclicked, run_clicked, run_unclicked
from benchmarks.table import Row, one_of, run_benchmark

FIRST_PERCENT = 70  # Photos whose first line is a crack, at least


def main(
    photos: Annotated[Path, Option(help="folder with the photos and masks of the list")],
    only: Annotated[str | None, one_of(read_sets())] = None,
    jobs: Annotated[int, Option(min=1, help="processes at the same time")] = 1,
) -> list[Row]:
    sets = {name: one for name, one in read_sets().items() if only in (None, name)}
    rows = [row for row in listed() if row.set in sets]
    with ProcessPoolExecutor(jobs, initializer=cv2.setNumThreads, initargs=(1,)) as pool:
        clicked = pool.map(partial(run_clicked, photos=photos), rows)
        unclicked = pool.map(partial(run_unclicked, photos=photos), rows)
        traced, searched = list(clicked), list(unclicked)
    _list(traced)
    by_set = {name: [answer for answer in traced if answer.row.set == name] for name in sets}
    return [
        *(row for name, answers in by_set.items() for row in clicked_rows(sets[name], answers)),
        silent_row(traced),
        interval_row(traced),
        unclicked_row(searched),
    ]


def clicked_rows(photo_set: Set, answers: Sequence[Clicked]) -> list[Row]:
    """Return the share of right traces of a set, and what became of the others."""
    name = f"{photo_set.name}, two clicks"
    verdicts = Counter(answer.verdict for answer in answers)
    percent = {word: 100 * verdicts[word] / max(len(answers), 1) for word in ("right", "other", "wrong", "refused")}
    rows = [Row(f"{name}: right, of {len(answers)}", percent.pop("right"), "%", photo_set.target_percent)]
    return rows + [Row(f"{name}: {word}", share, "%") for word, share in percent.items()]


def silent_row(answers: Sequence[Clicked]) -> Row:
    silent = [answer.verdict == "wrong" for answer in answers if answer.silent]
    return Row(
        f"two clicks: wrong, of {len(silent)} traces without a caution about the path",
        100 * float(np.mean(silent or [0])),
        "%",
        0,
        2,
    )


def interval_row(answers: Sequence[Clicked]) -> Row:
    """Return how often the width's interval, which is of half the step in light, holds the width that was painted."""
    stated = [answer.holds for answer in answers if answer.verdict == "right" and answer.holds is not None]
    return Row(f"intervals of the width that hold the mask's, of {len(stated)} right traces", sum(stated), "")


def unclicked_row(answers: Sequence[Unclicked]) -> Row:
    first = 100 * sum(any(answer.hits[:1]) for answer in answers) / len(answers) if answers else float("nan")
    return Row(f"no clicks: a crack is first, of {len(answers)}", first, "%", FIRST_PERCENT, 100)


def _list(clicked: Iterable[Clicked]) -> None:
    """Print each answer between two clicks that is not right."""
    for answer in clicked:
        if answer.verdict != "right":
            silent = ", without a caution" if answer.silent else ""
            words = "" if answer.verdict == "other" else f": {answer.words}"
            print(f"{answer.row.set} {Path(answer.row.photo).name}: {answer.verdict}{silent}{words}")
    print()


if __name__ == "__main__":
    run_benchmark(main)
