"""Notes: settings that no photo shows, written down for a sample or for a whole folder."""

import json
import re
import tomllib
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from sealtwin.core.errors import InputError, as_text
from sealtwin.core.settings import read_toml
from sealtwin.lab import note_words
from sealtwin.lab.found_files import FREE_TEXT, NAMED_FILES, NOTE_SUFFIX, plain
from sealtwin.lab.note_sentences import LONGEST_TEXT, names_of_samples, read_sentences, squeezed
from sealtwin.lab.note_words import (
    IGNORED,
    WordMeaning,
    key_like,
    key_of_unit,
    known_keys,
    meaning_of,
    normal,
    read_value,
    tables,
)
from sealtwin.lab.pairing import SampleFiles
from sealtwin.lab.sheets import kind_of_text, text_of
from validate.readings.samples import read_cells
from validate.readings.sheet import SheetCell, clipped
from validate.readings.text_table import is_missing
from validate.settings import Declared

SEEMS = "it seems to give "
LEAST_LINES = 3  # Lines of numbers from which a text may be readings
LINE_OF_NUMBERS = re.compile(r"(?!.*[^\W\d_]{3})(?:.*?(?<![\w.,])[-+\u2212]?\d+(?:[.,]\d+)?(?![.,]?\d)){2}")
"""Line with two numbers or more, and no word of three letters."""
MOST_QUOTED = 30  # Numbers in one question
NOT_READ = "Or give the file the role text, and its content is not read."
STARTER = 'Write a note with what no photo shows: data = "measured", and depth_mm = 16.0 in [crack]'
UNIT_OF_WORD = re.compile(r"(.*?)\s*(?:[\[(]\s*([^\])]*?)\s*[\])]|\s+(?:in|en)\s+(\S+)|,\s*(\S+))\s*:?\s*")
"""A word with its unit: "Tiefe [mm]", "depth (mm)", "Tiefe in mm" or "depth, mm". """
LONGEST_OWN = 200
WORDS = "words"  # Table of lab.toml that maps the lab's own words to settings
OF_ONE = (note_words.NAME, note_words.DATE, *NAMED_FILES.values(), "readings.as_written")
"""Keys that cannot apply to all samples of a folder."""
OF_ALL = SampleFiles("", {}, ())  # Stands for the sample of a note about a whole folder
KEYS = "a note may have the keys of a trial ('sealtwin init DIR' shows them), and data, date and operator."


@dataclass(frozen=True)
class NoteEntry:
    value: Any
    origin: str  # The file, and the row if it has rows


@dataclass
class Note:
    """Settings in notes by dotted key, and the faults of the notes."""

    entries: dict[str, NoteEntry] = field(default_factory=dict)
    faults: list[str] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)
    """Texts that are not settings, such as the weather or the name of a project."""
    words: dict[str, str] = field(default_factory=dict)
    """Setting, or "ignore", for each of the lab's own words."""
    meant: set[str] = field(default_factory=set)
    """Keys that faults are about, if the key is clear. They are wrong, so they are not also reported as missing."""
    doubts: list[tuple[str, str, str]] = field(default_factory=list)
    """Words that may be settings: the key of each, the fault if nothing else sets the key, and the remark otherwise."""

    def decided(self) -> "Note":
        """Turn each doubt into a fault or a remark; return this note."""
        for key, fault, remark in self.doubts:
            if key in self.entries:
                self.remarks.append(remark)
            else:
                self.meant.add(key)
                self.faults.append(fault)
        self.doubts = []
        return self

    def without(self, *prefixes: str) -> "Note":
        """Return this note without settings whose keys begin with one of ``prefixes``."""
        return replace(self, entries={key: one for key, one in self.entries.items() if not key.startswith(prefixes)})

    def over(self, defaults: "Note") -> "Note":
        """Return this note, with the folder's ``defaults`` for settings that it does not give."""
        dropped = set[str]()
        for ways in note_words.ALTERNATIVES:
            others = [way for way in ways if not way & self.entries.keys()]
            if len(others) < len(ways):
                dropped = dropped.union(*others)
        taken = {key: entry for key, entry in defaults.entries.items() if key not in dropped}
        faults, remarks = [*defaults.faults, *self.faults], [*defaults.remarks, *self.remarks]
        return Note(taken | self.entries, faults, remarks, meant=defaults.meant | self.meant)


