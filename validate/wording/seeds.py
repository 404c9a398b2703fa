"""Sentences on a level that is the mean of several runs."""

from validate.result import SeedRuns

OF_DRAFTS = "All are drafts: their mean scatters less than one does, but no band includes what drafts are off by."


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
