"""Sentences that several runs share, each written once."""

import re
from collections.abc import Mapping, Sequence

NUMBER = re.compile(r"\d[\d.,]*(e[+-]?\d+)?")


def kind_of(sentence: str) -> str:
    """Return the sentence without its numbers."""
    return NUMBER.sub("#", sentence)


def sentences_of_runs(by_run: Mapping[int, Sequence[str]], total: int) -> list[str]:
    """Return each sentence of the runs once, with the number of runs of ``total`` that have it.

    ``by_run`` has the sentences of a run by its number. Sentences that differ only in their numbers are returned once,
    with the numbers of the first of these runs, which is named.
    """
    kinds: dict[str, dict[int, str]] = {}
    for number, sentences in by_run.items():
        for sentence in sentences:
            kinds.setdefault(kind_of(sentence), {}).setdefault(number, sentence)
    shared = []
    for by_number in kinds.values():
        number, sentence = next(iter(by_number.items()))
        with_numbers = f" (numbers of run {number})" if len({*by_number.values()}) > 1 else ""
        shared.append(f"{len(by_number)} of {total} runs{with_numbers}: {sentence}")
    return shared
