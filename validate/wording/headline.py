"""The beginning of a report: cautions, the verdict in one line, the key figures, and the result in plain sentences."""

from typing import Any

from sealtwin.core.facts import Fact, doubt, of_keys
from sealtwin.core.record_files import Simulation
from sealtwin.core.records import Run
from sealtwin.core.run_figures import BRIDGES
from validate.metrics.verdict import NO_VERDICT, SOUND, edited_by_hand, kept_volume, leak
from validate.report_input import Evidence
from validate.result import Outcome, SeedRuns
from validate.units import counted
from validate.wording.comparison import volumes_mm3
from validate.wording.of_runs import seed_sentences
from validate.wording.prediction import predicted_sentence

FEW_ACROSS = 3.0
"""Least number of particles from wall to wall; the paper has four. Runs with two particles gained 11 to 17 % in volume,
runs with four gained none."""
LEAST_BOND = 1.0  # Least Bond number, by water's surface tension, within the model's range: about 2 mm of cement paste
MOST_COMPRESSED = 0.10
"""Largest sound compression of the particles, at their 95th percentile; benchmarks/paper_run.py has the same limit."""
AT_REST = 0.5  # Largest distance from rest of a level at rest, in radii of the particles
MUCH_SPILLED = 0.05
"""Spilled share above which the spill is always reported. A smaller one is reported if it makes the ratio unsound."""
ML = 1000.0  # mm³
NOT_A_VALIDATION = "data.not-a-validation"  # Key of the caution about data that were not measured
METHOD = "method"  # First part of the keys of facts on a draft, and on the fast model
DRAFTED_MM = 1.1
"""A draft's level is this near to the mean of accurate runs at nine of ten places (benchmarks/drafts.py)."""
FAST = (
    "This fill was computed by the fast model, not by particles: it is the flow along the crack, averaged over each "
    "section. It is for screening; do not rely on its level alone."
)


def method_facts(run: Run | Simulation) -> tuple[Fact, ...]:
    """Return cautions about a draft, or about the fast model and whether it fits the case. Other runs have none."""
    if run.fast_fill is None:
        accurate_mm = _table(run, "solver").get("accurate_radius_mm") or run.radius_mm
        draft = (
            f"This run is a draft, with particles of {run.radius_mm:g} mm radius (accurate: {accurate_mm:g} mm): "
            f"its level is within {DRAFTED_MM:g} mm of accurate ones at nine of ten places. For a final result set "
            'solver.preset = "accurate".'
        )
        return (doubt(f"{METHOD}.draft", draft, DRAFTED_MM, "mm"),) if is_draft(run) else ()
    if run.unfit:
        return (doubt(f"{METHOD}.fast", f"{FAST} It is UNFIT for this case:"), *run.unfit)
    above_mm = round(run.fast_fill.above_mm, 1)
    over = f"; its level is up to {above_mm} mm above the face, with overspill only as a slump next to the mouth"
    return (doubt(f"{METHOD}.fast", f"{FAST} The case is within its domain{over if above_mm > 0 else ''}."),)


def is_draft(run: Run | Simulation) -> bool:
    return _table(run, "solver").get("preset") == "draft"


def run_warnings(run: Run | Simulation, volume_ratio: float, seeds: SeedRuns | None = None) -> tuple[Fact, ...]:
    """Return a caution for each figure of a run that shows a fault. A sound run has none.

    ``volume_ratio`` is the volume of the settled particles divided by the dispensed volume. A volume lost over the
    sample's edge has its own sentence, since the fluid did not lose it. Faults of the other runs of ``seeds`` follow.
    """
    others = () if seeds is None else seeds.warnings
    return *method_facts(run), *fluid_warnings(run, volume_ratio), *others


