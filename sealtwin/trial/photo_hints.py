"""Write hints and shape from the trace page into a trial file, and leave the rest of the file unchanged."""

import json
import tomllib
from codecs import BOM_UTF8
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from digitise.trace_page.session import Hints, Shape
from sealtwin.core.errors import InputError
from sealtwin.core.files import write_bytes
from sealtwin.core.plain_files import read_bytes
from sealtwin.core.settings import checked
from sealtwin.trial.starter_files import TRIAL
from sealtwin.trial.trial_file import Trial, seen_from, with_settings

NEEDED = ("fluid", "solver")
"""Tables without which a trial cannot run; a new trial has those of the starter."""
NEW_TRIAL = """\
# Traced on the page of 'sealtwin trace'. Pixels count from the centre of the photo's first pixel, x right, y down.
# 'sealtwin init DIR' writes a trial that shows the other settings.

name = ""

[photo]
file = ""
data = "undeclared"  # "measured", "reconstructed" or "synthetic"; "undeclared" if the origin is unknown.

[crack]
"""


class TrialFile:
    """A trial file as it was when the page was opened."""

    def __init__(self, path: Path, settings: Mapping[str, Any] | None = None) -> None:
        """Read a trial file. ``settings`` by dotted name replace those of the file when it is saved."""
        # A link is kept: its target is written.
        self.path = path
        self._settings = seen_from(path.parent, settings or {})
        self._target = path.resolve()
        self._content = read_bytes(self._target)
        self._keys = list(Hints.model_fields)

    def save(self, hints: Hints, shape: Shape) -> list[str]:
        """Write the hints into [photo] and the shape into [crack]; return the changed keys.

        Keys that ``hints`` lacks are removed; keys that ``shape`` lacks are not changed.

        Raises InputError, and does not change the file, if it was edited meanwhile or would not be a valid trial.
        """
        if not self._target.is_file() or read_bytes(self._target) != self._content:
            raise InputError(
                f"{self.path}: changed since the page was opened, and not overwritten. Run 'sealtwin trace "
                f"{self.path}' again."
            )
        # Notepad on Windows writes a mark before the text.
        mark = BOM_UTF8 if self._content.startswith(BOM_UTF8) else b""
        text = self._content.removeprefix(mark).decode("utf-8")
        before = tomllib.loads(text)
        edited, changed = with_hints(text, hints, shape, self._settings, self._keys)
        before = with_settings(before, self._settings)
        after = tomllib.loads(edited)
        others = {key: value for key, value in before["photo"].items() if key not in self._keys}
        given = {"photo": {**others, **hints.said()}}
        if "crack" in before or shape.said():
            given["crack"] = {**before.get("crack", {}), **shape.said()}
        if after != {**before, **given}:
            lines = "; ".join(f"{key} = {json.dumps(value)}" for key, value in {**hints.said(), **shape.said()}.items())
            raise InputError(
                f"{self.path}: [photo] or [crack] has a form that cannot be edited without changing more than the "
                f"hints. Write them yourself: {lines}"
            )
        checked(Trial, self.path, after)
        if changed:
            self._content = mark + edited.encode("utf-8")
            write_bytes(self._target, self._content)
        # The page may remove the markers of a frame that it wrote.
        self._keys += ["markers"] * bool(hints.frame)
        return changed


class NewTrial:
    """A new trial file in the folder of a photo, with the photo's name."""

    def __init__(self, photo: Path, settings: Mapping[str, Any] | None = None) -> None:
        """Raise InputError if a trial file of this name exists already; that file can be traced instead."""
        self.photo, self.path = photo, photo.with_suffix(".toml")
        self._settings = seen_from(photo.parent, settings or {})
        self._refuse_another()

    def save(self, hints: Hints, shape: Shape) -> list[str]:
        """Write the new file and return the names of its content. Raises InputError as ``TrialFile.save`` does.

        ``shape`` must have the depth, since no photo shows it.
        """
        import tomlkit

        self._refuse_another()
        document: Any = tomlkit.parse(NEW_TRIAL)
        document["name"] = self.photo.stem[:80]
        document["photo"]["file"] = self.photo.name
        text = "\n".join([tomlkit.dumps(document), *map(_from_starter, NEEDED)])
        text, changed = with_hints(text, hints, shape, self._settings)
        trial = checked(Trial, self.path, tomllib.loads(text))
        write_bytes(self.path, text.encode("utf-8"))
        undeclared = ['data = "undeclared"'] if trial.shown_by.data == "undeclared" else []
        return [*changed, *undeclared, *(f"the starter's [{name}]" for name in NEEDED)]

    def _refuse_another(self) -> None:
        if self.path.exists():
            raise InputError(
                f"{self.path}: already exists and is not overwritten. Run 'sealtwin trace {self.path}' to trace its "
                "photo, or move it away."
            )


def with_hints(
    text: str, hints: Hints, shape: Shape, settings: Mapping[str, Any], keys: Iterable[str] = Hints.model_fields
) -> tuple[str, list[str]]:
    """Return the text of a trial file with hints, shape and settings, and the changed keys.

    Comments and order do not change. ``settings`` by dotted name are written first. Those of ``keys`` that the hints
    lack are removed.
    """
    import tomlkit

    windows = "\r\n" in text
    document = tomlkit.parse(text.replace("\r\n", "\n"))
    replaced = _replaced(document, settings)
    photo: Any = document["photo"]
    given = hints.said()
    removed = [key for key in keys if key not in given and key in photo]
    for key in removed:
        photo.remove(key)
    if "crack" not in document and shape.said():
        document["crack"] = tomlkit.table()
    changed = [*replaced, *_filled(photo, given), *removed, *_filled(document.get("crack", {}), shape.said())]
    edited = tomlkit.dumps(document)
    return edited.replace("\n", "\r\n") if windows else edited, changed


def _replaced(document: Any, settings: Mapping[str, Any]) -> list[str]:
    """Write settings into their tables; return the changed keys."""
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
    """Write values into a table; return the changed keys."""
    changed = [key for key, value in values.items() if table.get(key) != value]
    for key in changed:
        _put(table, key, values[key])
    return changed


def _from_starter(name: str) -> str:
    """Return the text of a table of the starter, with its comments."""
    table = TRIAL[TRIAL.index(f"[{name}]") :].partition("\n\n")[0]
    return f"# From the starter, not measured: replace it by your own.\n{table}\n"


def _put(table: Any, key: str, value: Any) -> None:
    """Insert a key after the last key of a table, but before a comment that belongs to the next table."""
    from tomlkit.items import Table

    own = [name for name in table if not isinstance(table[name], Table)]
    if key in table or not isinstance(table, Table) or not table.value.body:
        table[key] = value
    elif own:
        table.value._insert_after(own[-1], key, value)
    else:
        table.value._insert_at(0, key, value)
