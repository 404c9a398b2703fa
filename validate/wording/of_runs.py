"""Sentences that several runs have in common, said once."""

import re
from collections.abc import Mapping, Sequence

NUMBER = re.compile(r"\d[\d.,]*(e[+-]?\d+)?")


def sentences_of_runs(by_run: Mapping[int, Sequence[str]], total: int) -> list[str]:
    """Return each sentence of the runs once, with the number of runs of ``total`` that have it.

    ``by_run`` has the sentences of a run by its number. Sentences that differ in their numbers alone are one: it has
    those of the first such run, which it names.
    """
    kinds: dict[str, dict[int, str]] = {}
    for number, sentences in by_run.items():
        for sentence in sentences:
            kinds.setdefault(NUMBER.sub("#", sentence), {}).setdefault(number, sentence)
    told = []
    for found in kinds.values():
        number, sentence = next(iter(found.items()))
        with_numbers = f", with the numbers of run {number}" if len({*found.values()}) > 1 else ""
        told.append(f"{len(found)} of {total} runs{with_numbers}: {sentence}")
    return told
