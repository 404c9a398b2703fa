"""The words in which labs write down what a photo cannot show, in four languages, and the settings that they mean."""

import difflib
import re
from dataclasses import dataclass, field
from typing import Literal

from sealtwin.lab.keys import known_keys
from validate.sheets.letters import plain_letters

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


def _choices(**words: str) -> dict[str, str]:
    """From a lab's word to the setting's, whose own stands first."""
    return {word.strip(): key.replace("_", "-") for key, of in words.items() for word in of.split(",")}


DATA = _choices(
    measured="measured, gemessen, mesuré, medido",
    reconstructed="reconstructed, rekonstruiert, reconstruit, reconstruido",
    synthetic="synthetic, synthetisch, synthétique, sintético",
)
ROLES = _choices(
    calibrated_on="calibrated on, calibration, kalibrierung, calage, calibración",
    held_out="held out, validation, validierung, zurückgehalten, validación",
)
TILTS = _choices(
    lean="lean, schräg, incliné, inclinado",
    flare="flare",
    funnel="funnel, trichter, entonnoir, embudo",
    vertical="vertical, senkrecht, vertikal",
)
QUANTITIES = _choices(
    level="level, level upward, height, höhe, pegel, niveau, hauteur, nivel, altura",
    depth="depth, depth downward, tiefe, profondeur, profundidad",
)
DATUMS = {
    "sample surface": "sample_surface", "surface": "sample_surface", "probenoberfläche": "sample_surface",
    "oberfläche": "sample_surface", "surface de l'échantillon": "sample_surface",
    "superficie de la muestra": "sample_surface", "superficie": "sample_surface",
    "sealant top": "sealant_top", "oberkante dichtstoff": "sealant_top",
    "caliper base": "caliper_base", "base of caliper": "caliper_base", "messschieberfuß": "caliper_base",
}  # fmt: skip
STATES = _choices(
    wet="wet, fresh, nass, feucht, frisch, frais, humide, fresco, húmedo",
    cured="cured, hardened, ausgehärtet, erhärtet, durci, endurecido, curado",
)
UNIT_NAMES = _choices(mm="mm", cm="cm", m="m", inch="inch, in, zoll, pouce, pouces, pulgada, pulgadas")
DECIMALS = _choices(point="point, punkt, punto", comma="comma, komma, virgule, coma")

