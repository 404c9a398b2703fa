"""The words in which labs write down what a photo cannot show, English and German, and the settings that they mean."""

import difflib
import re
import unicodedata
from dataclasses import dataclass, field
from typing import Literal

from sealtwin.lab.keys import known_keys

Kind = Literal["text", "date", "choice", "number", "size", "points"]

MILLI = 1e-3
UNITS: dict[str, dict[str, float]] = {
    "length": {"mm": 1, "cm": 10, "m": 1000, "inch": 25.4, "in": 25.4, "zoll": 25.4},
    "angle": {"°": 1, "deg": 1, "degrees": 1, "grad": 1},
    "volume": {"ml": 1, "cm3": 1, "cm³": 1, "mm3": MILLI, "mm³": MILLI, "l": 1000},
    "speed": {"mm/s": 1, "cm/s": 10, "m/s": 1000, "mm/min": 1 / 60, "cm/min": 10 / 60, "m/min": 1000 / 60},
    "scale": {"mm/px": 1, "mm/pixel": 1, "µm/px": MILLI, "um/px": MILLI},
    "viscosity": {"pas": 1, "mpas": MILLI},
    "density": {"kg/m3": 1, "kg/m³": 1, "g/cm3": 1000, "g/cm³": 1000},
    "stress": {"pa": 1, "kpa": 1000},
    "share": {"%": 1, "percent": 1, "prozent": 1},
}
"""What one of each is in the unit of its setting: mm, degrees, ml, mm/s, mm/px, Pa s, kg/m3, Pa, %."""


@dataclass(frozen=True)
class Meaning:
    """What a lab's word stands for."""

    key: str
    """A setting of the trial, dotted, or one of a note's own."""
    kind: Kind
    measure: str = ""
    """Of a number or a size: which of ``UNITS`` it has; empty where it has none."""
    choices: dict[str, str] = field(default_factory=dict)
    """From a lab's word to the setting's."""


DATA = {
    "measured": "measured", "gemessen": "measured", "reconstructed": "reconstructed",
    "rekonstruiert": "reconstructed", "synthetic": "synthetic", "synthetisch": "synthetic",
}  # fmt: skip
ROLES = {
    "calibrated on": "calibrated-on", "calibration": "calibrated-on", "kalibrierung": "calibrated-on",
    "held out": "held-out", "validation": "held-out", "validierung": "held-out", "zurückgehalten": "held-out",
}  # fmt: skip
TILTS = {name: name for name in ("lean", "flare", "funnel", "vertical")} | {
    "senkrecht": "vertical", "vertikal": "vertical", "trichter": "funnel",
}  # fmt: skip
QUANTITIES = {
    "level": "level", "level upward": "level", "height": "level", "höhe": "level", "pegel": "level",
    "depth": "depth", "depth downward": "depth", "tiefe": "depth",
}  # fmt: skip
DATUMS = {
    "sample surface": "sample_surface", "surface": "sample_surface", "probenoberfläche": "sample_surface",
    "oberfläche": "sample_surface", "sealant top": "sealant_top", "oberkante dichtstoff": "sealant_top",
    "caliper base": "caliper_base", "base of caliper": "caliper_base", "messschieberfuß": "caliper_base",
}  # fmt: skip
STATES = {
    "wet": "wet", "fresh": "wet", "nass": "wet", "feucht": "wet", "frisch": "wet",
    "cured": "cured", "hardened": "cured", "ausgehärtet": "cured", "erhärtet": "cured",
}  # fmt: skip
UNIT_NAMES = {"mm": "mm", "cm": "cm", "m": "m", "inch": "inch", "in": "inch", "zoll": "inch"}
DECIMALS = {"point": "point", "punkt": "point", "comma": "comma", "komma": "comma"}

