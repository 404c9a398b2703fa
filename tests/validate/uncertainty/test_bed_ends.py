"""The error of the model at the ends of the path: its size, its place, and the volume that it does not make."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support.evidence import make_evidence
from validate.uncertainty.validation import FIRST, LAST, MOUND, BedEnds

S_MM = np.linspace(0.0, 80.0, 81)
ENDS = BedEnds(10.0, 70.0, 2.0)


def test_it_is_largest_where_the_nozzle_stops_and_makes_no_volume():
    draws_mm = ENDS.errors(S_MM).draws_mm
    assert draws_mm.mean(axis=1) == pytest.approx(0.0, abs=1e-12)
    sd_mm = draws_mm.std(axis=0)
    assert sd_mm.argmax() == 70
    shape = np.exp(-np.abs(S_MM - 70.0) / 6.0)
    assert sd_mm[70] == pytest.approx(LAST * 2.0 * (1 - shape.mean()), rel=0.02)
    assert sd_mm[10] / sd_mm[70] == pytest.approx(FIRST / LAST, rel=0.1)
    # A path in the other direction has its mound at the other end.
    assert BedEnds(70.0, 10.0, 2.0).errors(S_MM).draws_mm.std(axis=0).argmax() == 10


def test_a_paste_has_a_mound_and_a_liquid_has_none(tmp_path):
    evidence = make_evidence(tmp_path)
    paste = replace(evidence.run, health=evidence.run.health.model_copy(update={"yield_stress_pa": 8.0}))
    ends = BedEnds.of(evidence.trajectory, paste)
    assert ends is not None
    assert ends.mound_mm == pytest.approx(MOUND * 8.0e3 / (1690.0 * 9.81))
    assert (ends.first_mm, ends.last_mm) == pytest.approx((5.0, 35.0), abs=1.5)
    assert BedEnds.of(evidence.trajectory, evidence.run) is None
