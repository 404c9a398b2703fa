"""Make the trial of 'sealtwin quick'. Settings that are not given are the starter's, and are marked as assumed."""

import hashlib
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sealtwin.core.errors import InputError
from sealtwin.core.files import write_text
from sealtwin.core.plain_files import read_bytes
from sealtwin.core.settings import checked
from sealtwin.trial.starter_files import TRIAL
from sealtwin.trial.trial_file import Trial, name_of, seen_from, with_settings

STARTER = tomllib.loads(TRIAL)
NOT_ASSUMED = ("crack.depth_mm", "path.flow", "path.ramp_mm", "path.lead_in_mm")
"""Settings of the starter that are not marked as assumed, since they are always given, or are defaults."""
ASSUMED = {
    f"{table}.{key}": value
    for table in ("crack", "path", "fluid", "solver", "nozzle")
    for key, value in STARTER[table].items()
    if f"{table}.{key}" not in NOT_ASSUMED
}
"""Settings that are taken from the starter if not given, by dotted name."""
QUICK = {**ASSUMED, "solver.preset": "draft"}
NOBODY = "undeclared"  # Origin of a photo, and origin and role of readings, if not declared: they validate nothing
MARK = "# Written by 'sealtwin quick', as it was while its check is "
"""First line of the file, before a hash of the others. A file that was not edited may be overwritten."""
HEAD = """\
# Settings marked as assumed were not given. Measure them, correct them here, and run again:
#   sealtwin run {file} --out {run}
"""


def quick_trial(photo: Path, folder: Path, settings: Mapping[str, Any], sheet: Path | None) -> tuple[str, list[str]]:
    """Return the text of a trial file in ``folder``, and its assumptions as "table.key = value".

    ``settings`` are the given ones, by dotted name. Raises InputError, naming the photo, if one cannot be used, or a
    file is missing.
    """
    for file in (photo, *([] if sheet is None else [sheet])):
        if not file.is_file():
            raise InputError(f"{file}: no such file.")
    sheets = {} if sheet is None else {"readings.file": sheet}
    if twice := sorted({"photo.file", *sheets} & settings.keys()):
        raise InputError(f"{photo}: {twice[0]} is given twice; give it once.")
    given = seen_from(folder, {"photo.file": photo, **settings, **sheets})
    defaults = {"photo.data": NOBODY, **QUICK}
    if sheet is not None:
        defaults |= {"readings.data": NOBODY, "readings.role": NOBODY}
    content = with_settings(with_settings({"name": name_of(photo, "photo")}, defaults), given)
    # A given setting also replaces those that it excludes.
    assumed = {name: value for name, value in defaults.items() if name not in given and _is_in(content, name)}
    sentences = [f"{name} = {toml_value(value)}" for name, value in assumed.items()]
    content = {"note": f"Assumed, not measured or given: {', '.join(sentences)}.", **content}
    checked(Trial, photo, content)
    return _text(folder, content, given, assumed), sentences


def _text(folder: Path, content: Mapping[str, Any], given: Mapping[str, Any], assumed: Mapping[str, Any]) -> str:
    head = {key: content[key] for key in ("name", "note", "seed", "seeds") if key in content}
    lines = [HEAD.format(file=(folder / "trial.toml").as_posix(), run=(folder / "run").as_posix())]
    lines += [f"{key} = {toml_value(value)}" for key, value in head.items()]
    tables = dict.fromkeys(name.partition(".")[0] for name in (*given, *assumed) if "." in name)
    for table in tables:
        lines += ["", f"[{table}]", *_rows(table, given), *(f"{row}  # assumed" for row in _rows(table, assumed))]
    text = "\n".join(lines) + "\n"
    return f"{MARK}{_check(text)}\n{text}"


def _is_in(content: Mapping[str, Any], name: str) -> bool:
    table, _, key = name.partition(".")
    return key in content[table]


def _rows(table: str, settings: Mapping[str, Any]) -> list[str]:
    """Return the lines of one table of a trial file."""
    parts = [(*name.partition(".")[::2], value) for name, value in settings.items()]
    return [f"{key} = {toml_value(value)}" for home, key, value in parts if home == table and key]


def write_quick_trial(path: Path, text: str) -> None:
    """Write the trial file. Raises InputError if the file exists and a user wrote or edited it."""
    if path.exists():
        first, _, rest = read_bytes(path).decode("utf-8", errors="replace").partition("\n")
        if first != MARK + _check(rest):
            raise InputError(
                f"{path}: written or edited by you, and not overwritten. Run 'sealtwin run {path}', or give another "
                "--out."
            )
    write_text(path, text)


def _check(content: str) -> str:
    return hashlib.sha256(content.encode()).hexdigest()[:12]


def toml_value(value: Any) -> str:
    """Return a value as text of a trial file."""
    import tomlkit

    if not isinstance(value, Mapping):
        return tomlkit.item(value).as_string()
    inline = tomlkit.inline_table()
    inline.update(value)
    return inline.as_string()
