"""The first line of a report: the verdict, and nothing claimed that was not measured."""

from dataclasses import replace

import pytest

from tests.evidence import make_evidence
from tests.tables import tables
from validate.result import Comparison
from validate.settings import Gate
from validate.wording.headline import headline, key_figures

GATE = Gate(mean_error_mm=1.0)


@pytest.mark.parametrize(
    ("gate", "error_mm", "outcome"), [(GATE, 0.5, "passed"), (GATE, 1.5, "failed"), (None, 1, "open")]
)
def test_the_headline_is_the_verdict(tmp_path, gate, error_mm, outcome):
    evidence = make_evidence(tmp_path, gate=gate, error_mm=error_mm)
    comparison = evidence.comparison
    assert isinstance(comparison, Comparison)
    assert headline(evidence) == (comparison.headline, outcome)


def test_without_readings_nothing_is_compared(tmp_path):
    evidence = make_evidence(tmp_path, readings_data=None)
    assert headline(evidence)[1] == "open"
    assert "mean error" not in dict(key_figures(evidence))
    assert "Agreement with the readings" not in [table.title for table in tables(evidence)]


def test_a_leak_without_readings_is_the_headline(tmp_path):
    evidence = make_evidence(tmp_path, readings_data=None)
    leaking = replace(evidence, run=replace(evidence.run, escaped_particles=2))
    assert headline(leaking) == (("Do not use: 2 particles went through a wall. There are no readings.",), "failed")
