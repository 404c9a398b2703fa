"""Names of columns, understood as a whole or not at all."""

import pytest

from validate.readings.header_words import ColumnMeaning, meaning, unit_of


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("s_mm", ColumnMeaning("station", "mm")),
        ("s/mm", ColumnMeaning("station", "mm")),
        ("S [mm]", ColumnMeaning("station", "mm")),
        ("Position entlang Riss (cm)", ColumnMeaning("station", "cm")),
        ("distance from start in m", ColumnMeaning("station", "m")),
        ("Abstand", ColumnMeaning("station")),
        ("level_1_mm", ColumnMeaning("reading", "mm", "level", "1")),
        ("depth_12_in", ColumnMeaning("reading", "inch", "depth", "12")),
        ("depth [in]", ColumnMeaning("reading", "inch", "depth")),
        ("depth [mm]", ColumnMeaning("reading", "mm", "depth")),
        ("Tiefe (cm)", ColumnMeaning("reading", "cm", "depth")),
        ("h in mm", ColumnMeaning("reading", "mm", "level")),
        ("Höhe 2 / Zoll", ColumnMeaning("reading", "inch", "level", "2")),
        ("Ho\u0308he", ColumnMeaning("reading", None, "level")),
        ("HOEHE", ColumnMeaning("reading", None, "level")),
        ("Tiefe unter Oberfläche Messung 3 [mm]", ColumnMeaning("reading", "mm", "depth", "3")),
        ("value down [mm]", ColumnMeaning("reading", "mm", "depth")),
        ("rep1", ColumnMeaning("reading", None, None, "1")),
        ("2. Messung (mm)", ColumnMeaning("reading", "mm", None, "2")),
        ("Messung", ColumnMeaning("repeat")),
        ("Wdh.", ColumnMeaning("repeat")),
        ("Reading No.", ColumnMeaning("repeat")),
        ("value", ColumnMeaning("reading")),
        ("Nr.", ColumnMeaning("skipped")),
        ("Risstiefe [mm]", ColumnMeaning("skipped", "mm")),
        ("Tiefe [1/10 mm]", ColumnMeaning("reading", "1/10 mm", "depth")),
        ("Tiefe 2 (mm/100)", ColumnMeaning("reading", "1/100 mm", "depth", "2")),
        ("Tiefe \u2152 mm", ColumnMeaning("reading", "1/10 mm", "depth")),
        ("s [1/10 mm]", ColumnMeaning("station", "1/10 mm")),
        ("Tiefe (0,1 mm)", ColumnMeaning("reading", "mm", "depth", "0-1", factor="0,1 mm")),
        ("Masse 10 g", ColumnMeaning("mass", "g", factor="10 g")),
        ("\u2212Tiefe [mm]", None),
        ("width [mm]", ColumnMeaning("skipped", "mm")),
        ("Temperatur [°C]", ColumnMeaning("skipped")),
        ("Tiefe unter Oberkante [mm]", ColumnMeaning("reading", "mm", "depth")),
        ("Station Nr", ColumnMeaning("skipped")),
        ("Mittelwert Tiefe [mm]", ColumnMeaning("skipped", "mm")),
        ("Bemerkung", ColumnMeaning("skipped")),
        ("Pegel 1 [mm]", ColumnMeaning("reading", "mm", "level", "1")),
        ("Pegel aufwärts 2 [mm]", ColumnMeaning("reading", "mm", "level", "2")),
        ("Pegel nach oben [mm]", ColumnMeaning("reading", "mm", "level")),
        ("Höhe abwärts [mm]", ColumnMeaning("reading", "mm", "depth")),
        ("Messwert_nach_unten_mm", ColumnMeaning("reading", "mm", "depth")),
        ("Niveau vers le haut (mm)", ColumnMeaning("reading", "mm", "level")),
        ("Hauteur vers le bas (mm)", ColumnMeaning("reading", "mm", "depth")),
        ("Nivel hacia arriba (mm)", ColumnMeaning("reading", "mm", "level")),
        ("Altura hacia abajo (mm)", ColumnMeaning("reading", "mm", "depth")),
        ("Level up 1 [mm]", ColumnMeaning("reading", "mm", "level", "1")),
        ("Height downward [mm]", ColumnMeaning("reading", "mm", "depth")),
        ("Profondeur 2 (mm)", ColumnMeaning("reading", "mm", "depth", "2")),
        ("profondeur sous la surface en mm", ColumnMeaning("reading", "mm", "depth")),
        ("Niveau [mm]", ColumnMeaning("reading", "mm", "level")),
        ("Hauteur mesurée (cm)", ColumnMeaning("reading", "cm", "level")),
        ("Mesure n° 3 [mm]", ColumnMeaning("reading", "mm", None, "3")),
        ("position le long de la fissure [mm]", ColumnMeaning("station", "mm")),
        ("Abscisse (mm)", ColumnMeaning("station", "mm")),
        ("Opérateur", ColumnMeaning("skipped")),
        ("Moyenne profondeur [mm]", ColumnMeaning("skipped", "mm")),
        ("posición [cm]", ColumnMeaning("station", "cm")),
        ("distancia desde el inicio (mm)", ColumnMeaning("station", "mm")),
        ("profundidad 1 [mm]", ColumnMeaning("reading", "mm", "depth", "1")),
        ("nivel (milímetros)", ColumnMeaning("reading", "mm", "level")),
        ("altura [pulgadas]", ColumnMeaning("reading", "inch", "level")),
        ("Medición", ColumnMeaning("repeat")),
        ("lectura", ColumnMeaning("reading")),
        ("Fecha", ColumnMeaning("skipped")),
        ("échantillon", ColumnMeaning("sample")),
        ("Muestra Nº", ColumnMeaning("sample")),
        ("Probe", ColumnMeaning("sample")),
        ("Sample ID", ColumnMeaning("sample")),
    ],
)
def test_names_of_labs_are_understood(name, expected):
    assert meaning(name) == expected


@pytest.mark.parametrize(
    "name",
    [
        "",
        "x",
        "t",
        "d [mm]",
        "12",
        "Länge [mm]",
        "crack depth [mm]",
        "Füllhöhe [mm]",
        "height above floor [mm]",
        "depth level [mm]",
        "level below surface [mm]",
        "level up and down [mm]",
        "depth upward [mm]",
        "Tiefe aufwärts [mm]",
        "Pegel unten [mm]",
        "Pegel nach 24 h [mm]",
        "Niveau vers le mur [mm]",
        "depth [mm] (cm)",
        "depth [µm]",
        "Position 1 [mm]",
        "<b>depth</b> [mm]",
        "$depth$ of $\\alpha$",
        "=depth+gap",
        "profondeur de la fissure [mm]",
        "profundidad de la grieta [mm]",
        "Probe 1 [mm]",
        "16.1",
    ],
)
def test_what_says_nothing_is_not_guessed(name):
    """A guess from a part of the name would be wrong: the depth of the crack is not that of the sealant."""
    assert meaning(name) is None


@pytest.mark.parametrize(
    ("text", "unit"), [("mm", "mm"), ("[cm]", "cm"), ("(in)", "inch"), ("s", None), ("1 mm", None)]
)
def test_a_unit_alone_is_told_from_other_cells(text, unit):
    assert unit_of(text) == unit