def read_note(
    path: Path,
    own: Mapping[str, str] | None = None,
    sample: SampleFiles = OF_ALL,
    answers: Mapping[str, Any] | None = None,
) -> Note:
    """Return the settings and faults of a sample's note. If the note cannot be read, only faults are returned.

    ``own`` maps the lab's own words to settings. ``answers`` has settings by dotted key from the pairing file.
    """
    reader = _NoteReader(own or {})
    try:
        if path.suffix.lower() == NOTE_SUFFIX:
            reader.read_tables(read_toml(path, name="note", starter=STARTER), as_text(path))
        elif path.suffix.lower() in FREE_TEXT and kind_of_text(path) == "text":
            return _of_sentences(path, sample, answers or {})
        else:
            reader.read_sheet(path)
        return reader.note.decided()
    except InputError as fault:
        return Note({}, str(fault).splitlines(), meant=set(known_keys()))


def _of_sentences(path: Path, sample: SampleFiles, answers: Mapping[str, Any]) -> Note:
    """Read a free text with the role note: each of its numbers becomes a setting, a fault or a remark."""
    text, where = text_of(path), as_text(path)
    if len(text) > LONGEST_TEXT:
        return Note(faults=[f"{where}: has {len(text):,} letters; shorten it to {LONGEST_TEXT:,}. {NOT_READ}"])
    if others := names_of_samples(text, sample.others):
        return Note(faults=[f"{where}: also names {', '.join(others)}. Write one note for each sample. {NOT_READ}"])
    sentences = read_sentences(text, sample.name)
    note = Note({key: NoteEntry(value, where) for key, (value, _) in sentences.settings.items()})
    note.remarks += [_read_as(where, key, value, words) for key, (value, words) in sentences.settings.items()]
    if sentences.bare:
        few = ", ".join(sentences.bare[:MOST_QUOTED])
        note.remarks.append(f"{where}: these numbers are not read because they have no unit: {few}.")
    skipped = set(map(squeezed, sample.answers.get("note", {}).get("skip", "").split(";")))
    unread = [one for one in sentences.unread if squeezed(one) not in skipped and not _is_answered(one, answers)]
    if unread:
        note.faults.append(
            f"{where}: no setting was read from {_quoted(unread)}. In this note's row of the pairing file, write the "
            f"settings into the column settings (crack.depth_mm = 9), and all else into the column skip ({unread[0]}). "
            f"{NOT_READ}"
        )
    return note


def _quoted(unread: Sequence[str]) -> str:
    more = f" and {len(unread) - MOST_QUOTED} more" * (len(unread) > MOST_QUOTED)
    return "; ".join(unread[:MOST_QUOTED]) + more


def seems_to_say(path: Path, sample: str = "") -> str:
    """Return a sentence on the settings that a text seems to give and on its other numbers; "" if it has neither."""
    try:
        sentences = read_sentences(text_of(path)[:LONGEST_TEXT], sample)
    except (InputError, OSError):
        return ""
    settings = ", ".join(f"{key} = {value} ({words})" for key, (value, words) in sentences.settings.items())
    parts = [f"{SEEMS}{settings}"] if settings else []
    if sentences.unread:
        parts.append(
            f"{'' if settings else 'it gives no setting; '}its numbers {_quoted(sentences.unread)} are not read"
        )
    return "; ".join(parts)


def lines_of_readings(path: Path) -> int:
    """Return the number of lines of a text that may be readings; 0 if it has too few of them."""
    try:
        lines = sum(LINE_OF_NUMBERS.match(line) is not None for line in text_of(path).splitlines())
    except (InputError, OSError):
        return 0
    return lines if lines >= LEAST_LINES else 0


