"""Volumes below a level, and the level of a volume, against prisms."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from digitise.settings import CrackShape
from digitise.solid.build_solid import build_solid
from sealtwin.core.records import Profile, Run
from sealtwin.core.run_figures import RunHealth
from tests.support.shapes import outline_between, straight_slot
from validate.metrics.volumes import balance_profile, fill_volumes, mass_balance
from validate.settings import Readings
from validate.uncertainty.meniscus import Mouth

LENGTH_MM, WIDTH_MM, DEPTH_MM = 80.0, 3.0, 16.0
OUTLINE = straight_slot(LENGTH_MM, WIDTH_MM)
TANGENT = np.tan(np.radians(5.5))


@cache
def solid(tilt: str = "vertical", angle_deg: float = 0.0):
    shape = {"depth_mm": DEPTH_MM, "tilt": tilt, "wall_angle_deg": angle_deg}
    return build_solid(OUTLINE, CrackShape.model_validate(shape))


def level(z_mm: float) -> Profile:
    return Profile(np.array([0.0, LENGTH_MM]), np.full(2, z_mm))


def test_volumes_of_a_half_filled_crack():
    plain = fill_volumes(level(-8), OUTLINE, solid(), 0, 80)
    assert (plain.underfill_mm3, plain.sealant_mm3, plain.fill_ratio) == pytest.approx((1920, 1920, 0.5))
    flare = fill_volumes(level(-8), OUTLINE, solid("flare", 5.5), 0, 80)
    assert flare.underfill_mm3 == pytest.approx(80 * 8 * (3 + 2 * 12 * TANGENT))
    assert flare.sealant_mm3 == pytest.approx(80 * 8 * (3 + 2 * 4 * TANGENT))
    funnel = fill_volumes(level(-16), OUTLINE, solid("funnel", 11.0), 0, 80)
    # Its walls meet between two levels.
    assert funnel.underfill_mm3 == pytest.approx(80 * 3**2 / (4 * np.tan(np.radians(11))), rel=1e-3)
    assert funnel.sealant_mm3 == pytest.approx(0.0, abs=1e-9)
    undercut = fill_volumes(level(-8), OUTLINE, solid("undercut", 5.5), 0, 80)
    assert undercut.underfill_mm3 == pytest.approx(80 * 8 * (3 + 2 * 4 * TANGENT))
    assert undercut.sealant_mm3 == pytest.approx(80 * 8 * (3 + 2 * 12 * TANGENT))
    heap = fill_volumes(level(2), OUTLINE, solid("lean", 11.0), 0, 80)
    full_mm3 = 80 * 3 * 16
    assert dict(heap) == pytest.approx(
        {"underfill_mm3": 0.0, "overfill_mm3": 480.0, "sealant_mm3": full_mm3 + 480.0, "fill_ratio": 1.0}
    )


def test_the_mouth_of_a_flare_is_wider_than_what_was_traced():
    for tilt, wider_mm in (("flare", 2 * 16 * TANGENT), ("funnel", 0.0), ("undercut", 0.0)):
        assert Mouth.of(OUTLINE, solid(tilt, 5.5), None).at_mm(np.array([40.0])) == pytest.approx(3 + wider_mm)


@pytest.mark.parametrize(
    ("tilt", "angle_deg", "volume_mm3", "level_mm"),
    [
        ("vertical", 0.0, 80 * 3 * 10, -6.0),
        ("vertical", 0.0, 80 * 3 * 20, 4.0),  # 80 x 3 x 16 below the face, the rest above its mouth
        ("flare", 5.5, 80 * (3 + 8 * TANGENT) * 8, -8.0),
        ("undercut", 5.5, 80 * (3 + 24 * TANGENT) * 8, -8.0),
    ],
)
def test_a_volume_that_lies_flat_in_the_crack_has_the_level_of_a_prism(tilt, angle_deg, volume_mm3, level_mm):
    sample = solid(tilt, angle_deg)
    baseline = balance_profile(volume_mm3, OUTLINE, sample)
    assert baseline.level_mm == pytest.approx(np.full(len(baseline.s_mm), level_mm), abs=1e-6)
    assert (baseline.s_mm[0], baseline.s_mm[-1]) == pytest.approx((0.0, LENGTH_MM))
    assert fill_volumes(baseline, OUTLINE, sample, 0, LENGTH_MM).sealant_mm3 == pytest.approx(volume_mm3, rel=1e-5)


def test_a_crack_that_closes_in_a_tip_has_a_level_too():
    """Its mouth has no width there; half of the 80 x 3 mm of a wedge is a mean width of 1.5 mm over all of it."""
    tip = np.linspace(0, 1, len(OUTLINE.centreline_mm))[:, None]
    left_mm, right_mm = (
        OUTLINE.centreline_mm + tip * (wall_mm - OUTLINE.centreline_mm)
        for wall_mm in (OUTLINE.left_wall_mm, OUTLINE.right_wall_mm)
    )
    wedge = outline_between(OUTLINE.centreline_mm, left_mm, right_mm, ("closed", "cut"), None)
    sample = build_solid(wedge, CrackShape(depth_mm=DEPTH_MM, tilt="vertical"))
    baseline = balance_profile(80 * 1.5 * 6, wedge, sample)
    assert np.interp(40, baseline.s_mm, baseline.level_mm) == pytest.approx(-10.0, abs=0.01)


RADIUS_MM = 0.4
WET = Readings(file=Path("P.csv"), data="measured", role="held-out", state="wet")


def run(position_mm, spilled=()) -> Run:
    position_mm = np.array(position_mm, dtype=float)
    over = np.isin(np.arange(len(position_mm)), spilled)
    zero = np.zeros_like(position_mm)
    return Run(position_mm, zero, over, RADIUS_MM, 2.0, {}, zero[:, 0], 0, "cpu", RunHealth())


def test_parts_add_up_to_what_was_dispensed():
    """Ten particles of 2 mm³: five below the face, three above, two over the edge; the settled ones fill 15 mm³."""
    heights_mm = [-8.0, -6, -4, -2, -1, 0.5, 0.6, 0.7, -90, -90]
    balance = mass_balance(
        run([[10.0 * i, 0, z] for i, z in enumerate(heights_mm)], spilled=(8, 9)), solid(), 0.75, 90.0, WET
    )
    assert (balance.dispensed_mm3, balance.spilled_mm3, balance.lost_mm3) == (20.0, 4.0, 1.0)
    assert balance.in_crack_mm3 == pytest.approx(15 * 5 / 8)
    parts = balance.in_crack_mm3 + balance.above_mm3 + balance.spilled_mm3 + balance.lost_mm3
    assert parts == pytest.approx(balance.dispensed_mm3)


def test_a_film_beside_the_mouth_is_a_footprint_and_a_heap_over_it_is_none():
    """A disc of 0.4 mm covers 0.50 mm²; on cells of 0.2 mm it is read within a third, a row of them within 10 %."""
    # Its disc reaches over the edge of the mouth, at 1.5 mm; its middle does not.
    heap = run([[40.0, 1.25, 0.3]])
    assert mass_balance(heap, solid(), 1.0, 90.0, WET).footprint_mm2 == 0.0
    beside = run([[40.0, 6.0, 0.3]])
    assert mass_balance(beside, solid(), 1.0, 90.0, WET).footprint_mm2 == pytest.approx(np.pi * 0.16, rel=1 / 3)
    row = run([[x, 6.0, 0.3] for x in np.arange(20, 60, 0.4)])
    assert mass_balance(row, solid(), 1.0, 90.0, WET).footprint_mm2 == pytest.approx(40 * 0.8, rel=0.15)
    assert mass_balance(run([[40.0, 6.0, -40.0]], spilled=(0,)), solid(), 1.0, 90.0, WET).footprint_mm2 == 0.0


def test_cured_sealant_was_more_when_it_was_given():
    cured = WET.model_copy(update={"state": "cured", "shrinkage_percent": 10.0})
    sealant = run([[40.0, 6.0, 0.3]])
    assert mass_balance(sealant, solid(), 1.0, 90.0, cured).readings_when_dispensed_mm3 == pytest.approx(100.0)
    assert mass_balance(sealant, solid(), 1.0, 90.0, WET).readings_when_dispensed_mm3 == 90.0
