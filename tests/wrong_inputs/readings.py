"""Wrong sheets of readings, and other files in their place."""

import shutil
import unicodedata
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from tests.support.lab_folder import DEFAULTS
from tests.support.tiny_study import AGED, FAST, FAST_PASTE, run_tiny
from tests.wrong_inputs.table import WrongInput

QUICK = DEFAULTS.replace("radius_mm = 0.45\nsubsteps = 2", 'model = "slot"').replace(AGED, FAST_PASTE)
"""Settings with the fast model, which is checked quickly."""
KEPT = TemporaryDirectory(prefix="sealtwin-wrong-inputs-")
IN_MM = 'unit = "mm"'


@cache
def simulated() -> Path:
    """Return a run folder by the fast model, whose sheet each row replaces. It is deleted when the tests end."""
    return run_tiny(Path(KEPT.name), FAST)


def sheet(name: str, text: str, *names: str, settings: str = "", suffix: str = ".csv") -> WrongInput:
    """A sheet that a run is not compared with; ``settings`` are further lines of [readings]."""

    def make(folder: Path) -> None:
        shutil.copytree(simulated(), folder, dirs_exist_ok=True)
        (folder / "inputs" / "readings.csv").unlink()
        (folder / "inputs" / f"readings{suffix}").write_text(text, encoding="utf-8")
        trial = (folder / "trial.toml").read_text(encoding="utf-8").replace("/readings.csv", f"/readings{suffix}")
        trial = trial.replace("[readings]\n", f"[readings]\n{settings}\n")
        (folder / "trial.toml").write_text(trial, encoding="utf-8")

    return WrongInput(name, make, "validate {given} --device cpu", (f"readings{suffix}", *names))


def write_photo(folder: Path) -> None:
    shutil.copy(simulated().parent / "crack.png", folder / "P01.png")


def lab(name: str, sheets: Mapping[str, str], *names: str, **others: Any) -> WrongInput:
    """A lab's folder of P01, with these sheets beside its photo."""

    def make(folder: Path) -> None:
        write_photo(folder)
        for file, text in {"lab.toml": QUICK, **sheets}.items():
            (folder / file).write_text(text, encoding="utf-8")

    return WrongInput(name, make, "ingest {given} --out {out} --dry-run", names, **others)


def table(*cells: str, head: str = "s_mm;depth_mm") -> str:
    """Rows at s = 1, 4, 7 and so on."""
    return "\n".join([head, *(f"{1 + 3 * row};{cell}" for row, cell in enumerate(cells))]) + "\n"


def under(head: str) -> str:
    return table("21.5", "24", "13", "12", head=head)


SIX = "2.15;2.1\n3;2.0;2.1\n5;1.9;2.1\n7;1.8;2.0\n9;1.8;2.1\n11;1.9;2.0\n"
TWINS = {f"{unicodedata.normalize(form, 'P01 Größe')}.csv": under("s_mm;depth_mm") for form in ("NFC", "NFD")}


def along_the_crack(name: str, text: str, option: str, *named: str) -> WrongInput:
    """A table of depths or widths along the crack."""

    def make(folder: Path) -> None:
        write_photo(folder)
        (folder / "along.csv").write_text(text, encoding="utf-8")

    command = f"digitise {{given}}/P01.png --mm-per-px 0.1 {option} {{given}}/along.csv --out {{out}}"
    return WrongInput(name, make, command, ("along.csv", *named), lacks=("P01.png",))


# fmt: off
CASES: list[WrongInput] = [
    # Units beside the readings.
    sheet("a decimal before the unit", under("s_mm;Tiefe (0,1 mm)"), "'Tiefe (0,1 mm)'", "as_written"),
    sheet("tenths and a declared unit", under("s_mm;Tiefe [1/10 mm]"), "'Tiefe [1/10 mm]'", settings=IN_MM),
    sheet("a row in inches", table("2.15;mm", "0.0945;inch", "1.3;mm", "1.2;mm", head="s_mm;depth;Einheit"),
        "C3 has the remark 'inch', but mm is read", "as_written", settings=IN_MM),
    sheet("a unit above", f"Einheit: Zoll\n{under('s_mm;depth')}", "A1 has the remark 'Einheit: Zoll', but mm is read",
        settings=IN_MM),
    # Files that are no sheets.
    sheet("a page in HTML", "<!DOCTYPE html>\n<table><tr><td>1</td></tr></table>\n", "'<!DOCTYPE html'", suffix=".xls"),
    sheet("a quotation mark that closes in another row",
        's_mm,depth_mm,note\n1,1.5,"left\n4,1.4,\n7,1.3,edge"\n10,1.2,\n', "line 4", "quotation"),
    # Doubts, which need the crack.
    lab("hundredths of a millimetre",
        {"P01.csv": table("2.15", "2.41", "1.37", head="s_mm;Tiefe [1/100 mm]")}, "1/100 mm", "as_written"),
    lab("a row of zeros",
        {"P01.csv": f"s_mm;depth_1_mm;depth_2_mm\n1;{SIX}0;0;0\n"}, "out of order at A7", "as_written = A7"),
    # Tables along the crack, and names of files.
    along_the_crack("a depth in inches", "s_mm;depth_mm\n0;8\n9;0.3 in\n", "--depth-mm", "row 3", "0.3 in"),
    along_the_crack("widths out of order", "s_mm;width_mm\n5;2\n3;2\n", "--depth-mm 8 --width-mm", "row 3",
        "3 follows 5"),
    lab("twins by Unicode", TWINS, "P01 Größe"),
]
# fmt: on
