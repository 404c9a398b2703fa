"""A path whose speed and flow come from a table."""

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
OWN = plan_trajectory(OUTLINE, NozzlePath(trim_mm=5.0, flow="cross_section"), SOLID.cavity_volume_mm3, SOLID.sections)


def rows():
    """A path that crawls at first, with a flow that falls."""
    t_s = np.array([0.0, 2.0, 5.0, 9.0])
    x_mm = np.array([5.0, 6.0, 20.0, 35.0])
    return np.column_stack(
        [t_s, x_mm, 0 * t_s, 0 * t_s + 3, [0.5, 14 / 3, 15 / 4, 0.0], [300.0, 120.0, 60.0, 0.0]]
    ).tolist()


def written(folder, rows):
    write_table(folder / "plan.csv", COLUMNS, np.array(rows))
    return folder / "plan.csv"


def test_a_trajectory_goes_through_a_file_unchanged(tmp_path):
    own = planned_path(OWN)
    columns = np.column_stack([getattr(own, name) for name in COLUMNS])
    path = NozzlePath(plan=written(tmp_path, columns)).loaded(tmp_path)
    again = plan_trajectory(OUTLINE, path)
    for name in ("t_s", "position_mm", "s_mm", "speed_mm_s", "flow_mm3_s"):
        np.testing.assert_allclose(getattr(again, name), getattr(OWN, name), atol=2e-5)


def test_the_volume_of_the_table_is_what_particles_and_the_fast_model_give(tmp_path):
    """300 x 2 + 120 x 3 + 60 x 4 mm3, to 0.1 %: a particle is 0.03 % of it."""
    trajectory = plan_trajectory(OUTLINE, NozzlePath(plan=read_planned_path(written(tmp_path, rows()))))
    assert trajectory.dispensed_mm3 == pytest.approx(1200.0, rel=1e-9)
    schedule = plan_releases(trajectory, 0.4, 2.4, seed=0)
    assert schedule.particles * schedule.dispensed_mm3 / schedule.particles == pytest.approx(1200.0, rel=1e-3)
    edges_mm, times_s = np.linspace(0, 40, 21), np.linspace(0, 20, 101)
    how = {"nozzle_mm": 2.4, "surface_mm": -5.0, "down": np.array([0.0, 1.0])}
    landed = supplied_mm3(trajectory, times_s, edges_mm, **how)
    assert landed.sum() == pytest.approx(1200.0, rel=1e-3)
    # Half of it comes while the nozzle crawls over the first millimetre.
    assert landed[:, :5].sum() == pytest.approx(600, rel=0.2)
    assert schedule.released[schedule.released.size * 2 // 9] == pytest.approx(schedule.particles / 2, rel=0.05)


def test_figures_of_the_path_are_those_of_the_plan(tmp_path):
    path = NozzlePath(plan=read_planned_path(written(tmp_path, rows())))
    figures = with_path(SOLID, plan_trajectory(OUTLINE, path), OUTLINE, path).figures
    assert figures.sealant_mm3 == pytest.approx(1200.0)
    assert figures.path is not None
    assert figures.path.sealant_mm3_per_mm == pytest.approx((16.0, 600.0))


@pytest.mark.parametrize(
    ("row", "column", "value", "says"),
    [
        (1, 0, 0.0, "row 3: t_s is 0; times must increase"),
        (3, 5, 5.0, "row 5: flow_mm3_s is 5"),
        (1, 4, 4.0, "row 3: speed_mm_s is 4; its places and times"),
        (1, 5, -1.0, "row 3, column flow_mm3_s: -1"),
        (1, 1, 5.0, "row 2: x_mm is 5; the nozzle does not move"),
        (2, 3, 0.0, "row 4, column z_mm: 0"),
    ],
)
def test_a_table_that_is_no_path_is_refused_with_its_row(tmp_path, row, column, value, says):
    changed = rows()
    changed[row][column] = value
    with pytest.raises(InputError) as refused:
        read_planned_path(written(tmp_path, changed))
    assert str(refused.value).startswith(f"{tmp_path / 'plan.csv'}, {says}")


def test_a_plan_beside_the_crack_is_refused(tmp_path):
    changed = np.array(rows())
    changed[:, 2] += 9.0
    path = NozzlePath(plan=read_planned_path(written(tmp_path, changed)))
    with pytest.raises(InputError, match=r"path\.plan, row 1: .* 9\.0 mm"):
        plan_trajectory(OUTLINE, path)


def test_other_settings_beside_a_plan_are_refused():
    with pytest.raises(InputError, match="leave out trim_mm, speed_mm_s"):
        NozzlePath(plan=planned_path(OWN), speed_mm_s=5.0, trim_mm=3.0)
