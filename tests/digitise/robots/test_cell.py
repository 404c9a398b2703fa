"""A cell file, the robot's frame and its pump: known rotations and flows, and refusals by key, row and value."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from digitise.robots.cell import LANGUAGES, Pump, PumpTable, RobotCell, RobotFrame, fit_frame, read_pump
from digitise.robots.programs import Urscript, gcode_text, table_text, urscript_text
from digitise.robots.robot_path import place_path
from digitise.robots.spel import spel_text
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats
from sealtwin.core.settings import read_settings
from sealtwin.trial.starter_files import CELL
from tests.support.robot_cells import TAUGHT_CELL, cell, trajectory
from tests.support.robot_readers import read_gcode


def read(tmp_path, *changes: tuple[str, str]) -> RobotCell:
    text = TAUGHT_CELL
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    (tmp_path / "cell.toml").write_text(text, encoding="utf-8")
    return read_settings(RobotCell, tmp_path / "cell.toml", name="cell file", starter="")


def uncommented(*tables: str) -> list[tuple[str, str]]:
    """Changes that uncomment tables of the example."""
    lines, example, live = [], CELL.splitlines(), False
    for line in example:
        if line.startswith(("[", "# [")):
            live = any(line.startswith(f"# [{table}]") for table in tables)
        if live and line.startswith("# "):
            lines.append((line, line[2:]))
    return lines


def test_the_example_cell_file_is_valid_with_all_tables_uncommented(tmp_path):
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
        (None, "low_mm = [150.0, -150.0, 50.0]", "low_mm = [150.0, -150.0]", ["reach.low_mm: "]),
        (None, "robot_mm = [250.0, 80.0, 55.0]", "robot_mm = [250.0, 80.0, 5e9]", ["taught.1.robot_mm.2", "10000"]),
        (None, '["spel", "csv"]', '["gcode"]', ['formats has "gcode", but there is no [gcode] table']),
        (None, '["spel", "csv"]', '["krl"]', ["formats.0 = 'krl'", "urscript"]),
        (None, "output_bit = 8", "", ["spel: ", "needs output_bit"]),
        (None, "output_bit = 8", "output_bit = 8\naxis_start_mm = 3.0", ["spel: ", "needs axis_start_mm"]),
        (None, BY_S[0], BY_S[1], ["spel: ", 'dispenser = "s" ', 'motion = "curve"']),
        (None, SECOND_POINT, "", ["taught: "]),
        ("plunger", "# diameter_mm = 20.0 ", "#", ["plunger.diameter_mm is missing"]),
        ("urscript", "# port = 0", "port = 2", ["port is 2, but the standard analog outputs are 0 and 1"]),
        ("urscript", '# dispenser = "analog"', 'dispenser = "digital"', [ONLY_ANALOG]),
        ("urscript", "# port = 0", BY_A_VECTOR, ["rotation_vector_rad: no such key"]),
    ],
)
def test_the_error_for_a_faulty_cell_file_names_the_key_or_the_remedy(tmp_path, table, old, new, named):
    """The cases are wrong values and wrong combinations, with or without an uncommented table of the example."""
    changes = [] if table is None else [it for it in uncommented(table) if not it[0].startswith(old.strip())]
    with pytest.raises(InputError, match=r"cell\.toml") as fault:
        read(tmp_path, (old, new), *changes, *([("output_bit = 8", "")] if new == BY_S[1] else []))
    assert all(words in str(fault.value) for words in named)


CORNERS = np.array([[0.0, 0.0], [160.0, 0.0], [0.0, 40.0]])
FOUR = np.vstack([CORNERS, [[160.0, 40.0]]])
NEARLY_A_LINE = np.array([[0.0, 0.0], [80.0, 1.0], [160.0, 0.0]])
SHIFT = np.array([312.0, -81.0, 55.0])


def seen(sample_mm: Floats, turn_deg: float = 130.0, tip_deg: float = 2.0) -> Floats:
    """The points as a robot finds them: turned about z, tipped, shifted."""
    flat_mm = np.column_stack([sample_mm, np.zeros(len(sample_mm))])
    return Rotation.from_euler("zx", [turn_deg, tip_deg], degrees=True).apply(flat_mm) + SHIFT


def fitted(sample_mm: Floats, robot_mm: Floats, limit_mm: float = 0.5) -> RobotFrame:
    return fit_frame(sample_mm, robot_mm, limit_mm=limit_mm, where="cell.toml")


@settings(max_examples=30)
@given(turn=st.floats(-180, 180), tip=st.floats(-60, 60), seed=st.integers(0, 99))
def test_any_rotation_and_shift_of_the_sample_is_found_exactly(turn, tip, seed):
    """Tolerance: rounding of coordinates of some hundred millimetres. Heights are along the face's normal."""
    frame = fitted(CORNERS, seen(CORNERS, turn, tip))
    assert frame.residual_mm.max() < 1e-9
    assert (frame.scale, np.linalg.det(frame.rotation)) == pytest.approx((1.0, 1.0), abs=1e-12)
    point = np.random.default_rng(seed).uniform(-50, 200, (5, 2))
    flat = np.column_stack([point, np.zeros(5)])
    assert np.abs(frame.to_robot_mm(flat) - seen(point, turn, tip)).max() < 1e-9
    lifted = frame.to_robot_mm(flat + np.array([0, 0, 3.0]))
    assert lifted - frame.to_robot_mm(flat) == pytest.approx(np.tile(3.0 * frame.normal, (5, 1)))


