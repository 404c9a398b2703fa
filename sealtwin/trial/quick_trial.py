"""The trial of 'sealtwin quick': what was given, and the starter's settings for all else, each marked as assumed."""

import hashlib
import os
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sealtwin.core.errors import InputError
from sealtwin.core.files import write_text
from sealtwin.core.plain_files import read_bytes
from sealtwin.core.settings import checked
from sealtwin.trial.starter_files import TRIAL
from sealtwin.trial.trial_file import LINE_BREAKING, Trial

Tables = Mapping[str, Mapping[str, Any]]
ASSUMED = {
    "crack": ("tilt", "wall_angle_deg"),
    "path": ("volume_ml", "trim_mm", "speed_mm_s"),
    "fluid": ("U", "D_cm", "yield_stress_pa", "freeze_after_s"),
    "solver": ("preset", "radius_mm", "settle_s"),
    "nozzle": ("diameter_mm",),
}
"""Settings that are the starter's where they are not given."""
NOBODY = "undeclared"  # Origin of a photo, and origin and role of readings, that nobody said: they validate nothing
MARK = "# Written by 'sealtwin quick', as it was while its check is "
"""First line of the file, ahead of a hash of the others: what nobody edited may be written anew."""
HEAD = """\
# What is marked as assumed was not given: measure it, correct it here, and run it again:
#   sealtwin run {file} --out {run}
"""


def quick_trial(photo: Path, folder: Path, given: Tables, sheet: Path | None) -> tuple[str, list[str]]:
    """Return the text of a trial file in ``folder``, and its assumptions as "table.key = value".

    ``given`` holds settings of [photo] and [crack], None for one that was not given. Raises InputError, naming the
    photo, where one cannot be used, or where a file is missing.
    """
    for file in (photo, *([] if sheet is None else [sheet])):
        if not file.is_file():
            raise InputError(f"{file}: no such file.")
    starter = tomllib.loads(TRIAL)
    said = {table: {key: value for key, value in keys.items() if value is not None} for table, keys in given.items()}
    said["photo"] = {"file": _from(folder, photo), **said["photo"]}
    assumed = {table: {key: starter[table][key] for key in keys} for table, keys in ASSUMED.items()}
    assumed = {"photo": {"data": NOBODY}} | assumed
    if sheet is not None:
        said["readings"] = {"file": _from(folder, sheet)}
        assumed["readings"] = {"data": NOBODY, "role": NOBODY}
    told = [f"{table}.{key} = {toml_value(value)}" for table, keys in assumed.items() for key, value in keys.items()]
    name = LINE_BREAKING.sub("-", photo.stem)[:80].strip() or "photo"
    head = {"name": name, "note": f"Assumed, not measured or given: {', '.join(told)}."}
    tables = {table: (said.get(table, {}), assumed.get(table, {})) for table in dict.fromkeys([*said, *assumed])}
    checked(Trial, photo, {**head, **{table: {**keys, **more} for table, (keys, more) in tables.items()}})
    lines = [HEAD.format(file=(folder / "trial.toml").as_posix(), run=(folder / "run").as_posix())]
    lines += [f"{key} = {toml_value(value)}" for key, value in head.items()]
    for table, (keys, more) in tables.items():
        lines += ["", f"[{table}]", *(f"{key} = {toml_value(value)}" for key, value in keys.items())]
        lines += [f"{key} = {toml_value(value)}  # assumed" for key, value in more.items()]
    content = "\n".join(lines) + "\n"
    return f"{MARK}{_check(content)}\n{content}", told


def write_quick_trial(path: Path, text: str) -> None:
    """Write the file. Raises InputError where there is one that anybody wrote or edited."""
    if path.exists():
        first, _, rest = read_bytes(path).decode("utf-8", errors="replace").partition("\n")
        if first != MARK + _check(rest):
            raise InputError(
                f"{path}: is yours, or was edited, and is not overwritten. Run 'sealtwin run {path}', or give another "
                "--out."
            )
    write_text(path, text)


def _check(content: str) -> str:
    return hashlib.sha256(content.encode()).hexdigest()[:12]


def _from(folder: Path, file: Path) -> str:
    """Return a file as seen from the trial's folder, so that both can be moved together and no home is named."""
    try:
        return Path(os.path.relpath(file, folder)).as_posix()
    except ValueError:
        # On another drive of Windows.
        return file.absolute().as_posix()


def toml_value(value: Any) -> str:
    """Return a value as a trial file writes it."""
    import tomlkit

    if not isinstance(value, Mapping):
        return tomlkit.item(value).as_string()
    inline = tomlkit.inline_table()
    inline.update(value)
    return inline.as_string()
