"""A weighed fill, compared with cavities whose volume at each level has a closed form."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from digitise.settings import CrackShape
from digitise.solid.build_solid import build_solid, with_weighed
from digitise.weighing.fill import WeighedFill
from digitise.weighing.fit_cavity import weigh
from sealtwin.core.errors import InputError
from tests.support.shapes import CLOSED, straight_slot

LENGTH_MM, WIDTH_MM, DEPTH_MM = 80.0, 3.0, 16.0
LEVELS_MM = (-12.0, -9.0, -6.0, -3.0, 0.0)


def slot(width_mm=WIDTH_MM):
    return straight_slot(LENGTH_MM, width_mm)


def shaped(tilt, depth_mm: Any = DEPTH_MM) -> CrackShape:
    return CrackShape(depth_mm=depth_mm, tilt=tilt)


def fill_of(floor_mm, mouth_mm, depth_mm=DEPTH_MM, levels_mm=LEVELS_MM, off_g=None, **liquid: Any):
    """Return the weighed fill of a straight trapezoid up to each level, without a meniscus."""
    height_mm = depth_mm + np.array(levels_mm)
    width_mm = floor_mm + (mouth_mm - floor_mm) * height_mm / depth_mm
    mass_g = LENGTH_MM * height_mm * (floor_mm + width_mm) / 2 * 1e-3 + (0 if off_g is None else np.array(off_g))
    liquid_figures: dict[str, Any] = {"density_kg_m3": 1000.0, "surface_tension_n_m": 0.0} | liquid
    return WeighedFill(mass_g=tuple(mass_g.tolist()), level_mm=levels_mm, **liquid_figures)


@pytest.mark.parametrize(
    ("tilt", "floor_mm", "mouth_mm"), [("flare", 3.0, 5.0), ("funnel", 1.4, 3.0), ("undercut", 5.0, 3.0)]
)
def test_error_free_weighings_give_wall_angle_depth_and_width(tilt, floor_mm, mouth_mm):
    angle_deg = np.degrees(np.arctan(abs(mouth_mm - floor_mm) / 2 / DEPTH_MM))
    fill = fill_of(floor_mm, mouth_mm, mass_sd_g=5e-3, level_sd_mm=0.02, flush_sd_mm=0.02)
    outline, shape, weighed = weigh(slot(), CrackShape(depth_mm=15.0, tilt=tilt), fill, 0.3, 2.0)
    assert (weighed.findings, shape.fill) == ((), None)
    assert weighed.wall_angle_deg == pytest.approx(angle_deg, abs=0.15)
    assert (weighed.depth_mm, weighed.width_mm) == pytest.approx((DEPTH_MM, WIDTH_MM), abs=0.1)
    solid = with_weighed(build_solid(outline, shape), weighed)
    true_mm3 = LENGTH_MM * DEPTH_MM * (floor_mm + mouth_mm) / 2
    assert solid.cavity_volume_mm3 == pytest.approx(true_mm3, rel=0.005)
    low_mm3, high_mm3 = solid.figures.cavity_volume_95_mm3 or (0.0, 0.0)
    assert low_mm3 < true_mm3 < high_mm3


def test_the_volume_interval_includes_the_correlation_of_width_angle_and_depth():
    """``steps`` is a root of the covariance: the volume is more certain than independent unknowns would make it."""
    _, _, weighed = weigh(slot(), shaped("flare"), fill_of(3.0, 5.0), 0.2, 1.0)
    root = np.array(weighed.steps)
    assert root == pytest.approx(np.tril(root))
    slope = np.radians(1) / np.cos(np.radians(weighed.wall_angle_deg)) ** 2
    gradient = np.array([LENGTH_MM * DEPTH_MM, LENGTH_MM * DEPTH_MM**2 * slope, LENGTH_MM * 5.0])
    alone_mm3 = np.sqrt((gradient**2 * (root**2).sum(axis=1)).sum())
    together_mm3 = np.linalg.norm(gradient @ root)
    low_mm3, high_mm3 = weighed.volume_95_mm3
    assert (high_mm3 - low_mm3) / 4 == pytest.approx(together_mm3, rel=0.1)
    assert together_mm3 < 0.4 * alone_mm3


@pytest.mark.parametrize(
    ("traced_mm", "gauged_mm", "off_g", "named"),
    [
        (2.0, DEPTH_MM, None, "width"),
        (3.0, 13.0, None, "depth_mm"),
        (3.0, DEPTH_MM, [0.0, 0.5, 0.0, -0.5, 0.0], "straight walls"),
    ],
)
def test_a_width_depth_or_shape_that_contradicts_the_fill_gives_a_warning(traced_mm, gauged_mm, off_g, named):
    fill = fill_of(3.0, 5.0, off_g=off_g, level_sd_mm=0.05, flush_sd_mm=0.05)
    _, _, weighed = weigh(slot(traced_mm), CrackShape(depth_mm=gauged_mm, tilt="flare"), fill, 0.1, 0.2)
    assert any(named in finding.text for finding in weighed.findings)


@pytest.mark.parametrize("factor", [1 / 28.35, 10.0])
def test_a_weighed_fill_that_fits_no_wall_angle_is_refused(factor):
    fill = fill_of(3.0, 5.0)
    wrong = fill.model_copy(update={"mass_g": tuple(factor * mass_g for mass_g in fill.mass_g or ())})
    with pytest.raises(InputError, match="grams"):
        weigh(slot(), shaped("flare"), wrong, 0.1, 0.2)


@pytest.mark.parametrize(("tilt", "angle_deg"), [("lean", 4.0), ("vertical", 20.0), ("funnel", 35.0)])
def test_an_undeclared_undercut_gives_a_warning_with_its_angle(tilt, angle_deg):
    """Before, the fit ended at a bound of 14 degrees, and from 25 degrees on there was no warning."""
    fill = fill_of(WIDTH_MM + 2 * DEPTH_MM * np.tan(np.radians(angle_deg)), WIDTH_MM)
    _, shape, weighed = weigh(slot(), shaped(tilt), fill, None, None)
    assert any(f"open downward by {angle_deg:.1f} degrees each" in finding.text for finding in weighed.findings)
    assert any('"undercut"' in finding.text for finding in weighed.findings)
    assert tilt != "funnel" or shape.wall_angle_deg == 0


def test_the_fit_includes_the_volume_of_an_undercut_around_the_tips():
    """A closed slot whose floor is wider all around has a closed form at each level."""
    slope, outline = 1.0 / DEPTH_MM, straight_slot(LENGTH_MM, WIDTH_MM, CLOSED)
    depth_mm = np.linspace(0.0, DEPTH_MM, 16_001)
    area_mm2 = LENGTH_MM * WIDTH_MM + 2 * (LENGTH_MM + WIDTH_MM) * slope * depth_mm + np.pi * (slope * depth_mm) ** 2
    starts = np.searchsorted(depth_mm, -np.array(LEVELS_MM))
    below_mm3 = [np.trapezoid(area_mm2[start:], depth_mm[start:]) for start in starts]
    mass_g = tuple(1e-3 * np.array(below_mm3))
    fill = WeighedFill(mass_g=mass_g, level_mm=LEVELS_MM, density_kg_m3=1000.0, surface_tension_n_m=0.0)
    _, _, weighed = weigh(outline, shaped("undercut"), fill, 0.01, 0.01)
    # Without the solid's own volumes the angle is 0.06 degrees too large.
    assert weighed.wall_angle_deg == pytest.approx(np.degrees(np.arctan(slope)), abs=0.02)


def test_walls_wrongly_declared_parallel_give_a_warning_without_changing_the_tilt():
    _, shape, weighed = weigh(slot(), CrackShape(depth_mm=DEPTH_MM), fill_of(1.4, 3.0, level_sd_mm=0.1), 0.1, 0.2)
    assert (shape.tilt, shape.wall_angle_deg, weighed.steps[1]) == ("lean", 11.0, (0.0, 0.0, 0.0))
    assert any("tilt" in finding.text for finding in weighed.findings)
    # No angle was fitted, so that the summary has none.
    assert str(weighed).startswith("width 2.3")
    assert "wall" not in str(weighed)
    _, _, sound = weigh(slot(), CrackShape(depth_mm=DEPTH_MM), fill_of(3.0, 3.0), 0.1, 0.2)
    assert sound.findings == ()


def test_all_depths_of_a_table_are_shifted_to_the_weighed_depth():
    _, moved, weighed = weigh(slot(), shaped("flare", ((0.0, 15.0), (80.0, 15.0))), fill_of(3.0, 5.0), 0.05, 2.0)
    assert np.array(moved.depth_mm) == pytest.approx(np.array([(0.0, weighed.depth_mm), (80.0, weighed.depth_mm)]))
    assert weighed.depth_mm == pytest.approx(DEPTH_MM, abs=0.1)


def test_a_weighing_does_not_change_the_width_of_an_outline_with_side_cracks():
    outline = replace(slot(), branches_kept=True)
    moved, _, weighed = weigh(outline, shaped("flare"), fill_of(3.2, 5.2), 0.3, 0.2)
    assert moved is outline
    assert weighed.steps[0] == (0.0, 0.0, 0.0)
