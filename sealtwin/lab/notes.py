"""Notes: settings that no photo shows, as keys of a trial, and the other numbers of a lab's texts."""

import re
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from datetime import date
from functools import cache
from pathlib import Path
from typing import Any

from sealtwin.core.errors import InputError, as_text, naming
from sealtwin.core.plain_files import opened
from sealtwin.core.settings import dotted_names, read_toml
from sealtwin.lab.found_files import NAMED_FILES, NOTE_SUFFIX, TABLE_SUFFIXES, few, plain
from sealtwin.trial.trial_file import Trial
from validate.readings.header_words import sample_key
from validate.readings.samples import read_cells, sheets_of
from validate.readings.sheet import clipped
from validate.readings.text_table import decoded
from validate.settings import OF_THE_SHEET, SIGNS, Columns, Declared

NAME = "name"
DATA, DATE, OPERATOR = "data", "date", "operator"
OWN = frozenset({DATA, DATE, OPERATOR})
"""Keys that only notes have: data is the origin of photo and readings; date and operator go into the catalogue."""
OF_READINGS = ("readings.", "gate.")  # Prefixes of keys that only samples with readings need
COLUMNS = "readings.columns"  # Table inside another table
MESH = "mesh"  # Samples of a lab are photos; 'sealtwin import-mesh' reads a mesh
SCALE, DEPTH = "photo.mm_per_px", "crack.depth_mm"
ALTERNATIVES = (
    (
        {SCALE, "photo.scale_is"},
        {"photo.ruler_px", "photo.ruler_mm"},
        {"photo.markers", "photo.face_mm", "photo.face_corners_px"},
    ),
    ({"fluid.U", "fluid.D_cm"}, {"fluid.viscosity_pa_s"}),
)
"""Sets of settings that replace each other. If a sample gives a setting of one set, the folder's defaults for the other
sets are dropped."""
OF_ONE = (NAME, DATE, *NAMED_FILES.values(), "readings.as_written")
"""Keys that cannot apply to all samples of a folder."""
STARTER = 'Write a note with what no photo shows: data = "measured", and depth_mm = 16.0 in [crack]'
KEYS = "a note may have the keys of a trial ('sealtwin init DIR' shows them), and data, date and operator."
NUMBER = re.compile(r"[\d¼-¾⅐-⅞]")
ASSIGNED = re.compile(r"\s*([A-Za-z_]\w*(?:\.[A-Za-z_]\w*){0,3})\s*=[^#]*(#\D*)?")
"""Line ``key = value``, perhaps with a comment, which has no number."""
SENTENCE_END = re.compile(r"(?<=[^\W\d][.!?])\s+(?=[A-ZÀ-Þ])")
LEAST_LINES = 3  # Lines of numbers from which a text may be readings
LINE_OF_NUMBERS = re.compile(r"(?!.*[^\W\d_]{3})(?:.*?(?<![\w.,])[-+\u2212]?\d+(?:[.,]\d+)?(?![.,]?\d)){2}")
"""Line with two numbers or more, and no word of three letters."""
MOST_QUOTED = 8  # Sentences in one question
LARGEST_READ_BYTES = 200_000
LONGEST_OWN = 200
GERMAN_DATE = re.compile(r"(\d{1,2})\.(\d{1,2})\.(\d{4})")


@dataclass(frozen=True)
class NoteEntry:
    value: Any
    origin: str  # The file


