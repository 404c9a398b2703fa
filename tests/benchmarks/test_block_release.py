"""A released block of fluid: its volume, its walls and its final extent."""

from functools import partial
from typing import Any

import numpy as np
import pytest

from benchmarks.block_release import BlockRelease, FluidBlock, release
from sealtwin.core.errors import InputError, NumericalError
from simulate.settings import LEVEL, SampleSlope, Solver, particle_volume
from tests.support.small_fluids import sealant

PASTE = {"consistency_pa_s_n": 6.2, "flow_index": 0.5, "density_kg_m3": 1175.0}


def released(
    fluid: dict[str, Any], seed: int = 0, slope: SampleSlope = LEVEL, solver: dict[str, Any] | None = None, **block: Any
) -> BlockRelease:
    table = {"length_mm": 20.0, "width_mm": 20.0, "height_mm": 20.0, "ahead_mm": 30.0, "duration_s": 0.3, **block}
    settings = Solver.model_validate({"radius_mm": 1.5, **(solver or {})})
    return release(FluidBlock.model_validate(table), sealant(**fluid), settings, slope=slope, seed=seed)


def test_a_released_block_keeps_its_volume_and_stays_between_its_walls():
    """Softer fluid flows farther, and beside the gate too. Times start when the gate opens."""
    stiff, soft = (released(PASTE | {"yield_stress_pa": stress_pa}) for stress_pa in (40.0, 4.0))
    assert soft.front_mm[-1] > stiff.front_mm[-1] + 3 > 3
    for block in (stiff, soft):
        assert block.t_s[[0, -1]] == pytest.approx([0.0, 0.3], abs=0.01)
        assert (np.diff(block.front_mm) > -0.3).all()
        assert block.volume_ratio == pytest.approx(1.0, abs=0.08)
        assert len(block.position_mm) * particle_volume(1.5) == pytest.approx(20.0**3, rel=0.05)
        x, y, z = block.position_mm.T
        assert (z > 0).all()
        assert x.min() > -20
        assert (np.abs(y[x < 0]) < 10).all()
    assert np.abs(y).max() > 10


def test_a_released_block_depends_on_its_seed_and_its_slope():
    release_of = partial(released, PASTE | {"yield_stress_pa": 4.0}, duration_s=0.2)
    level, same, other = (release_of(seed=seed) for seed in (3, 3, 4))
    assert np.array_equal(level.position_mm, same.position_mm)
    assert not np.array_equal(level.position_mm, other.position_mm)
    down, up = (release_of(slope=SampleSlope(gradient_deg=angle)).front_mm[-1] for angle in (-15.0, 15.0))
    assert down > up + 5


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"solver": {"radius_mm": 2.0}}, "solver.radius_mm is 2"),
        ({"solver": {"radius_mm": 0.05}}, "solver.radius_mm is 0.05"),
        ({"solver": {"radius_mm": "auto"}}, "solver.radius_mm"),
        ({"ahead_mm": 8.0}, "ahead_mm is 8"),
        ({"solver": {"settle_s": 1.0}}, "solver.settle_s"),
        ({"solver": {"model": "slot"}}, "solver.model"),
    ],
)
def test_the_error_for_an_impossible_block_release_names_the_setting(change, named):
    with pytest.raises((InputError, NumericalError), match=named):
        released(PASTE | {"yield_stress_pa": 1.0}, **change)