@pytest.mark.parametrize(
    ("sample_mm", "robot_mm", "says"),
    [
        (CORNERS, seen(CORNERS * 1.013), r"1\.013 times as far apart"),
        (CORNERS, seen(CORNERS * [1, -1], tip_deg=0.0), "mirrored"),
        # The arm hangs upside down.
        (CORNERS, seen(CORNERS, tip_deg=0.0) * [1, -1, -1], "whose z points up"),
        (CORNERS, seen(CORNERS[[0, 2, 1]]), r"do not fit .* are 0\.6\d* times"),
        (
            FOUR,
            seen(FOUR) + np.outer([0, 0, 0, 6], [1, 0, 0]),
            r"point 4, .*\[160, 40\], .*4\.04 mm off, and at most 0.5",
        ),
        (NEARLY_A_LINE, seen(NEARLY_A_LINE), r"0\.47 mm \(RMS\) of a line"),
        (np.zeros((3, 2)), seen(np.zeros((3, 2))), r"within 0 mm \(RMS\) of a line"),
    ],
)
def test_taught_points_without_a_rigid_fit_to_the_sample_are_refused(sample_mm, robot_mm, says):
    with pytest.raises(InputError, match=r"cell\.toml: .*" + says):
        fitted(sample_mm, robot_mm)


HEAD = "asked_mm3_s,weighed_g,time_s,delay_s\n"
GIVES = 0.8  # Share of the asked flow


def pump(folder: Path, rows: str = "", head: str = HEAD) -> PumpTable:
    """A pump that gives four fifths, weighed twice at three flows, unless ``rows`` say otherwise."""
    for asked in () if rows else (10, 100, 1000):
        for off in (0.99, 1.01):
            rows += f"{asked},{GIVES * asked * 1.69e-3 * 20 * off:.9g},20,0.4\n"
    (folder / "pump.csv").write_text(head + rows, encoding="utf-8")
    return read_pump(Pump(file=Path("pump.csv"), density_kg_m3=1690.0), folder)


def test_the_commanded_pump_flow_is_corrected_only_within_the_weighed_range(tmp_path):
    """Three pairs are 1 % off their mean, so that s = sqrt(2) %, with three degrees of freedom and t = 3.182."""
    table = pump(tmp_path)
    assert table.asked_for(np.array([0.0, 8.0, 40.0, 800.0])) == pytest.approx([0, 10, 50, 1000])
    assert table.error_95 == pytest.approx(3.182 * 0.01, rel=1e-3)
    for flow_mm3_s in (7.9, 801.0):
        with pytest.raises(InputError, match=r"pump\.csv: the path needs .* from 8 to 800"):
            table.asked_for(np.array([0.0, flow_mm3_s]))