@dataclass
class Note:
    """Settings in notes by dotted key, and the faults of the notes."""

    entries: dict[str, NoteEntry] = field(default_factory=dict)
    faults: list[str] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)
    """Texts that are not settings, such as the weather or the name of a project."""
    meant: set[str] = field(default_factory=set)
    """Keys that faults are about, if the key is clear. They are wrong, so they are not also reported as missing."""

    def without(self, *prefixes: str) -> "Note":
        """Return this note without settings whose keys begin with one of ``prefixes``."""
        return replace(self, entries={key: one for key, one in self.entries.items() if not key.startswith(prefixes)})

    def over(self, defaults: "Note") -> "Note":
        """Return this note, with the folder's ``defaults`` for settings that it does not give."""
        dropped = set[str]()
        for ways in ALTERNATIVES:
            others = [way for way in ways if not way & self.entries.keys()]
            if len(others) < len(ways):
                dropped = dropped.union(*others)
        taken = {key: entry for key, entry in defaults.entries.items() if key not in dropped}
        faults, remarks = [*defaults.faults, *self.faults], [*defaults.remarks, *self.remarks]
        return Note(taken | self.entries, faults, remarks, meant=defaults.meant | self.meant)

    def read(self, path: Path, sample: str = "") -> str:
        """Add the settings of a TOML file, or of the lines ``key = value`` of a text or sheet, and their faults.

        Return quotations of what has a number and sets nothing, except for the name of the ``sample``; "" if there is
        none.
        """
        where, unread = as_text(path), list[str]()
        try:
            if path.suffix.lower() == NOTE_SUFFIX:
                unread = self.take_tables(read_toml(path, name="note", starter=STARTER), where)
            else:
                for line in _lines(path):
                    unread += self._take_line(line, where, sample)
        except InputError as fault:
            self.faults += str(fault).splitlines()
            self.meant |= known_keys()
        return few([f"'{plain(clipped(' '.join(text.split())))}'" for text in unread], MOST_QUOTED)

    def take_tables(self, content: Mapping[str, Any], where: str) -> list[str]:
        """Add the settings of TOML tables. Return unknown keys whose values have a number."""
        unread = list[str]()
        for name, table in content.items():
            inside = isinstance(table, dict) and name in tables()
            named = {f"{name}.{key}": one for key, one in table.items()} if inside else {name: table}
            for key, inner in named.items():
                settings = of_columns(inner) if key == COLUMNS and isinstance(inner, dict) else {key: inner}
                unread += [f"{k} = {value!r}" for k, value in settings.items() if not self._is_taken(k, value, where)]
        return unread

    def _take_line(self, line: str, where: str, sample: str) -> list[str]:
        """Take a line ``key = value``, or return the sentences of another line that have a number."""
        key = ASSIGNED.match(line)
        try:
            if key is not None and key.end() == len(line):
                return self.take_tables(tomllib.loads(line), where)
        except (ValueError, RecursionError):
            pass  # Quoted below
        if key is not None and (key[1] in known_keys() or "." in key[1]):
            return [line]
        return [one.strip() for one in SENTENCE_END.split(line) if _has_number(one, sample)]

    def _is_taken(self, key: str, value: Any, where: str) -> bool:
        """Take a key of a trial, or a key that only notes have; return False for an unknown key with a number."""
        if key in tables():
            self.faults.append(
                f"{where}: {key} is a table of settings, not a setting; write [{key}], and its keys on the next lines."
            )
        elif key == MESH or (key not in known_keys() and key.partition(".")[0] in tables()):
            # A key in a table of a trial cannot be a remark; a mesh is not possible in a lab.
            self.faults.append(f"{where}: {shown(key)}: no such key; {KEYS}")
        elif key not in known_keys():
            if NUMBER.search(repr(value)):
                return False
            self.remarks.append(f"{where}: {shown(key)} = {shown(value)} is kept as a remark; it sets nothing.")
        elif key in self.entries:
            self.faults.append(f"{where}: {key} is also given in {self.entries[key].origin}; keep one of the two.")
        else:
            try:
                self.entries[key] = NoteEntry(_own(key, value), where)
            except ValueError as fault:
                self.meant.add(key)
                self.faults.append(f"{where}: {key} = {shown(value)} {fault}")
        return True


def _lines(path: Path) -> Iterator[str]:
    """Yield the lines of a text, or the rows of all sheets of a table. Raises InputError if it cannot be read."""
    if path.suffix.lower() not in TABLE_SUFFIXES:
        yield from _text_of(path).splitlines()
        if path.stat().st_size > LARGEST_READ_BYTES:
            yield f"all behind its first {LARGEST_READ_BYTES} bytes"
        return
    for grid in sheets_of(path) or (read_cells(path, Declared()),):
        for row in grid.rows:
            cells = (cell.text or "0 (formula without a result)" * (cell.kind == "formula") for cell in row.cells)
            yield "; ".join(filter(None, cells))


def _text_of(path: Path) -> str:
    """Return the beginning of a text in any encoding. Raises InputError if the file is not text."""
    with naming(path), opened(path) as file:
        content = file.read(LARGEST_READ_BYTES)
    return decoded(path, content)[0]


