"""A lab's folder as labs leave them: ten samples in ten dialects; and fifteen faults that can be planted in it."""

import csv
import io
import os
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from datetime import date
from pathlib import Path

import numpy as np
import openpyxl

from tests.support.photos import mortar, with_crack, write_png
from tests.support.sheet_writers import Hand, write_sheet

S_MM = (1.0, 3.0, 5.0, 7.0, 9.0, 11.0)
LENGTH_MM = 12.0
ENDS = "[[40.0, 101.0], [160.0, 98.0]]"
DEFAULTS = f"""\
# Of all samples in this folder.
data = "synthetic"
date = 2026-05-03
operator = "A. Muster"

[photo]
mm_per_px = 0.1
ends_px = {ENDS}

[crack]
depth_mm = 8.0
tilt = "vertical"

[path]
volume_ml = 0.08
speed_mm_s = 20.0
trim_mm = 1.0

[fluid]
U = 30.0
D_cm = 0.3
freeze_after_s = 0.2

[solver]
radius_mm = 0.45
substeps = 2
settle_s = 0.0

[output]
snapshots_s = []

[readings]
role = "held-out"
"""
# fmt: off
HANDS = {
    "P01": ("P01.csv", Hand()),
    "P02": ("P02_Messung.csv", Hand(encoding="utf-8-sig", separator=";", decimal=",", language="german",
        units="brackets", quantity="depth")),
    "P03": ("p-03 Tiefen.csv", Hand(encoding="cp1252", separator=";", decimal=",", sep_line=True, language="german",
        units="parentheses", station_unit="cm", unit="cm", newline="\r\n")),
    "P04": ("P04_levels.txt", Hand(encoding="utf-16", separator="\t", decimal=",", language="english", units="slash",
        quantity="depth")),
    "P05": ("P05/readings.csv", Hand(long=True, order=(3, 0, 16, 1, 2, *range(4, 16), 17))),
    "P06": ("P06.xlsx", Hand(workbook=True, language="german", units="row", title=("Probe P06", "Labor 3"),
        gap=True)),
    "P07": ("sheets/P07.csv", Hand(encoding="latin-1", language="french", units="in", missing="k.A.", separator=";",
        quantity="depth")),
    "P08": ("P08_caliper.csv", Hand(language="english", units="brackets", station_unit="inch", unit="inch",
        newline="\r\n")),
    "P09": ("P09_measurements.tsv", Hand(separator="\t", language="english", units="parentheses", missing="n/a",
        note=True)),
    "P10": ("P10 lecturas.xlsx", Hand(workbook=True, long=True, language="spanish", units="brackets", quantity="depth",
        unit="cm")),
}
"""Of each sample, its sheet and how that is written."""
PHOTOS = {"P03": "P03_Foto.PNG", "P05": "P05/photo.png", "P07": "photos/P07.png", "P09": "P09_top.png"}
# fmt: on


def levels_mm(sample: str) -> np.ndarray:
    """Three repeats at each station, (6, 3): what the sheet of a sample says, upward from its face."""
    rng = np.random.default_rng(int(sample[1:]))
    return np.round(-1.5 + np.linspace(-0.5, 0.5, len(S_MM))[:, None] + rng.normal(0, 0.03, (len(S_MM), 3)), 2)


def make_lab_folder(folder: Path) -> Path:
    """Ten sound samples, lab.toml, and a README that is none of them."""
    for number, (sample, (sheet, hand)) in enumerate(HANDS.items()):
        photo = folder / PHOTOS.get(sample, f"{sample}.png")
        for path in (photo, folder / sheet):
            path.parent.mkdir(parents=True, exist_ok=True)
        crack_px = [(40, 101), (80, 97), (120, 103), (160, 98)]
        write_png(photo, with_crack(mortar((200, 200), seed=number), crack_px, 20))
        levels = levels_mm(sample)
        if hand.missing:
            levels[2, 1] = np.nan
        write_sheet(folder / sheet, hand, S_MM, levels)
    (folder / "lab.toml").write_text(DEFAULTS, encoding="utf-8")
    (folder / "README.pdf").write_bytes(b"%PDF-1.4")
    return folder


