"""Names of columns: understood whole, or not at all."""

import pytest

from validate.sheets.words import Meaning, meaning, unit_of


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("s_mm", Meaning("station", "mm")),
        ("s/mm", Meaning("station", "mm")),
        ("S [mm]", Meaning("station", "mm")),
        ("Position entlang Riss (cm)", Meaning("station", "cm")),
        ("distance from start in m", Meaning("station", "m")),
        ("Abstand", Meaning("station")),
        ("level_1_mm", Meaning("reading", "mm", "level", "1")),
        ("depth_12_in", Meaning("reading", "inch", "depth", "12")),
        ("depth [in]", Meaning("reading", "inch", "depth")),
        ("depth [mm]", Meaning("reading", "mm", "depth")),
        ("Tiefe (cm)", Meaning("reading", "cm", "depth")),
        ("h in mm", Meaning("reading", "mm", "level")),
        ("Höhe 2 / Zoll", Meaning("reading", "inch", "level", "2")),
        ("Ho\u0308he", Meaning("reading", None, "level")),
        ("HOEHE", Meaning("reading", None, "level")),
        ("Tiefe unter Oberfläche Messung 3 [mm]", Meaning("reading", "mm", "depth", "3")),
        ("value down [mm]", Meaning("reading", "mm", "depth")),
        ("rep1", Meaning("reading", None, None, "1")),
        ("2. Messung (mm)", Meaning("reading", "mm", None, "2")),
        ("Messung", Meaning("repeat")),
        ("Wdh.", Meaning("repeat")),
        ("Reading No.", Meaning("repeat")),
        ("value", Meaning("reading")),
        ("Nr.", Meaning("skipped")),
        ("Station Nr", Meaning("skipped")),
        ("Mittelwert Tiefe [mm]", Meaning("skipped", "mm")),
        ("Bemerkung", Meaning("skipped")),
        ("Pegel 1 [mm]", Meaning("reading", "mm", "level", "1")),
        ("Pegel aufwärts 2 [mm]", Meaning("reading", "mm", "level", "2")),
        ("Pegel nach oben [mm]", Meaning("reading", "mm", "level")),
        ("Höhe abwärts [mm]", Meaning("reading", "mm", "depth")),
        ("Messwert_nach_unten_mm", Meaning("reading", "mm", "depth")),
        ("Niveau vers le haut (mm)", Meaning("reading", "mm", "level")),
        ("Hauteur vers le bas (mm)", Meaning("reading", "mm", "depth")),
        ("Nivel hacia arriba (mm)", Meaning("reading", "mm", "level")),
        ("Altura hacia abajo (mm)", Meaning("reading", "mm", "depth")),
        ("Level up 1 [mm]", Meaning("reading", "mm", "level", "1")),
        ("Height downward [mm]", Meaning("reading", "mm", "depth")),
        ("Profondeur 2 (mm)", Meaning("reading", "mm", "depth", "2")),
        ("profondeur sous la surface en mm", Meaning("reading", "mm", "depth")),
        ("Niveau [mm]", Meaning("reading", "mm", "level")),
        ("Hauteur mesurée (cm)", Meaning("reading", "cm", "level")),
        ("Mesure n° 3 [mm]", Meaning("reading", "mm", None, "3")),
        ("position le long de la fissure [mm]", Meaning("station", "mm")),
        ("Abscisse (mm)", Meaning("station", "mm")),
        ("Opérateur", Meaning("skipped")),
        ("Moyenne profondeur [mm]", Meaning("skipped", "mm")),
        ("posición [cm]", Meaning("station", "cm")),
        ("distancia desde el inicio (mm)", Meaning("station", "mm")),
        ("profundidad 1 [mm]", Meaning("reading", "mm", "depth", "1")),
        ("nivel (milímetros)", Meaning("reading", "mm", "level")),
        ("altura [pulgadas]", Meaning("reading", "inch", "level")),
        ("Medición", Meaning("repeat")),
        ("lectura", Meaning("reading")),
        ("Fecha", Meaning("skipped")),
        ("échantillon", Meaning("sample")),
        ("Muestra Nº", Meaning("sample")),
        ("Probe", Meaning("sample")),
        ("Sample ID", Meaning("sample")),
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
        "Risstiefe [mm]",
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
        "width [mm]",
        "largeur [mm]",
        "ancho de grieta [mm]",
        "profondeur de la fissure [mm]",
        "profundidad de la grieta [mm]",
        "Probe 1 [mm]",
        "sample width",
        "16.1",
    ],
)
def test_what_says_nothing_is_not_guessed(name):
    """Half of some would be enough for a guess, and it would be wrong: a crack's depth is no sealant's."""
    assert meaning(name) is None


@pytest.mark.parametrize(
    ("text", "unit"), [("mm", "mm"), ("[cm]", "cm"), ("(in)", "inch"), ("s", None), ("1 mm", None)]
)
def test_a_unit_alone_is_told_from_other_cells(text, unit):
    assert unit_of(text) == unit
