"""Facts that several runs have in common."""

import pytest

from sealtwin.core.facts import doubt, texts
from validate.wording.run_facts import facts_of_runs

LOST, OTHER = (doubt("fluid.volume", f"The fluid lost {percent} % of its volume.") for percent in (19, 6))
BED = doubt("fluid.compressed", "The bed is compressed.")


@pytest.mark.parametrize(
    ("by_run", "sentences"),
    [
        ({1: [BED, BED]}, [f"1 of 1 runs: {BED}"]),
        ({4: [LOST, BED], 7: [OTHER], 9: [BED]}, [f"2 of 3 runs (as of run 4): {LOST}", f"2 of 3 runs: {BED}"]),
    ],
)
def test_a_fact_is_stated_once_with_its_runs(by_run, sentences):
    assert list(texts(facts_of_runs(by_run, len(by_run)))) == sentences
