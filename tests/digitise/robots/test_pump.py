"""A pump by a scale: what programs ask for, how well it is known, and how long they wait."""

from pathlib import Path

import numpy as np
import pytest

from digitise.robots.cell import Pump, PumpTable, read_pump
from digitise.robots.programs import gcode_text, table_text, urscript_text
from digitise.robots.robot_path import place_path
from digitise.robots.spel import spel_text
from sealtwin.core.errors import InputError
from tests.support.robot_cells import cell, trajectory
from tests.support.robot_readers import read_gcode

HEAD = "asked_mm3_s,weighed_g,time_s,delay_s\n"
GIVES = 0.8  # Of what it is asked for


def pump(folder: Path, rows: str = "", head: str = HEAD) -> PumpTable:
    """A pump that gives four fifths, weighed twice at three flows, unless ``rows`` say otherwise."""
    for asked in () if rows else (10, 100, 1000):
        for off in (0.99, 1.01):
            rows += f"{asked},{GIVES * asked * 1.69e-3 * 20 * off:.9g},20,0.4\n"
    (folder / "pump.csv").write_text(head + rows, encoding="utf-8")
    return read_pump(Pump(file=Path("pump.csv"), density_kg_m3=1690.0), folder)


def test_it_is_asked_for_more_where_it_gives_less(tmp_path):
    table = pump(tmp_path)
    assert table.asked_for(np.array([0.0, 8.0, 40.0, 800.0])) == pytest.approx([0, 10, 50, 1000])
    # Three pairs that are 1 % to either side: s = sqrt(2) %, three degrees of freedom, two of each.
    assert table.error_95 == pytest.approx(3.182 * 0.01, rel=1e-3)


@pytest.mark.parametrize("wanted", [7.9, 801.0])
def test_a_flow_that_was_not_weighed_is_refused(tmp_path, wanted):
    with pytest.raises(InputError, match=r"pump\.csv: the path needs .* calibrated only from 8 to 800"):
        pump(tmp_path).asked_for(np.array([0.0, wanted]))


@pytest.mark.parametrize(
    ("rows", "says"),
    [
        ("10,1,20,0\n20,2,20,0\n30,3,20,0\n40,4,20,0\n", "a single weighing shows no scatter"),
        ("10,1,20,0\n10,1,20,0\n20,1,20,0\n20,1,20,0\n", "at a request of 20 mm³/s the pump gave"),
        ("10,1,20,0\n10,1,20,0\n20,two,20,0\n20,1,20,0\n", "row 4, column weighed_g: 'two' is not a number"),
        ("10,0.34,0.33,0\n10,0.34,0.33,0\n20,0.68,0.33,0\n20,0.68,0.33,0\n", "gives 61 times .* time_s in seconds"),
        ("10,1,20,99\n10,1,20,0\n20,2,20,0\n20,2,20,0\n", "row 2, column delay_s: 99; 0 to 30 is allowed"),
    ],
)
def test_a_fault_is_named_by_row_and_value(tmp_path, rows, says):
    with pytest.raises(InputError, match=says):
        pump(tmp_path, rows)


@pytest.mark.parametrize(("off", "warned"), [(0.01, False), (0.05, True), (0.25, True)])
def test_a_pump_that_scatters_earns_a_warning_with_the_figure(tmp_path, off, warned):
    path = place_path(trajectory(), cell(), "cell.toml", scattered(tmp_path, off))
    warnings = [warning for warning in path.warnings if warning.startswith("pump.csv:")]
    # Two to either side of each of two flows: s = sqrt(2) off, two degrees of freedom, two of each.
    assert [
        f"scatter by {np.sqrt(2) * off:.0%}" in one and f"known to {4.303 * off:.0%}" in one for one in warnings
    ] == ([True] * warned)


def test_equal_weighings_show_no_interval(tmp_path):
    """A scale with a coarse digit. Broken on purpose, the path's flow is known to 0 %, without a word."""
    table = scattered(tmp_path, 0.0)
    assert table.error_95 is None
    assert "show no scatter" in table.warnings[0]


def scattered(folder: Path, off: float) -> PumpTable:
    """A pump that obeys, weighed twice at the path's flow and at three times it, each time ``off`` its mean."""
    flow = trajectory().flow_mm3_s.max()
    weighed = [(asked, asked * 1.69e-3 * 20 * (1 + sign * off)) for asked in (flow, 3 * flow) for sign in (-1, 1)]
    return pump(folder, "".join(f"{asked:.12g},{gram:.12g},20,0\n" for asked, gram in weighed))


def test_each_program_asks_for_what_gives_the_paths_flow_and_waits_once(tmp_path):
    it, table = trajectory(lead_in_mm=5.0), pump(tmp_path)
    flow = it.flow_mm3_s.max()
    path = place_path(it, cell(gcode={}), "cell.toml", table)
    assert path.wanted_mm3 == pytest.approx(it.dispensed_mm3)
    assert path.trajectory.flow_mm3_s == pytest.approx(it.flow_mm3_s / GIVES)
    assert path.hold_s == pytest.approx(0.4)
    rows = np.array([line.split(",") for line in table_text(path).splitlines()[1:]], dtype=float)
    assert len(rows) == len(it.t_s) + 1
    waiting = rows[it.giving.start]
    assert (waiting[5], waiting[6]) == pytest.approx((0.0, flow / GIVES), abs=1e-5)
    assert rows[it.giving.start + 1, 0] - waiting[0] == pytest.approx(0.4, abs=1e-5)
    script, program = urscript_text(path), spel_text(path)
    assert script.count("sleep(0.400)") == 1
    assert program.count("  Wait 0.400") == 1
    # Both arms stop before they wait.
    assert "CP" not in program[: program.index("  On 8")].splitlines()[-1]
    assert (
        "r=0.0000000"
        in script[: script.index("  set_standard_analog_out(0, 0.0", script.index("movep"))].splitlines()[-1]
    )
    motions = read_gcode(gcode_text(path))
    given = sum(motion.given for motion in motions) * np.pi * 10.0**2
    assert given == pytest.approx((it.dispensed_mm3 + 0.4 * flow) / GIVES, rel=1e-4)
