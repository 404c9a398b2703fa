"""Several short pours in one launch, told by the host or replayed, and what may go wrong in one of them."""

import re
from functools import cache
from typing import Any

import numpy as np
import pytest

from sealtwin.core.errors import NumericalError
from sealtwin.core.records import Run
from simulate.injection import Injection
from simulate.settings import Fluid
from tests.support.small_fluids import injected, path, results, slot

PASTES = (
    Fluid(U=30.0, D_cm=0.3, freeze_after_s=0.2),
    Fluid(viscosity_pa_s=0.5, D_cm=0.01, freeze_after_s="never"),
    Fluid(U=30.0, D_cm=0.3, yield_stress_pa=12.0, freeze_after_s="never"),
)


def ready(pastes: tuple[Fluid, ...], **how: Any) -> Injection:
    crack = slot(12.0)
    way = path(crack[1], 0.1, speed_mm_s=20.0)
    return injected(crack, way, *pastes, **{"radius_mm": 0.5, "settle_s": 0.3, "substeps": 8, **how})


def finish(injection: Injection) -> Injection:
    while injection.done < injection.frames and not injection.at_rest:
        injection.advance()
    assert injection.engine.recorded == injection.engine.uses_recordings
    return injection


def together(pastes: tuple[Fluid, ...], **how: Any) -> list[Run]:
    return results(finish(ready(pastes, **how)))


@cache
def alone(number: int, device: str = "cpu") -> Run:
    """What that one of the pastes does in a launch of its own: several tests hold theirs against it."""
    (run,) = together(PASTES[number : number + 1], device=device)
    return run


def check_going_on(**how: Any) -> None:
    """From where a run was kept: in a solver of its own, and back in one that has recorded its frame already."""
    unbroken = finish(ready(PASTES[2:], **how))
    killed, resumed = (ready(PASTES[2:], **how) for _ in range(2))
    # Between two renumberings.
    for _ in range(31):
        killed.advance()
    kept = killed.snapshot()
    for _ in range(7):
        killed.advance()
    for run in (killed, resumed):
        run.restore(kept)
        assert np.array_equal(results(finish(run))[0].position_mm, results(unbroken)[0].position_mm)
    resumed.earlier_mm = np.zeros((0, 3))
    resumed.restore(killed.snapshot())
    assert np.array_equal(resumed.earlier_mm, unbroken.earlier_mm)
    assert len(resumed.earlier_mm)


SPOILED = (PASTES[0], Fluid(U=1e4, D_cm=3.0, freeze_after_s="never"), PASTES[0])
"""The second of them is to fail."""


def spoil_a_place(monkeypatch: pytest.MonkeyPatch, **how: Any) -> tuple[Injection, str]:
    """The tenth particle of the second run has no position; returns the runs, and the reason that is given."""
    injection = ready(SPOILED, **how)
    position = injection.engine.state.position.numpy().copy()
    position[injection.schedule.particles + 9] = np.nan
    injection.engine.state.position.assign(position)
    return injection, r"is not finite.*, particle \d+ at \(nan"


def forbid_long_solves(monkeypatch: pytest.MonkeyPatch, **how: Any) -> tuple[Injection, str]:
    """The stiff one of them takes up to 19 iterations, the others two."""
    monkeypatch.setattr("simulate.fluid.viscosity.ITERATIONS_AT_MOST", 6)
    return ready(SPOILED, **how), r"did not converge .* Frame \d+"


def check_the_others(injection: Injection, reason: str) -> None:
    first, failed, last = injection.outcomes()
    assert isinstance(failed, NumericalError)
    # The others are frozen by now; what failed would never be.
    assert injection.moving == 0
    assert re.search(reason, str(failed))
    expected = alone(0, injection.engine.state.device)
    for run in (first, last):
        assert isinstance(run, Run)
        assert np.array_equal(run.position_mm, expected.position_mm)
        assert np.isfinite(run.health.recorded()["density_error_max"])
