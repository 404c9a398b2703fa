"""Notes: settings that no photo shows, as keys of a trial, in TOML or in lines of a text."""

import re
import tomllib
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path, PurePath
from typing import Any

from sealtwin.core.doubts import Doubt, Location
from sealtwin.core.errors import InputError, naming
from sealtwin.core.plain_files import opened
from sealtwin.core.settings import dotted_names, read_toml
from sealtwin.lab.files import DEFAULTS, NOTE_SUFFIX, PAIRING, SETTING, SETTINGS, plain
from sealtwin.trial.trial_file import Trial
from simulate.settings import VISCOSITIES_PA_S
from validate.readings.grid import quoted
from validate.readings.words import is_ambiguous, number, sample_key
from validate.settings import SIGNS

DATE, OPERATOR = "date", "operator"
OWN = ("name", DATE, OPERATOR)
"""Keys that do not go into the trial: its name is that of the photo, and the others go into the catalogue."""
ORIGINS = ("photo.data", "readings.data")
"""Settings that the key data of a note stands for: the origin of photo and readings."""
OF_READINGS = ("readings.", "gate.")  # Prefixes of keys that only samples with readings need
SCALE, DEPTH = "photo.mm_per_px", "crack.depth_mm"
ALTERNATIVES = (
    (
        {SCALE, "photo.scale_is"},
        {"photo.ruler_px", "photo.ruler_mm"},
        {"photo.markers", "photo.face_mm", "photo.face_corners_px"},
    ),
    ({"fluid.U", "fluid.D_cm"}, *({f"fluid.{key}"} for key in VISCOSITIES_PA_S)),
)
"""Sets of settings that replace each other. If a sample gives a setting of one set, the folder's defaults for the other
sets are dropped."""
OF_ONE = "readings.as_written"  # Key that cannot apply to all samples of a folder
STARTER = 'Write a note with what no photo shows: data = "measured", and depth_mm = 16.0 in [crack]'
KEYS = "no such key; write one of a trial ('sealtwin init DIR' shows them), or data, date or operator."
NOT_READ = (
    "is not read, since not each of its lines is key = value with a key of a trial. Write its settings into its row, "
    "such as settings = crack.depth_mm = 9.0; if it has readings, set its role to readings; if neither, to ignore."
)
NUMBER = re.compile(r"[\d¼-¾⅐-⅞]")
LARGEST_READ_BYTES = 200_000
LONGEST = 200
ISO_DATE = re.compile(r"\d{4}-\d\d-\d\d")
CELL = re.compile("[A-Za-z]{1,3}[0-9]*")  # Or a column; words about a whole sheet are longer


@dataclass
class Note:
    """Settings in notes by dotted key, the files that give them, and the faults of the notes."""

    values: dict[str, Any] = field(default_factory=dict)
    origins: dict[str, Location] = field(default_factory=dict)
    faults: list[Doubt] = field(default_factory=list)

    def over(self, defaults: "Note", without: tuple[str, ...] = ()) -> "Note":
        """Return this note, with ``defaults`` for settings that it does not give.

        Defaults whose keys begin with one of ``without`` are left out.
        """
        replaced = [ways for ways in ALTERNATIVES if any(way & self.values.keys() for way in ways)]
        dropped = {key for ways in replaced for way in ways if not way & self.values.keys() for key in way}
        values = {key: value for key, value in defaults.values.items() if not key.startswith(without)}
        values = {key: value for key, value in values.items() if key not in dropped} | self.values
        return Note(values, defaults.origins | self.origins, [*defaults.faults, *self.faults])

    def take_tables(self, content: Mapping[str, Any], where: Location) -> None:
        """Add the settings of TOML tables, and a fault for each key that no trial has."""
        for key, value in content.items():
            if isinstance(value, dict) and key not in known_keys():
                self.take_tables({f"{key}.{name}": inner for name, inner in value.items()}, where)
            else:
                self.take(key, value, where)

    def take(self, key: str, value: Any, where: Location) -> None:
        """Add a setting by its dotted key. One that another file gives is a fault."""
        if key in (DATE, OPERATOR):
            value = plain(f"{value}"[:LONGEST])
        for each in ORIGINS if key == "data" else (key,):
            origin, fault = self.origins.get(each, where), ""
            if each not in known_keys():
                fault = KEYS
            elif origin != where:
                fault = f"also given in {origin.named()}; keep one of the two."
            elif key == DATE and not ISO_DATE.match(value):
                fault = "is not a date; write 2026-12-31."
            if fault:
                self.faults.append(Doubt("note", where, f"{key} = {quoted(f'{value}')}: {fault}"))
            else:
                self.values[each], self.origins[each] = value, where


