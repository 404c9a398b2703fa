"""A note: what somebody wrote down about a sample, or about all of a folder, since no photo shows it."""

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

SEEMS = "it seems to say "
MOST_QUOTED = 30  # Numbers in one question
NOT_READ = "Or give the file the role text: it is kept then, and not read."
STARTER = 'a note says what no photo shows: data = "measured", and in [crack] depth_mm = 16.0'
UNIT_OF_WORD = re.compile(r"(.*?)\s*(?:[\[(]\s*([^\])]*?)\s*[\])]|\s+(?:in|en)\s+(\S+)|,\s*(\S+))\s*:?\s*")
"""Tiefe [mm], depth (mm), Tiefe in mm, depth, mm."""
LONGEST_OWN = 200
WORDS = "words"  # Table of lab.toml with the lab's own words and their settings
OF_ONE = (note_words.NAME, note_words.DATE, *NAMED_FILES.values(), "readings.as_written")
"""Keys that cannot hold for all samples of a folder."""
OF_ALL = SampleFiles("", {}, ())  # No sample, of a note that is of all of a folder
KEYS = "a note knows the keys of a trial ('sealtwin init DIR' shows them), and data, date and operator."


@dataclass(frozen=True)
class NoteEntry:
    value: Any
    origin: str  # The file, and the row if it has rows


