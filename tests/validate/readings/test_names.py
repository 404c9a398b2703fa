"""Names of columns, which are understood completely or not at all."""

from dataclasses import replace

import pytest

from validate.readings.words import Meaning, Role, may_change, meaning, parsed, stated

NAMES = {
    Meaning(Role.STATION, "mm"): "s_mm|s/mm|x / mm|distanza dall'inizio, mm|"
    "position le long de la fissure [mm]|distancia desde el inicio (mm)|Distance along crack [mm]",
    Meaning(Role.STATION, "cm"): "Position entlang Riss (cm)",
    Meaning(Role.STATION, "m"): "distance from start in m",
    Meaning(Role.STATION): "Abstand",
    Meaning(Role.READING, "mm", "level", "1"): "level_1_mm|Level up 1 [mm]",
    Meaning(Role.READING, "mm", "level"): "h in mm|nivel (milímetros)",
    Meaning(Role.READING, "inch", "level", "2"): "Höhe 2 / Zoll",
    Meaning(Role.READING, None, "level"): "Ho\u0308he|HOEHE",
    Meaning(Role.READING, "mm", "depth"): "depth [mm]|Tiefe unter Oberkante [mm]|Höhe abwärts [mm]|"
    "profondeur sous la surface en mm",
    Meaning(Role.READING, "mm", "depth", "3"): "Tiefe unter Oberfläche Messung 3 [mm]",
    Meaning(Role.READING, "inch", "depth", "12"): "depth_12_in",
    Meaning(Role.READING, "inch", "depth"): "depth [in]",
    Meaning(Role.READING, "µm", "depth"): "depth [µm]|Tiefe / \u03bcm|Tiefe in um|Einsinktiefe (micron)",
    Meaning(Role.READING, None, "depth"): "Tiefenmaß|profondeur par rapport à la surface|hundimiento",
    Meaning(Role.READING, "mm", "level", "3"): "Level rel. to surface 3, mm|altezza 3 rispetto al bordo / mm",
    Meaning(Role.READING, "mm", None, "2"): "2. Messung (mm)",
    Meaning(
        Role.READING, "mm", None, "3"
    ): "Mesure 3 [mm]|Mesure n° 3 [mm]|3e mesure [mm]|Mesure III [mm]|lectura_c_mm|lettura (3) [mm]",
    Meaning(Role.READING): "value|lectura",
    Meaning(Role.REPEAT): "Messung|Reading No.|Lauf|Zyklus Nr.|Herhaling|Lecture n°",
    Meaning(Role.SAMPLE): "Muestra Nº|Sample ID|Prüfkörper Nr.",
    Meaning(Role.OTHER, "mm"): "Risstiefe [mm]|width [mm]|Mittelwert Tiefe [mm]|Moyenne profondeur [mm]",
    Meaning(Role.OTHER): "Nr.|Feuchte [%]|Temperatur 2 [°C]|Temp. [°C/°F]|relative Luftfeuchtigkeit [%]|"
    "Station Nr|Opérateur|Bemerkung",
}
# The depth of the crack is not that of the sealant, and a sign or a factor may change readings.
UNKNOWN = (
    "|x|t|d [mm]|12|Länge [mm]|crack depth [mm]|Füllhöhe [mm]|depth level [mm]|"
    "level below surface [mm]|level up and down [mm]|depth upward [mm]|Tiefe aufwärts [mm]|Pegel unten [mm]|"
    "Altura hacia abajo (mm)|Niveau vers le mur [mm]|depth [mm] (cm)|"
    "depth [nm]|Position 1 [mm]|<b>depth</b> [mm]|$depth$ of $\\alpha$|=depth+gap|profondeur de la fissure [mm]|"
    "profundidad de la grieta [mm]|Probe 1 [mm]|16.1|\u2212Tiefe [mm]|X_Value [s]|Y [mm]|x1|"
    "Level [mm] (- = above)|Tiefe ab Messschieber [mm]|Probe 1 Tiefe [mm]|Tiefe \u2152 mm|Tiefe (0,1 mm)|"
    "Masse 10 g|Tiefe [g]|RH [%]|RH [mm]|depth RH [%]|depth RH [mm]|depth RH|Position RH|rel [%]|"
    "Tiefe [1/10 mm]"
)
NO_LENGTHS = (
    "s [-]|s [1]|s/L|depth/D [-]|s [%]|Tiefe [\u2030]|Position rel.|relative position|Tiefe [°]|1/depth [1/mm]|Tiefe/2"
)
LENGTHS = "s/mm|Tiefe / mm|Level rel. to face|1. Lettura [mm]"
RESTS = "Tiefe [1/10 mm]|depth [mm/100]|Tiefe 2 (1/100 mm)|"
RESTS += "depth (+5 mm)|depth -5 [mm]|depth [mm-5]|± depth [mm]|depth [mm²]|depth² [mm]|Tiefe x 10 2|depth [nm]|[10 mm]"
READ = (Role.STATION, Role.READING, Role.REPEAT, Role.SAMPLE)


