"""Sheets drawn from what ordinary ones are made of, in any arrangement: titles, headers, means, remarks, comments."""

import numpy as np

from benchmarks.ordinary_sheets import Rows
from sealtwin.core.records import Floats

Random = np.random.Generator
TITLES = ("Riss 4", "Prüfbericht 17", "Datum 3.5.2026", "Tiefen in mm", "Bediener: X")
FOOTNOTES = ("gemessen am 3.4.26", "Unterschrift: M.", "Fotos 3 bis 7", "* Ausreißer")
BETWEEN = ("# Pause", "# neu angesetzt", "Teil 2", "rechts")
MISSING = ("n. m.", "k.A.", "-", "", "n/a", "nicht messbar")
REMARKS = ("", "ok", "Kante 3 mm ab", "n. m.")
SUMMARIES = ("Mittelwert", "Mean", "Summe", "Max", "Ø", "Stabw.")


def arranged_sheet(random: Random) -> tuple[list[float], Floats, Rows]:
    """Draw places, levels and rows of a sheet of 4 to 9 stations and 1 to 4 readings. A missing reading is NaN."""
    count, repeats = int(random.integers(4, 10)), int(random.integers(1, 5))
    s_mm = np.sort(random.choice(np.arange(0, 30, 0.5), count, replace=False))
    levels_mm = np.round(-random.uniform(1, 6, (count, repeats)), 2)
    downward, numbered, mean, remark, beside, summary, footnote, between = random.random(8) < 0.35
    mean = bool(mean) and repeats > 1
    before = ["Nr."] if numbered else []
    behind = [*(["Mittelwert"] if mean else []), *(["Bemerkung"] if remark else []), *(["", "min"] if beside else [])]
    header = _header(random, before, behind, repeats, str(random.choice(["Tiefe"] if downward else ["Höhe", "Niveau"])))
    values = -levels_mm if downward else levels_mm
    body: Rows = []
    for number, (s, row) in enumerate(zip(s_mm, values, strict=True), start=1):
        means = [round(float(row.mean()), 3)] if mean else []
        others = [*means, *([_one(random, REMARKS)] if remark else []), *(["", 20.0 + number] if beside else [])]
        body.append([*([float(number)] if numbered else []), *map(float, (s, *row)), *others])
    first = len(before) + 1
    if repeats > 1 and random.random() < 0.3:
        i, j = int(random.integers(count)), int(random.integers(repeats))
        body[i][first + j], levels_mm[i, j] = _one(random, MISSING), np.nan
    means = [round(float(value), 3) for value in values.mean(axis=0)]
    body += [[_one(random, SUMMARIES), *[""] * (first - 1), *means]] if summary else []
    body += [[_one(random, FOOTNOTES)]] if footnote else []
    body[2:2] = [[_one(random, BETWEEN)]] if between else []
    rows = [*([title] for title in random.permutation(TITLES)[: random.integers(4)]), *header, *body]
    return s_mm.tolist(), levels_mm, [[*row, *[""] * (len(header[0]) - len(row))] for row in rows]


def _one(random: Random, texts: tuple[str, ...]) -> str:
    return str(random.choice(texts))


def _header(random: Random, before: list[str], behind: list[str], repeats: int, what: str) -> Rows:
    """Return the rows that name the columns, in one of five ways."""
    place = _one(random, ("Abstand", "Position", "s", "Ort", "x"))
    blank, rest = [""] * (len(before) + 1), [""] * len(behind)
    numbers = range(1, repeats + 1)
    spanning = [*before, f"{place} [mm]", f"{what} [mm]", *[""] * (repeats - 1), *behind]
    units = [*blank[1:], *["mm"] * (1 + repeats), *rest]
    ways: tuple[Rows, ...] = (
        [[*before, f"{place} [mm]", *(f"{what} {number} [mm]" for number in numbers), *behind]],
        [[*before, f"{place} (mm)", *(f"{number}. Messung {what} (mm)" for number in numbers), *behind]],
        [[*before, f"{place} [mm]", *[f"{what} [mm]"] * repeats, *behind]],
        [[*before, place, *(f"{what} {number}" for number in numbers), *behind], units],
        [spanning, [*blank, *(f"Messung {number}" for number in numbers), *rest]],
        [spanning, [*blank, *map(float, numbers), *rest]],
    )
    return ways[int(random.integers(len(ways)))]