@dataclass
class Note:
    """Settings in notes by dotted key, and the faults of the notes, a sentence each."""

    entries: dict[str, NoteEntry] = field(default_factory=dict)
    faults: list[str] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)
    """Text that belongs to no setting: the weather, the name of a project."""
    words: dict[str, str] = field(default_factory=dict)
    """Settings, or "ignore", by the lab's own words for them."""
    meant: set[str] = field(default_factory=set)
    """Keys that the faults are about, as far as can be known: they are not missing, but wrong."""
    doubts: list[tuple[str, str, str]] = field(default_factory=list)
    """Keys that an unknown word may mean, with the fault if nothing else says that key, and the remark if it does."""

    def decided(self) -> "Note":
        """Return this note with each doubt as a fault or a remark."""
        for key, fault, remark in self.doubts:
            if key in self.entries:
                self.remarks.append(remark)
            else:
                self.meant.add(key)
                self.faults.append(fault)
        self.doubts = []
        return self

    def without(self, *prefixes: str) -> "Note":
        """Return this note without settings whose keys begin so."""
        return replace(self, entries={key: one for key, one in self.entries.items() if not key.startswith(prefixes)})

    def over(self, defaults: "Note") -> "Note":
        """Return this note, with the folder's ``defaults`` for all that it does not say."""
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
    """Return the settings of a note of a sample and its faults, also if it cannot be read.

    ``own`` are the settings that the lab's own words mean; ``answers`` are settings by dotted key that the pairing file
    has beside the sample's files.
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
    """Read a free text that the user calls a note: each number of it is a setting, or a fault or a remark."""
    text, where = text_of(path), as_text(path)
    if len(text) > LONGEST_TEXT:
        return Note(faults=[f"{where}: {len(text):,} letters; a note has at most {LONGEST_TEXT:,}. {NOT_READ}"])
    if others := names_of_samples(text, sample.others):
        return Note(faults=[f"{where}: names {', '.join(others)} too. Give each sample a note of its own. {NOT_READ}"])
    sentences = read_sentences(text, sample.name)
    note = Note({key: NoteEntry(value, where) for key, (value, _) in sentences.settings.items()})
    note.remarks += [_read_as(where, key, value, words) for key, (value, words) in sentences.settings.items()]
    if sentences.bare:
        few = ", ".join(sentences.bare[:MOST_QUOTED])
        note.remarks.append(f"{where}: not read, since they have no unit: {few}.")
    skipped = set(map(squeezed, sample.answers.get("note", {}).get("skip", "").split(";")))
    unread = [one for one in sentences.unread if squeezed(one) not in skipped and not _is_answered(one, answers)]
    if unread:
        note.faults.append(
            f"{where}: {_quoted(unread)}: no setting was read from {'this' if len(unread) == 1 else 'these'}. In the "
            f"pairing file, beside this note, write what is a setting into settings (crack.depth_mm = 9), and all else "
            f"into skip ({unread[0]}). {NOT_READ}"
        )
    return note


def _quoted(unread: Sequence[str]) -> str:
    more = f" and {len(unread) - MOST_QUOTED} more" * (len(unread) > MOST_QUOTED)
    return "; ".join(unread[:MOST_QUOTED]) + more


def seems_to_say(path: Path, sample: str = "") -> str:
    """Return in words the settings of a text as a note, and the numbers that would be asked about; or ""."""
    try:
        sentences = read_sentences(text_of(path)[:LONGEST_TEXT], sample)
    except (InputError, OSError):
        return ""
    settings = ", ".join(f"{key} = {value} ({words})" for key, (value, words) in sentences.settings.items())
    parts = [f"{SEEMS}{settings}"] if settings else []
    if sentences.unread:
        leaves = "leaves" if settings else "gives no setting, and leaves"
        parts.append(f"as a note it {leaves} open {_quoted(sentences.unread)}")
    return "; ".join(parts)


def text_and_samples(path: Path, samples: Sequence[str]) -> tuple[str, list[str]]:
    """Return what a text seems to say, and the samples that it names."""
    try:
        return seems_to_say(path), names_of_samples(text_of(path)[:LONGEST_TEXT], samples)
    except (InputError, OSError):
        return "", []


def _is_answered(quoted: str, settings: Mapping[str, Any]) -> bool:
    """Return whether a number of a note is a value of one of ``settings``, in the unit of either."""
    for key, value in settings.items():
        numbers = re.findall(r"-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?", json.dumps(value, default=str))
        with suppress(ValueError):
            if WordMeaning(key).unit and read_value(WordMeaning(key), quoted, "") in map(float, numbers):
                return True
    return False


def read_defaults(path: Path) -> Note:
    """Read lab.toml, if there is one. Raises InputError with all its faults, since one would fail every sample."""
    if path.is_symlink() or not path.is_file():
        return Note()
    note = read_note(path)
    faults = [f"{path}: {key} is of one sample; put it into its note." for key in OF_ONE if key in note.entries]
    faults += [
        f"{path}: [{WORDS}] {word!r} = {shown(key)} is no setting of a trial, nor {IGNORED!r}."
        for word, key in note.words.items()
        if key not in known_keys() and key != IGNORED
    ]
    if faults := [*note.faults, *faults]:
        raise InputError("\n".join(faults))
    return note


def read_cell(text: str, where: str) -> Note:
    """Read settings in a cell: a trial's own keys as TOML, a semicolon between two."""
    reader = _NoteReader({})
    try:
        reader.read_tables(tomllib.loads(text.replace(";", "\n")), where)
    except tomllib.TOMLDecodeError as fault:
        example = "crack.depth_mm = 16.0; photo.ends_px = [[12, 340], [905, 377]]"
        return Note(faults=[f"{where}: settings = {shown(text)}: not as TOML writes them ({fault}); write {example}."])
    return reader.note