def fluid_warnings(run: Run | Simulation, volume_ratio: float) -> tuple[Fact, ...]:
    """Return the cautions of ``run_warnings`` without those on the method."""
    facts = [*run.remarks]
    if run.escaped_particles:
        text = f"{leak(run.escaped_particles)}, which must never happen. Please report it with the trial file."
        facts.append(Fact("fluid.escaped", text, run.escaped_particles, level="fault"))
    low, high = SOUND
    spilled = run.spilled_particles / max(1, run.particles)
    # To the digits that are shown: 1.050 is never too much.
    ratio = round(volume_ratio / max(1 - spilled, 1e-3), 3)
    if not low <= ratio <= high:
        rest = " of what stayed on the sample" if spilled else ""
        change, hollows, off = ("lost", "", "low") if ratio < low else ("gained", ", or bridges empty spaces", "high")
        text = (
            f"The fluid {change} {100 * abs(1 - ratio):.0f} % of its volume{hollows} ({ratio:.3f}{rest}; {low:g} to "
            f"{high:g} is sound), so its levels are too {off}.{_why(run, lost=ratio < low)}"
        )
        facts.append(doubt("fluid.volume", text, ratio))
    if (compressed := run.health.density_error_p95 or 0.0) > MOST_COMPRESSED:
        # The two-level pressure is for deep beds, and many substeps help shallow ones as well.
        cure = 'Set solver.pressure = "two-level" for a deep bed, or more solver.substeps for any bed.'
        if _table(run, "solver").get("pressure") == "two-level":
            cure = "Set more solver.substeps."
        text = (
            f"The bed is compressed (5 % of its particles by more than {100 * compressed:.0f} %), so levels there are "
            f"too low. {cure}"
        )
        facts.append(doubt("fluid.compressed", text, compressed))
    off_mm, flat_mm = run.health.to_rest_mm or 0.0, run.health.flat_mm
    # Where the nozzle has just been the level cannot be judged yet, and may still move by millimetres.
    never_frozen = _table(run, "fluid").get("freeze_after_s") == "never"
    unsettled = off_mm > 0 and flat_mm is None and never_frozen and not _table(run, "solver").get("settle_s")
    if unsettled or off_mm > AT_REST * run.radius_mm:
        rest = f"the change at the end of the run shows that it will move by about {off_mm:.1f} mm more"
        if unsettled:
            rest = f"it was read as the nozzle stopped, and elsewhere it moved by {off_mm:.1f} mm in the last tenth"
        elif flat_mm is not None:
            rest = f"without a yield stress it will be flat at {flat_mm:.2f} mm, and is up to {off_mm:.1f} mm off"
        text = f"The level is not that at rest: {rest}. Set a longer solver.settle_s."
        facts.append(doubt("fluid.unsettled", text, off_mm, "mm"))
    if not kept_volume(volume_ratio) and (low <= ratio <= high or spilled > MUCH_SPILLED):
        text = (
            f"{counted(run.spilled_particles, 'particle')} ({100 * spilled:.1f} % of the sealant) ran over the edge "
            "of the sample, so the levels are those of the rest."
        )
        facts.append(doubt("fluid.spilled", text, run.spilled_particles))
    if (bond := run.health.bond) is not None and bond < LEAST_BOND:
        text = (
            f"The Bond number across the crack is {bond:.2g}: surface tension, which is not modelled, is stronger than "
            "gravity there, so the real sealant may come to rest elsewhere."
        )
        facts.append(doubt("fluid.bond", text, bond))
    return tuple(facts)


def _why(run: Run | Simulation, *, lost: bool) -> str:
    across = run.health.particles_across
    if lost and _table(run, "solver").get("preset") == "paper":
        return ' Preset "paper" has the constants of its source, which lose volume; set solver.preset = "accurate".'
    if is_draft(run):
        return ""  # Its own sentence names preset accurate, and a draft replaces radius_mm.
    if lost:
        return " Set more solver.substeps, which reduces the compression (see the numerical health)."
    # Finer particles do not fill the hollows under paste that bridges a crack.
    if across is None or across >= FEW_ACROSS or of_keys(run.remarks, BRIDGES):
        return ""
    return (
        f" Only {across:.1f} particles fit side by side between the walls; the paper's runs have four. "
        "Make solver.radius_mm smaller."
    )


def _table(run: Run | Simulation, name: str) -> dict[str, Any]:
    """Return a table of the run's settings in effect; empty if there is none of that name."""
    table = run.settings.get(name)
    return table if isinstance(table, dict) else {}


def cautions(evidence: Evidence) -> tuple[Fact, ...]:
    """Return cautions about edited files, about the run, and about data that were not measured."""
    kinds = not_measured(evidence)
    text = f"Not a validation: {' and '.join(kinds)}. No error here is that of a real sample."
    return (*faults(evidence), *((doubt(NOT_A_VALIDATION, text),) if kinds else ()))


