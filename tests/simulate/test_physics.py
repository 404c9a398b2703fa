"""The fluid keeps what the physics benchmark found: each case meets its tolerances, but for the misses that are known.

A case that begins to meet what it missed fails here too: it is to be struck from the list, and told.
"""

import pytest

from benchmarks.physics import CASES

QUICK = ("momentum", "passes", "drop", "energy")
KNOWN_MISSES = {
    "dam_break": {
        "dam, 1.3 < T < 1.9: front off pysph's table",
        "dam, 1.3 < T < 1.9: front off Trixi's table",
        "dam, other T: front off Trixi's table",
    },
    "shear_wave": {"shear wave, pressure active: nu for 3.2 asked"},
    "banks": {
        "bank of 9 Pa, R 0.4 mm: tan / a finite heap's",
        "banks: spread of tan / S between stresses",
    },
}
"""Fronts 8 % ahead of the experiment (16 % at the end), where potential flow is 9 % (17 %); a fluid of 3 mm2/s that is
1.6 mm2/s too thick, as particles jostle; slopes that grow a little faster than the stress.
"""


def misses(name: str) -> set[str]:
    return {finding.name for finding in CASES[name]() if finding.missed}


@pytest.mark.parametrize("name", QUICK)
def test_a_quick_case_meets_its_tolerances(name):
    """Seen to fail: with 2 lambda_i for lambda_i + lambda_j, twice the resistance, half the gravity, twice gamma^2."""
    assert misses(name) == set()


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in CASES if name not in QUICK])
def test_a_long_case_meets_all_that_is_not_known_to_be_missed(name):
    assert misses(name) == KNOWN_MISSES.get(name, set())
