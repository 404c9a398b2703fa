"""Hints of the trace page, written into a trial file that otherwise stays as it is."""

import json
import tomllib
from pathlib import Path
from typing import Any

from digitise.trace_page.session import Hints
from sealtwin.core.errors import InputError
from sealtwin.core.files import write_bytes
from sealtwin.core.settings import checked
from sealtwin.trial.trial_file import Trial

BYTE_ORDER_MARK = "\ufeff"  # Mark that Windows' Notepad puts before the text

NEW_TRIAL = """\
# Traced on the page of 'sealtwin trace'. Pixels count from the centre of the photo's first pixel, x right, y down.
# 'sealtwin init DIR' writes a trial that shows the other settings.

name = ""

[photo]
file = ""
data = "measured"

[crack]
"""


class TrialFile:
    """Trial file as it was when the page opened."""

    def __init__(self, path: Path) -> None:
        # A link stays one: its target is written.
        self.path = path
        self._target = path.resolve()
        self._content = self._target.read_bytes()

    def save(self, hints: Hints, _: float | None = None) -> list[str]:
        """Write the hints into the file's [photo]; keys that ``hints`` lacks are removed. Returns the changed keys.

        Raises InputError, and leaves the file as it was, if the file has changed since or would be no trial with them.
        """
        if not self._target.is_file() or self._target.read_bytes() != self._content:
            raise InputError(
                f"{self.path}: changed since the page was opened, and is not overwritten. Run 'sealtwin trace "
                f"{self.path}' again."
            )
        text = self._content.decode("utf-8")
        before = tomllib.loads(text.removeprefix(BYTE_ORDER_MARK))
        edited, changed = with_hints(text, hints)
        after = tomllib.loads(edited.removeprefix(BYTE_ORDER_MARK))
        kept = {key: value for key, value in before["photo"].items() if key not in Hints.model_fields}
        if after != {**before, "photo": {**kept, **hints.said()}}:
            lines = "; ".join(f"{key} = {json.dumps(value)}" for key, value in hints.said().items())
            raise InputError(
                f"{self.path}: [photo] is written in a way that cannot be edited without changing more than the hints. "
                f"Put them in yourself: {lines}"
            )
        checked(Trial, self.path, after)
        if changed:
            write_bytes(self._target, edited.encode("utf-8"))
            self._content = edited.encode("utf-8")
        return changed


class NewTrial:
    """New trial file beside a photo, with the photo's name."""

    def __init__(self, photo: Path) -> None:
        """Raise InputError if there is a file of that name, which can be traced itself."""
        self.photo, self.path = photo, photo.with_suffix(".toml")
        self._refuse_another()

    def save(self, hints: Hints, depth_mm: float | None) -> list[str]:
        """Write the file; return and raise as ``TrialFile.save``. The depth is required: no photo shows it."""
        import tomlkit

        self._refuse_another()
        document: Any = tomlkit.parse(NEW_TRIAL)
        document["name"] = self.photo.stem[:80]
        document["photo"]["file"] = self.photo.name
        if depth_mm is not None:
            document["crack"]["depth_mm"] = depth_mm
        text, changed = with_hints(tomlkit.dumps(document), hints)
        checked(Trial, self.path, tomllib.loads(text))
        write_bytes(self.path, text.encode("utf-8"))
        return changed

    def _refuse_another(self) -> None:
        if self.path.exists():
            raise InputError(
                f"{self.path}: is there already and is not overwritten. Run 'sealtwin trace {self.path}' to trace its "
                "photo, or move it away."
            )


def with_hints(text: str, hints: Hints) -> tuple[str, list[str]]:
    """Return a trial file's text with ``hints`` in its [photo], comments and order kept, and the keys that changed."""
    import tomlkit

    windows = "\r\n" in text
    mark = BYTE_ORDER_MARK if text.startswith(BYTE_ORDER_MARK) else ""
    document = tomlkit.parse(text.removeprefix(mark).replace("\r\n", "\n"))
    photo: Any = document["photo"]
    said, changed = hints.said(), []
    for key in Hints.model_fields:
        if key in said and photo.get(key) != said[key]:
            _put(photo, key, said[key])
            changed.append(key)
        elif key not in said and key in photo:
            photo.remove(key)
            changed.append(key)
    edited = tomlkit.dumps(document)
    return mark + (edited.replace("\n", "\r\n") if windows else edited), changed


def _put(table: Any, key: str, value: Any) -> None:
    """Insert a key below the table's last key, not below a comment that belongs to the next table."""
    from tomlkit.items import Table

    own = [name for name in table if not isinstance(table[name], Table)]
    if key in table or not own or not isinstance(table, Table):
        table[key] = value
    else:
        table.value._insert_after(own[-1], key, value)