@pytest.mark.parametrize(
    ("rows", "says"),
    [
        ("10,1,20,0\n20,2,20,0\n30,3,20,0\n40,4,20,0\n", "a single weighing"),
        ("10,1,20,0\n10,1,20,0\n20,1,20,0\n20,1,20,0\n", "20 mm³/s"),
        ("10,1,20,0\n10,1,20,0\n20,two,20,0\n20,1,20,0\n", "row 4, column weighed_g: 'two'"),
        ("10,0.34,0.33,0\n10,0.34,0.33,0\n20,0.68,0.33,0\n20,0.68,0.33,0\n", "61 times .* time_s"),
        ("10,1,20,99\n10,1,20,0\n20,2,20,0\n20,2,20,0\n", "row 2, column delay_s: 99 "),
    ],
)
def test_a_faulty_pump_file_is_refused_with_the_reason(tmp_path, rows, says):
    with pytest.raises(InputError, match=says):
        pump(tmp_path, rows)


@pytest.mark.parametrize(("off", "words"), [(0.01, []), (0.25, ["35%", "108%"])])
def test_a_pump_with_large_scatter_gives_a_warning_with_the_error_in_percent(tmp_path, off, words):
    """Two pairs are ``off`` to either side: s = sqrt(2) off, and with two degrees of freedom the error is 4.303 off."""
    path = place_path(trajectory(), cell(), "cell.toml", scattered(tmp_path, off))
    warnings = [warning for warning in path.warnings if warning.startswith("pump.csv:")]
    assert len(warnings) == bool(words)
    assert all(word in warnings[0] for word in words)


def test_equal_weighings_give_a_warning_instead_of_an_error_interval(tmp_path):
    """The scale has a coarse last digit. Broken on purpose, the flow has an error of 0 % and no warning."""
    table = scattered(tmp_path, 0.0)
    assert table.error_95 is None
    assert "show no scatter" in table.warnings[0]


def scattered(folder: Path, off: float) -> PumpTable:
    """A pump that gives the asked flow, weighed twice at the path's flow and at three times it, ``off`` its mean."""
    flow = trajectory().flow_mm3_s.max()
    weighed = [(asked, asked * 1.69e-3 * 20 * (1 + sign * off)) for asked in (flow, 3 * flow) for sign in (-1, 1)]
    return pump(folder, "".join(f"{asked:.12g},{gram:.12g},20,0\n" for asked, gram in weighed))


def test_each_robot_program_commands_the_corrected_flow_after_one_wait(tmp_path):
    it, table = trajectory(lead_in_mm=5.0), pump(tmp_path)
    flow = it.flow_mm3_s.max()
    path = place_path(it, cell(gcode={}), "cell.toml", table)
    assert path.wanted_mm3 == pytest.approx(it.dispensed_mm3)
    assert path.trajectory.flow_mm3_s == pytest.approx(it.flow_mm3_s / GIVES)
    assert path.hold_s == pytest.approx(0.4)
    rows = np.array([line.split(",") for line in table_text(path).splitlines()[1:]], dtype=float)
    assert len(rows) == len(it.t_s) + 1
    waiting, moving = rows[it.giving.start : it.giving.start + 2]
    assert (waiting[5], waiting[6], moving[0] - waiting[0]) == pytest.approx((0.0, flow / GIVES, 0.4), abs=1e-5)
    script, program = urscript_text(path), spel_text(path)
    assert (script.count("sleep(0.400)"), program.count("  Wait 0.400")) == (1, 1)
    # Both arms stop before they wait.
    assert "CP" not in program[: program.index("  On 8")].splitlines()[-1]
    begun = script.index("  set_standard_analog_out(0, 0.0", script.index("movep"))
    assert "r=0.0000000" in script[:begun].splitlines()[-1]
    motions = read_gcode(gcode_text(path))
    volume_mm3 = sum(motion.given for motion in motions) * np.pi * 10.0**2
    assert volume_mm3 == pytest.approx((it.dispensed_mm3 + 0.4 * flow) / GIVES, rel=1e-4)