MEANINGS: tuple[tuple[str, Meaning], ...] = (
    ("sample, sample name, name, probe, probenname, bezeichnung, prüfkörper", Meaning("name", "text")),
    ("remark, remarks, comment, note, bemerkung, anmerkung, kommentar", Meaning("note", "text")),
    ("date, test date, datum, prüfdatum, messdatum", Meaning("date", "date")),
    ("operator, tester, by, bearbeiter, prüfer, bediener", Meaning("operator", "text")),
    ("data, origin of data, daten, herkunft der daten", Meaning("data", "choice", choices=DATA)),
    ("depth, crack depth, tiefe, risstiefe", Meaning("crack.depth_mm", "number", "length")),
    ("wall shape, tilt, wandform, wandneigung", Meaning("crack.tilt", "choice", choices=TILTS)),
    ("wall angle, wandwinkel, neigungswinkel", Meaning("crack.wall_angle_deg", "number", "angle")),
    ("scale, maßstab, auflösung", Meaning("photo.mm_per_px", "number", "scale")),
    ("face, face size, sample size, probengröße, probenabmessungen", Meaning("photo.face_mm", "size", "length")),
    ("ends, crack ends, rissenden", Meaning("photo.ends_px", "points")),
    ("volume, sealant volume, volumen, menge, vergussmenge", Meaning("path.volume_ml", "number", "volume")),
    ("speed, nozzle speed, geschwindigkeit, vorschub", Meaning("path.speed_mm_s", "number", "speed")),
    ("nozzle height, düsenhöhe, düsenabstand", Meaning("path.nozzle_height_mm", "number", "length")),
    ("nozzle, nozzle diameter, düse, düsendurchmesser", Meaning("nozzle.diameter_mm", "number", "length")),
    ("viscosity, viskosität", Meaning("fluid.viscosity_pa_s", "number", "viscosity")),
    ("density, dichte", Meaning("fluid.density_kg_m3", "number", "density")),
    ("yield stress, fließgrenze", Meaning("fluid.yield_stress_pa", "number", "stress")),
    ("use of readings, verwendung der messwerte", Meaning("readings.role", "choice", choices=ROLES)),
    ("readings are, messgröße", Meaning("readings.quantity", "choice", choices=QUANTITIES)),
    ("unit of readings, einheit der messwerte", Meaning("readings.unit", "choice", choices=UNIT_NAMES)),
    ("decimal sign, dezimalzeichen", Meaning("readings.decimal", "choice", choices=DECIMALS)),
    ("readings sheet, tabellenblatt", Meaning("readings.sheet", "text")),
    ("readings datum, zero of readings, bezug, nullpunkt", Meaning("readings.datum", "choice", choices=DATUMS)),
    ("height of datum, bezugshöhe, höhe des nullpunkts", Meaning("readings.datum_level_mm", "number", "length")),
    ("state, state of sealant, zustand", Meaning("readings.state", "choice", choices=STATES)),
    ("shrinkage, schwindung, schwindmaß", Meaning("readings.shrinkage_percent", "number", "share")),
    ("probe width, messspitze", Meaning("readings.probe_mm", "number", "length")),
)  # fmt: skip
"""German Datum is the date; a datum of readings is a Bezug."""
HEADS = {"key", "parameter", "property", "quantity", "item", "angabe", "merkmal", "größe"}
"""In the first row of a sheet of words these head the column."""
NOT_STATED = {"none", "keine angabe", "unknown", "unbekannt", "?"}
"""Beside what is a missing reading."""

NOTHING_BUT_WORDS = re.compile(r"[^\w/]+|_")
UMLAUTS = str.maketrans({"ä": "ae", "ö": "oe", "ü": "ue"})


def normal(text: str) -> str:
    """Equal for two spellings of one word: case, umlauts written out, hyphens, more blanks than one."""
    folded = unicodedata.normalize("NFKC", text).casefold().translate(UMLAUTS)
    return " ".join(NOTHING_BUT_WORDS.sub(" ", folded).split())


BY_WORD = {normal(word): meaning for words, meaning in MEANINGS for word in words.split(",")}


def likely_word(written: str) -> str | None:
    """Which word of ours somebody may have meant."""
    words = {normal(word): word.strip() for words, _ in MEANINGS for word in words.split(",")}
    close = difflib.get_close_matches(normal(written), words, n=1)
    return words[close[0]] if close else None


def likely_key(written: str) -> str | None:
    """Which setting: crack.depth_mm for depth_mm, and for crack.dpeth_mm."""
    keys = sorted(known_keys())
    last = {key.rpartition(".")[2]: key for key in keys}
    if found := last.get(written.rpartition(".")[2]):
        return found
    close = difflib.get_close_matches(written, keys, n=1) or difflib.get_close_matches(written, last, n=1)
    return last.get(close[0], close[0]) if close else None
