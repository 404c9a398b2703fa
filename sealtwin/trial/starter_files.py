"""Files to start from: a commented trial for 'sealtwin init', a robot's cell, a study, and the trial of the demo."""

from importlib.resources import files as resources
from pathlib import Path

from sealtwin.core.errors import InputError
from sealtwin.core.files import write_text, write_unless_other
from sealtwin.core.run_folder import require_folder

TEMPLATES = resources("sealtwin").joinpath("templates")
TRIAL = TEMPLATES.joinpath("starter_trial.toml").read_text(encoding="utf-8")
CELL = TEMPLATES.joinpath("starter_cell.toml").read_text(encoding="utf-8")
STUDY = TEMPLATES.joinpath("study.toml").read_text(encoding="utf-8")
READINGS = "s_mm,level_1_mm,level_2_mm,level_3_mm\n"
"""Header of a sheet of readings with three repeats of the level at each station. Levels are upward from the face."""
DEMO = ("photo.jpg", "truth.json", "caliper.csv", "trial.toml", "trial-paper.toml")
"""Files of the paper's reconstructed trial, which is a fixture of the tests. The wheel has them too."""


def write_example_cell(path: Path) -> None:
    """Write a cell file. Raises InputError if ``path`` exists."""
    _write_new({path: CELL.replace("{file}", path.name)}, "name")


def write_example_study(file: Path) -> None:
    """Write a commented study. Raises InputError if ``file`` exists."""
    _write_new({file: STUDY.replace("{file}", str(file))}, "name")


def write_starter(folder: Path) -> list[Path]:
    """Write trial.toml and caliper.csv into a folder, and return them. Raises InputError if one of them exists."""
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder}: this is a file; give a folder, new or existing.")
    trial = TRIAL.replace("{folder}", folder.as_posix())
    return _write_new({folder / "trial.toml": trial, folder / "caliper.csv": READINGS}, "folder")


def _write_new(contents: dict[Path, str], other: str) -> list[Path]:
    for path in contents:
        if path.exists():
            raise InputError(f"{path}: already exists and is not overwritten; give another {other}.")
    for path, text in contents.items():
        write_text(path, text)
    return list(contents)


def place_paper_trial(folder: Path) -> None:
    """Copy the reconstructed trial into a folder, new or existing.

    Raises InputError if it has files of the same names with another content, which are not overwritten.
    """
    require_folder(folder)
    write_unless_other({folder / name: (shipped_trial() / name).read_bytes() for name in DEMO})


def shipped_trial() -> Path:
    """Return the folder of the reconstructed trial: in the package of a wheel, or the fixture of a checkout.

    Raises InputError if the installation lacks it.
    """
    package = Path(str(resources("sealtwin")))
    for folder in (package / "demo", package.parent / "fixtures" / "paper-trial"):
        if (folder / "trial.toml").is_file():
            return folder
    raise InputError(f"{package / 'demo'}: the demo's files are missing; install sealtwin again.")
