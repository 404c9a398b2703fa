"""A note: what somebody wrote down about a sample, or about all of a folder, since no photo shows it."""

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sealtwin.errors import InputError, as_text
from sealtwin.lab.finding import plain
from sealtwin.lab.keys import ALTERNATIVES, DATE, MESH, NAME, OF_READINGS, OWN, known_keys, tables
from sealtwin.lab.naming import NOTE_SUFFIX
from sealtwin.lab.values import read_date, read_setting, read_value
from sealtwin.lab.words import BY_WORD, HEADS, NOT_STATED, UNITS, likely_key, likely_word, normal
from sealtwin.store.settings_file import read_toml

if TYPE_CHECKING:
    from validate.sheets.grid import Cell

STARTER = 'a note says what no photo shows: data = "measured", and in [crack] depth_mm = 16.0'
UNIT_OF_WORD = re.compile(r"(.*?)\s*(?:[\[(]\s*([^\])]*?)\s*[\])]|\s+(?:in|en)\s+(\S+)|,\s*(\S+))\s*:?\s*")
"""Tiefe [mm], depth (mm), Tiefe in mm, depth, mm."""
LONGEST_SHOWN = 60
LONGEST_OWN = 200
KEYS = "a note knows the keys of a trial ('sealtwin init DIR' shows them), and data, date and operator."


@dataclass(frozen=True)
class Entry:
    """One thing that a note says."""

    value: Any
    origin: str
    """The file, and the row where it has rows: where whoever mends it must look."""


@dataclass
class Note:
    """What notes say, by dotted key; and what is wrong with them, a sentence each."""

    entries: dict[str, Entry] = field(default_factory=dict)
    faults: list[str] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)
    """What it says besides, of which no setting speaks: the weather, the name of a project."""
    meant: set[str] = field(default_factory=set)
    """Keys that the faults are about, as far as can be told: they are not missing, but wrong."""

    def over(self, defaults: "Note") -> "Note":
        """This one, and what it does not say as the folder's ``defaults`` say it."""
        taken = dict(defaults.entries)
        for ways in ALTERNATIVES:
            own = [way for way in ways if way & set(self.entries)]
            for way in ways:
                if own and way not in own:
                    taken = {key: entry for key, entry in taken.items() if key not in way}
        return Note(taken | self.entries, self.faults, [*defaults.remarks, *self.remarks], self.meant)

    def without_readings(self) -> "Note":
        """For a sample that has none: what the folder says of readings is then of others."""
        kept = {key: entry for key, entry in self.entries.items() if not key.startswith(OF_READINGS)}
        return Note(kept, self.faults, self.remarks, self.meant)


def read_note(path: Path) -> Note:
    """All that ``path`` says, and all that is wrong with it; it raises nothing for a file that cannot be read."""
    try:
        return _toml(path) if path.suffix.lower() == NOTE_SUFFIX else _words(path)
    except InputError as fault:
        return Note({}, str(fault).splitlines(), meant=set(known_keys()))


def _toml(path: Path) -> Note:
    note = Note()
    where = as_text(path)
    for name, value in read_toml(path, name="note", starter=STARTER).items():
        if isinstance(value, dict) and name in tables():
            for key, inner in value.items():
                _take(note, f"{name}.{key}", inner, where)
        else:
            _take(note, name, value, where)
    return note


def _take(note: Note, key: str, value: Any, where: str) -> None:
    """A trial's own key, or one of a note's."""
    if key in tables():
        note.faults.append(f"{where}: {key} is a table of settings; write [{key}], and its keys below.")
    elif key not in known_keys():
        _unknown(note, likely_key(key), f"{where}: {shown(key)}", ": no such key", value, is_setting=_is_setting(key))
    elif key in note.entries:
        note.faults.append(f"{where}: {key} stands there twice, also in {note.entries[key].origin}; keep one.")
    else:
        try:
            note.entries[key] = Entry(_own(key, value), where)
        except ValueError as fault:
            note.meant.add(key)
            note.faults.append(f"{where}: {key} = {shown(value)} {fault}")


