"""A note: what somebody wrote down about a sample, or about all of a folder, since no photo shows it."""

import json
import re
import tomllib
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from sealtwin.core.errors import InputError, as_text
from sealtwin.core.settings import read_toml
from sealtwin.lab import note_words
from sealtwin.lab.found_files import FREE_TEXT, NOTE_SUFFIX, plain
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
OF_ONE = ("name", "date", "photo.file", "photo.mask", "photo.second_photo", "readings.file", "readings.as_written")
"""Keys that cannot hold for all samples of a folder."""
KEYS = "a note knows the keys of a trial ('sealtwin init DIR' shows them), and data, date and operator."


@dataclass(frozen=True)
class NoteEntry:
    """One thing that a note says."""

    value: Any
    origin: str  # The file, and the row where it has rows: where whoever mends it must look


@dataclass
class Note:
    """Settings in notes by dotted key, and the faults of the notes, a sentence each."""

    entries: dict[str, NoteEntry] = field(default_factory=dict)
    faults: list[str] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)
    """Remaining text that belongs to no setting: the weather, the name of a project."""
    words: dict[str, str] = field(default_factory=dict)
    """Settings, or "ignore", by the lab's own words for them."""
    meant: set[str] = field(default_factory=set)
    """Keys that the faults are about, as far as can be told: they are not missing, but wrong."""

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

    def over(self, defaults: "Note") -> "Note":
        """Return this note, and what it does not say as the folder's ``defaults`` say it."""
        dropped = set[str]()
        for ways in note_words.ALTERNATIVES:
            others = [way for way in ways if not way & self.entries.keys()]
            if len(others) < len(ways):
                dropped = dropped.union(*others)
        taken = {key: entry for key, entry in defaults.entries.items() if key not in dropped}
        faults, remarks = [*defaults.faults, *self.faults], [*defaults.remarks, *self.remarks]
        return Note(taken | self.entries, faults, remarks, meant=defaults.meant | self.meant)


@dataclass(frozen=True)
class OfNote:
    """The sample that a note is of, and what the pairing file answers about the note's numbers."""

    sample: str = ""
    others: tuple[str, ...] = ()  # Names of the lab's other samples
    skip: tuple[str, ...] = ()  # Numbers of no setting, as the note writes them
    settings: Mapping[str, Any] = field(default_factory=dict)  # By dotted key


def read_note(path: Path, own: Mapping[str, str] | None = None, of: OfNote | None = None) -> Note:
    """Return all that ``path`` says, and all that is wrong with it, also where it cannot be read.

    ``own`` are the settings that the lab's own words mean.
    """
    try:
        if path.suffix.lower() == NOTE_SUFFIX:
            return _of_tables(read_toml(path, name="note", starter=STARTER), as_text(path), own or {}).decided()
        if path.suffix.lower() in FREE_TEXT and kind_of_text(path) == "text":
            return _of_sentences(path, of or OfNote())
        return _words(path, own or {}).decided()
    except InputError as fault:
        return Note({}, str(fault).splitlines(), meant=set(known_keys()))


def _of_sentences(path: Path, of: OfNote) -> Note:
    """Read a free text of which somebody has said that it is a note: no number of it is dropped in silence."""
    text, where = text_of(path), as_text(path)
    if len(text) > LONGEST_TEXT:
        return Note(faults=[f"{where}: {len(text):,} letters; a note has at most {LONGEST_TEXT:,}. {NOT_READ}"])
    if others := names_of_samples(text, of.others):
        return Note(faults=[f"{where}: names {', '.join(others)} too. Give each sample a note of its own. {NOT_READ}"])
    said = read_sentences(text, of.sample)
    note = Note({key: NoteEntry(value, where) for key, (value, _) in said.settings.items()})
    note.remarks += [_read_as(where, key, value, words) for key, (value, words) in said.settings.items()]
    if said.bare:
        few = ", ".join(said.bare[:MOST_QUOTED])
        note.remarks.append(f"{where}: not read, since they have no unit: {few}.")
    skipped = set(map(squeezed, of.skip))
    unread = [one for one in said.unread if squeezed(one) not in skipped and not _is_answered(one, of.settings)]
    if unread:
        more = f" and {len(unread) - MOST_QUOTED} more" * (len(unread) > MOST_QUOTED)
        quoted = "; ".join(unread[:MOST_QUOTED])
        note.faults.append(
            f"{where}: {quoted}{more}: no setting was read from {'this' if len(unread) == 1 else 'these'}. In the "
            f"pairing file, beside this note, write what is a setting into settings (crack.depth_mm = 9), and all else "
            f"into skip ({unread[0]}). {NOT_READ}"
        )
    return note


