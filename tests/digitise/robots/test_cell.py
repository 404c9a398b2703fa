"""A cell file: every fault named by key, value and what is allowed; of no cell is asked what another language needs."""

import pytest

from digitise.robots.cell import LANGUAGES, RobotCell
from digitise.robots.programs import Urscript
from sealtwin.core.errors import InputError
from sealtwin.core.settings import read_settings
from sealtwin.trial.starter_files import CELL


def read(tmp_path, *changes: tuple[str, str]) -> RobotCell:
    text = CELL
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    path = tmp_path / "cell.toml"
    path.write_text(text, encoding="utf-8")
    return read_settings(RobotCell, path, name="cell file", starter="'sealtwin robot --example FILE' writes one")


def uncommented(*tables: str) -> list[tuple[str, str]]:
    """Changes that bring tables of the example to life."""
    lines, example, live = [], CELL.splitlines(), False
    for line in example:
        if line.startswith(("[", "# [")):
            live = any(line.startswith(f"# [{table}]") for table in tables)
        if live and line.startswith("# "):
            lines.append((line, line[2:]))
    return lines


def test_the_example_is_a_valid_cell_with_every_table_of_it_alive(tmp_path):
    cell = read(tmp_path, *uncommented("plunger", *LANGUAGES))
    assert [kind for kind in LANGUAGES if cell.missing_for(kind) is None] == list(LANGUAGES)
    assert cell.table(Urscript).full_flow_mm3_s == 1000.0


BY_S = 'dispenser = "output"     ', 'dispenser = "s"\naxis_start_mm = 0.0\n#'
SECOND_POINT = "[[taught]]\nsample_mm = [0.0, 40.0]\nrobot_mm = [210.0, -80.0, 55.0]\n"
BY_A_VECTOR = "port = 0\nrotation_vector_rad = [0.0, 3.1, 0.0]"
ONLY_ANALOG = "full_flow_mm3_s and dispenser"


@pytest.mark.parametrize(
    ("table", "old", "new", "named"),
    [
        (None, "frame_limit_mm", "frame_limit", ["frame_limit: no such key", "did you mean 'frame_limit_mm'"]),
        (None, "low_mm = [150.0, -150.0, 50.0]", "low_mm = [150.0, -150.0]", ["reach.low_mm: 2 given, 3 needed"]),
        (None, "robot_mm = [250.0, 80.0, 55.0]", "robot_mm = [250.0, 80.0, 5e9]", ["taught.1.robot_mm.2", "10000"]),
        (None, '["spel", "csv"]', '["gcode"]', ['formats has "gcode", but there is no [gcode] table']),
        (None, '["spel", "csv"]', '["krl"]', ["formats.0 = 'krl'", "urscript"]),
        (None, 'dispenser = "output"', 'dispenser = "z"', ["spel: ", "needs output_bit"]),
        (None, "output_bit = 8", "", ["spel: ", "needs output_bit"]),
        (None, "output_bit = 8", "output_bit = 8\naxis_start_mm = 3.0", ["spel: ", "need axis_start_mm"]),
        (None, BY_S[0], BY_S[1], ["spel: ", 'dispenser = "s" ', 'motion = "curve"']),
        (None, "largest_speed_mm_s = 100.0", "largest_speed_mm_s = nan", ["motion.largest_speed_mm_s = nan", "finite"]),
        (None, "acceleration_mm_s2 = 200.0", "", ["motion.acceleration_mm_s2 is missing"]),
        (None, SECOND_POINT, "", ["taught: give at least 3 values, not 2"]),
        ("plunger", "# diameter_mm = 20.0 ", "diameter_mm = 20.0\nmm3_per_mm = 3.0 #", ["plunger.mm3_per_mm: no such"]),
        ("plunger", "# diameter_mm = 20.0 ", "#", ["plunger.diameter_mm is missing"]),
        ("urscript", "# port = 0", "port = 2", ["port is 2: give 0 or 1"]),
        ("urscript", "# full_flow_mm3_s = 1000.0", "#", [ONLY_ANALOG]),
        ("urscript", '# dispenser = "analog"', 'dispenser = "digital"', [ONLY_ANALOG]),
        ("urscript", "# port = 0", BY_A_VECTOR, ["rotation_vector_rad: no such key"]),
    ],
)
def test_a_fault_is_named_by_key_value_and_remedy(tmp_path, table, old, new, named):
    """What is wrong alone, or does not go together; with a table of the example brought to life, or none."""
    changes = [] if table is None else [it for it in uncommented(table) if not it[0].startswith(old.strip())]
    with pytest.raises(InputError) as fault:
        read(tmp_path, (old, new), *changes, *([("output_bit = 8", "")] if new == BY_S[1] else []))
    for words in ["cell.toml", *named]:
        assert words in str(fault.value)


def test_what_a_language_needs_is_told_apart(tmp_path):
    cell = read(tmp_path)
    assert [cell.missing_for(kind) for kind in LANGUAGES] == [None, None, None, "gcode", "urscript"]
    on_z = read(
        tmp_path,
        *uncommented("plunger", "gcode"),
        ('dispenser = "output"', 'dispenser = "z"'),
        ("output_bit = 8", "axis_start_mm = -20.0"),
    )
    assert on_z.missing_for("spel") is None
    assert on_z.missing_for("gcode") is None
    no_plunger = on_z.model_copy(update={"plunger": None})
    assert (no_plunger.missing_for("spel"), no_plunger.missing_for("gcode")) == ("plunger", "plunger")
