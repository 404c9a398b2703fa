"""Sentences that several runs have in common."""

import pytest

from validate.wording.of_runs import sentences_of_runs

LOST, GAINED = "The fluid lost {} % of its volume ({}).", "The fluid gained 6 % of its volume (1.06)."


ONE, OTHER = LOST.format(19, 0.81), LOST.format(6, 9.4e-1)


@pytest.mark.parametrize(
    ("by_run", "sentences"),
    [
        ({1: [GAINED, GAINED]}, [f"1 of 1 runs: {GAINED}"]),
        (
            {4: [ONE, GAINED], 7: [OTHER], 9: [GAINED]},
            [f"2 of 3 runs (numbers of run 4): {ONE}", f"2 of 3 runs: {GAINED}"],
        ),
    ],
)
def test_a_sentence_is_said_once_with_its_runs(by_run, sentences):
    assert sentences_of_runs(by_run, len(by_run)) == sentences
