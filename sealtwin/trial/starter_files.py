"""Files to start from: a commented trial for 'sealtwin init', a robot's cell, a study, and the trial of the demo."""

from collections.abc import Mapping, Sequence
from importlib.resources import files as resources
from io import BytesIO
from pathlib import Path

from sealtwin.core.errors import InputError
from sealtwin.core.files import write_bytes, write_unless_other
from sealtwin.core.run_folder import require_folder

TEMPLATES = resources("sealtwin").joinpath("templates")
TRIAL = TEMPLATES.joinpath("starter_trial.toml").read_text(encoding="utf-8")
CELL = TEMPLATES.joinpath("starter_cell.toml").read_text(encoding="utf-8")
STUDY = TEMPLATES.joinpath("study.toml").read_text(encoding="utf-8")
SHEET = "caliper.xlsx"
HEADER = ("Distance along crack [mm]", *(f"Depth below face {repeat} [mm]" for repeat in (1, 2, 3)))
"""Header of the empty sheet of readings, with three repeats at each station."""
STATIONS = 30  # Empty rows with a frame
DEMO = ("photo.jpg", "truth.json", "caliper.csv", "trial.toml", "trial-paper.toml")
"""Files of the paper's reconstructed trial, which is a fixture of the tests. The wheel has them too."""
MEASURED = ("measured.toml", "fronts.csv", "flow_curve_okonomiyaki.csv")
"""Files of 'sealtwin demo --measured', which the benchmarks read too. The wheel has them too."""


def write_example_cell(path: Path) -> None:
    """Write a cell file. Raises InputError if ``path`` exists."""
    _write_new({path: CELL.replace("{file}", path.name)}, "name")


def write_example_study(file: Path) -> None:
    """Write a commented study. Raises InputError if ``file`` exists."""
    _write_new({file: STUDY.replace("{file}", str(file))}, "name")


def write_starter(folder: Path) -> list[Path]:
    """Write trial.toml and a sheet for readings into a folder, and return them. Raises InputError if one exists."""
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder}: this is a file; give a folder, new or existing.")
    trial = TRIAL.replace("{folder}", folder.as_posix())
    return _write_new({folder / "trial.toml": trial, folder / SHEET: empty_sheet()}, "folder")


def empty_sheet() -> bytes:
    """Return an XLSX for readings. It is read without a question once numbers are in it."""
    import openpyxl
    from openpyxl.styles import Alignment, Border, Font, Side
    from openpyxl.utils import get_column_letter

    book, content = openpyxl.Workbook(), BytesIO()
    sheet = book.worksheets[0]
    sheet.title = "Readings"
    sheet.append(HEADER)
    line = Side(style="thin", color="999999")
    for row in sheet.iter_rows(min_row=1, max_row=1 + STATIONS, max_col=len(HEADER)):
        for cell in row:
            cell.border = Border(line, line, line, line)
            cell.number_format = "0.00"
    for column, cell in enumerate(sheet[1], start=1):
        cell.font, cell.alignment = Font(bold=True), Alignment(wrap_text=True, vertical="top")
        sheet.column_dimensions[get_column_letter(column)].width = 18
    sheet.freeze_panes = "A2"
    book.save(content)
    return content.getvalue()


def _write_new(contents: Mapping[Path, str | bytes], other: str) -> list[Path]:
    for path in contents:
        if path.exists():
            raise InputError(f"{path}: already exists and is not overwritten; give another {other}.")
    for path, content in contents.items():
        write_bytes(path, content.encode() if isinstance(content, str) else content)
    return list(contents)


def place_paper_trial(folder: Path) -> None:
    """Copy the reconstructed trial into a folder, new or existing.

    Raises InputError if it has files of the same names with another content, which are not overwritten.
    """
    require_folder(folder)
    write_unless_other({folder / name: (shipped_trial() / name).read_bytes() for name in DEMO})


def shipped_trial() -> Path:
    """Return the folder of the reconstructed trial. Raises InputError if the installation lacks one of its files."""
    return _shipped("demo", "fixtures/paper-trial", DEMO)


def shipped_measured() -> Path:
    """Return the folder of the measured dam breaks. Raises InputError if the installation lacks one of its files."""
    return _shipped("measured", "benchmarks/measured", MEASURED)


def _shipped(in_wheel: str, in_checkout: str, names: Sequence[str]) -> Path:
    """Return the folder that has all files of these names: in the package of a wheel, or in a checkout."""
    package = Path(str(resources("sealtwin")))
    for folder in (package / in_wheel, package.parent / in_checkout):
        if all((folder / name).is_file() for name in names):
            return folder
    raise InputError(f"{package / in_wheel}: the demo's files are missing; install sealtwin again.")
