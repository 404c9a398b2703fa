"""A sloping sample: gravity is turned in its frame, and sealant falls and settles along it."""

import numpy as np
import pytest
from pydantic import ValidationError

from sealtwin.core.errors import InputError
from simulate.profile import measure_profile
from simulate.settings import LEVEL, Fluid, Nozzle, SampleSlope
from simulate.setup_checks import check_fit
from tests.support.small_fluids import as_paper, path, pour, slot

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
def test_gravity_is_along_the_plumb_line_in_the_samples_frame(slope, along):
    """Rising towards +x, sealant runs towards -x. Seen to fail with the signs or the axes exchanged."""
    assert slope.down == pytest.approx(np.array(along) / np.linalg.norm(along))
    assert slope.level == (slope is LEVEL)
    # The same bits as before for a level sample: no -0.0.
    assert not np.signbit(LEVEL.down[:2]).any()


@pytest.mark.parametrize("table", [{"gradient_deg": 45.1}, {"crossfall_deg": -46.0}, {"slope_deg": 1.0}])
def test_a_slope_beyond_its_bounds_is_refused(table):
    with pytest.raises(ValidationError):
        SampleSlope.model_validate(table)


def test_sealant_on_a_sloping_sample_settles_to_a_horizontal_level():
    """Levels are measured perpendicular to the face, so the level at rest slopes by the gradient."""
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


def test_sealant_that_would_freeze_during_its_fall_on_a_slope_is_refused():
    """A fall of 16 mm perpendicular to the face takes sqrt(2 h / g cos): 0.057 s level, 0.068 s at 45 degrees."""
    solid, outline = slot()
    fluid = Fluid(U=30.0, freeze_after_s=0.06)
    check_fit(outline, solid, fluid, as_paper({}), Nozzle(diameter_mm=2.4))
    with pytest.raises(InputError, match=r"in 0\.068 s"):
        check_fit(outline, solid, fluid, as_paper({}), Nozzle(diameter_mm=2.4), SampleSlope(gradient_deg=45.0))