@pytest.mark.parametrize(
    ("name", "expected"), [(name, key) for key, names in NAMES.items() for name in names.split("|")]
)
def test_column_names_in_several_languages_are_understood(name, expected):
    assert meaning(name) == expected


@pytest.mark.parametrize("name", UNKNOWN.split("|"))
def test_the_meaning_of_an_ambiguous_column_name_is_not_certain(name):
    assert (entry := meaning(name)) is None or not entry.is_whole


LIKELY = {
    Meaning(Role.STATION, "mm"): "Balkenposition [mm]|Distance from the notch [mm]|LageAmBalken_mm",
    Meaning(Role.READING, "mm", "depth"): "Depth of sealant under pavement surface [mm]|Kuhlentiefe ab Oberfläche [mm]",
    Meaning(Role.READING, "mm", "depth", "2"): "sealantDepthBelowDeck_b_mm|Distance below deck 2nd [mm]",
    Meaning(Role.NEW, "mm", None, "2"): "Foo 2 [mm]|Cedimento II [mm]",
    Meaning(Role.READING, "mm", "level"): "Level of goop over the face [mm]|Hoogte boven betonvlak [mm]",
}
NOT_LIKELY = (
    "crack depth [mm]|profondeur de la fissure [mm]|profundidad de la grieta [mm]|Tiefe rechts [mm]|"
    "level below deck [mm]|depth from straightedge [mm]|Probe 1 Tiefe [mm]|depth offset [mm]|half depth [mm]|"
    "Tiefe x10 [mm]"
)


@pytest.mark.parametrize(
    ("name", "expected"), [(name, key) for key, names in LIKELY.items() for name in names.split("|")]
)
def test_known_words_give_a_likely_meaning_beside_unknown_ones(name, expected):
    assert meaning(name) == replace(expected, is_whole=False)
    assert not may_change(name)


@pytest.mark.parametrize("name", NOT_LIKELY.split("|"))
def test_a_word_that_may_change_readings_is_noticed(name):
    assert may_change(name) or meaning(name) is None


STATED = {
    ("mm", "level"): "Height of sealant relative to the face: + above, - below. All values in mm.|"
    "Nivel respecto a la cara, en mm (negativo = por debajo)|Peil in mm boven (+) of onder (-) het bovenvlak",
    ("mm", "depth"): "Rücksprung der Dichtmasse, nach unten positiv, alle Angaben in mm",
    ("", "depth"): "Profondeur sous la face",
    ("cm", None): "alle Angaben in cm",
    ("", None): "Crack depth 15 mm|Digital depth gauge, 0.01 mm|Tiefe, negativ = unter der Oberfläche|"
    "Level, downward positive|Depth and height of the joint|Gauge: depth micrometer",
}


@pytest.mark.parametrize(("text", "expected"), [(text, key) for key, of in STATED.items() for text in of.split("|")])
def test_a_text_states_units_and_direction_only_if_it_is_clear(text, expected):
    units, quantities = stated(text)
    assert (" ".join(units), next(iter(quantities), None)) == expected


def test_signs_and_factors_in_a_column_name_are_detected():
    assert [name for name in (NO_LENGTHS + "|" + RESTS).split("|") if not parsed(name).has_rest] == []
    assert [name for name in LENGTHS.split("|") if parsed(name).has_rest] == []
    read = [name for what, names in NAMES.items() if what.role in READ for name in names.split("|")]
    assert not any(parsed(name).has_rest for name in read)
