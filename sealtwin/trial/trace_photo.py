"""Open the photo of a trial on the trace page, and write the user's hints to the trial file."""

import json
import shlex
import tomllib
from codecs import BOM_UTF8
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from digitise.trace_page.page import Opened
from digitise.trace_page.session import UNSCALED_MM_PER_PX, Hints, Shape, TraceSession
from sealtwin.core.errors import InputError
from sealtwin.core.files import write_bytes
from sealtwin.core.plain_files import read_bytes
from sealtwin.trial.job import TRIAL_SUFFIX
from sealtwin.trial.starter_files import NOBODY, begin_trial, starter_text
from sealtwin.trial.trial_file import SettingValues, checked_trial, load_trial, seen_from, with_settings


def opened(path: Path, replacements: SettingValues) -> Opened:
    """Return the session of a trial file or a photo, a function that saves its hints, and facts for the page.

    ``replacements`` are settings by dotted name that replace settings of the trial. Raises InputError for a bad photo
    or trial.
    """
    new = path.suffix.lower() != TRIAL_SUFFIX
    temporary = _temporary(replacements) if new else {}
    loaded = begin_trial(path, {**temporary, **replacements}) if new else load_trial(path, replacements)
    if loaded.photo is None:
        raise InputError(f"{path}: this trial starts from a {loaded.kind} and has no photo to trace.")
    trial = new_trial(path, replacements) if new else TrialFile(path, replacements)
    # A trial for a path without a solid has no table [crack].
    hints, shape = Hints.of(loaded.photo), Shape() if loaded.crack is None else Shape.of(loaded.crack)
    if "photo.mm_per_px" in temporary:
        hints = hints.model_copy(update={"mm_per_px": None})
    if "crack.depth_mm" in temporary:
        shape = shape.model_copy(update={"depth_mm": None})
    saves_to = f"Writes {trial.path.name} to the photo's folder." if new else f"Saves to {path.name}."
    runs, settings = loaded.fluid is not None, loaded.photo
    tables = [key for key in Shape.model_fields if isinstance(getattr(loaded.crack, key, None), tuple)]
    facts: dict[str, Any] = {"saves_to": saves_to}
    facts |= {"is_new": new, "path_only": bool(settings.path_only), "shape": shape.entries(), "tables": tables}

    def save(hints: Hints, shape: Shape) -> dict[str, Any]:
        changed = trial.save(hints, shape)
        return {
            "file": str(trial.path),
            "changed": changed,
            "summary": f"Saved to {trial.path}: {', '.join(changed) if changed else 'nothing had changed'}.",
            "next": f"sealtwin {'run' if runs else 'digitise'} {shlex.quote(str(trial.path))}",
        }

    return Opened(TraceSession(settings, path.parent, hints), save, facts)


def _temporary(replacements: SettingValues) -> dict[str, Any]:
    """Return a scale and a depth for a photo of which neither is known."""
    scales = {f"photo.{key}" for key in ("markers", "face_mm", "ruler_px", "mm_per_px")}
    whether = {"photo.mm_per_px": scales & replacements.keys(), "crack.depth_mm": "crack.depth_mm" in replacements}
    return {name: UNSCALED_MM_PER_PX for name, is_given in whether.items() if not is_given}


class TrialFile:
    """A trial file as it was when the page was opened, or the text of a new trial file."""

    def __init__(self, path: Path, settings: SettingValues | None = None, new: str = "") -> None:
        """Read a trial file, or take its text from ``new``. ``settings`` by dotted name replace settings of the file.

        Raises InputError if the file of a new trial already exists.
        """
        # If the file is a link, its target is written and the link remains.
        self.path, self._target = path, path.resolve()
        self._settings, self._keys = seen_from(path.parent, settings or {}), list(Hints.model_fields)
        self._new, self._content = bool(new), new.encode() if new else read_bytes(self._target)
        self._require_unchanged()

    def _require_unchanged(self) -> None:
        exists = self._target.exists()
        if exists != (not self._new) or (exists and read_bytes(self._target) != self._content):
            fault = "already exists" if self._new else "was changed after the page was opened"
            raise InputError(
                f"{self.path}: {fault}, so it is not overwritten. To trace it, use 'sealtwin trace {self.path}'."
            )

    def save(self, hints: Hints, shape: Shape) -> list[str]:
        """Write the hints to [photo] and the shape to [crack]. Returns the changed keys.

        Keys that are not in ``hints`` are removed from [photo]. Keys that are not in ``shape`` are not changed in
        [crack]. Raises InputError, without changing the file, if the file was edited in the meantime or would not be a
        valid trial.
        """
        self._require_unchanged()
        # Notepad on Windows writes a byte-order mark before the text.
        mark = BOM_UTF8 if self._content.startswith(BOM_UTF8) else b""
        text = self._content.removeprefix(mark).decode("utf-8")
        before = tomllib.loads(text)
        edited, changed = with_hints(text, hints, shape, self._settings, self._keys)
        before = with_settings(before, self._settings)
        after = tomllib.loads(edited)
        others = {key: value for key, value in before["photo"].items() if key not in self._keys}
        tables = {"photo": {**others, **hints.entries()}}
        if "crack" in before or shape.entries():
            tables["crack"] = {**before.get("crack", {}), **shape.entries()}
        # The page removes settings from ``assumed`` that the user has set.
        if after != {**before, **tables, **{key: after[key] for key in after.keys() & {"assumed"}}}:
            lines = "; ".join(
                f"{key} = {json.dumps(value)}" for key, value in {**hints.entries(), **shape.entries()}.items()
            )
            raise InputError(
                f"{self.path}: [photo] or [crack] is written in a form that sealtwin cannot edit without other "
                f"changes. Add these lines yourself: {lines}"
            )
        checked_trial(self.path, after)
        if changed:
            self._content = mark + edited.encode("utf-8")
            write_bytes(self._target, self._content)
        # The page may remove the markers of a frame that it wrote.
        self._keys += ["markers"] * bool(hints.frame)
        self._new = False
        return changed