def read_note(folder: Path, file: PurePath, sample: str, note: Note, *, answered: bool = False) -> None:
    """Add to ``note`` the settings of a TOML file, or of a text if each of its lines is ``key = value`` of a known key.

    Another file is a fault if it may have settings, that is a known key, a number that is not in the key of its
    ``sample``, or letters that are not UTF-8, unless its row has been ``answered``.
    """
    path, where = folder / file, Location(file)
    try:
        if path.suffix.lower() == NOTE_SUFFIX:
            note.take_tables(read_toml(path, name="note", starter=STARTER), where)
            return
        with naming(path), opened(path) as opened_file:
            content = opened_file.read(LARGEST_READ_BYTES)
    except InputError as fault:
        note.faults.append(Doubt("note", where, f"{fault}"))
        return
    text = content.decode("utf-8-sig", errors="replace")
    is_cut = "\ufffd" in text or len(content) == LARGEST_READ_BYTES  # The mark stands for letters that are not UTF-8
    if not is_cut and "#" not in text:  # A comment may change the meaning of a setting
        with suppress(ValueError, RecursionError):
            settings, alone = tomllib.loads(text), Note()
            alone.take_tables(settings, where)
            if not alone.faults:
                note.take_tables(settings, where)
                return
    words = [word for word in text.split() if word in known_keys() or NUMBER.search(word)]
    if not answered and (is_cut or any(sample_key(word) != sample for word in words)):
        note.faults.append(Doubt("note", where, NOT_READ))


def read_defaults(folder: Path) -> Note:
    """Read lab.toml, if there is one. Raises InputError with all its faults, since each would affect every sample."""
    note, file = Note(), PurePath(DEFAULTS)
    if (folder / file).is_file() and not (folder / file).is_symlink():
        read_note(folder, file, "", note)
    if OF_ONE in note.values:
        finding = f"{OF_ONE} applies to one sample only; move it into that sample's note."
        note.faults.append(Doubt("note", Location(file), finding))
    if note.faults:
        raise InputError("\n".join(map(str, note.faults)))
    return note


def value_of(text: str) -> Any:
    """Return the value in a cell: a number, a value of TOML, or the text, such as 1,234, which may be two numbers."""
    if is_ambiguous(text):
        return text
    if (value := number(text)) is not None:
        return int(value) if value.is_integer() else value
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except (ValueError, KeyError, RecursionError):
        return text


READ_AS = {
    **dict.fromkeys(("s", "repeat", "levels", "range"), str.upper),
    **dict.fromkeys(("datum_level_mm", "crack", "places", "skip"), value_of),
    "sign": lambda text: SIGNS.get(text, text),
    "as_written": lambda text: text.upper() if CELL.fullmatch(text) else text,
}
"""Functions that read a value in a column of the pairing file. Other texts are values as they are."""
LISTS = ("levels", "places", "skip", "as_written")
"""Columns with several values. A unit of places is a single one."""


def note_of_answers(answers: Mapping[str, str], file: PurePath) -> Note:
    """Return the settings in the answers of a file's row. Its column of settings is TOML, separated by semicolons."""
    note, where = Note(), Location(file, f"row in {PAIRING}")
    for name, text in ((name, answers[name]) for name in SETTING if name in answers):
        read, parts = READ_AS.get(name, str), re.split(r"(?:[\s;]|,(?!\d))+", text)
        is_list = name in LISTS and (name != "places" or len(parts) > 1)
        note.take(SETTING[name], [*map(read, parts)] if is_list else read(text), where)
    try:
        note.take_tables(tomllib.loads(answers.get(SETTINGS, "").replace(";", "\n")), where)
    except (ValueError, RecursionError) as fault:
        example = "crack.depth_mm = 16.0; photo.ends_px = [[12, 340], [905, 377]]"
        finding = f"settings = {quoted(answers[SETTINGS])}: {fault}. Write for example {example}."
        note.faults.append(Doubt("note", where, finding))
    return note


@cache
def known_keys() -> frozenset[str]:
    """Return the dotted names of all settings that a note may give."""
    return frozenset([DATE, OPERATOR, *dotted_names(Trial), *SETTING.values()]) - {"readings.columns"}