def _own(key: str, value: Any) -> Any:
    """The trial checks its own settings. Raises ValueError where one of a note's cannot be."""
    if key == DATE:
        return read_date(value)
    if key == NAME and not (isinstance(value, str) and value.strip() and plain(value) == value):
        raise ValueError("must be a name: one line of letters that can all be seen.")
    if key in OWN and not (isinstance(value, str) and 0 < len(value) <= LONGEST_OWN):
        raise ValueError(f"must be one to {LONGEST_OWN} letters, in quotes.")
    return value


def _unknown(note: Note, likely: str | None, place: str, what: str, value: Any, *, is_setting: bool = False) -> None:
    """A slip of the pen is a fault, since its value would be lost; anything else that a lab writes down is remarked."""
    if likely is not None:
        note.meant.add(likely)
        note.faults.append(f"{place}{what}; did you mean {likely!r}?")
    elif is_setting:
        note.faults.append(f"{place}{what}; {KEYS}")
    else:
        note.remarks.append(f"{place} = {shown(value)}: written down, and no setting.")


def _is_setting(key: str) -> bool:
    """Whether it can be meant for nothing else."""
    return key == MESH or key.partition(".")[0] in tables()


def _words(path: Path) -> Note:
    """A sheet of two columns, word and value; a third may hold the unit."""
    from validate.settings import Declared
    from validate.sheets.cells import read_cells
    from validate.sheets.decimals import MISSING

    grid = read_cells(path, Declared())
    note = Note()
    for place, row in enumerate(grid.rows):
        word, value, unit, *more = (row.cell(column).text for column in range(max(4, len(row.cells))))
        where = str(grid.place(row.number))
        if place == 0 and normal(word) in HEADS:
            continue
        if any(more) or (unit and not _is_unit(unit)):
            held = next(text for text in (*more, unit) if text)
            note.faults.append(
                f"{where}: {shown(held)} beside word and value; a third column holds units, and no more are read."
            )
        elif not word:
            note.faults.append(f"{where}: {shown(value)} without a word before it; write what it is.")
        elif value.casefold() not in NOT_STATED | MISSING:
            if row.cell(1).kind in {"formula", "error"}:
                note.faults.append(f"{where}: {shown(word)} holds a formula without a result; write the value itself.")
            else:
                _take_word(note, word, row.cell(1), unit, where)
    return note


def _take_word(note: Note, word: str, cell: "Cell", unit: str, where: str) -> None:
    written, value, exact = word.rstrip(": "), cell.text, cell.kind == "number"
    if written in known_keys():
        try:
            _take(note, written, read_setting(value, exact=exact), where)
        except ValueError as fault:
            note.meant.add(written)
            note.faults.append(f"{where}: {written} = {shown(value)} {fault}")
        return
    found = UNIT_OF_WORD.fullmatch(word)
    name, in_word = (found[1], next((part for part in found.groups()[1:] if part), "")) if found else (written, "")
    meaning = BY_WORD.get(normal(written)) or BY_WORD.get(normal(name))
    if meaning is None:
        word_meant = likely_word(name)
        if word_meant is not None:
            note.meant.add(BY_WORD[normal(word_meant)].key)
        likely = word_meant or likely_key(name)
        _unknown(note, likely, f"{where}: {shown(written)}", ": no word that is known", value)
        return
    try:
        _take(note, meaning.key, read_value(meaning, value, in_word or unit, exact=exact), where)
    except ValueError as fault:
        note.meant.add(meaning.key)
        note.faults.append(f"{where}, column 2: {shown(written)} = {shown(value)} {fault}")


def _is_unit(text: str) -> bool:
    return any(text.casefold().replace(" ", "") in units for units in UNITS.values())


def shown(value: object) -> str:
    text = repr(value)
    return text if len(text) <= LONGEST_SHOWN else f"{text[:LONGEST_SHOWN]}..."
