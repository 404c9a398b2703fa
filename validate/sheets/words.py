"""What a column's name says, in English or German: place or reading, upward or downward, unit, number.

A word that is not known here makes the whole name unknown: half understood is guessed.
"""

import re
import unicodedata
from dataclasses import dataclass
from typing import Literal

from validate.settings import Quantity, Unit

Role = Literal["station", "reading", "repeat", "skipped"]
"""station: place along the crack; repeat: which of several readings of a place a row holds; skipped: no reading."""

NAMES_OF_UNITS: dict[Unit, tuple[str, ...]] = {
    "mm": ("mm", "millimeter", "millimeters", "millimetre", "millimetres"),
    "cm": ("cm", "centimeter", "centimeters", "centimetre", "centimetres", "zentimeter"),
    "m": ("m", "meter", "meters", "metre", "metres"),
    "inch": ("inch", "inches", "zoll"),
}
UNITS: dict[str, Unit] = {name: unit for unit, names in NAMES_OF_UNITS.items() for name in names}
INCH = re.compile(r"[\[(/_]\s*in\s*[\])]?\s*$")
"""Elsewhere "in" is what stands before a unit."""
LONGEST_NAME = 200
"""Letters. A longer name is a text, and would keep the search for a unit busy."""
WORD = re.compile(r"[^\W\d_]+|[0-9]+")

STATION = {"s", "station", "position", "pos", "chainage", "stationing", "distance", "arclength"}
STATION |= {"stationierung", "abstand", "entfernung", "bogenlaenge", "lauflaenge", "ort"}
DEPTH = {"depth", "tiefe", "messtiefe"} | {"down", "downward", "downwards", "below", "unten", "unter", "unterhalb"}
LEVEL = {"level", "height", "h", "hoehe", "niveau"} | {"up", "upward", "upwards", "above", "oben", "ueber", "oberhalb"}
REPEAT = {"rep", "repeat", "repetition", "replicate", "measurement", "messung", "wdh", "wiederholung", "durchgang"}
VALUE = {"value", "reading", "wert", "messwert", "ablesung"}
COUNTER = {"no", "nr", "number", "nummer", "index"}
SKIPPED = {"note", "notes", "remark", "remarks", "comment", "comments", "operator", "date", "time", "id"}
SKIPPED |= {"bemerkung", "bemerkungen", "anmerkung", "kommentar", "notiz", "pruefer", "datum", "zeit", "uhrzeit"}
SKIPPED |= {"mean", "average", "avg", "median", "min", "max", "range", "sd", "std", "stdev"}
SKIPPED |= {"mittel", "mittelwert", "mw", "spannweite", "stabw", "standardabweichung"}
"""What is worked out of readings is none."""
OF_ANY = {"in", "the", "of", "from", "der", "des", "von", "vom", "ab"}
OF_STATION = OF_ANY | {"along", "crack", "centreline", "centerline", "start", "entlang", "riss", "rissanfang", "anfang"}
OF_READING = OF_ANY | {"sample", "surface", "face", "probe", "oberflaeche", "probenoberflaeche", "measured", "gemessen"}
"""Not "crack": a crack's depth is no reading of the sealant in it."""


@dataclass(frozen=True)
class Meaning:
    role: Role
    unit: Unit | None = None
    quantity: Quantity | None = None
    """Of a reading, where its name says it."""
    number: str | None = None
    """Of a repeat, where its name holds one."""


def meaning(name: str) -> Meaning | None:
    """None where the name, or any word of it, says nothing."""
    if len(name) > LONGEST_NAME:
        return None
    plain = _plain(name)
    found = WORD.findall(plain)
    numbers = [word for word in found if word.isdigit()]
    units: set[Unit] = {UNITS[word] for word in found if word in UNITS}
    words = {word for word in found if not word.isdigit() and word not in UNITS}
    if INCH.search(plain):
        units.add("inch")
    if len(units) > 1:
        return None
    unit = next(iter(units), None)
    if words & SKIPPED or (words and words <= COUNTER) or (words & STATION and words & COUNTER):
        return Meaning("skipped", unit)
    if words & STATION:
        return Meaning("station", unit) if words <= STATION | OF_STATION and not numbers else None
    if (
        not words & (DEPTH | LEVEL | REPEAT | VALUE)
        or not words <= DEPTH | LEVEL | REPEAT | VALUE | COUNTER | OF_READING
    ):
        return None
    if words & DEPTH and words & LEVEL:
        return None
    quantity: Quantity | None = "depth" if words & DEPTH else "level" if words & LEVEL else None
    bare = quantity is None and unit is None and not numbers
    counts = bare and (words & COUNTER or not words & VALUE)
    return Meaning("repeat" if counts else "reading", unit, quantity, "-".join(numbers) or None)


def unit_of(text: str) -> Unit | None:
    """Of a cell that holds a unit and nothing else, such as "[mm]"."""
    word = _plain(text).strip("[]() ")
    return "inch" if word == "in" else UNITS.get(word)


def _plain(text: str) -> str:
    text = unicodedata.normalize("NFC", text).casefold()
    return text.translate(str.maketrans({"ä": "ae", "ö": "oe", "ü": "ue"}))
