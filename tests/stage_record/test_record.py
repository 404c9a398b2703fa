"""Stage numbers, compared with the record of outputs, and the rules of the record."""

import numpy as np
import pytest

from benchmarks.kept_runs import PARTS
from tests.stage_record import record
from tests.stage_record.record import Recorded, StageRecord

LEVEL = StageRecord(3, {"level": Recorded(np.array([-4.0, -3.9]), 1e-4)})


@pytest.mark.parametrize("stage", PARTS)
def test_the_outputs_of_a_stage_change_only_with_its_stage_number(stage):
    """Each tolerance is 20 times the effect of rounding all inputs.

    Seen to fail with each of these changed in turn: the reach and the constant of the density kernel, the law of
    viscosity by 1 %, the walls' mass by 2 % and their hold by 0.5 %, the slowest shear, the fall in a substep, the
    order of releases, the fast model's friction and its plug, a wall's half contrast by 0.001, the smoothing of walls,
    the slope of a tilt by 0.2 %, a t-quantile from 0.975 to 0.974 and the share of a band from 0.95 to 0.949.
    """
    recorded, now = record.read().get(stage), record.outputs_of(stage)
    fault = record.fault_of(stage, recorded, PARTS[stage], now)
    assert not fault, fault
    assert recorded is not None
    late = record.out_of_date(recorded, PARTS[stage], now)
    assert not late, f"{stage}: {late}. Call 'python -m tests.stage_record'."


@pytest.mark.parametrize(
    ("number", "level_mm", "words"),
    [
        (3, [-4.0, -3.90005], ""),
        (3, [-4.0, -3.899], "1 of 1 outputs moved, and its number is still 3"),
        (3, [-4.0], "1 values, and 2 in the record"),
        (3, [-4.0, np.nan], "1 of 1 outputs moved"),
        (4, [-4.0, -3.899], ""),
        (2, [-4.0, -3.9], "a number never falls"),
    ],
)
def test_an_output_may_change_within_its_tolerance_or_with_a_higher_stage_number(number, level_mm, words):
    fault = record.fault_of("simulate", LEVEL, number, {"level": np.array(level_mm)})
    assert words in fault
    assert bool(words) == bool(fault)
