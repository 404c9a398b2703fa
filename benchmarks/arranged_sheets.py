"""Sheets drawn from what ordinary ones are made of, in any arrangement: titles, headers, means, remarks, comments."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from benchmarks.ordinary_sheets import Rows, write_rows
from sealtwin.core.records import Floats

Random = np.random.Generator
TITLES = ("Riss 4", "Prüfbericht 17", "Datum 3.5.2026", "Tiefen in mm", "Bediener: X")
FOOTNOTES = ("gemessen am 3.4.26", "Unterschrift: M.", "Fotos 3 bis 7", "* Ausreißer")
BETWEEN = ("# Pause", "# neu angesetzt", "Teil 2", "rechts")
MISSING = ("n. m.", "k.A.", "-", "", "n/a", "nicht messbar")
REMARKS = ("", "ok", "Kante 3 mm ab", "n. m.")
SUMMARIES = ("Mittelwert", "Mean", "Summe", "Max", "Ø", "Stabw.")


@dataclass(frozen=True)
class ArrangedSheet:
    s_mm: list[float]
    levels_mm: Floats  # (n, r); NaN where one is missing
    rows: Rows
    format: Literal["csv", "tsv", "xlsx", "ods"]
    mark: str

    def write(self, folder: Path) -> Path:
        path = folder / f"sheet.{self.format}"
        write_rows(path, self.rows, self.mark)
        return path


def arranged_sheet(random: Random) -> ArrangedSheet:
    """Draw a sheet of 4 to 9 stations and 1 to 4 readings."""
    count, repeats = int(random.integers(4, 10)), int(random.integers(1, 5))
    s_mm = np.sort(random.choice(np.arange(0, 30, 0.5), count, replace=False))
    levels_mm = np.round(-random.uniform(1, 6, (count, repeats)), 2)
    downward, numbered, mean, remark, beside = random.random(5) < (0.6, 0.3, 0.4, 0.4, 0.2)
    mean = bool(mean) and repeats > 1
    before = ["Nr."] if numbered else []
    behind = [*(["Mittelwert"] if mean else []), *(["Bemerkung"] if remark else []), *(["", "min"] if beside else [])]
    header = _header(random, before, behind, repeats, str(random.choice(["Tiefe"] if downward else ["Höhe", "Niveau"])))
    values = -levels_mm if downward else levels_mm
    body: Rows = [
        [
            *([float(number)] if numbered else []),
            *map(float, (s, *row)),
            *([round(float(row.mean()), 3)] if mean else []),
            *([str(random.choice(REMARKS))] if remark else []),
            *(["", 20.0 + number] if beside else []),
        ]
        for number, (s, row) in enumerate(zip(s_mm, values, strict=True), start=1)
    ]
    expected_mm = levels_mm.copy()
    first = len(before) + 1
    if repeats > 1 and random.random() < 0.3:
        i, j = int(random.integers(count)), int(random.integers(repeats))
        body[i][first + j], expected_mm[i, j] = str(random.choice(MISSING)), np.nan
    width = len(header[0])
    if random.random() < 0.3:
        means = [round(float(value), 3) for value in values.mean(axis=0)]
        body.append([str(random.choice(SUMMARIES)), *[""] * (first - 1), *means, *[""] * len(behind)])
    if random.random() < 0.3:
        body.append([str(random.choice(FOOTNOTES)), *[""] * (width - 1)])
    if random.random() < 0.3:
        body.insert(int(random.integers(1, count)), [str(random.choice(BETWEEN)), *[""] * (width - 1)])
    titles = [[title, *[""] * (width - 1)] for title in random.permutation(TITLES)[: random.integers(4)]]
    rows = [*titles, *header, *body]
    kind = random.choice(["csv", "csv", "tsv", "xlsx", "ods"])
    return ArrangedSheet(s_mm.tolist(), expected_mm, rows, str(kind), str(random.choice([",", "."])))  # pyright: ignore[reportArgumentType]


def _header(random: Random, before: list[str], behind: list[str], repeats: int, what: str) -> Rows:
    """Return the rows that name the columns, in one of five ways."""
    place = str(random.choice(["Abstand", "Position", "s", "Ort", "x"]))
    blank, rest = [""] * (len(before) + 1), [""] * len(behind)
    numbers = range(1, repeats + 1)
    spanning = [*before, f"{place} [mm]", f"{what} [mm]", *[""] * (repeats - 1), *behind]
    ways: tuple[Rows, ...] = (
        [[*before, f"{place} [mm]", *(f"{what} {number} [mm]" for number in numbers), *behind]],
        [[*before, f"{place} (mm)", *(f"{number}. Messung {what} (mm)" for number in numbers), *behind]],
        [[*before, f"{place} [mm]", *[f"{what} [mm]"] * repeats, *behind]],
        [
            [*before, place, *(f"{what} {number}" for number in numbers), *behind],
            [*blank[1:], *["mm"] * (1 + repeats), *rest],
        ],
        [spanning, [*blank, *(f"Messung {number}" for number in numbers), *rest]],
        [spanning, [*blank, *map(float, numbers), *rest]],
    )  # fmt: skip
    return ways[int(random.integers(len(ways)))]