def text_and_samples(path: Path, samples: Sequence[str]) -> tuple[str, list[str]]:
    """Return the sentence of ``seems_to_say`` for a text, and the samples that it names."""
    try:
        return seems_to_say(path), names_of_samples(text_of(path)[:LONGEST_TEXT], samples)
    except (InputError, OSError):
        return "", []


def _is_answered(quoted: str, settings: Mapping[str, Any]) -> bool:
    """Return True if the quoted number of a note, in the setting's unit, is a value of one of ``settings``."""
    for key, value in settings.items():
        numbers = re.findall(r"-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?", json.dumps(value, default=str))
        with suppress(ValueError):
            if WordMeaning(key).unit and read_value(WordMeaning(key), quoted, "") in map(float, numbers):
                return True
    return False


def read_defaults(path: Path) -> Note:
    """Read lab.toml, if there is one. Raises InputError with all its faults, since each would affect every sample."""
    if path.is_symlink() or not path.is_file():
        return Note()
    note = read_note(path)
    faults = [
        f"{path}: {key} applies to one sample only; move it into that sample's note."
        for key in OF_ONE
        if key in note.entries
    ]
    faults += [
        f"{path}: [{WORDS}] {word!r} = {shown(key)}: write a setting of a trial, or {IGNORED!r}."
        for word, key in note.words.items()
        if key not in known_keys() and key != IGNORED
    ]
    if faults := [*note.faults, *faults]:
        raise InputError("\n".join(faults))
    return note


def read_cell(text: str, where: str) -> Note:
    """Read the settings in a cell of the pairing file. They are keys of a trial in TOML, separated by semicolons."""
    reader = _NoteReader({})
    try:
        reader.read_tables(tomllib.loads(text.replace(";", "\n")), where)
    except tomllib.TOMLDecodeError as fault:
        example = "crack.depth_mm = 16.0; photo.ends_px = [[12, 340], [905, 377]]"
        return Note(
            faults=[f"{where}: settings = {shown(text)} is not valid TOML ({fault}); write for example {example}."]
        )
    return reader.note


