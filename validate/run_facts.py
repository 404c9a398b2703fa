"""Facts about a fluid run: cautions about its method and its figures, and facts that several runs share."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from sealtwin.core.facts import Fact, Facts, of_keys
from sealtwin.core.record_files import Simulation
from sealtwin.core.records import Run
from sealtwin.core.run_figures import BRIDGES
from validate.metrics.verdict import SOUND, kept_volume
from validate.result import SeedRuns
from validate.sentences import doubted, sentence, stated

FEW_ACROSS = 3.0
"""Smallest number of particles from wall to wall without a caution. The paper has four. Runs with two particles gained
11 to 17 % in volume, and runs with four gained none."""
MIN_BOND = 1.0  # Smallest Bond number for which the model is valid: cement paste (water's surface tension), 2 mm wide
MAX_COMPRESSED = 0.10
"""Largest compression of the particles without a caution, as 95th percentile."""
AT_REST = 0.5  # Largest distance from rest, in particle radii, at which a level counts as at rest
MUCH_SPILLED = 0.05
"""Spilled fraction above which a spill is always reported. A smaller spill is reported if only this spill takes the
volume ratio out of its allowed range."""
DRAFTED_MM = 1.1
"""Largest difference in mm between the level of a draft and the mean of accurate runs at nine of ten positions
(benchmarks/drafts.py)."""


def run_warnings(run: Run | Simulation, volume_ratio: float, seeds: SeedRuns | None = None) -> Facts:
    """Return a caution for each figure of a run that shows a fault, for a draft, and for an unfit fast model.

    ``volume_ratio`` is the volume of the settled particles divided by the dispensed volume. Volume that ran over the
    sample's edge has its own sentence, because the fluid did not lose it. Faults of the other runs in ``seeds`` come
    last.
    """
    facts = []
    if run.fast_fill is not None and run.unfit:
        facts = [doubted("method.fast", run=run), *run.unfit]
    elif is_draft(run):
        accurate_mm = run.settings.get("solver", {}).get("accurate_radius_mm") or run.radius_mm
        facts = [doubted("method.draft", DRAFTED_MM, "mm", run=run, accurate_mm=accurate_mm)]
    return *facts, *fluid_warnings(run, volume_ratio), *(() if seeds is None else seeds.warnings)


def is_draft(run: Run | Simulation) -> bool:
    return run.settings.get("solver", {}).get("preset") == "draft"


def fluid_warnings(run: Run | Simulation, volume_ratio: float) -> Facts:
    """Return the cautions of ``run_warnings`` without the cautions about a draft or the fast model."""
    facts, solver, health = [*run.remarks], run.settings.get("solver", {}), run.health
    if run.escaped_particles:
        facts.append(stated("fluid.escaped", run.escaped_particles, level="fault"))
    spilled = run.spilled_particles / max(1, run.particles)
    # Rounded to the printed digits, so that a ratio printed as 1.050 is never reported as too large.
    ratio = round(volume_ratio / max(1 - spilled, 1e-3), 3)
    if not (sound := kept_volume(ratio)):
        across = health.particles_across
        # Finer particles do not fill the hollows under paste that bridges a crack.
        few_across = across is not None and across < FEW_ACROSS and not of_keys(run.remarks, BRIDGES)
        parts = {"sound": SOUND, "spilled": spilled, "preset": solver.get("preset"), "across": across}
        facts.append(doubted("fluid.volume", ratio, few_across=few_across, **parts))
    if (compressed := health.density_error_p95 or 0.0) > MAX_COMPRESSED:
        facts.append(doubted("fluid.compressed", compressed))
    off_mm, flat_mm = health.to_rest_mm or 0.0, health.flat_mm
    # Where the nozzle has just passed, the level cannot be judged yet, and may still change by millimetres.
    never_frozen = run.settings.get("fluid", {}).get("freeze_after_s") == "never"
    unsettled = off_mm > 0 and flat_mm is None and never_frozen and not solver.get("settle_s")
    if unsettled or off_mm > AT_REST * run.radius_mm:
        facts.append(doubted("fluid.unsettled", off_mm, "mm", unsettled=unsettled, flat_mm=flat_mm))
    if not kept_volume(volume_ratio) and (sound or spilled > MUCH_SPILLED):
        facts.append(doubted("fluid.spilled", run.spilled_particles, share=spilled))
    if (bond := health.bond) is not None and bond < MIN_BOND:
        facts.append(doubted("fluid.bond", bond))
    return tuple(facts)


def facts_of_runs(by_run: Mapping[int, Sequence[Fact]], total: int) -> list[Fact]:
    """Return one fact for each key among the facts of runs, with the number of runs, of ``total``, that have it.

    ``by_run`` contains the facts of each run by its number. If the sentences of a key differ, the sentence of the first
    of these runs is returned, and the run is named.
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
    """Return the seeds as words, for example "1 to 5"."""
    first, *_, last = seeds.seeds
    if last - first == len(seeds.seeds) - 1 > 1:
        return f"{first} to {last}"
    return f"{', '.join(map(str, seeds.seeds[:-1]))} and {last}"


def levels_in_words(seeds: SeedRuns | None, noun: str) -> str:
    """Return the plural of ``noun``, a simulated level. If levels are means of several runs, the words say so."""
    return f"{noun}s" if seeds is None else f"means of {len(seeds.seeds)} {noun}s"


def mean_sentence(seeds: SeedRuns | None) -> str:
    """Return the sentence about the mean of several runs and its band. Returns "" for a single run."""
    return "" if seeds is None else sentence("seeds.mean", seeds=seeds, names=names_of(seeds))


def seed_facts(seeds: SeedRuns | None, *, draft: bool) -> Facts:
    """Return facts about a run repeated with several seeds: results are means, and pictures show the first run.

    Returns () for a single run.
    """
    if seeds is None:
        return ()
    mean = stated("seeds.mean", len(seeds.seeds), seeds=seeds, names=names_of(seeds))
    return mean, stated("seeds.first", seeds.seeds[0], seeds=seeds), *((stated("seeds.drafts"),) if draft else ())