@dataclass(frozen=True)
class Planted:
    """Something that is wrong, and the pattern of what must be said of it."""

    what: str
    says: str
    plant: Callable[[Path], object]


def _edit(name: str, old: str, new: str, encoding: str = "utf-8") -> Callable[[Path], object]:
    def edit(folder: Path) -> None:
        text = (folder / name).read_bytes().decode(encoding)
        assert text.count(old) >= 1, f"{name} holds no {old!r}"
        (folder / name).write_bytes(text.replace(old, new, 1).encode(encoding))

    return edit


def _cell(name: str, row: int, column: int, text: str, hand: Hand) -> Callable[[Path], object]:
    """Both from 1."""

    def edit(folder: Path) -> None:
        lines = (folder / name).read_bytes().decode(hand.encoding).split(hand.newline)
        cells = next(csv.reader(io.StringIO(lines[row - 1]), delimiter=hand.separator))
        cells[column - 1] = text
        lines[row - 1] = hand.separator.join(cells)
        (folder / name).write_bytes(hand.newline.join(lines).encode(hand.encoding))

    return edit


def _in_workbook(name: str, cell: str, value: date) -> Callable[[Path], object]:
    def edit(folder: Path) -> None:
        book = openpyxl.load_workbook(folder / name)
        book.worksheets[0][cell] = value
        book.save(folder / name)

    return edit


# fmt: off
FAULTS = (
    Planted("a reading that is no number", r"P01\.csv: C3 'O\.5'",
        _cell("P01.csv", 3, 3, "O.5", HANDS["P01"][1])),
    Planted("a reading a hundred times too large", r"P01\.csv: -155 mm in B5 .*in a crack 8 mm deep, ",
        _cell("P01.csv", 5, 2, "-155.0", HANDS["P01"][1])),
    Planted("a header without a unit", r"P04_levels\.txt: column A .*has no unit",
        _edit("P04_levels.txt", "/mm", "", "utf-16")),
    Planted("two photos of one sample", r"P05/photo\.png, P05/side\.png: 2 files have the role photo",
        lambda folder: shutil.copy(folder / "P05/photo.png", folder / "P05/side.png")),
    Planted("a date among the readings", r"P06\.xlsx, sheet 'Sheet': C7 '2026-03-01': a date",
        _in_workbook("P06.xlsx", "C7", date(2026, 3, 1))),
    Planted("a sheet one letter off",
        r"sheets/PO7\.csv: there is no photo with the name 'PO7'\. Photos without a sheet: .*P07\.png",
        lambda folder: (folder / "sheets/P07.csv").rename(folder / "sheets/PO7.csv")),
    Planted("a photo cut short", r"P08\.png: \S*photo\.png: the picture is damaged or cut short",
        lambda folder: os.truncate(folder / "P08.png", 9000)),
    Planted("an old workbook",
        r"P11_Messung\.xls: this is an old Excel workbook \(\.xls\), or one with a password\. Open it in a spreadsheet",
        lambda folder: ((folder / "P11_Messung.xls").write_bytes(b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"),
            shutil.copy(folder / "P10.png", folder / "P11.png"))),
    Planted("a sheet without a photo", r"Z99_readings\.csv: there is no photo with the name 'Z99'",
        lambda folder: write_sheet(folder / "Z99_readings.csv", Hand(), S_MM, levels_mm("P01"))),
    Planted("a place before the crack begins",
        r"P09_measurements\.tsv: -3 mm in A3 is outside the crack",
        _cell("P09_measurements.tsv", 3, 1, "-3.0", HANDS["P09"][1])),
)
# fmt: on
"""All at once in one folder: none of them hides another, and P10 stays sound."""
