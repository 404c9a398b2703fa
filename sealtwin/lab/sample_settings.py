"""Settings of samples: those of all samples in lab.toml, and those of one sample in its rows of pairing.csv."""

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path, PurePath
from typing import Any

from sealtwin.core.doubts import Doubt, Location
from sealtwin.core.errors import InputError
from sealtwin.core.settings import dotted_names, read_toml
from sealtwin.lab.files import DEFAULTS, PAIRING, SETTING, plain
from sealtwin.trial.trial_file import Trial
from simulate.settings import VISCOSITIES_PA_S
from validate.readings.grid import quoted
from validate.readings.words import is_ambiguous, number
from validate.settings import SIGNS

DATE, OPERATOR = "date", "operator"
OWN = ("name", DATE, OPERATOR)
"""Keys that are not copied to the trial.

The name of the trial is the name of the photo. Date and operator are stored in the catalogue."""
ORIGINS = ("photo.data", "readings.data")
"""Settings that the key ``data`` sets: the origin of the photo and of the readings."""
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
"""Groups of alternative sets of settings. If a sample has a setting of one set, the defaults of lab.toml for the other
sets of its group are dropped."""
OF_ONE = "readings.as_written"  # Key that cannot apply to all samples of a folder
STARTER = 'Write what a photo does not show: data = "measured", and depth_mm = 16.0 in [crack]'
KEYS = "there is no such key. Write a key of a trial ('sealtwin init DIR' shows them), or data, date or operator."
LONGEST = 200
ISO_DATE = re.compile(r"\d{4}-\d\d-\d\d")
CELL = re.compile("[A-Za-z]{1,3}[0-9]*")  # Pattern of a cell or a column. Words about a whole sheet are longer


@dataclass
class SampleSettings:
    """Settings by dotted key, the location of each, and the faults in them."""

    values: dict[str, Any] = field(default_factory=dict)
    origins: dict[str, Location] = field(default_factory=dict)
    faults: list[Doubt] = field(default_factory=list)

    def over(self, defaults: "SampleSettings", without: tuple[str, ...] = ()) -> "SampleSettings":
        """Return these settings, and ``defaults`` for the settings that are not given.

        Defaults whose keys begin with a text in ``without`` are left out.
        """
        replaced = [ways for ways in ALTERNATIVES if any(way & self.values.keys() for way in ways)]
        dropped = {key for ways in replaced for way in ways if not way & self.values.keys() for key in way}
        values = {key: value for key, value in defaults.values.items() if not key.startswith(without)}
        values = {key: value for key, value in values.items() if key not in dropped} | self.values
        return SampleSettings(values, defaults.origins | self.origins, [*defaults.faults, *self.faults])

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
            if not is_setting(entry):
                fault = KEYS
            elif origin != where:
                fault = f"this key is also given in {origin.named()}. Keep only one of the two."
            elif key == DATE and not ISO_DATE.match(value):
                fault = "this is not a date. Write a date such as 2026-12-31."
            if fault:
                self.faults.append(Doubt("setting", where, f"{key} = {quoted(f'{value}')}: {fault}"))
            else:
                self.values[entry], self.origins[entry] = value, where


def read_defaults(folder: Path) -> SampleSettings:
    """Read lab.toml, if there is one. Raises InputError with all faults of the file, since it affects every sample."""
    settings, file = SampleSettings(), PurePath(DEFAULTS)
    if (folder / file).is_file() and not (folder / file).is_symlink():
        settings.take_tables(read_toml(folder / file, name="file", starter=STARTER), Location(file))
    if OF_ONE in settings.values:
        finding = f"{OF_ONE} can apply to one sample only. Give it in pairing.csv."
        settings.faults.append(Doubt("setting", Location(file), finding))
    if settings.faults:
        raise InputError("\n".join(map(str, settings.faults)))
    return settings


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


def settings_of_answers(answers: Mapping[str, str], file: PurePath) -> SampleSettings:
    """Return the settings in the answers of a file's row."""
    settings, where = SampleSettings(), Location(file, f"row in {PAIRING}")
    for name, text in answers.items():
        read, parts = READ_AS.get(name, str if name in SETTING else value_of), re.split(r"(?:[\s;]|,(?!\d))+", text)
        is_list = name in LISTS and (name != "places" or len(parts) > 1)
        settings.take(SETTING.get(name, name), [*map(read, parts)] if is_list else read(text), where)
    return settings


def is_setting(key: str) -> bool:
    """Return whether lab.toml and pairing.csv may give a key: that of a setting, or of a part of one."""
    return any(f"{key}.".startswith(f"{name}.") for name in known_keys())


@cache
def known_keys() -> frozenset[str]:
    """Return the dotted names of all settings that lab.toml and pairing.csv may give."""
    return frozenset([DATE, OPERATOR, *dotted_names(Trial), *SETTING.values()]) - {"readings.columns"}
