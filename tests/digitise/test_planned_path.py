"""A path whose speed and flow come from a table."""

from pathlib import Path

import numpy as np
import pytest

from digitise.planned_path import COLUMNS, planned_path, read_planned_path
from digitise.settings import CrackShape, NozzlePath
from digitise.solid.build_solid import build_solid
from digitise.trajectory import plan_trajectory, with_path
from sealtwin.core.errors import InputError
from sealtwin.core.files import write_table
from simulate.setup.release_schedule import plan_releases
from simulate.slot.fill import supplied_mm3
from tests.support.shapes import straight_slot

OUTLINE = straight_slot(40.0, 4.0)
SOLID = build_solid(OUTLINE, CrackShape(depth_mm=10.0, tilt="vertical"))
BY_SECTIONS = plan_trajectory(OUTLINE, NozzlePath(trim_mm=5.0, flow="cross_section"), 1600.0, SOLID.sections)
ROWS = np.array(
    [
        [0.0, 5.0, 0.0, 3.0, 0.5, 300.0],
        [2.0, 6.0, 0.0, 3.0, 14 / 3, 120.0],
        [5.0, 20.0, 0.0, 3.0, 15 / 4, 60.0],
        [9.0, 35.0, 0.0, 3.0, 0.0, 0.0],
    ]
)
"""A path that is slow at first, with a flow that falls."""


def written(folder, rows=ROWS):
    write_table(folder / "plan.csv", COLUMNS, np.array(rows))
    return folder / "plan.csv"


def test_a_trial_reads_the_path_table_beside_its_file(tmp_path):
    path = written(tmp_path)
    assert NozzlePath(plan=Path(path.name)).loaded(tmp_path) == NozzlePath(plan=read_planned_path(path))


def test_particles_and_the_fast_model_dispense_the_volume_of_the_path_table(tmp_path):
    """The volume is 300 x 2 + 120 x 3 + 60 x 4 mm3. Tolerance: 0.1 %; a particle is 0.03 %.

    Half of the sealant is dispensed while the nozzle moves over the first millimetre.
    """
    path = NozzlePath(plan=read_planned_path(written(tmp_path)))
    trajectory = plan_trajectory(OUTLINE, path)
    schedule = plan_releases(trajectory, 0.4, 2.4, seed=0)
    assert schedule.dispensed_mm3 == pytest.approx(1200.0, rel=1e-3)
    assert schedule.released[schedule.released.size * 2 // 9] == pytest.approx(schedule.particles / 2, rel=0.05)
    edges_mm, times_s = np.linspace(0, 40, 21), np.linspace(0, 20, 101)
    nozzle = {"nozzle_mm": 2.4, "surface_mm": -5.0, "down": np.array([0.0, 1.0])}
    landed = supplied_mm3(trajectory, times_s, edges_mm, **nozzle)
    assert landed.sum() == pytest.approx(1200.0, rel=1e-3)
    assert landed[:, :5].sum() == pytest.approx(600, rel=0.2)
    figures = with_path(SOLID, trajectory, OUTLINE, path).figures
    assert figures.sealant_mm3 == pytest.approx(1200.0)
    assert figures.path is not None
    assert figures.path.sealant_mm3_per_mm == pytest.approx((16.0, 600.0))


@pytest.mark.parametrize(
    ("row", "column", "value", "says"),
    [
        (1, 0, 0.0, "row 3: t_s is 0"),
        (3, 5, 5.0, "row 5: flow_mm3_s is 5"),
        (1, 4, 4.0, "row 3: speed_mm_s is 4"),
        (1, 5, -1.0, "row 3, column flow_mm3_s: -1"),
        (1, 1, 5.0, "row 2: x_mm is 5"),
        (2, 3, 0.0, "row 4, column z_mm: 0"),
    ],
)
def test_the_error_for_a_faulty_path_table_names_the_row(tmp_path, row, column, value, says):
    changed = ROWS.copy()
    changed[row, column] = value
    with pytest.raises(InputError, match=rf"plan\.csv, {says}"):
        read_planned_path(written(tmp_path, changed))


def test_a_path_table_off_the_crack_or_with_conflicting_settings_is_refused(tmp_path):
    path = NozzlePath(plan=read_planned_path(written(tmp_path, ROWS + np.array([0, 0, 9.0, 0, 0, 0]))))
    with pytest.raises(InputError, match=r"path\.plan, row 1: .* 9\.0 mm"):
        plan_trajectory(OUTLINE, path)
    with pytest.raises(InputError, match="Leave out trim_mm, speed_mm_s"):
        NozzlePath(plan=planned_path(BY_SECTIONS), speed_mm_s=5.0, trim_mm=3.0)
