"""Real photos of cracked roads and walls from public sets: right between two clicks, and what is picked without clicks.

    python -m benchmarks.real_roads --photos PHOTOS [--only SET] [--jobs 2]

PHOTOS is made from clones of the sets (python -m benchmarks.real_roads_photos --help); none of it is in this
repository. The list was drawn by rule, and is judged by rule (real_roads_rules). Refusals, other branches, wrong lines
and lines picked alone without a crack are listed, with the product's words.
"""

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import Annotated

import cv2
import numpy as np
from typer import Option

from benchmarks.real_roads_photos import Crop, Listed, Set, crops, listed, read_sets
from benchmarks.real_roads_runs import Clicked, Unclicked, run_bare, run_clicked, run_unclicked
from benchmarks.table import Row, one_of, run_benchmark

FIRST_PERCENT, ALONE_PERCENT, BARE_PERCENT = 70, 7, 15
"""Photos whose first line is a crack, at least; lines picked alone that are none, and crops where one is, at most."""
NOT_JUDGED = "crack"


def main(
    photos: Annotated[Path, Option(help="folder with the photos and masks of the list")],
    only: Annotated[str | None, one_of(read_sets())] = None,
    jobs: Annotated[int, Option(min=1, help="processes at the same time")] = 1,
) -> list[Row]:
    sets = {name: one for name, one in read_sets().items() if only in (None, name)}
    rows = [row for row in listed() if row.set in sets]
    bare = [crop for crop in crops() if crop.set in sets and crop.kind != NOT_JUDGED]
    with ProcessPoolExecutor(jobs, initializer=cv2.setNumThreads, initargs=(1,)) as pool:
        clicked = pool.map(partial(run_clicked, photos=photos), rows)
        unclicked = pool.map(partial(run_unclicked, photos=photos), rows)
        on_bare = pool.map(partial(run_bare, photos=photos), bare)
        answers = list(clicked), list(unclicked), list(on_bare)
    _list(*answers)
    return [
        *(row for one in sets.values() for row in clicked_rows(one, [a for a in answers[0] if a.of.set == one.name])),
        *silent_rows(answers[0]),
        *unclicked_rows(answers[1]),
        *bare_rows(answers[2]),
    ]


def clicked_rows(photo_set: Set, answers: Sequence[Clicked]) -> list[Row]:
    """Return the share of right traces of a set, and what became of the others."""
    name = f"{photo_set.name}, two clicks"
    right = _percent(answers, _is("right"))
    rows = [Row(f"{name}: right, of {len(answers)}", right, "%", photo_set.target_percent)]
    rows += [Row(f"{name}: {word}", _percent(answers, _is(word)), "%") for word in ("other", "wrong", "refused")]
    ratios = [answer.width_ratio for answer in answers if np.isfinite(answer.width_ratio)]
    if ratios:
        rows.append(
            Row(f"{photo_set.name}: width over the mask's, median of {len(ratios)}", float(np.median(ratios)), "")
        )
    return rows


def silent_rows(answers: Sequence[Clicked]) -> list[Row]:
    silent = sum(answer.silent for answer in answers)
    seconds = float(np.median([answer.time_s for answer in answers]))
    return [
        Row(f"two clicks: wrong in silence, of {len(answers)}", silent, "", 0, 0),
        Row("two clicks: processor time, median", seconds, "s"),
    ]


def unclicked_rows(answers: Sequence[Unclicked]) -> list[Row]:
    alone = [answer for answer in answers if answer.alone]
    first = _percent(answers, lambda answer: any(answer.hits[:1]))
    among = _percent(answers, lambda answer: any(answer.hits[:3]))
    none = _percent(alone, lambda answer: not answer.hit)
    complete = sum(answer.traced and not answer.hit for answer in alone)
    count = len(answers)
    return [
        Row(f"no clicks: a crack is first, of {count}", first, "%", FIRST_PERCENT, 100),
        Row("no clicks: a crack is among the first three", among, "%"),
        Row("no clicks: nothing offered", _percent(answers, lambda answer: not answer.hits), "%"),
        Row("no clicks: a line is picked alone", _percent(answers, lambda answer: answer.alone), "%"),
        Row(f"no clicks: alone and none, of {len(alone)} alone", none, "%", 0, ALONE_PERCENT),
        Row("no clicks: alone, none, and traced to the end", complete, ""),
    ]


def bare_rows(answers: Sequence[Unclicked]) -> list[Row]:
    """Return the share of crops where a line is picked alone, of all and by what is in them."""
    share = _percent(answers, lambda answer: answer.alone)
    rows = [Row(f"bare: a line is picked alone, of {len(answers)}", share, "%", 0, BARE_PERCENT)]
    for kind in dict.fromkeys(_kind(answer) for answer in answers):
        some = [answer for answer in answers if _kind(answer) == kind]
        rows.append(Row(f"bare, {kind}: picked alone, of {len(some)}", sum(answer.alone for answer in some), ""))
    rows.append(Row("bare: a line is offered", _percent(answers, lambda answer: bool(answer.hits)), "%"))
    rows.append(Row("bare: alone and traced to the end", sum(answer.traced for answer in answers), ""))
    return rows


def _list(clicked: Iterable[Clicked], unclicked: Iterable[Unclicked], bare: Iterable[Unclicked]) -> None:
    """Print each answer between two clicks that is not right, and each line that is picked alone without a crack."""
    for answer in clicked:
        if answer.verdict != "right":
            silent = ", in silence" if answer.silent else ""
            words = "" if answer.verdict == "other" else f": {answer.words}"
            print(f"{answer.of.set} {Path(answer.of.photo).name}: {answer.verdict}{silent}{words}")
    for answer in (*unclicked, *bare):
        if answer.alone and not answer.hit:
            then = f"; then: {answer.words}" if answer.words else ""
            print(f"{answer.of.set} {_place(answer.of)}: picked alone without clicks, no crack{then}")
    print()


def _place(of: Listed | Crop) -> str:
    name = Path(of.photo).name
    return f"{name}, {of.kind} at ({of.left_px}, {of.top_px})" if isinstance(of, Crop) else name


def _kind(answer: Unclicked) -> str:
    return answer.of.kind if isinstance(answer.of, Crop) else ""


def _is(name: str) -> Callable[[Clicked], bool]:
    return lambda answer: answer.verdict == name


def _percent(answers: Sequence, holds: Callable) -> float:
    return 100 * sum(map(holds, answers)) / len(answers) if answers else float("nan")


if __name__ == "__main__":
    run_benchmark(main)
