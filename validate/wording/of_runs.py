"""Sentences that several runs share, each written once, and sentences on a level that is their mean."""

import re
from collections.abc import Mapping, Sequence

from validate.result import SeedRuns

OF_DRAFTS = "All are drafts: their mean scatters less than one does, but no band includes what drafts are off by."
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


def names_of(seeds: SeedRuns) -> str:
    """Return the seeds in words."""
    first, *_, last = seeds.seeds
    if last - first == len(seeds.seeds) - 1 > 1:
        return f"{first} to {last}"
    return f"{', '.join(map(str, seeds.seeds[:-1]))} and {last}"


def levels_in_words(seeds: SeedRuns | None, one: str) -> str:
    """Return the plural of ``one``, a simulated level, of which several may be averaged."""
    return f"{one}s" if seeds is None else f"means of {len(seeds.seeds)} {one}s"


def mean_sentence(seeds: SeedRuns) -> str:
    """Return the sentence on the mean and its band."""
    return (
        f"The level is the mean of {len(seeds.seeds)} runs, with seeds {names_of(seeds)}; by their scatter alone, one "
        f"further run is within ± {seeds.band_95_mm:.2f} mm at 19 of 20 places."
    )


def seed_sentences(seeds: SeedRuns | None, *, draft: bool) -> tuple[str, ...]:
    """Return the sentences on the mean, on what the first run alone shows, and on drafts; none for a single run."""
    if seeds is None:
        return ()
    of_first = f"Particles, volumes and pictures of the fill are those of seed {seeds.seeds[0]}."
    return mean_sentence(seeds), of_first, *((OF_DRAFTS,) if draft else ())