def _has_number(text: str, sample: str) -> bool:
    """Return whether a text has a number, except for the digits in the name of its sample."""
    name = sample_key(sample)
    has_letters = any(map(str.isalpha, name))
    return any(NUMBER.search(word) and not (has_letters and sample_key(word) == name) for word in text.split())


def lines_of_readings(path: Path) -> int:
    """Return the number of lines of a text that may be readings; 0 if it has too few of them."""
    try:
        lines = sum(LINE_OF_NUMBERS.match(line) is not None for line in _text_of(path).splitlines())
    except (InputError, OSError):
        return 0
    return lines if lines >= LEAST_LINES else 0


def read_defaults(path: Path) -> Note:
    """Read lab.toml, if there is one. Raises InputError with all its faults, since each would affect every sample."""
    note = Note()
    if path.is_symlink() or not path.is_file():
        return note
    unread = note.read(path)
    faults = [
        f"{path}: {key} applies to one sample only; move it into that sample's note."
        for key in OF_ONE
        if key in note.entries
    ]
    faults += [f"{path}: {unread}: no such key; {KEYS}"] if unread else []
    if faults := [*note.faults, *faults]:
        raise InputError("\n".join(faults))
    return note


def read_cell(text: str, where: str) -> Note:
    """Read the settings in a cell of the pairing file. They are keys of a trial in TOML, separated by semicolons."""
    note = Note()
    try:
        unread = note.take_tables(tomllib.loads(text.replace(";", "\n")), where)
        note.faults += [f"{where}: {clipped(one)}: no such key; {KEYS}" for one in unread]
    except (ValueError, RecursionError) as fault:
        example = "crack.depth_mm = 16.0; photo.ends_px = [[12, 340], [905, 377]]"
        note.faults.append(
            f"{where}: settings = {shown(text)} is not valid TOML ({fault}); write for example {example}."
        )
    return note


@cache
def known_keys() -> frozenset[str]:
    """Return the dotted names of all settings that a note may give."""
    named = [key for key in dotted_names(Trial) if not key.startswith(f"{MESH}.")]
    return OWN.union(named, (f"{COLUMNS}.{key}" for key in Columns.model_fields))


@cache
def tables() -> frozenset[str]:
    return frozenset(key.partition(".")[0] for key in known_keys() if "." in key)


def of_columns(table: Mapping[str, Any]) -> dict[str, Any]:
    """Return the settings in a table of columns by dotted key. Those of a whole sheet become settings of [readings]."""
    of_readings = (*OF_THE_SHEET, "as_written")
    settings = {f"readings.{key}": table[key] for key in of_readings if key in table}
    if "sign" in table:
        settings["readings.quantity"] = SIGNS.get(str(table["sign"]), table["sign"])
    rest = {f"{COLUMNS}.{key}": value for key, value in table.items() if key not in (*of_readings, "sign")}
    return settings | rest


def _own(key: str, value: Any) -> Any:
    """Return the value of a key. Raises ValueError if a key that only notes have has an invalid value."""
    if key == DATE:
        return _read_date(value)
    if key == NAME and not (isinstance(value, str) and value.strip() and plain(value) == value):
        raise ValueError("is not a name; write one line of visible letters.")
    if key in OWN and not (isinstance(value, str) and 0 < len(value) <= LONGEST_OWN):
        raise ValueError(f"is not a text of 1 to {LONGEST_OWN} letters; write one in quotes.")
    return value


def _read_date(value: object) -> str:
    """Return a date in ISO 8601. ``value`` has this form or one such as 31.12.2026; otherwise raises ValueError."""
    text = value.isoformat() if isinstance(value, date) else str(value).strip()
    if german := GERMAN_DATE.fullmatch(text):
        day, month, year = german.groups()
        text = f"{year}-{month:0>2}-{day:0>2}"
    try:
        return date.fromisoformat(text[:10] if re.match(r"\d{4}-\d\d-\d\d[T ]", text) else text).isoformat()
    except ValueError:
        raise ValueError("is not an unambiguous date; write 2026-12-31 or 31.12.2026.") from None


def shown(value: object) -> str:
    return clipped(repr(value))