MEANINGS: tuple[tuple[str, Meaning], ...] = (
    (
        "sample, sample name, name, probe, probenname, bezeichnung, prüfkörper, échantillon, éprouvette, nom, muestra, "
        "probeta, nombre",
        Meaning("name", "text"),
    ),
    (
        "remark, remarks, comment, note, bemerkung, anmerkung, kommentar, remarque, commentaire, nota, observación, "
        "observaciones, comentario",
        Meaning("note", "text"),
    ),
    ("date, test date, datum, prüfdatum, messdatum, date d'essai, fecha, fecha de ensayo", Meaning("date", "date")),
    (
        "operator, tester, by, bearbeiter, prüfer, bediener, opérateur, opératrice, operador, operadora",
        Meaning("operator", "text"),
    ),
    (
        "data, origin of data, daten, herkunft der daten, données, origine des données, datos, origen de los datos",
        Meaning("data", "choice", choices=DATA),
    ),
    (
        "depth, crack depth, tiefe, risstiefe, profondeur, profondeur de la fissure, profundidad, "
        "profundidad de la grieta",
        Meaning("crack.depth_mm", "number", "length"),
    ),
    (
        "wall shape, tilt, wandform, wandneigung, forme des parois, forma de las paredes",
        Meaning("crack.tilt", "choice", choices=TILTS),
    ),
    (
        "wall angle, wandwinkel, neigungswinkel, angle des parois, ángulo de las paredes",
        Meaning("crack.wall_angle_deg", "number", "angle"),
    ),
    ("scale, maßstab, auflösung, échelle, escala", Meaning("photo.mm_per_px", "number", "scale")),
    (
        "face, face size, sample size, probengröße, probenabmessungen, dimensions de l'échantillon, "
        "dimensiones de la muestra",
        Meaning("photo.face_mm", "size", "length"),
    ),
    (
        "ends, crack ends, rissenden, extrémités, extrémités de la fissure, extremos, extremos de la grieta",
        Meaning("photo.ends_px", "points"),
    ),
    (
        "volume, sealant volume, volumen, menge, vergussmenge, volume de mastic, volumen de sellador",
        Meaning("path.volume_ml", "number", "volume"),
    ),
    (
        "speed, nozzle speed, geschwindigkeit, vorschub, vitesse, velocidad",
        Meaning("path.speed_mm_s", "number", "speed"),
    ),
    (
        "nozzle height, düsenhöhe, düsenabstand, hauteur de la buse, altura de la boquilla",
        Meaning("path.nozzle_height_mm", "number", "length"),
    ),
    (
        "nozzle, nozzle diameter, düse, düsendurchmesser, buse, diamètre de la buse, boquilla, diámetro de la boquilla",
        Meaning("nozzle.diameter_mm", "number", "length"),
    ),
    ("viscosity, viskosität, viscosité, viscosidad", Meaning("fluid.viscosity_pa_s", "number", "viscosity")),
    ("density, dichte, densité, masse volumique, densidad", Meaning("fluid.density_kg_m3", "number", "density")),
    (
        "yield stress, fließgrenze, seuil d'écoulement, umbral de fluencia",
        Meaning("fluid.yield_stress_pa", "number", "stress"),
    ),
    (
        "use of readings, verwendung der messwerte, usage des mesures, uso de las lecturas",
        Meaning("readings.role", "choice", choices=ROLES),
    ),
    (
        "readings are, messgröße, grandeur mesurée, magnitud medida",
        Meaning("readings.quantity", "choice", choices=QUANTITIES),
    ),
    (
        "unit of readings, einheit der messwerte, unité des mesures, unidad de las lecturas",
        Meaning("readings.unit", "choice", choices=UNIT_NAMES),
    ),
    (
        "decimal sign, dezimalzeichen, séparateur décimal, separador decimal",
        Meaning("readings.decimal", "choice", choices=DECIMALS),
    ),
    ("readings sheet, tabellenblatt, feuille, hoja", Meaning("readings.sheet", "text")),
    (
        "readings datum, zero of readings, bezug, nullpunkt, zéro des mesures, cero de las lecturas",
        Meaning("readings.datum", "choice", choices=DATUMS),
    ),
    (
        "height of datum, bezugshöhe, höhe des nullpunkts, hauteur du zéro, altura del cero",
        Meaning("readings.datum_level_mm", "number", "length"),
    ),
    (
        "state, state of sealant, zustand, état, état du mastic, estado, estado del sellador",
        Meaning("readings.state", "choice", choices=STATES),
    ),
    (
        "shrinkage, schwindung, schwindmaß, retrait, retracción",
        Meaning("readings.shrinkage_percent", "number", "share"),
    ),
    (
        "probe width, messspitze, largeur de la pointe, ancho de la punta",
        Meaning("readings.probe_mm", "number", "length"),
    ),
)
"""English, German, French, Spanish. German Datum is the date; a datum of readings is a Bezug."""
HEADS = {"key", "parameter", "property", "quantity", "item", "angabe", "merkmal", "groesse"}
HEADS |= {"parametre", "propriete", "grandeur", "parametro", "propiedad"}
"""In the first row of a sheet of words these head the column."""
NOT_STATED = {
    "none",
    "unknown",
    "keine angabe",
    "unbekannt",
    "inconnu",
    "non indiqué",
    "desconocido",
    "no indicado",
    "?",
}
"""Beside what is a missing reading."""
LIKENESS = 0.8
"""Share of letters that two words have in one order. Teife and Tiefe reach it; Wetter and Tester do not."""

NOTHING_BUT_WORDS = re.compile(r"[^\w/]+|_")


def normal(text: str) -> str:
    """Equal for two spellings of one word: case, accents, umlauts written out, hyphens, more blanks than one."""
    return " ".join(NOTHING_BUT_WORDS.sub(" ", plain_letters(text)).split())


BY_WORD = {normal(word): meaning for words, meaning in MEANINGS for word in words.split(",")}


def likely_word(written: str) -> str | None:
    """Which word of ours somebody may have meant."""
    words = {normal(word): word.strip() for words, _ in MEANINGS for word in words.split(",")}
    close = difflib.get_close_matches(normal(written), words, n=1, cutoff=LIKENESS)
    return words[close[0]] if close else None


def likely_key(written: str) -> str | None:
    """Which setting: crack.depth_mm for depth_mm, and for crack.dpeth_mm."""
    keys = sorted(known_keys())
    # [uncertainty] has the names of what is uncertain, which is more often meant.
    named_first = sorted(keys, key=lambda key: not key.startswith("uncertainty."))
    last = {key.rpartition(".")[2]: key for key in named_first}
    if found := last.get(written.rpartition(".")[2]):
        return found
    close = [
        found for among in (keys, last) for found in difflib.get_close_matches(written, among, n=1, cutoff=LIKENESS)
    ]
    return last.get(close[0], close[0]) if close else None
