"""Claims on damping, freezing and time, on runs whose verdict is known."""

from collections.abc import Sequence
from functools import cache

import numpy as np
import pytest

from reports.reproduction.extra_claims import (
    D_CM,
    ETA_PER_S,
    QUIET_CORES,
    judge_damping,
    judge_freezing,
    judge_slots,
    judge_times,
)
from reports.reproduction.judging import Finding
from reports.reproduction.pace import Pace
from reports.reproduction.redrawn import SETS
from sealtwin.core.records import Profile
from tests.charts import S_MM

SEEDED_MM = np.array([-0.1, -0.05, 0.0, 0.05, 0.1])
"""Five runs about their mean: a standard deviation of 0.08 mm."""


def damped(by_mm: Sequence[float], runs_mm: np.ndarray) -> Finding:
    """Mean errors that each eta moves by so much, alike against all readings; U and D move them by 2 mm."""
    error_mm = 1.4 + np.array(by_mm)[:, None] + runs_mm
    every = np.broadcast_to(error_mm, (SETS + 1, *error_mm.shape))
    assert len(by_mm) == len(ETA_PER_S)
    return judge_damping(every, np.full(SETS + 1, 2.0))


@pytest.mark.parametrize(
    ("by_mm", "scatter", "judgement"),
    # A tenth of 2 mm; the mean of five runs is unsure by 0.035 mm, by t of 4 degrees of freedom.
    [
        ((0.0, 0.0, 0.0), 1, "agrees"),
        ((0.0, 0.1, 0.2), 1, "open"),
        ((0.0, 0.3, 0.6), 1, "disagrees"),
        ((0.0, 0.0, 0.0), 6, "open"),
    ],
)
def test_damping_is_judged_by_what_it_does_beside_what_u_and_d_do(by_mm, scatter, judgement):
    assert damped(by_mm, scatter * SEEDED_MM).judgement == judgement


def beds(uneven_mm: float, scatter: float) -> list[Profile]:
    """Beds that are so uneven, each by a share of ``scatter`` more or less."""
    wave = np.sqrt(2) * np.sin(2 * np.pi * S_MM[:-1] / 80)
    return [Profile(S_MM[:-1], uneven_mm * (1 + scatter * by) * wave) for by in (-1.0, -0.5, 0.0, 0.5, 1.0)]


@pytest.mark.parametrize(
    ("uneven_mm", "scatter", "judgement"),
    [((4.0, 3.0, 1.0), 0.02, "agrees"), ((3.0, 3.0, 2.9), 0.1, "open"), ((3.0, 3.5, 4.0), 0.02, "disagrees")],
)
def test_a_bed_is_flatter_where_its_level_varies_less(uneven_mm, scatter, judgement):
    finding = judge_freezing([beds(each, scatter) for each in uneven_mm])
    assert finding.judgement == judgement
    assert finding.ours == ", ".join(f"{each:.2f}" for each in uneven_mm) + " mm"


def pace(run_s: float, others_cores: float = 0.0, power: float = 1.0) -> Pace:
    """A run whose frames take a time that is a power of the particles that move."""
    moving = np.repeat(np.arange(100, 2500, 20), 2)
    frame_ms = 1.0 + 1e-3 * (moving / 2500.0) ** power * 2500
    return Pace(run_s, run_s, others_cores, moving, frame_ms)


@cache
def timed(run_s: tuple[float, ...], scatter: float, others_cores: float = 0.0, power: float = 1.0) -> list[Finding]:
    """Three runs of each D, those in passes with these times, and those that are solved at once all with the first."""
    by = (1 - scatter, 1.0, 1 + scatter)
    passes = {d: [pace(s * each, others_cores, power) for each in by] for d, s in zip(D_CM, run_s, strict=True)}
    solved = {d: [pace(run_s[0] * each, others_cores, power) for each in by] for d in D_CM}
    return judge_times(passes, solved)


@pytest.mark.broad
def test_times_of_a_quiet_machine_are_judged():
    in_passes, at_once, linear = timed((10.0, 10.0, 30.0), 0.01)
    assert (in_passes.judgement, in_passes.ours) == ("agrees", "3.00 times the time")
    assert (at_once.judgement, at_once.ours) == ("disagrees", "1.00 times the time")
    assert (linear.judgement, linear.ours) == ("agrees", "R² = 1.00")
    assert timed((10.0, 10.0, 10.0), 0.01)[0].judgement == "disagrees"


def test_no_time_is_judged_that_was_taken_beside_other_processes():
    """Even one that is far from the limit; the load stands beside it."""
    for finding in timed((10.0, 10.0, 30.0), 0.01, others_cores=2 * QUIET_CORES):
        assert finding.judgement == "open"
        assert "load by others 0.20 cores at most: not judged" in finding.redrawn
    assert "load by others 0.00 cores" in timed((10.0, 10.0, 30.0), 0.01)[0].redrawn


@pytest.mark.parametrize(
    ("narrow_s", "scatter", "others_cores", "judgement"),
    [(90.0, 0.02, 0.0, "open"), (300.0, 0.02, 0.0, "disagrees"), (300.0, 0.02, 1.0, "open")],
)
def test_a_third_of_the_width_takes_nine_times_as_long_or_not(narrow_s, scatter, others_cores, judgement):
    wide = [pace(10.0 * (1 + scatter * by), others_cores) for by in (-1, 0, 1)]
    finding = judge_slots(wide, pace(narrow_s, others_cores))
    assert (finding.judgement, finding.ours) == (judgement, f"{narrow_s / 10:.0f} times")