def seems_to_say(path: Path, sample: str = "") -> str:
    """Return in words what a text would say as a note, and which of its numbers would be asked about; or ""."""
    try:
        said = read_sentences(text_of(path)[:LONGEST_TEXT], sample)
    except (InputError, OSError):
        return ""
    settings = ", ".join(f"{key} = {value} ({words})" for key, (value, words) in said.settings.items())
    unread = "; ".join(said.unread[:MOST_QUOTED])
    more = f" and {len(said.unread) - MOST_QUOTED} more" * (len(said.unread) > MOST_QUOTED)
    told = [f"{SEEMS}{settings}"] if settings else []
    told += (
        [f"as a note it {'leaves' if settings else 'gives no setting, and leaves'} open {unread}{more}"]
        if unread
        else []
    )
    return "; ".join(told)


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
    try:
        return _of_tables(tomllib.loads(text.replace(";", "\n")), where, {})
    except tomllib.TOMLDecodeError as fault:
        example = "crack.depth_mm = 16.0; photo.ends_px = [[12, 340], [905, 377]]"
        return Note(faults=[f"{where}: settings = {shown(text)}: not as TOML writes them ({fault}); write {example}."])


def _of_tables(content: Mapping[str, Any], where: str, own: Mapping[str, str]) -> Note:
    note = Note()
    for name, value in content.items():
        is_table = isinstance(value, dict) and name in tables()
        for key, inner in ((f"{name}.{key}", inner) for key, inner in value.items()) if is_table else ((name, value),):
            if key == WORDS and isinstance(inner, dict):
                note.words = {normal(word): str(meant) for word, meant in inner.items()}
            elif key == note_words.COLUMNS and isinstance(inner, dict):
                for column, value in note_words.of_columns(inner).items():
                    _take(note, column, value, where, {})
            else:
                _take(note, key, inner, where, own)
    return note


def _take(note: Note, key: str, value: Any, where: str, own: Mapping[str, str]) -> None:
    """Take a trial's own key, or one of a note's."""
    if key in tables():
        note.faults.append(f"{where}: {key} is a table of settings; write [{key}], and its keys below.")
    elif key == note_words.MESH or (key not in known_keys() and key.partition(".")[0] in tables()):
        # A mesh, or a key of a trial's table, can only be a setting.
        note.faults.append(f"{where}: {shown(key)}: no such key; {KEYS}")
    elif key not in known_keys():
        _take_unknown(note, key, value, "", where, own)
    elif key in note.entries:
        note.faults.append(f"{where}: {key} stands there twice, also in {note.entries[key].origin}; keep one.")
    else:
        try:
            note.entries[key] = NoteEntry(_own(key, value), where)
        except ValueError as fault:
            note.meant.add(key)
            note.faults.append(f"{where}: {key} = {shown(value)} {fault}")


def _own(key: str, value: Any) -> Any:
    """Return a value that can be; the trial checks its own settings. Raises ValueError for one of a note's."""
    if key == note_words.DATE:
        return note_words.read_date(value)
    if key == note_words.NAME and not (isinstance(value, str) and value.strip() and plain(value) == value):
        raise ValueError("must be a name: one line of letters that can all be seen.")
    if key in note_words.OWN and not (isinstance(value, str) and 0 < len(value) <= LONGEST_OWN):
        raise ValueError(f"must be one to {LONGEST_OWN} letters, in quotes.")
    return value


