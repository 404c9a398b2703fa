"""A sample that does not lie level: gravity turns in its frame, and all that falls or settles follows."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from sealtwin.core.errors import InputError
from sealtwin.core.records import Bed
from simulate.profile import measure_profile, settled
from simulate.settings import LEVEL, Fluid, Nozzle, SampleSlope, Solver, particle_volume
from simulate.setup_checks import check_fit
from tests.support.small_fluids import path, pour, slot
from tests.support.tanks import Pit, Tank, settled_mm

FALLS_BACK = SampleSlope(gradient_deg=10.0)


@pytest.mark.parametrize(
    ("slope", "along"),
    [
        (LEVEL, (0.0, 0.0, -1.0)),
        (SampleSlope(gradient_deg=45.0), (-1.0, 0.0, -1.0)),
        (SampleSlope(crossfall_deg=-45.0), (0.0, 1.0, -1.0)),
        (SampleSlope(gradient_deg=45.0, crossfall_deg=45.0), (-1.0, -1.0, -1.0)),
    ],
)
def test_down_is_the_plumb_line_in_the_samples_frame(slope, along):
    """Rising towards +x, sealant runs towards -x. Seen to fail with the signs or the axes exchanged."""
    assert slope.down == pytest.approx(np.array(along) / np.linalg.norm(along))
    assert slope.level == (slope is LEVEL)
    # The same bits as before for a level sample: no -0.0.
    assert not np.signbit(LEVEL.down[:2]).any()


@pytest.mark.parametrize("table", [{"gradient_deg": 45.1}, {"crossfall_deg": -46.0}, {"slope_deg": 1.0}])
def test_a_slope_beyond_its_bounds_is_refused(table):
    with pytest.raises(ValidationError):
        SampleSlope.model_validate(table)


@pytest.mark.slow
def test_the_surface_of_a_settled_liquid_is_square_to_gravity():
    """A plane through the topmost particles, away from the walls; the mean of some moments, which scatters by 0.5."""
    pit = Pit(14.0, 9.0, 18.0)
    sizes: dict[str, Any] = {"radius_mm": 0.5, "step_s": 1.8e-3}
    # At rest in a level tank: a lattice bursts.
    slope = SampleSlope(gradient_deg=6.0, crossfall_deg=-4.0)
    fluid = settled_mm(pit, height_mm=6.0, **sizes)
    tank = Tank.of(pit, fluid, viscosity_mm2_s=100.0, slope=slope, **sizes)
    tank.wait(0.5)
    seen = [plane_deg(tank) for number, _ in enumerate(tank.run(0.6)) if number % 15 == 0]
    assert np.mean(seen, axis=0) == pytest.approx((-6.0, 4.0), abs=0.8)


def plane_deg(tank: Tank) -> tuple[float, float]:
    """Angles with x and with y of the plane through the topmost particle of each column of 1 mm."""
    size = np.array([tank.pit.length_mm, tank.pit.width_mm])
    place = tank.place_mm
    column = np.floor(place[:, :2] + [0.0, size[1] / 2]).astype(int)
    top = np.full(column.max(axis=0) + 1, -np.inf)
    np.maximum.at(top, (column[:, 0], column[:, 1]), place[:, 2])
    middle = np.argwhere(np.isfinite(top)) + 0.5
    inner = (np.minimum(middle, size - middle) > 1.5).all(axis=1)
    axes = np.column_stack([middle[inner], np.ones(inner.sum())])
    along, across, _ = np.linalg.lstsq(axes, top[np.isfinite(top)][inner], rcond=None)[0]
    return float(np.degrees(np.arctan(along))), float(np.degrees(np.arctan(across)))


def test_sealant_runs_to_the_low_end():
    """On a gradient the low end fills and the high one empties.

    The level counts square to the face: at rest it leaves the face by the gradient.
    """
    crack = slot(30.0, depth_mm=8.0)
    way = path(crack[1], 0.5, speed_mm_s=30.0)
    fluid = Fluid(U=3.0, D_cm=0.03, freeze_after_s="never")
    sloping = pour(crack, way, fluid, slope=FALLS_BACK, radius_mm=0.7, settle_s=1.5)
    assert sloping.settings["sample"] == {"crossfall_deg": 0.0, "gradient_deg": 10.0}
    assert sloping.health.flat_mm is None, "its level at rest slopes too"
    profile = measure_profile(sloping, crack[1], crack[0])
    inner = (profile.s_mm > 4) & (profile.s_mm < 26)
    across = np.diff(crack[1].centreline_mm[[0, -1], 0])[0]
    assert across > 0, "s counts along +x"
    slope = np.polyfit(profile.s_mm[inner], profile.level_mm[inner], 1)[0]
    assert np.degrees(np.arctan(slope)) == pytest.approx(-10.0, abs=1.0)


def test_a_jet_in_flight_is_told_by_its_speed_along_gravity():
    """A particle that flies sideways down a steep slope is in flight, and on a level sample it is spray."""
    position_mm = np.array([[3.0, 0.0, -15.6], [3.0, 0.0, -10.0]])
    velocity_mm_s = np.array([[0.0, 0.0, 0.0], [-300.0, 0.0, -80.0]])
    level = Bed(position_mm, velocity_mm_s, np.zeros(2, bool), 0.4, particle_volume(0.4), LEVEL.table)
    assert settled(level, np.full(2, 16.0)).tolist() == [True, True]
    steep = replace(level, settings=SampleSlope(gradient_deg=40.0).table)
    assert settled(steep, np.full(2, 16.0)).tolist() == [True, False]


def test_what_would_freeze_in_the_air_is_refused_by_the_fall_on_the_slope():
    """16 mm square to the face take sqrt(2 h / g cos) s: 0.057 s level, 0.068 at 45 degrees."""
    solid, outline = slot()
    fluid = Fluid(U=30.0, freeze_after_s=0.06)
    check_fit(outline, solid, fluid, Solver(), Nozzle())
    with pytest.raises(InputError, match=r"in 0\.068 s"):
        check_fit(outline, solid, fluid, Solver(), Nozzle(), SampleSlope(gradient_deg=45.0))