class _NoteReader:
    """Reads tables of TOML, or a sheet of words and values, into a note; ``own`` are keys by the lab's own words."""

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
        """Read a sheet of two columns, word and value; a third may hold the unit."""
        grid = read_cells(path, Declared())
        for place, row in enumerate(grid.rows):
            word, value, unit, *more = (row.cell(column).text for column in range(max(4, len(row.cells))))
            where = str(grid.place(row.number))
            if place == 0 and normal(word) in note_words.HEADS:
                continue
            if any(more) or (unit and not note_words.is_unit(unit)):
                beside = next(text for text in (*more, unit) if text)
                self.note.faults.append(
                    f"{where}: {shown(beside)} beside word and value; a third column holds units, and no more are read."
                )
            elif not word:
                self.note.faults.append(f"{where}: {shown(value)} without a word before it; write what it is.")
            elif row.cell(1).kind in {"formula", "error"}:
                self.note.faults.append(
                    f"{where}: {shown(word)} holds a formula without a result; write the value itself."
                )
            elif value.casefold() not in note_words.NOT_STATED and not is_missing(value):
                self._take_word(word, row.cell(1), unit, where, grid.shown_units.get((row.number, 1), ""))

    def _take(self, key: str, value: Any, where: str) -> None:
        """Take a trial's own key, or one of a note's."""
        note = self.note
        if key in tables():
            note.faults.append(f"{where}: {key} is a table of settings; write [{key}], and its keys below.")
        elif key == note_words.MESH or (key not in known_keys() and key.partition(".")[0] in tables()):
            # A mesh, or a key of a trial's table, can only be a setting.
            note.faults.append(f"{where}: {shown(key)}: no such key; {KEYS}")
        elif key not in known_keys():
            self._take_unknown(key, value, "", where)
        elif key in note.entries:
            note.faults.append(f"{where}: {key} stands there twice, also in {note.entries[key].origin}; keep one.")
        else:
            try:
                note.entries[key] = NoteEntry(_own(key, value), where)
            except ValueError as fault:
                note.meant.add(key)
                note.faults.append(f"{where}: {key} = {shown(value)} {fault}")

    def _take_word(self, word: str, cell: SheetCell, unit: str, where: str, behind: str) -> None:
        """Take a word and its value; ``behind`` is the unit that the format of a workbook's number shows behind it."""
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
                raise ValueError(
                    f"has the format of percentages, {float(value) * 100:.12g} %; write a number without it."
                )
            behind = behind if exact and note_words.is_unit(behind) else ""
            setting = note_words.read_value(meaning, value, in_word, exact=exact, behind=behind)
            self._take(meaning.key, setting, where)
            if meaning.unit and note_words.has_words_beside(value):
                self.note.remarks.append(_read_as(where, meaning.key, setting, value))
        except ValueError as fault:
            self.note.meant.add(meaning.key)
            self.note.faults.append(f"{where}, column 2: {shown(written)} = {shown(value)} {fault}")

    def _take_unknown(self, word: str, value: object, unit: str, where: str) -> None:
        """Remark what is no setting; ask about what may be one, since the folder's would be taken in its place."""
        key = likely = None
        if self.own.get(normal(word)) != IGNORED:
            key, likely = key_of_unit(str(value), unit), key_like(word, str(value), unit)
        remark = f"{where}: {shown(word)} = {shown(value)}: written down, and no setting."
        fault = (
            f"{where}: {shown(word)} = {shown(value)} may be {key or likely}, and the word is not known. Say what it "
            f'is in lab.toml: [{WORDS}] "{word}" = "{key or likely}" (or another key, or "{IGNORED}").'
        )
        if key is not None:
            self.note.meant.add(key)
            self.note.faults.append(fault)
        elif likely is not None:
            self.note.doubts.append((likely, fault, remark))
        else:
            self.note.remarks.append(remark)


def _own(key: str, value: Any) -> Any:
    """Return a value that can be; the trial checks its own settings. Raises ValueError for one of a note's."""
    if key == note_words.DATE:
        return note_words.read_date(value)
    if key == note_words.NAME and not (isinstance(value, str) and value.strip() and plain(value) == value):
        raise ValueError("must be a name: one line of letters that can all be seen.")
    if key in note_words.OWN and not (isinstance(value, str) and 0 < len(value) <= LONGEST_OWN):
        raise ValueError(f"must be one to {LONGEST_OWN} letters, in quotes.")
    return value


def _read_as(where: str, key: str, value: object, words: str) -> str:
    return f"{where}: read as {key} = {shown(value)} ({words})."


def shown(value: object) -> str:
    return clipped(repr(value))
