"""Sentences that several runs share, each written once, and sentences on a level that is their mean."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from sealtwin.core.facts import Fact
from validate.result import SeedRuns

OF_DRAFTS = "All are drafts: their mean scatters less than one does, but no band includes what drafts are off by."


def facts_of_runs(by_run: Mapping[int, Sequence[Fact]], total: int) -> list[Fact]:
    """Return a fact for each key that runs have, with the number of runs of ``total`` that have it.

    ``by_run`` has the facts of a run by its number. If sentences of a key differ, that of the first of these runs is
    returned, and the run is named.
    """
    by_key: dict[str, dict[int, Fact]] = {}
    for number, facts in by_run.items():
        for fact in facts:
            by_key.setdefault(fact.key, {}).setdefault(number, fact)
    shared = []
    for by_number in by_key.values():
        number, fact = next(iter(by_number.items()))
        as_run = f" (as of run {number})" if len({*by_number.values()}) > 1 else ""
        shared.append(replace(fact, text=f"{len(by_number)} of {total} runs{as_run}: {fact.text}"))
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
