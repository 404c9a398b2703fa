"""Read notes, which give settings that a photo does not show, as keys of a trial in TOML."""

import re
import tomllib
from collections.abc import Mapping
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
"""Keys of a note that are not copied to the trial.

The name of the trial is the name of the photo. Date and operator are stored in the catalogue."""
ORIGINS = ("photo.data", "readings.data")
"""Settings that the key ``data`` of a note sets: the origin of the photo and of the readings."""
OF_READINGS = ("readings.", "gate.")  # Prefixes of keys that apply only to samples with readings
SCALE, DEPTH = "photo.mm_per_px", "crack.depth_mm"
ALTERNATIVES = (
    (
        {SCALE, "photo.scale_is"},
        {"photo.ruler_px", "photo.ruler_mm"},
        {"photo.markers", "photo.face_mm", "photo.face_corners_px"},
    ),
    ({"fluid.U", "fluid.D_cm"}, *({f"fluid.{key}"} for key in VISCOSITIES_PA_S)),
)
"""Groups of alternative sets of settings. If a sample's note gives a setting of one set, the folder's defaults for the
other sets of its group are dropped."""
OF_ONE = "readings.as_written"  # Key that cannot apply to all samples of a folder
STARTER = 'Write a note with what a photo does not show: data = "measured", and depth_mm = 16.0 in [crack]'
KEYS = "there is no such key. Write a key of a trial ('sealtwin init DIR' shows them), or data, date or operator."
NOT_READ = (
    "is not read, since it is a text. If it has settings, write them into the column settings of its row, such as "
    "crack.depth_mm = 9.0. If it has readings, set its role to readings. Otherwise, set its role to ignore."
)
NUMBER = re.compile(r"[\d¼-¾⅐-⅞]")
LARGEST_READ_BYTES = 200_000
LONGEST = 200
ISO_DATE = re.compile(r"\d{4}-\d\d-\d\d")
CELL = re.compile("[A-Za-z]{1,3}[0-9]*")  # Pattern of a cell or a column. Words about a whole sheet are longer


@dataclass
class Note:
    """Settings from notes by dotted key, the location of each setting, and the faults of the notes."""

    values: dict[str, Any] = field(default_factory=dict)
    origins: dict[str, Location] = field(default_factory=dict)
    faults: list[Doubt] = field(default_factory=list)

    def over(self, defaults: "Note", without: tuple[str, ...] = ()) -> "Note":
        """Return a note with the settings of this note, and with ``defaults`` for the settings that it does not give.

        Defaults whose keys begin with a text in ``without`` are left out.
        """
        replaced = [ways for ways in ALTERNATIVES if any(way & self.values.keys() for way in ways)]
        dropped = {key for ways in replaced for way in ways if not way & self.values.keys() for key in way}
        values = {key: value for key, value in defaults.values.items() if not key.startswith(without)}
        values = {key: value for key, value in values.items() if key not in dropped} | self.values
        return Note(values, defaults.origins | self.origins, [*defaults.faults, *self.faults])

    def take_tables(self, content: Mapping[str, Any], where: Location) -> None:
        """Add the settings in TOML tables, and a fault for each key that is not a key of a trial."""
        for key, value in content.items():
            if isinstance(value, dict) and key not in known_keys():
                self.take_tables({f"{key}.{name}": inner for name, inner in value.items()}, where)
            else:
                self.take(key, value, where)

    def take(self, key: str, value: Any, where: Location) -> None:
        """Add a setting by its dotted key. A setting that another file also gives is a fault."""
        if key in (DATE, OPERATOR):
            value = plain(f"{value}"[:LONGEST])
        for entry in ORIGINS if key == "data" else (key,):
            origin, fault = self.origins.get(entry, where), ""
            if entry not in known_keys():
                fault = KEYS
            elif origin != where:
                fault = f"this key is also given in {origin.named()}. Keep only one of the two."
            elif key == DATE and not ISO_DATE.match(value):
                fault = "this is not a date. Write a date such as 2026-12-31."
            if fault:
                self.faults.append(Doubt("note", where, f"{key} = {quoted(f'{value}')}: {fault}"))
            else:
                self.values[entry], self.origins[entry] = value, where


def read_note(folder: Path, file: PurePath, sample: str, note: Note, *, answered: bool = False) -> None:
    """Add to ``note`` the settings in a TOML file.

    A text file is a fault if it may contain settings: a known key, a number that is not part of the name of its
    ``sample``, or characters that are not UTF-8. It is not a fault if the user has ``answered`` its row.
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
    is_cut = "\ufffd" in text or len(content) == LARGEST_READ_BYTES  # \ufffd replaces characters that are not UTF-8
    words = [word for word in text.split() if word in known_keys() or NUMBER.search(word)]
    if not answered and (is_cut or any(sample_key(word) != sample for word in words)):
        note.faults.append(Doubt("note", where, NOT_READ))


def read_defaults(folder: Path) -> Note:
    """Read lab.toml, if there is one. Raises InputError with all faults of the file, since it affects every sample."""
    note, file = Note(), PurePath(DEFAULTS)
    if (folder / file).is_file() and not (folder / file).is_symlink():
        read_note(folder, file, "", note)
    if OF_ONE in note.values:
        finding = f"{OF_ONE} can apply to one sample only. Move it to the note of that sample."
        note.faults.append(Doubt("note", Location(file), finding))
    if note.faults:
        raise InputError("\n".join(map(str, note.faults)))
    return note


def value_of(text: str) -> Any:
    """Return the value in a cell: a number, a TOML value, or the text itself.

    An ambiguous number such as 1,234 is returned as text.
    """
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
"""Functions that read the values in some columns of the pairing file. Values in other columns are texts."""
LISTS = ("levels", "places", "skip", "as_written")
"""Columns of the pairing file with a list of values. The column places may also have a unit, which is not a list."""


def note_of_answers(answers: Mapping[str, str], file: PurePath) -> Note:
    """Return the settings in the answers of a file's row.

    The column settings contains TOML, with semicolons between the lines.
    """
    note, where = Note(), Location(file, f"row in {PAIRING}")
    for name, text in ((name, answers[name]) for name in SETTING if name in answers):
        read, parts = READ_AS.get(name, str), re.split(r"(?:[\s;]|,(?!\d))+", text)
        is_list = name in LISTS and (name != "places" or len(parts) > 1)
        note.take(SETTING[name], [*map(read, parts)] if is_list else read(text), where)
    try:
        note.take_tables(tomllib.loads(answers.get(SETTINGS, "").replace(";", "\n")), where)
    except (ValueError, RecursionError) as fault:
        example = "crack.depth_mm = 16.0; photo.ends_px = [[12, 340], [905, 377]]"
        finding = f"settings = {quoted(answers[SETTINGS])}: {fault}. Write, for example, {example}."
        note.faults.append(Doubt("note", where, finding))
    return note


@cache
def known_keys() -> frozenset[str]:
    """Return the dotted names of all settings that a note may give."""
    return frozenset([DATE, OPERATOR, *dotted_names(Trial), *SETTING.values()]) - {"readings.columns"}
