"""Sheets of readings, and what a lab leaves in place of one."""

import shutil
import unicodedata
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from tests.support.ingested_lab import sealtwin
from tests.support.lab_folder import DEFAULTS, ENDS
from tests.support.photos import mortar, with_crack, write_png
from tests.wrong_inputs.table import WrongInput

Write = Callable[[Path], object]
TRIAL = f"""\
name = "P01"
[photo]
file = "P01.png"
data = "synthetic"
mm_per_px = 0.1
ends_px = {ENDS}
[crack]
depth_mm = 8.0
tilt = "vertical"
[path]
volume_ml = 0.08
trim_mm = 1.0
[fluid]
viscosity_pa_s = 5.0
freeze_after_s = "never"
[solver]
model = "slot"
settle_s = 0.2
[readings]
file = "P01.csv"
data = "synthetic"
role = "held-out"
"""
QUICK = DEFAULTS.replace("radius_mm = 0.45\nsubsteps = 2", 'model = "slot"').replace(
    "U = 30.0\nD_cm = 0.3\nfreeze_after_s = 0.2", 'viscosity_pa_s = 5.0\nfreeze_after_s = "never"'
)
"""Of the fast model, which is checked soon."""
KEPT = TemporaryDirectory(prefix="sealtwin-wrong-inputs-")
IN_MM = 'unit = "mm"'


@cache
def simulated() -> Path:
    """Return a run folder by the fast model, whose sheet each row replaces. It is deleted when the tests end."""
    folder = Path(KEPT.name)
    write_photo(folder / "P01.png")
    (folder / "P01.csv").write_text("s_mm,depth_mm\n1,1.5\n12,1.6\n", encoding="utf-8")
    (folder / "trial.toml").write_text(TRIAL, encoding="utf-8")
    for words in (("digitise", folder / "trial.toml", "--out", folder / "run"), ("simulate", folder / "run")):
        answer = sealtwin(*words)
        assert answer.exit_code == 0, answer.output
    return folder / "run"


def write_photo(path: Path) -> None:
    write_png(path, with_crack(mortar((200, 200), seed=0), [(40, 101), (80, 97), (120, 103), (160, 98)], 20))


def of(path: Path, write: str | Write) -> None:
    _ = path.write_text(write, encoding="utf-8") if isinstance(write, str) else write(path)


def sheet(name: str, write: str | Write, *names: str, settings: str = "", suffix: str = ".csv") -> WrongInput:
    """A sheet that a run is not compared with; ``settings`` are further lines of [readings]."""

    def make(folder: Path) -> None:
        shutil.copytree(simulated(), folder, dirs_exist_ok=True)
        (folder / "inputs" / "P01.csv").unlink()
        of(folder / "inputs" / f"P01{suffix}", write)
        trial = (folder / "trial.toml").read_text(encoding="utf-8").replace("/P01.csv", f"/P01{suffix}")
        trial = trial.replace("[readings]\n", f"[readings]\n{settings}\n")
        (folder / "trial.toml").write_text(trial, encoding="utf-8")

    return WrongInput(name, make, "validate {given} --device cpu", (f"P01{suffix}", *names))


def lab(name: str, files: Mapping[str, str | Write], *names: str, settings: str = "", **others: Any) -> WrongInput:
    """A lab's folder of P01, with these files beside its photo."""
    note = f"[crack]\ndepth_mm = 8.0\n[photo]\nends_px = {ENDS}\n"
    notes = {} if "P01_note.xlsx" in files else {"P01.toml": note}

    def make(folder: Path) -> None:
        write_photo(folder / "P01.png")
        for file, write in ({**notes, "lab.toml": f"{QUICK}{settings}\n", **files}).items():
            of(folder / file, write)

    return WrongInput(name, make, "ingest {given} --out {out} --dry-run", names, **others)


def table(*cells: str, head: str = "s_mm;depth_mm") -> str:
    """Rows at s = 1, 4, 7 and so on."""
    return "\n".join([head, *(f"{1 + 3 * row};{cell}" for row, cell in enumerate(cells))]) + "\n"


def under(head: str) -> str:
    return table("21.5", "24", "13", "12", head=head)


SIX = "2.15;2.1\n3;2.0;2.1\n5;1.9;2.1\n7;1.8;2.0\n9;1.8;2.1\n11;1.9;2.0\n"
TWINS = {f"{unicodedata.normalize(form, 'P01 Größe')}.csv": under("s_mm;depth_mm") for form in ("NFC", "NFD")}


def along_the_crack(name: str, rows: str, *named: str, quantity: str = "depth") -> WrongInput:
    """A table of depths or widths along the crack, under its header."""

    def make(folder: Path) -> None:
        write_photo(folder / "P01.png")
        (folder / "along.csv").write_text(f"s_mm;{quantity}_mm{rows}", encoding="utf-8")

    depth = "" if quantity == "depth" else "--depth-mm 8 "
    command = f"digitise {{given}}/P01.png --mm-per-px 0.1 {depth}--{quantity}-mm {{given}}/along.csv --out {{out}}"
    return WrongInput(name, make, command, ("along.csv", *named), lacks=("P01.png",))


# fmt: off
CASES: list[WrongInput] = [
    # A number beside a unit.
    sheet("a decimal before the unit", under("s_mm;Tiefe (0,1 mm)"), "'Tiefe (0,1 mm)'", "as_written"),
    sheet("tenths and a declared unit", under("s_mm;Tiefe [1/10 mm]"), "column B", "settings, mm", settings=IN_MM),
    # Units beside the readings.
    sheet("a row in inches", table("2.15;mm", "0.0945;inch", "1.3;mm", "1.2;mm", head="s_mm;depth;Einheit"),
        "C3 'inch'", "as_written", settings=IN_MM),
    sheet("a unit above", f"Einheit: Zoll\n{under('s_mm;depth')}", "A1 'Einheit: Zoll'", settings=IN_MM),
    # Cells that are no number.
    # What is no sheet.
    sheet("a page in HTML", "<!DOCTYPE html>\n<table><tr><td>1</td></tr></table>\n", "'<!DOCTYPE html'", suffix=".xls"),
    # Doubts, which need the crack.
    lab("hundredths with digits of a micrometre",
        {"P01.csv": table("2.15", "2.41", "1.37", head="s_mm;Tiefe [1/100 mm]")}, "1/100 mm", "as_written"),
    lab("a row of zeros", {"P01.csv": f"s_mm;depth_1_mm;depth_2_mm\n1;{SIX}0;0;0\n"}, "B8", "as_written = B8 C8"),
    # Sisters.
    sheet("a quotation mark that closes in another row",
        's_mm,depth_mm,note\n1,1.5,"left\n4,1.4,\n7,1.3,edge"\n10,1.2,\n', "line 4", "quotation"),
    along_the_crack("a depth in inches", ";Einheit\n0;8;mm\n9;0.3;inch\n", "row 3", "unit"),
    along_the_crack("widths out of order", "\n5;2\n3;2\n", "row 3", "follows 5", quantity="width"),
    # What a lab leaves.
    lab("twins by Unicode", TWINS, "P01 Größe"),
]
# fmt: on
