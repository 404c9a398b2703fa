"""What a column's name says, in English, German, French or Spanish: place or reading, which way, unit, number.

A word that is not known here makes the whole name unknown: half understood is guessed.
"""

import re
from dataclasses import dataclass
from typing import Literal

from validate.settings import Quantity, Unit
from validate.sheets.letters import plain_letters

Role = Literal["station", "reading", "repeat", "sample", "skipped"]
"""station: place along the crack; repeat: which of several readings of a place a row holds; sample: whose row it is;
skipped: no reading.
"""

NAMES_OF_UNITS: dict[Unit, str] = {
    "mm": "mm millimeter millimeters millimetre millimetres milimetro milimetros",
    "cm": "cm centimeter centimeters centimetre centimetres zentimeter centimetro centimetros",
    "m": "m meter meters metre metres metro metros",
    "inch": "inch inches zoll pouce pouces pulgada pulgadas",
}
UNITS: dict[str, Unit] = {name: unit for unit, names in NAMES_OF_UNITS.items() for name in names.split()}
INCH = re.compile(r"[\[(/_]\s*in\s*[\])]?\s*$")
"""Elsewhere "in" is what stands before a unit."""
LONGEST_NAME = 200
"""Letters. A longer name is a text, and would keep the search for a unit busy."""
WORD = re.compile(r"[^\W\d_]+|[0-9]+")


def _set(words: str) -> frozenset[str]:
    """Words as ``plain_letters`` leaves them: English, German, French, Spanish."""
    return frozenset(words.split())


STATION = _set(
    "s station position pos chainage stationing distance arclength "
    "stationierung abstand entfernung bogenlaenge lauflaenge ort "
    "abscisse emplacement posicion distancia abscisa estacion progresiva"
)
TOWARD = re.compile(
    r"(?<![^\W_])(?:nach|vers(?:[\W_]+le)?|hacia)[\W_]+(?:(?P<up>oben|haut|arriba)|unten|bas|abajo)(?![^\W_])"
)
"""A direction in several words. "nach" alone may be "after"."""
DOWNWARD = _set("down downward downwards abwaerts")
DEPTH = DOWNWARD | _set(
    "depth below tiefe messtiefe unten unter unterhalb profondeur prof dessous sous bas profundidad debajo bajo abajo"
)
HEIGHT = _set("level height h hoehe niveau pegel hauteur nivel altura")
LEVEL = HEIGHT | _set("up upward upwards above aufwaerts oben ueber oberhalb dessus haut encima sobre arriba")
REPEAT = _set(
    "rep repeat repetition replicate measurement messung wdh wiederholung durchgang "
    "mesure essai medida medicion repeticion ensayo"
)
VALUE = _set("value reading wert messwert ablesung valeur lecture releve valor lectura")
COUNTER = _set("no nr number nummer index numero num n")
SAMPLE = _set("sample specimen probe probekoerper pruefkoerper echantillon eprouvette muestra probeta")
OF_SAMPLE = COUNTER | _set("name id code label bezeichnung kennung nom nombre de la del l")
SKIPPED = _set(
    "note notes remark remarks comment comments operator date time id "
    "bemerkung bemerkungen anmerkung kommentar notiz pruefer bediener datum zeit uhrzeit "
    "remarque remarques commentaire commentaires operateur heure "
    "nota notas observacion observaciones comentario comentarios operador fecha hora "
    "mean average avg median min max range sd std stdev "
    "mittel mittelwert mw spannweite stabw standardabweichung moyenne moy mediane media promedio mediana desviacion"
)
"""What is worked out of readings is none."""
OF_ANY = _set("in the of from der des von vom ab en de du la le les l d au a del el desde depuis")
OF_STATION = OF_ANY | _set(
    "along crack centreline centerline start entlang riss rissanfang anfang "
    "long fissure debut origine largo grieta fisura inicio origen lo"
)
OF_READING = OF_ANY | _set(
    "sample surface face probe oberflaeche probenoberflaeche measured gemessen "
    "echantillon mesuree superficie cara muestra medido"
)
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
    plain = TOWARD.sub(lambda toward: "upward" if toward["up"] else "downward", plain_letters(name))
    found = WORD.findall(plain)
    numbers = [word for word in found if word.isdigit()]
    units: set[Unit] = {UNITS[word] for word in found if word in UNITS}
    words = {word for word in found if not word.isdigit() and word not in UNITS}
    if INCH.search(plain):
        units.add("inch")
    if len(units) > 1:
        return None
    unit = next(iter(units), None)
    if words & SAMPLE and words <= SAMPLE | OF_SAMPLE and not (unit or numbers):
        return Meaning("sample")
    if words & SKIPPED or (words and words <= COUNTER) or (words & STATION and words & COUNTER):
        return Meaning("skipped", unit)
    if words & STATION:
        return Meaning("station", unit) if words <= STATION | OF_STATION and not numbers else None
    if (
        not words & (DEPTH | LEVEL | REPEAT | VALUE)
        or not words <= DEPTH | LEVEL | REPEAT | VALUE | COUNTER | OF_READING
    ):
        return None
    ways = words & (DEPTH | LEVEL)
    # A height that counts downward is a depth; a level below something may be either.
    if words & DEPTH and words & LEVEL and not ways <= HEIGHT | DOWNWARD:
        return None
    quantity: Quantity | None = "depth" if words & DEPTH else "level" if words & LEVEL else None
    bare = quantity is None and unit is None and not numbers
    counts = bare and (words & COUNTER or not words & VALUE)
    return Meaning("repeat" if counts else "reading", unit, quantity, "-".join(numbers) or None)


def unit_of(text: str) -> Unit | None:
    """Of a cell that holds a unit and nothing else, such as "[mm]"."""
    word = plain_letters(text).strip("[]() ")
    return "inch" if word == "in" else UNITS.get(word)
