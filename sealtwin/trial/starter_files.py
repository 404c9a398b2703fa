"""Write starter files: a commented trial, a robot's cell, a study, the demo, and trials for 'quick' and 'import-dxf'.

For settings that the user does not give, 'sealtwin quick' uses the settings of the commented trial, the "starter".
"""

import hashlib
import tomllib
from collections.abc import Mapping
from importlib.resources import files as resources
from io import BytesIO
from pathlib import Path
from typing import Any

from digitise.drawing.given import GivenDrawing
from sealtwin.core.errors import InputError
from sealtwin.core.facts import Fact
from sealtwin.core.files import write_bytes, write_text, write_unless_other
from sealtwin.core.plain_files import read_bytes
from sealtwin.core.run_folder import require_folder
from sealtwin.core.settings import checked, doubts_of
from sealtwin.trial.trial_file import (
    SettingValues,
    Trial,
    checked_trial,
    name_of,
    names_in,
    seen_from,
    trial_text,
    with_settings,
)

TEMPLATES = resources("sealtwin").joinpath("templates")
TRIAL = TEMPLATES.joinpath("starter_trial.toml").read_text(encoding="utf-8")
CELL = TEMPLATES.joinpath("starter_cell.toml").read_text(encoding="utf-8")
STUDY = TEMPLATES.joinpath("study.toml").read_text(encoding="utf-8")
SHEET = "caliper.xlsx"
HEADER = ("Distance along crack [mm]", *(f"Depth below face {repeat} [mm]" for repeat in (1, 2, 3)))
"""Header of the empty sheet of readings, with three repeats at each station."""
DEMO = ("photo.jpg", "truth.json", "caliper.csv", "trial.toml", "trial-paper.toml")
"""Files of the reconstruction of the paper's trial. They are fixtures of the tests, and also part of the wheel."""
STARTER = tomllib.loads(TRIAL)
NOT_ASSUMED = ("crack.depth_mm", "path.flow", "path.ramp_mm", "path.lead_in_mm")
"""Settings of the starter that are not marked as assumed, since the user always gives them or they are defaults."""
ASSUMED = {
    f"{table}.{key}": value
    for table in ("crack", "path", "fluid", "solver", "nozzle")
    for key, value in STARTER[table].items()
    if f"{table}.{key}" not in NOT_ASSUMED
}
"""Settings of the starter that are used if the user does not give them, by dotted name."""
QUICK = {**ASSUMED, "solver.preset": "draft"}
NOBODY = "undeclared"  # Value of a photo's origin, and of the readings' origin and role, if they are not declared
MARK = "# Written by 'sealtwin quick', as it was while its check is "
"""Beginning of the first line of a trial file, before a hash of the other lines.

The hash shows if the file was edited. An unchanged file may be overwritten."""
MESH, DRAWN = "drawing.stl", "trial.toml"
"""Names of the files that are written for a drawn crack."""
HEAD = """\
# Settings marked as assumed were not given. Measure them, correct them in this file, and run the trial again:
#   sealtwin run {file} --out {run}
"""


def write_example_cell(path: Path) -> None:
    """Write an example of a cell file. Raises InputError if ``path`` exists."""
    _write_new({path: CELL.replace("{file}", path.name)}, "name")


def write_example_study(file: Path) -> None:
    """Write an example of a study file. Raises InputError if ``file`` exists."""
    _write_new({file: STUDY.replace("{file}", str(file))}, "name")


def write_starter(folder: Path) -> list[Path]:
    """Write trial.toml and a sheet for readings to a folder, and return their paths.

    Raises InputError if one of them exists.
    """
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder}: is a file; give a new or existing folder.")
    trial = TRIAL.replace("{folder}", folder.as_posix())
    return _write_new({folder / "trial.toml": trial, folder / SHEET: empty_sheet()}, "folder")


def empty_sheet() -> bytes:
    """Return an empty XLSX sheet for readings. After numbers are filled in, it can be read without questions."""
    import openpyxl
    from openpyxl.styles import Font
    from openpyxl.utils import get_column_letter

    book, content = openpyxl.Workbook(), BytesIO()
    sheet = book.worksheets[0]
    sheet.title = "Readings"
    sheet.append(HEADER)
    for column, text in enumerate(HEADER, start=1):
        sheet.cell(1, column).font = Font(bold=True)
        sheet.column_dimensions[get_column_letter(column)].width = len(text)
    sheet.freeze_panes = "A2"
    book.save(content)
    return content.getvalue()


def _write_new(contents: Mapping[Path, str | bytes], other: str) -> list[Path]:
    for path in contents:
        if path.exists():
            raise InputError(f"{path}: already exists and is not overwritten. Give another {other}.")
    for path, content in contents.items():
        write_bytes(path, content.encode() if isinstance(content, str) else content)
    return list(contents)


def place_paper_trial(folder: Path) -> None:
    """Copy the reconstruction of the paper's trial to a new or existing folder.

    Raises InputError if the folder contains files with the same names and different content, which are not overwritten.
    """
    require_folder(folder)
    write_unless_other({folder / name: (shipped_trial() / name).read_bytes() for name in DEMO})