def faults(evidence: Evidence) -> tuple[Fact, ...]:
    """Return cautions about edited files, the run and the weighed cavity."""
    facts = list(run_warnings(evidence.run, evidence.volume_ratio, evidence.seeds))
    if (weighed := evidence.solid.figures.weighed) is not None:
        facts += weighed.findings
    if evidence.edited:
        edited = (
            f"{edited_by_hand(evidence.edited)}: this report shows the files as they are now, and is not a result of "
            "this trial. Run the trial again, which writes its own files and keeps yours."
        )
        facts.insert(0, Fact("files.edited", edited, len(evidence.edited), level="fault"))
    return tuple(facts)


def not_measured(evidence: Evidence) -> list[str]:
    """Return clauses on the data that were not measured, or not declared; none for a validation."""
    kinds, seen_in = [], evidence.outline.seen_in
    readings_data = "measured" if evidence.readings is None else evidence.readings.data
    for thing, data in ((f"the {seen_in} is", evidence.photo_data), ("the caliper readings are", readings_data)):
        if data == "undeclared":
            kinds.append(f"it is not declared whether {thing} measured")
        elif data != "measured":
            kinds.append(f"{thing} {data}")
    if evidence.comparison is not None and evidence.comparison.role == "undeclared":
        kinds.append("it is not declared whether the fluid was calibrated on these readings")
    return kinds


def headline(evidence: Evidence) -> tuple[tuple[Fact, ...], Outcome]:
    """Return the facts of the verdict and its outcome."""
    if evidence.comparison is not None:
        return evidence.comparison.headline, evidence.comparison.outcome
    if evidence.run.escaped_particles:
        text, key, outcome = f"{leak(evidence.run.escaped_particles)}. There are no readings.", "leak", "failed"
    elif not evidence.run.has_particles:
        text, key, outcome = f"{NO_VERDICT} There are no readings.", "screening", "open"
    elif evidence.edited:
        text, key = f"{edited_by_hand(evidence.edited)}: no verdict. There are no readings.", "edited"
        outcome = "undecided"
    elif evidence.prediction is not None:
        text, key, outcome = predicted_sentence(evidence.prediction), "predicted", "open"
    else:
        text, key, outcome = "No readings: the simulated fill is not compared with anything.", "no-readings", "open"
    return (Fact(f"verdict.{key}", text, level="fault" if key in ("leak", "edited") else "plain"),), outcome


def in_short(evidence: Evidence) -> tuple[str, ...]:
    """Return sentences on the error, if there are readings, and on the places of the sealant."""
    return (*_nearness(evidence), *mean_of_seeds(evidence), _whereabouts(evidence))


def mean_of_seeds(evidence: Evidence) -> tuple[str, ...]:
    return seed_sentences(evidence.seeds, draft=is_draft(evidence.run))


def _nearness(evidence: Evidence) -> tuple[str, ...]:
    if evidence.comparison is None:
        return ()
    m = evidence.comparison
    side = "above" if m.bias_mm > 0 else "below"
    worst = f"{m.worst_error_mm:.1f} mm, {m.worst_at_mm:.0f} mm from the start"
    if (station := m.worst_at_a_station) is not None:
        worst = f"{station.error_mm:.1f} mm at a station, {station.s_mm:.0f} mm from the start"
    bias = f"{abs(m.bias_mm):.1f} mm {side}" if round(m.bias_mm, 1) else "as high as"
    return (
        f"Along {m.covered_length_mm:.0f} mm of crack, the simulated level is {m.mean_error_mm:.1f} mm from the "
        f"readings on average and at most {worst}; its mean is {bias} theirs.",
    )


def _whereabouts(evidence: Evidence) -> str:
    ml = {place: volume_mm3 / ML for place, (_, volume_mm3) in volumes_mm3(evidence).items()}
    over = "; the fast model does not compute what runs over the edge of the sample"
    if evidence.run.has_particles:
        amount = f"{ml['spilled']:.2f} ml" if ml["spilled"] >= 0.005 else "less than 0.01 ml"
        over = f"; {amount if ml['spilled'] else 'none'} ran over the edge of the sample"
    return (
        f"Of {ml['dispensed']:.2f} ml dispensed, {ml['in_crack']:.2f} ml are in the crack, which holds "
        f"{evidence.solid.cavity_volume_mm3 / ML:.2f} ml, and {ml['above_face']:.2f} ml are above the face{over}."
    )