class _NoteReader:
    """Reads TOML tables, or a sheet of words and values, into a note; ``own`` maps the lab's own words to keys."""

    def __init__(self, own: Mapping[str, str]) -> None:
        self.note, self.own = Note(), own

    def read_tables(self, content: Mapping[str, Any], where: str) -> None:
        for name, value in content.items():
            inside = isinstance(value, dict) and name in tables()
            for key, inner in (
                {f"{name}.{key}": one for key, one in value.items()}.items() if inside else [(name, value)]
            ):
                if key == WORDS and isinstance(inner, dict):
                    self.note.words = {normal(word): str(meant) for word, meant in inner.items()}
                elif key == note_words.COLUMNS and isinstance(inner, dict):
                    for column, value in note_words.of_columns(inner).items():
                        self._take(column, value, where)
                else:
                    self._take(key, inner, where)

    def read_sheet(self, path: Path) -> None:
        """Read a sheet with the columns word and value, and perhaps unit."""
        grid = read_cells(path, Declared())
        for place, row in enumerate(grid.rows):
            word, value, unit, *more = (row.cell(column).text for column in range(max(4, len(row.cells))))
            where = str(grid.place(row.number))
            if place == 0 and normal(word) in note_words.HEADS:
                continue
            if any(more) or (unit and not note_words.is_unit(unit)):
                extra = next(text for text in (*more, unit) if text)
                self.note.faults.append(
                    f"{where}: {shown(extra)} is not a word, value or unit, the only columns that are read; remove it."
                )
            elif not word:
                self.note.faults.append(
                    f"{where}: {shown(value)} has no word in the first column; write there what the value means."
                )
            elif row.cell(1).kind in {"formula", "error"}:
                self.note.faults.append(
                    f"{where}: the value of {shown(word)} is a formula without a result; write the value itself."
                )
            elif value.casefold() not in note_words.NOT_STATED and not is_missing(value):
                self._take_word(word, row.cell(1), unit, where, grid.shown_units.get((row.number, 1), ""))

    def _take(self, key: str, value: Any, where: str) -> None:
        """Take a key of a trial, or a key that only notes have."""
        note = self.note
        if key in tables():
            note.faults.append(
                f"{where}: {key} is a table of settings, not a setting; write [{key}], and its keys on the next lines."
            )
        elif key == note_words.MESH or (key not in known_keys() and key.partition(".")[0] in tables()):
            # A key in a table of a trial cannot be a remark; a mesh is not possible in a lab.
            note.faults.append(f"{where}: {shown(key)}: no such key; {KEYS}")
        elif key not in known_keys():
            self._take_unknown(key, value, "", where)
        elif key in note.entries:
            note.faults.append(f"{where}: {key} is also given in {note.entries[key].origin}; keep one of the two.")
        else:
            try:
                note.entries[key] = NoteEntry(_own(key, value), where)
            except ValueError as fault:
                note.meant.add(key)
                note.faults.append(f"{where}: {key} = {shown(value)} {fault}")

    def _take_word(self, word: str, cell: SheetCell, unit: str, where: str, behind: str) -> None:
        """Take a word and its value; ``behind`` is the unit that the workbook's format shows after the number."""
        written, value = word.rstrip(": "), cell.text
        parts = UNIT_OF_WORD.fullmatch(word)
        name, in_word = (parts[1], next(filter(None, parts.groups()[1:]), "")) if parts else (written, "")
        in_word = in_word or unit or (written if note_words.is_unit(written) else "")
        meaning = meaning_of(written, name, self.own)
        if meaning is None or meaning.key == IGNORED:
            self._take_unknown(written, value, in_word, where)
            return
        try:
            exact = cell.kind == "number"
            if exact and behind == "%":
                raise ValueError(f"is formatted as {float(value) * 100:.12g} %; write a plain number.")
            behind = behind if exact and note_words.is_unit(behind) else ""
            setting = note_words.read_value(meaning, value, in_word, exact=exact, behind=behind)
            self._take(meaning.key, setting, where)
            if meaning.unit and note_words.has_words_beside(value):
                self.note.remarks.append(_read_as(where, meaning.key, setting, value))
        except ValueError as fault:
            self.note.meant.add(meaning.key)
            self.note.faults.append(f"{where}, column 2: {shown(written)} = {shown(value)} {fault}")

    def _take_unknown(self, word: str, value: object, unit: str, where: str) -> None:
        """Add a remark, or a question if the word may be a setting: otherwise the folder's default would be used."""
        key = likely = None
        if self.own.get(normal(word)) != IGNORED:
            key, likely = key_of_unit(str(value), unit), key_like(word, str(value), unit)
        remark = f"{where}: {shown(word)} = {shown(value)} is kept as a remark; it sets nothing."
        fault = (
            f"{where}: {shown(word)} = {shown(value)} may be {key or likely}, but the word is unknown. Define it "
            f'in lab.toml: [{WORDS}] "{word}" = "{key or likely}" (or another key, or "{IGNORED}").'
        )
        if key is not None:
            self.note.meant.add(key)
            self.note.faults.append(fault)
        elif likely is not None:
            self.note.doubts.append((likely, fault, remark))
        else:
            self.note.remarks.append(remark)


def _own(key: str, value: Any) -> Any:
    """Return the value of a key. Raises ValueError if a key that only notes have has an invalid value."""
    if key == note_words.DATE:
        return note_words.read_date(value)
    if key == note_words.NAME and not (isinstance(value, str) and value.strip() and plain(value) == value):
        raise ValueError("is not a name; write one line of visible letters.")
    if key in note_words.OWN and not (isinstance(value, str) and 0 < len(value) <= LONGEST_OWN):
        raise ValueError(f"is not a text of 1 to {LONGEST_OWN} letters; write one in quotes.")
    return value


def _read_as(where: str, key: str, value: object, words: str) -> str:
    return f"{where}: read as {key} = {shown(value)} ({words})."


def shown(value: object) -> str:
    return clipped(repr(value))