def shipped_trial() -> Path:
    """Return the folder of the reconstructed trial. Raises InputError if a file is missing in this installation.

    The folder is in the installed package or in a checkout.
    """
    package = Path(str(resources("sealtwin")))
    for folder in (package / "demo", package.parent / "fixtures/paper-trial"):
        if all((folder / name).is_file() for name in DEMO):
            return folder
    raise InputError(f"{package / 'demo'}: the files of the demo are missing. Install sealtwin again.")


def quick_trial(photo: Path, folder: Path, settings: SettingValues, sheet: Path | None) -> tuple[str, list[str]]:
    """Return the text of a trial file in ``folder``, and the assumed settings as texts "table.key = value".

    ``settings`` are the user's settings by dotted name. Raises InputError with the name of the photo if a setting
    cannot be used or a file is missing.
    """
    for file in filter(None, (photo, sheet)):
        if not file.is_file():
            raise InputError(f"{file}: no such file.")
    sheets = {} if sheet is None else {"readings.file": sheet}
    if twice := sorted({"photo.file", *sheets} & settings.keys()):
        raise InputError(f"{photo}: {twice[0]} is given twice; give it only once.")
    settings = seen_from(folder, {"photo.file": photo, **settings, **sheets})
    defaults = {"photo.data": NOBODY, **QUICK}
    if sheet is not None:
        defaults |= {"readings.data": NOBODY, "readings.role": NOBODY}
    content = with_settings(with_settings({"name": name_of(photo, "photo")}, defaults), settings)
    # A setting of the user also replaces the settings that it excludes.
    assumed = {name: value for name, value in defaults.items() if name not in settings and name in names_in(content)}
    sentences = [f"{name} = {toml_value(value)}" for name, value in assumed.items()]
    content = {
        "note": f"These settings were neither measured nor given, but assumed: {', '.join(sentences)}.",
        **content,
    }
    checked_trial(photo, content)
    return _text(folder, content, settings, assumed), sentences


def _text(folder: Path, content: Mapping[str, Any], settings: SettingValues, assumed: SettingValues) -> str:
    head = {key: content[key] for key in ("name", "note", "seed", "seeds") if key in content}
    lines = [HEAD.format(file=(folder / "trial.toml").as_posix(), run=(folder / "run").as_posix())]
    lines += [f"{key} = {toml_value(value)}" for key, value in head.items()]
    tables = dict.fromkeys(name.partition(".")[0] for name in (*settings, *assumed) if "." in name)
    for table in tables:
        lines += ["", f"[{table}]", *_rows(table, settings), *(f"{row}  # assumed" for row in _rows(table, assumed))]
    text = "\n".join(lines) + "\n"
    return f"{MARK}{_check(text)}\n{text}"


def _rows(table: str, settings: SettingValues) -> list[str]:
    """Return the lines for one table of a trial file."""
    parts = [(*name.partition(".")[::2], value) for name, value in settings.items()]
    return [f"{key} = {toml_value(value)}" for home, key, value in parts if home == table and key]


def write_quick_trial(path: Path, text: str) -> None:
    """Write a trial file. Raises InputError if the file exists and a user wrote or edited it."""
    if path.exists():
        first, _, rest = read_bytes(path).decode("utf-8", errors="replace").partition("\n")
        if first != MARK + _check(rest):
            raise InputError(
                f"{path}: you wrote or edited this file, so it is not overwritten. Run 'sealtwin run {path}', or give "
                "another --out."
            )
    write_text(path, text)


def _check(content: str) -> str:
    return hashlib.sha256(content.encode()).hexdigest()[:12]


def write_drawn_trial(
    drawing: Path, folder: Path, crack: GivenDrawing, settings: SettingValues
) -> tuple[Path, list[Fact]]:
    """Write a trial with the mesh of a drawn crack. Returns the file and notes.

    ``settings`` are settings of the trial by dotted name. Raises InputError if the drawing cannot be used, or if a file
    with the same name and different content exists.
    """
    from digitise.drawing.read_dxf import drawn_crack, open_drawing, sample_stl
    from digitise.settings import CrackShape

    require_folder(folder)
    drawn = open_drawing(drawing, crack.units)
    depth_mm = crack.depth_mm
    outline, _ = drawn_crack(drawn, crack)
    doubts = doubts_of(CrackShape(depth_mm=depth_mm), width_mm=outline.mean_width_mm)
    notes = [*drawn.notes, *doubts]
    mesh = {"file": MESH, "data": crack.data, "units": "mm"}
    contents = {folder / MESH: sample_stl(outline, depth_mm)}
    floor = f"{depth_mm:g} mm deep, with upright walls and a level floor"
    note = f"The crack is from the drawing {drawing.name} in {drawn.unit}. It is {floor}."
    content = {"name": name_of(drawing, "drawing"), "note": note, "mesh": mesh}
    trial = checked(Trial, drawing, with_settings(content, settings))
    contents[folder / DRAWN] = trial_text(trial).encode()
    write_unless_other(contents)
    return folder / DRAWN, notes


def toml_value(value: Any) -> str:
    """Return a value as TOML text for a trial file."""
    import tomlkit

    if not isinstance(value, Mapping):
        return tomlkit.item(value).as_string()
    inline = tomlkit.inline_table()
    inline.update(value)
    return inline.as_string()
