"""Beds measured by kernels, here on the CPU, against the same beds measured by the level's own functions."""

import numpy as np
import pytest
import warp as wp

from sealtwin.core.records import Bed, Solid
from simulate.injection import Injection
from simulate.kernels.status import ASLEEP, ESCAPED, FROZEN, GIVEN_UP, MOVING, SPILLED, WAITING
from simulate.profile import half_spacing_mm, settled
from simulate.settings import LEVEL, SampleSlope
from simulate.setup.signed_distance import CM
from simulate.vessel import vessel_of
from simulate.volume_control import CELL, FLOWS_MM_S, BedFigures, VolumeControl
from tests.fluids import slot
from tests.launches import PASTES, finish, ready

RUNS = (*PASTES, PASTES[2])


@pytest.fixture(scope="module")
def spread() -> Injection:
    """Beds at rest, and of each run in turn: some in flight, over the edge, frozen, asleep, lost or not released."""
    injection = finish(ready(RUNS))
    state, random = injection.engine.state, np.random.default_rng(5)
    place, velocity, status = (array.numpy().copy() for array in (state.position, state.velocity, state.status))
    for run in range(state.runs):
        own = np.arange(state.count)[state.own(run)]
        status[own] = random.choice([int(kind) for kind in (MOVING, MOVING, ASLEEP, FROZEN)], len(own))
        velocity[own] = random.normal(0, 2 * FLOWS_MM_S * CM, (len(own), 3))
        # In a jet, whose lower end is in the bed, on the face beside the crack, and under a wall that overhangs.
        jet, face, aside = own[:40], own[40:70], own[100:160]
        place[jet, :3] = CM * random.uniform([5.8, -0.2, -14.5], [6.2, 0.2, -9.0], (40, 3))
        velocity[jet] = random.normal(0, 0.2, (40, 3)) - [0, 0, 25]
        place[face, :3] = CM * random.uniform([2, 3, 0.2], [9, 4, 0.5], (30, 3))
        place[aside, :3] = CM * random.uniform([2, -4, -15], [9, 4, -9], (60, 3))
        for kind, which in ((SPILLED, own[70:80]), (ESCAPED, own[80:85]), (WAITING, own[-30:])):
            status[which] = int(kind)
        place[own[90], 2] = np.nan
    status[state.own(2)] = int(GIVEN_UP)
    for array, values in ((state.position, place), (state.velocity, velocity), (state.status, status)):
        array.assign(values)
    return injection


def figures(injection: Injection, solid: Solid, slope: SampleSlope) -> list[BedFigures]:
    control = VolumeControl(
        solid,
        injection.schedule,
        injection.engine.state,
        radius_mm=injection.solver.size_mm,
        factor=1.0,
        yields=[True] * len(RUNS),
        down=slope.down,
    )
    return list(control.figures())


def figures_by_host(injection: Injection, solid: Solid, slope: SampleSlope, run: int) -> BedFigures:
    state, radius_mm = injection.engine.state, injection.solver.size_mm
    own = state.own(run)
    status, place_mm, speed_mm_s = state.status_of()[own], state.position_mm()[own], state.velocity_mm_s()[own]
    here = (status <= int(FROZEN)) & np.isfinite(place_mm).all(axis=1)
    size_mm3 = injection.schedule.dispensed_mm3 / injection.schedule.particles
    lost = np.zeros(here.sum(), dtype=bool)
    bed = Bed(place_mm[here], speed_mm_s[here], lost, radius_mm, size_mm3, slope.table)
    lies, moves = settled(bed, np.full(here.sum(), solid.depth_mm)), status[here] == int(MOVING)
    flows = moves & (np.linalg.norm(bed.velocity_mm_s, axis=1) >= FLOWS_MM_S)
    volume_mm3 = vessel_of(solid, CELL * radius_mm).volume_mm3(bed.position_mm[lies], half_spacing_mm(bed))
    lying, moving, both, flowing = (int(mask.sum()) for mask in (lies, moves, moves & lies, flows & lies))
    return BedFigures(lying, moving, both, flowing, volume_mm3)


@pytest.mark.parametrize(
    ("tilt", "slope"), [("vertical", LEVEL), ("lean", SampleSlope(crossfall_deg=8.0, gradient_deg=-5.0))]
)
@pytest.mark.parametrize("lanes", [1, 32])
def test_the_device_measures_the_beds_that_the_host_measures(spread, tilt, slope, lanes, monkeypatch):
    """Volumes to 1e-9, for sums have another order; counts are the same. One more particle is 1e-3 of a bed's volume.

    46 particles of each run are lost or wait; of the 40 of each jet some lie on the bed. Walls that lean end the
    liquid from above.
    """
    monkeypatch.setattr(wp.config, "enable_cpu_blocks", True)
    monkeypatch.setattr("simulate.kernels.beds.LANES", lanes)
    solid, _ = slot(12.0, tilt=tilt, angle_deg=10.0)
    there = figures(spread, solid, slope)
    here = [figures_by_host(spread, solid, slope, run) for run in range(len(RUNS))]
    here_at_most = spread.schedule.particles - 46
    assert [bed[:2] for bed in there] == [bed[:2] for bed in here]
    for host, device in zip(here[:2] + here[3:], there[:2] + there[3:], strict=True):
        assert device[:4] == host[:4]
        assert device.volume_mm3 == pytest.approx(host.volume_mm3, rel=1e-9)
        assert 0 < host.flowing_and_lying < host.moving_and_lying < min(host.moving, host.lying)
        assert here_at_most - 40 < host.lying < here_at_most
    assert there[2] == BedFigures(0, 0, 0, 0, 0.0)


def test_each_run_has_the_bits_that_it_has_in_any_company(spread, monkeypatch):
    together = figures(spread, spread.solid, LEVEL)
    monkeypatch.setattr("simulate.volume_control.MOST_TOPS", 1)
    assert figures(spread, spread.solid, LEVEL) == together
