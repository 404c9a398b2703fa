"""Begin trials: the commented starter of 'init' and 'trace', trials of a photo, a mesh or a drawing, and the demo.

All of them take the settings that nobody gave from the same defaults: those of the settings' fields and, for the
sealant, the starter's table [fluid]. Also write starters of a robot's cell and of a study.
"""

import tomllib
from collections.abc import Mapping
from importlib.resources import files as resources
from io import BytesIO
from pathlib import Path
from typing import Any

from sealtwin.core.errors import InputError, present
from sealtwin.core.files import write_unless_other
from sealtwin.core.run_folder import require_folder
from sealtwin.core.settings import table_of
from sealtwin.trial.trial_file import KINDS, Kind, SettingValues, Trial, checked_trial, with_settings
from simulate.settings import LAWS

TEMPLATES = resources("sealtwin").joinpath("templates")
TRIAL = TEMPLATES.joinpath("starter_trial.toml").read_text(encoding="utf-8")
CELL = TEMPLATES.joinpath("starter_cell.toml").read_text(encoding="utf-8")
STUDY = TEMPLATES.joinpath("study.toml").read_text(encoding="utf-8")
SHEET = "caliper.xlsx"
HEADER = ("Distance along crack [mm]", *(f"Depth below face {repeat} [mm]" for repeat in (1, 2, 3)))
"""Header of the empty sheet of readings, with three repeats at each station."""
PAPER, REAL = "paper-trial", "real-crack"
DEMO = {
    PAPER: ("photo.jpg", "truth.json", "caliper.csv", "trial.toml", "trial-paper.toml"),
    REAL: ("photo.jpg", "LICENCE.txt", "trial.toml"),
}
"""Files of the reconstruction of the paper's trial, and of a photo of a real crack whose lengths are invented.

They are fixtures of the tests, and also part of the wheel.
"""
NOBODY = "undeclared"  # Origin of a file, and use of readings, that nobody has declared
SEALANT = {f"fluid.{key}": value for key, value in tomllib.loads(TRIAL)["fluid"].items()}
"""Sealant of a trial for which none is given, by dotted name."""


def begun(content: Mapping[str, Any], settings: SettingValues) -> dict[str, Any]:
    """Return the tables of a new trial: ``content`` with the user's ``settings``, and the assumed sealant.

    ``settings`` are by dotted name. A setting of the sealant that they give or exclude is not assumed.
    """
    sealant = SEALANT
    if settings.keys() & {f"fluid.{key}" for key in LAWS}:
        # A sealant whose law of flow is given has no yield stress unless the user gives it: an oil has none.
        sealant = {"fluid.freeze_after_s": SEALANT["fluid.freeze_after_s"]}
    return with_settings({**with_settings(content, sealant), "assumed": list(sealant)}, settings)


def begin_trial(file: Path, settings: SettingValues) -> Trial:
    """Return the trial of a photo, a mesh or a drawing. ``settings`` are by dotted name.

    Settings of another kind of file apply to this kind if it has them: photo.width_mm is a drawing's drawing.width_mm.
    Raises InputError if a setting cannot be used.
    """
    kind = kind_of(file)
    table, of_kind = present(table_of(Trial, (kind, "")), kind), dict[str, Any]()
    for name, value in settings.items():
        home, _, key = name.partition(".")
        if home in KINDS and home != kind and key not in table.model_fields:
            raise InputError(f"{file}: {name} is for a {home}, but this file is a {kind}.")
        of_kind[f"{kind}.{key}" if home in KINDS else name] = value
    if f"{kind}.file" in of_kind:
        raise InputError(f"{kind}.file and {file} are both given; give only one {kind}.")
    content = {kind: {"file": file.name, "data": NOBODY}}
    if any(name.startswith("readings.") for name in settings):
        content["readings"] = {"data": NOBODY, "role": NOBODY}
    return checked_trial(file, begun(content, of_kind))


def kind_of(file: Path) -> Kind:
    """Return the table of a trial to which a file belongs by its suffix: a mesh, a drawing or, for others, a photo."""
    from sealtwin.core.mesh_file import READERS

    suffix = file.suffix.lower()
    return "mesh" if suffix in READERS else "drawing" if suffix == ".dxf" else "photo"


def write_example_cell(path: Path) -> None:
    """Write an example of a cell file. Raises InputError if ``path`` exists."""
    write_unless_other({path: CELL.replace("{file}", path.name).encode()})


def write_example_study(file: Path) -> None:
    """Write an example of a study file. Raises InputError if ``file`` exists."""
    write_unless_other({file: STUDY.replace("{file}", str(file)).encode()})


def write_starter(folder: Path) -> list[Path]:
    """Write trial.toml and a sheet for readings to a folder, and return their paths.

    Raises InputError if one of them exists.
    """
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder}: is a file; give a new or existing folder.")
    trial = folder / "trial.toml"
    contents = {trial: starter_text(trial).encode(), folder / SHEET: empty_sheet()}
    write_unless_other(contents)
    return [*contents]


def starter_text(trial: Path) -> str:
    """Return the text of a new trial file, with comments that name it."""
    return TRIAL.replace("{trial}", trial.as_posix())


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


def place_trial(folder: Path, name: str) -> None:
    """Copy a trial of ``DEMO`` to a new or existing folder.

    Raises InputError if the folder contains files with the same names and different content, which are not overwritten.
    """
    require_folder(folder)
    write_unless_other({folder / file: (shipped_trial(name) / file).read_bytes() for file in DEMO[name]})


def shipped_trial(name: str) -> Path:
    """Return the folder of a trial of ``DEMO``. Raises InputError if a file is missing in this installation.

    The folder is in the installed package or in a checkout.
    """
    package = Path(str(resources("sealtwin")))
    for folder in (package / "demo" / name, package.parent / "fixtures" / name):
        if all((folder / file).is_file() for file in DEMO[name]):
            return folder
    raise InputError(f"{package / 'demo' / name}: the files of the demo are missing. Install sealtwin again.")
