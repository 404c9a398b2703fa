"""The fast model's fill in time: conservation of volume, states of rest, a similarity solution and the fall."""

import numpy as np
import pytest

from sealtwin.core.records import Outline, Solid, Trajectory
from simulate.settings import SampleSlope
from simulate.slot.fill import HerschelBulkley, fill, supplied_mm3
from tests.support.small_fluids import path, slot

PASTE = HerschelBulkley(1690.0, 7.0, 0.3)


def poured_in_the_middle(crack: tuple[Solid, Outline], volume_mm3: float, within_s: float = 0.05) -> Trajectory:
    _, outline = crack
    place_mm = np.array([*outline.centreline_mm[len(outline.centreline_mm) // 2], 3.0])
    t_s, s_mm = np.array([0.0, within_s]), np.full(2, outline.length_mm / 2)
    return Trajectory(t_s, np.tile(place_mm, (2, 1)), s_mm, 0 * t_s, np.array([volume_mm3 / within_s, 0.0]))


@pytest.mark.parametrize(("stress_pa", "index"), [(0.0, 1.0), (3.0, 0.5), (40.0, 1.0)])
def test_the_dispensed_volume_is_conserved_including_sealant_in_flight(stress_pa: float, index: float):
    """Overfilled cracks and steep samples are included. A fall takes 57 ms of a pour of 7 s."""
    crack, paste = slot(40.0), HerschelBulkley(1690.0, stress_pa, 0.3, index)
    for volume_ml, slope in ((1.0, SampleSlope()), (3.0, SampleSlope(gradient_deg=8.0, crossfall_deg=3.0))):
        trajectory = path(crack[1], volume_ml, trim_mm=6.0)
        settled, flying = (
            fill(*crack, trajectory, paste, nozzle_mm=2.4, settle_s=settle_s, slope=slope) for settle_s in (2.0, 0.0)
        )
        assert settled.mass_error < 1e-12
        assert settled.area_mm2.min() > -1e-9
        assert 0 < flying.in_flight_mm3 < 0.02 * flying.dispensed_mm3
        assert flying.mass_error < 1e-12


@pytest.mark.parametrize("gradient_deg", [0.0, 4.0, -4.0])
def test_the_level_of_a_liquid_at_rest_is_horizontal(gradient_deg):
    crack, paste = slot(40.0), HerschelBulkley(1690.0, 0.0, 0.05)
    trajectory, slope = path(crack[1], 1.0, trim_mm=6.0), SampleSlope(gradient_deg=gradient_deg)
    filled = fill(*crack, trajectory, paste, nozzle_mm=2.4, settle_s=60.0, slope=slope)
    rises = np.diff(filled.level_mm) / filled.sections.step_mm
    np.testing.assert_allclose(rises, -np.tan(np.radians(gradient_deg)), atol=1e-3)


def test_paste_at_rest_has_the_steepest_slope_that_its_walls_support():
    """The slope is tau P / rho g A, with corners rounded, on both sides of the pour.

    Cells under the nozzle, within its radius and 8 tau / rho g, are left out, since paste there supports itself.
    """
    crack = slot(80.0, 4.0, 20.0)
    filled = fill(*crack, poured_in_the_middle(crack, 1800.0), PASTE, nozzle_mm=2.4, settle_s=600.0)
    sections = filled.sections
    height_mm = sections.height_mm(filled.area_mm2)
    radius_mm = sections.holding_mm(filled.area_mm2, sections.wetted_mm(height_mm))
    steepest = PASTE.yield_stress_pa / (1690.0 * 9.81e-3) / np.maximum(radius_mm, 1e-6)
    rises = np.abs(np.diff(filled.level_mm) / sections.step_mm)
    upper = np.where(filled.level_mm[1:] > filled.level_mm[:-1], steepest[1:], steepest[:-1])
    beside = np.abs((sections.s_mm[1:] + sections.s_mm[:-1]) / 2 - 40.0) > 6.0
    deep = beside & (filled.area_mm2[1:] > 20.0) & (filled.area_mm2[:-1] > 20.0)
    # The flow ends slowly, so that up to 0.02 of the slope remains.
    assert (rises[deep] <= 1.03 * upper[deep]).all()
    np.testing.assert_allclose(rises[deep], upper[deep], rtol=0.03)


def test_a_newtonian_fluid_spreads_as_in_barenblatts_similarity_solution():
    """Between plates h_t = k (h h_x)_x, k = rho g w^2 / 12 mu: a parabola whose ends move as t^(1/3)."""
    width_mm, viscosity, volume_mm3, after_s = 0.4, 0.5, 240.0, 20.0
    crack = slot(120.0, width_mm, 60.0, "vertical", 0.0)
    paste = HerschelBulkley(1690.0, 0.0, viscosity)
    pour = poured_in_the_middle(crack, volume_mm3)
    filled = fill(*crack, pour, paste, nozzle_mm=0.7, settle_s=after_s, cells=120)
    k = 1690.0 * 9.81e-3 * width_mm**2 / (12 * viscosity)
    # h = (C - x^2 / 12 tau^(2/3)) / tau^(1/3) with tau = k t / 2, and 4 sqrt(12) C^(3/2) / 3 the area.
    tau = k * after_s / 2
    c = (3 * volume_mm3 / width_mm / (4 * np.sqrt(12.0))) ** (2 / 3)
    front_mm = np.sqrt(12 * c) * tau ** (1 / 3)
    x = filled.sections.s_mm - 60.0
    wanted_mm = np.maximum(c - x**2 / (12 * tau ** (2 / 3)), 0.0) / tau ** (1 / 3)
    height_mm = filled.level_mm - filled.sections.bottom_mm
    assert 10.0 < front_mm < 55.0
    # The floor adds drag of about w / h, most of all at the front.
    middle = np.abs(x) < 0.7 * front_mm
    np.testing.assert_allclose(height_mm[middle], wanted_mm[middle], rtol=0.02)
    assert np.abs(x[height_mm > 0.3]).max() == pytest.approx(front_mm, rel=0.03)


EDGES_MM = np.linspace(0.0, 40.0, 81)
STRAIGHT_DOWN = np.array([0.0, 1.0])


def landed(trajectory: Trajectory, times_s: np.ndarray, down: np.ndarray = STRAIGHT_DOWN) -> np.ndarray:
    return supplied_mm3(trajectory, times_s, EDGES_MM, nozzle_mm=2.4, surface_mm=-16.0, down=down)


def test_sealant_falls_along_the_plumb_line_on_level_and_sloping_samples():
    """On a slope of 30 degrees sealant lands over 5 mm downhill of the nozzle."""
    still = poured_in_the_middle(slot(40.0), 200.0, within_s=2.0)
    middle_mm, times_s = (EDGES_MM[1:] + EDGES_MM[:-1]) / 2, np.linspace(0.0, 3.0, 100)
    upright = landed(still, times_s).sum(axis=0)
    assert upright @ middle_mm / upright.sum() == pytest.approx(20.0, abs=1e-9)
    assert np.ptp(middle_mm[upright > 0]) <= 2.4 + 0.5
    leaning = landed(still, times_s, np.array([0.5, np.sqrt(0.75)])).sum(axis=0)
    assert leaning @ middle_mm / leaning.sum() > 25.0