def _words(path: Path, own: Mapping[str, str]) -> Note:
    """Read a sheet of two columns, word and value; a third may hold the unit."""
    grid = read_cells(path, Declared())
    note = Note()
    for place, row in enumerate(grid.rows):
        word, value, unit, *more = (row.cell(column).text for column in range(max(4, len(row.cells))))
        where = str(grid.place(row.number))
        if place == 0 and normal(word) in note_words.HEADS:
            continue
        if any(more) or (unit and not note_words.is_unit(unit)):
            held = next(text for text in (*more, unit) if text)
            note.faults.append(
                f"{where}: {shown(held)} beside word and value; a third column holds units, and no more are read."
            )
        elif not word:
            note.faults.append(f"{where}: {shown(value)} without a word before it; write what it is.")
        elif row.cell(1).kind in {"formula", "error"}:
            note.faults.append(f"{where}: {shown(word)} holds a formula without a result; write the value itself.")
        elif value.casefold() not in note_words.NOT_STATED and not is_missing(value):
            _take_word(note, word, row.cell(1), unit, where, own, grid.shown_units.get((row.number, 1), ""))
    return note


def _take_word(
    note: Note, word: str, cell: SheetCell, unit: str, where: str, own: Mapping[str, str], behind: str
) -> None:
    """Take a word and its value; ``behind`` is what the format of a workbook's number shows behind it."""
    written, value = word.rstrip(": "), cell.text
    found = UNIT_OF_WORD.fullmatch(word)
    name, in_word = (found[1], next((part for part in found.groups()[1:] if part), "")) if found else (written, "")
    in_word = in_word or unit or (written if note_words.is_unit(written) else "")
    meaning = meaning_of(written, name, own)
    if meaning is None or meaning.key == IGNORED:
        _take_unknown(note, written, value, in_word, where, own)
        return
    try:
        exact = cell.kind == "number"
        if exact and behind == "%":
            raise ValueError(f"has the format of percentages, {float(value) * 100:.12g} %; write a number without it.")
        behind = behind if exact and note_words.is_unit(behind) else ""
        read = note_words.read_value(meaning, value, in_word, exact=exact, behind=behind)
        _take(note, meaning.key, read, where, own)
        if meaning.unit and note_words.has_words_beside(value):
            note.remarks.append(_read_as(where, meaning.key, read, value))
    except ValueError as fault:
        note.meant.add(meaning.key)
        note.faults.append(f"{where}, column 2: {shown(written)} = {shown(value)} {fault}")


def _take_unknown(note: Note, word: str, value: object, unit: str, where: str, own: Mapping[str, str]) -> None:
    """Keep what is no setting; ask about what may be one, since the folder's would be taken in its place."""
    is_ignored = own.get(normal(word)) == IGNORED
    key = None if is_ignored else key_of_unit(str(value), unit)
    likely = None if is_ignored else key_like(word, str(value), unit)
    remark = f"{where}: {shown(word)} = {shown(value)}: written down, and no setting."
    if key is None and likely is None:
        note.remarks.append(remark)
        return
    fault = (
        f"{where}: {shown(word)} = {shown(value)} may be {key or likely}, and the word is not known. Say what it is in "
        f'lab.toml: [{WORDS}] "{word}" = "{key or likely}" (or another key, or "{IGNORED}").'
    )
    if key is None:
        note.doubts.append((str(likely), fault, remark))
        return
    note.meant.add(key)
    note.faults.append(fault)


def _read_as(where: str, key: str, value: object, words: str) -> str:
    return f"{where}: read as {key} = {shown(value)} ({words})."


def shown(value: object) -> str:
    return clipped(repr(value))
