"""Write what was pointed at on the trace page into a trial file, and leave everything else in it as it is."""

import json
import tomllib
from pathlib import Path
from typing import Any

from digitise.trace_page.hints import Hints
from sealtwin.errors import InputError
from sealtwin.store.files import write_bytes
from sealtwin.store.settings_file import checked
from sealtwin.trials.trial import Trial

BYTE_ORDER_MARK = "\ufeff"
"""Windows' Notepad puts one before the text."""

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
    """A trial file as it was when the page opened."""

    def __init__(self, path: Path) -> None:
        # A link stays one: its target is written.
        self.path = path
        self._target = path.resolve()
        self._content = self._target.read_bytes()

    def save(self, hints: Hints) -> list[str]:
        """Give the file's [photo] the hints, in one step or not at all; keys that ``hints`` does not say go.

        Returns:
            The keys that changed.

        Raises:
            InputError: the file was changed by somebody else, or would be no trial with these hints. It is as it was.
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
        if after != _expected(before, hints):
            raise InputError(
                f"{self.path}: [photo] is written in a way that cannot be edited without changing more than the hints. "
                f"Put them in yourself: {_as_lines(hints)}"
            )
        checked(Trial, self.path, after)
        if changed:
            write_bytes(self._target, edited.encode("utf-8"))
            self._content = edited.encode("utf-8")
        return changed


class NewTrial:
    """The trial file that a photo does not have yet: it gets the photo's name, and lies beside it."""

    def __init__(self, photo: Path) -> None:
        """Raises InputError where there is a file of that name: it is to be traced itself."""
        self.photo, self.path = photo, photo.with_suffix(".toml")
        self._refuse_another()

    def save(self, hints: Hints, depth_mm: float | None) -> list[str]:
        """Returns and raises as ``TrialFile.save``; the depth must be given, since no photo shows it."""
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
    """A trial file's text with ``hints`` in its [photo], comments and order kept; and the keys that changed."""
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
    """Under the table's last key, rather than under a comment that belongs to the next table."""
    from tomlkit.items import Table

    own = [name for name in table if not isinstance(table[name], Table)]
    if key in table or not own or not isinstance(table, Table):
        table[key] = value
    else:
        table.value._insert_after(own[-1], key, value)


def _expected(content: dict[str, Any], hints: Hints) -> dict[str, Any]:
    kept = {key: value for key, value in content["photo"].items() if key not in Hints.model_fields}
    return {**content, "photo": {**kept, **hints.said()}}


def _as_lines(hints: Hints) -> str:
    return "; ".join(f"{key} = {json.dumps(value)}" for key, value in hints.said().items())
