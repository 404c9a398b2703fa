"""Names of columns, understood as a whole or not at all."""

import pytest

from validate.readings.header_words import ColumnMeaning, meaning, name_in_titles

NAMES = {
    ColumnMeaning("station", "mm"): "s_mm|s/mm|x / mm|distanza dall'inizio, mm|lungo la fessura [mm]|"
    "position le long de la fissure [mm]|distancia desde el inicio (mm)",
    ColumnMeaning("station", "cm"): "Position entlang Riss (cm)",
    ColumnMeaning("station", "m"): "distance from start in m",
    ColumnMeaning("station"): "Abstand|Along crack|a lo largo de la grieta|X_Value|x-Koordinate",
    ColumnMeaning("station", "1/10 mm"): "s [1/10 mm]",
    ColumnMeaning("reading", "mm", "level", "1"): "level_1_mm|Level up 1 [mm]",
    ColumnMeaning("reading", "mm", "level"): "h in mm|Pegel nach oben [mm]|Niveau vers le haut (mm)|nivel (milímetros)",
    ColumnMeaning("reading", "inch", "level", "2"): "Höhe 2 / Zoll",
    ColumnMeaning("reading", None, "level"): "Ho\u0308he|HOEHE",
    ColumnMeaning("reading", "mm", "depth"): "depth [mm]|Tiefe unter Oberkante [mm]|Höhe abwärts [mm]|"
    "Messwert_nach_unten_mm|Hauteur vers le bas (mm)|Altura hacia abajo (mm)|profondeur sous la surface en mm",
    ColumnMeaning("reading", "mm", "depth", "3"): "Tiefe unter Oberfläche Messung 3 [mm]",
    ColumnMeaning("reading", "inch", "depth", "12"): "depth_12_in",
    ColumnMeaning("reading", "inch", "depth"): "depth [in]",
    ColumnMeaning(
        "reading", "µm", "depth"
    ): "depth [µm]|Tiefe / \u03bcm|Tiefe in um|Einsinktiefe ab Oberkante (micron)",
    ColumnMeaning("reading", None, "depth"): "Tiefenmaß|profondeur par rapport à la surface|hundimiento",
    ColumnMeaning("reading", "mm", "level", "3"): "Level rel. to surface #3, mm|altezza 3 rispetto al bordo / mm",
    ColumnMeaning("reading", "1/10 mm", "depth"): "Tiefe [1/10 mm]|Tiefe \u2152 mm",
    ColumnMeaning("reading", "1/100 mm", "depth", "2"): "Tiefe 2 (mm/100)",
    ColumnMeaning("reading", "mm", "depth", "0-1", factor="0,1 mm"): "Tiefe (0,1 mm)",
    ColumnMeaning("reading", "mm", None, "2"): "2. Messung (mm)",
    ColumnMeaning("reading", "mm", None, "3"): "Mesure n° 3 [mm]",
    ColumnMeaning("reading"): "value|lectura",
    ColumnMeaning("repeat"): "Messung|Reading No.|Lauf|Zyklus Nr.",
    ColumnMeaning("mass", "g", factor="10 g"): "Masse 10 g",
    ColumnMeaning("sample"): "Muestra Nº|Sample ID|Prüfkörper Nr.",
    ColumnMeaning("skipped", "mm"): "Risstiefe [mm]|width [mm]|Mittelwert Tiefe [mm]|Moyenne profondeur [mm]",
    ColumnMeaning("skipped"): "Nr.|Temperatur [°C]|Station Nr|Opérateur",
}
UNKNOWN = (
    "|x|t|d [mm]|12|Länge [mm]|crack depth [mm]|Füllhöhe [mm]|height above floor [mm]|depth level [mm]|"
    "level below surface [mm]|level up and down [mm]|depth upward [mm]|Tiefe aufwärts [mm]|Pegel unten [mm]|"
    "Pegel nach 24 h [mm]|Niveau vers le mur [mm]|depth [mm] (cm)|depth [nm]|Position 1 [mm]|<b>depth</b> [mm]|"
    "$depth$ of $\\alpha$|=depth+gap|profondeur de la fissure [mm]|profundidad de la grieta [mm]|Probe 1 [mm]|16.1|"
    "\u2212Tiefe [mm]|X_Value [s]|Y [mm]|x1|Level [mm] (- = above)|Tiefe ab Messschieber [mm]"
)


@pytest.mark.parametrize(
    ("name", "expected"), [(name, key) for key, names in NAMES.items() for name in names.split("|")]
)
def test_names_of_labs_are_understood(name, expected):
    assert meaning(name) == expected


@pytest.mark.parametrize("name", UNKNOWN.split("|"))
def test_what_says_nothing_is_not_guessed(name):
    """A guess from a part of the name would be wrong: the depth of the crack is not that of the sealant."""
    assert meaning(name) is None


@pytest.mark.parametrize(
    ("title", "name"),
    [
        ("A01 Tiefe ab Oberkante in mm, Tiefenmaß", "Tiefe ab Oberkante in mm, Tiefenmaß"),
        ("A01 Tiefe ab Oberkante in mm, Schublehre neu", "Tiefe ab Oberkante in mm"),
        ("A02 level vs top face, mm (+ = proud)", "level vs top face, mm"),
        ("A02 depth below face, mm (- = proud)", "depth below face, mm"),
        ("A02 level vs top face, mm (- = proud)", None),
        ("A02 depth below face, mm (+ = proud)", None),
        ("A02 level vs top face, mm (+ = zork)", None),
        ("A02 Tiefe mm, Unterkante", "reading [mm]"),
        ("A02 Tiefe ab Oberkante mm, in cm", None),
        ("A02 Tiefe ab Oberkante mm x10", None),
        ("A02 Tiefe ab Oberkante Messschieber mm", "reading [mm]"),
    ],
)
def test_a_title_keeps_its_meaning_beside_a_word_that_changes_nothing(title, name):
    assert name_in_titles([title]) == name
