"""The volume that a bed keeps, whatever holds it."""

import numpy as np
import pytest

from simulate.injection import Injection
from simulate.kernels.status import MOVING
from simulate.profile import volume_ratio
from simulate.settings import Fluid
from simulate.setup.signed_distance import CM
from simulate.vessel import Vessel
from simulate.volume_control import CELL, LEAST_FACTOR, LEAST_FLOWING, MOST_FACTOR
from tests.fluids import path, pour, slot
from tests.launches import PASTES, finish, ready

THIN = Fluid(U=30.0, D_cm=0.3, freeze_after_s="never")
FREEZING = THIN.model_copy(update={"freeze_after_s": 2.58})
FLOOR_CM = -1.6
STIFF = THIN.model_copy(update={"yield_stress_pa": 12.0})


@pytest.mark.parametrize("paste", [THIN, FREEZING, STIFF])
def test_a_bed_has_the_volume_that_was_dispensed_whatever_holds_it(paste):
    """340 particles in a slot of 12 mm, of which one in seven lies at the surface; hence 2 % and not one.

    Columns of R/3: those of ``volume_ratio`` itself, 0.4 mm, read a bed as small as this 1 % too small. Broken on
    purpose, with a factor of 1.0 throughout, fluid without a yield stress keeps 0.91; paste of 12 Pa, whose factor is
    near 1 anyway, keeps 0.99, and its factor says that it was not steered.
    """
    crack = slot(12.0)
    run = pour(crack, path(crack[1], 0.38, speed_mm_s=4.0), paste, radius_mm=0.6, settle_s=1.0)
    assert volume_ratio(run, crack[0], cell_mm=0.2) == pytest.approx(1.0, abs=0.02)
    assert run.escaped_particles == 0
    factor = run.health.volume_factor
    assert factor is not None
    assert LEAST_FACTOR * 0.9999 <= factor <= MOST_FACTOR * 1.0001
    assert factor != pytest.approx(run.settings["solver"]["volume_factor"], abs=1e-4)


@pytest.mark.parametrize("solver", [{"preset": "paper"}, {"volume_factor": 1.0}])
def test_a_factor_that_is_given_or_the_papers_stays(solver):
    injection = finish(ready(PASTES[:1], **solver))
    assert injection.volume_control is None
    assert (injection.engine.state.swelling.numpy() == 1.0).all()


def test_its_columns_read_a_rough_bed_in_a_narrow_slot():
    """Particles of 0.6 mm that lie loose, so that columns as wide as they are miss hollows between them."""
    solid, _ = slot(28.0, 3.1, 8.0, "vertical", 0.0)
    random, off = np.random.default_rng(0), []
    for _ in range(12):
        place_mm = random.uniform([0, -1.2, -7.5], [28, 1.2, -3.0], (160, 3))
        coarse, fine = (Vessel(solid, cell_mm).volume_mm3(place_mm, 0.52) for cell_mm in (CELL * 0.6, 0.1))
        off.append(coarse / fine - 1)
    assert np.abs(off).max() < 0.01


@pytest.fixture(scope="module")
def liquid():
    """A bed in which nothing flies any more."""
    return finish(ready(PASTES[1:2], settle_s=0.5))


@pytest.fixture(scope="module")
def paste():
    """The same of 12 Pa."""
    return finish(ready(PASTES[2:3], settle_s=0.5))


@pytest.mark.parametrize(("stretch", "bound"), [(1.3, LEAST_FACTOR), (0.7, MOST_FACTOR)])
def test_too_large_a_bed_shrinks_and_too_small_a_one_swells_within_bounds(liquid, stretch, bound):
    once, last = _factors(liquid, stretch, speed_mm_s=2.0)
    assert np.sign(once / liquid.engine.scheme.volume_factor - 1) == np.sign(1 - stretch)
    assert last == pytest.approx(bound, rel=1e-5)


def test_paste_that_stands_may_shrink_but_is_given_nothing(liquid, paste):
    """What a yield stress holds is not more for being pressed; it gives way later, at once. A liquid creeps on."""
    before = paste.engine.scheme.volume_factor
    assert _factors(paste, 0.7, speed_mm_s=0.5) == pytest.approx((before, before))
    assert _factors(paste, 1.3, speed_mm_s=0.5)[1] == pytest.approx(LEAST_FACTOR, rel=1e-5)
    assert _factors(liquid, 0.7, speed_mm_s=0.5)[1] == pytest.approx(MOST_FACTOR, rel=1e-5)
    assert _factors(liquid, 0.98, speed_mm_s=0.5) == _factors(liquid, 0.98, speed_mm_s=2.0)


def test_the_less_of_a_paste_flows_the_more_it_makes_up_for(paste):
    whole, half, tenth = (_factors(paste, 0.98, 2.0, share)[0] for share in (1.0, 0.5, 0.1))
    before = paste.engine.scheme.volume_factor
    assert (half - before) / (whole - before) == pytest.approx(2, rel=0.02)
    assert (tenth - before) / (whole - before) == pytest.approx(1 / LEAST_FLOWING, rel=0.02)


def _factors(bed: Injection, stretch: float, speed_mm_s: float, share: float = 1.0) -> tuple[float, float]:
    """Factor after one measurement and after twenty more, of the bed made ``stretch`` times as high.

    The ``share`` of it that was released first moves at ``speed_mm_s``, the others hardly.
    """
    state, control, scheme = bed.engine.state, bed.volume_control, bed.engine.scheme.volume_factor
    assert control is not None
    place, velocity, status = (array.numpy().copy() for array in (state.position, state.velocity, state.status))
    stretched, moved = place.copy(), np.zeros_like(velocity)
    stretched[:, 2] = FLOOR_CM + stretch * (place[:, 2] - FLOOR_CM)
    moved[: round(share * len(moved)), 0] = speed_mm_s * CM
    for array, values in ((state.position, stretched), (state.velocity, moved)):
        array.assign(values)
    state.status.fill_(int(MOVING))
    state.swelling.fill_(1.0)
    due = (bed.done // control.every + 1) * control.every
    factors = []
    for _ in range(21):
        control.after_frame(due)
        factors.append(float(state.swelling.numpy()[0]) * scheme)
    for array, values in ((state.position, place), (state.velocity, velocity), (state.status, status)):
        array.assign(values)
    return factors[0], factors[-1]