def new_trial(photo: Path, settings: SettingValues | None = None) -> TrialFile:
    """Return a new trial file with the name of a photo, in the photo's folder. Raises InputError if the file exists.

    It is the starter of 'sealtwin init', without the scale and the depth, which nobody has measured yet.
    """
    import tomlkit

    path = photo.with_suffix(TRIAL_SUFFIX)
    document: Any = tomlkit.parse(starter_text(path))
    document["photo"] |= {"file": photo.name, "data": NOBODY}
    for table, key in (name.split(".") for name in ("photo.mm_per_px", "photo.scale_is", "crack.depth_mm")):
        document[table].remove(key)
    return TrialFile(path, settings, tomlkit.dumps(document))


def with_hints(
    text: str, hints: Hints, shape: Shape, settings: SettingValues, keys: Iterable[str]
) -> tuple[str, list[str]]:
    """Return the text of a trial file with hints, shape and settings, and the changed keys.

    Comments and order do not change. ``settings`` by dotted name are written before the hints. A key in ``keys`` that
    is not in the hints is removed.
    """
    import tomlkit

    windows = "\r\n" in text
    document = tomlkit.parse(text.replace("\r\n", "\n"))
    replaced = _replaced(document, settings)
    photo: Any = document["photo"]
    values = hints.entries()
    removed = [key for key in keys if key not in values and key in photo]
    for key in removed:
        photo.remove(key)
    if "crack" not in document and shape.entries():
        document["crack"] = tomlkit.table()
    shaped = _filled(document.get("crack", {}), shape.entries())
    changed = [*replaced, *_filled(photo, values), *removed, *shaped]
    names = {*settings, *(f"crack.{key}" for key in shaped)}
    if assumed := document.get("assumed"):
        changed += _filled(document, {"assumed": [name for name in assumed if name not in names]})
    edited = tomlkit.dumps(document)
    return edited.replace("\n", "\r\n") if windows else edited, changed


def _replaced(document: Any, settings: SettingValues) -> list[str]:
    """Write settings by dotted name to their tables, and return the changed keys."""
    import tomlkit

    wanted, changed = with_settings(document.unwrap(), settings), list[str]()
    for name in dict.fromkeys(name.partition(".")[0] for name in settings):
        if not isinstance(wanted[name], dict):
            changed += _filled(document, {name: wanted[name]})
            continue
        home = document.setdefault(name, tomlkit.table())
        removed = [key for key in home if key not in wanted[name]]
        for key in removed:
            home.remove(key)
        changed += [*removed, *_filled(home, wanted[name])]
    return changed


def _filled(table: Any, values: dict[str, Any]) -> list[str]:
    """Write values to a table, and return the changed keys."""
    changed = [key for key, value in values.items() if table.get(key) != value]
    for key in changed:
        _put(table, key, values[key])
    return changed


def _put(table: Any, key: str, value: Any) -> None:
    """Insert a key after the last key of a table, but before a comment that belongs to the next table."""
    from tomlkit.items import Table

    keys = [name for name in table if not isinstance(table[name], Table)]
    if key in table or not isinstance(table, Table) or not table.value.body:
        table[key] = value
    elif keys:
        table.value._insert_after(keys[-1], key, value)
    else:
        table.value._insert_at(0, key, value)
