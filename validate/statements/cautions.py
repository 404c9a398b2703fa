"""What must be said before any number of a trial."""

from sealtwin.records import Run
from validate.comparison.verdict import edited_by_hand, leak
from validate.evidence import Evidence
from validate.wording import counted

SOUND = (0.95, 1.05)
"""Volume that lies on the sample over what was dispensed on it: what preset "accurate" promises."""
FEW_ACROSS = 3.0
"""Particles from wall to wall; four in the paper. Runs with two gained 11 to 17 %, with four nothing."""
LEAST_BOND = 1.0
"""Gravity over surface tension, by water's: below it the model's range ends. About 2 mm of cement paste."""
MOST_COMPRESSED = 0.10
"""That 95 % of the particles stay below, as benchmarks/paper_run.py asks of every run."""
MUCH_SPILLED = 0.05
"""Of the sealant: named beside a loss by the fluid; below it, only where it is what makes the ratio unsound."""


def run_warnings(run: Run, volume_ratio: float) -> tuple[str, ...]:
    """What a run's own numbers say against it, in whole sentences; empty where it is sound.

    ``volume_ratio`` is what the settled particles fill over all that was dispensed. What ran over the sample's edge is
    no fault of the fluid, and is told apart.
    """
    texts = []
    if run.escaped_particles:
        texts.append(f"{leak(run.escaped_particles)}, which must never happen. Please report it with the trial file.")
    low, high = SOUND
    spilled = run.spilled_particles / len(run.position_mm)
    # To the digits that are shown: 1.050 is never too much.
    kept = round(volume_ratio / max(1 - spilled, 1e-3), 3)
    if not low <= kept <= high:
        change, stand = ("lost", "lower") if kept < low else ("gained", "higher")
        why = _why_lost(run) if kept < low else _why_gained(run)
        texts.append(
            f"The fluid {change} {100 * abs(1 - kept):.0f} % of its volume ({kept:.3f}; {low:g} to {high:g} is sound): "
            f"levels stand {stand} than that much sealant would.{why}"
        )
    if (compressed := run.health.get("density_error_p95") or 0.0) > MOST_COMPRESSED:
        texts.append(
            f"The bed is compressed: of its particles 5 % are by more than {100 * compressed:.0f} %, and levels stand "
            f"lower there than as much sealant would. {_less_compressed(run)}"
        )
    if not low <= round(volume_ratio, 3) <= high and (low <= kept <= high or spilled > MUCH_SPILLED):
        texts.append(
            f"{counted(run.spilled_particles, 'particle')}, {100 * spilled:.1f} % of the sealant, ran over the edge "
            "of the sample: the levels are those of what is left."
        )
    if (bond := run.health.get("bond", LEAST_BOND)) < LEAST_BOND:
        texts.append(
            f"The Bond number across the crack is {bond:.2g}: surface tension, which is not modelled, is stronger than "
            "gravity there, and holds or draws sealant in ways that this run cannot show."
        )
    return tuple(texts)


def cautions(evidence: Evidence) -> tuple[str, ...]:
    """Of files that somebody edited, of the run, then of data that nobody measured; only what is so is named."""
    run_texts = (*_edits(evidence.edited), *run_warnings(evidence.run, evidence.volume_ratio))
    kinds = []
    if evidence.photo_data != "measured":
        kinds.append(f"the {evidence.outline.seen_in} is {evidence.photo_data}")
    if evidence.readings is not None and evidence.readings.data != "measured":
        kinds.append(f"the caliper readings are {evidence.readings.data}")
    if not kinds:
        return run_texts
    return (*run_texts, f"Not a validation: {' and '.join(kinds)}. This report can show consistency, nothing more.")


def _edits(names: tuple[str, ...]) -> tuple[str, ...]:
    if not names:
        return ()
    return (
        f"{edited_by_hand(names)}: what follows is of these files as they are now, and no result of this trial. Run "
        "it again: it makes its own, and keeps yours beside them.",
    )


def _less_compressed(run: Run) -> str:
    """What to do; the two-level pressure is for deep beds, and many substeps help shallow ones as well."""
    if run.settings.get("solver", {}).get("pressure") == "two-level":
        return "More solver.substeps compress less."
    return 'solver.pressure = "two-level" compresses a deep bed less (decision 0065), more solver.substeps any.'


def _why_lost(run: Run) -> str:
    if run.settings.get("solver", {}).get("preset") == "paper":
        return (
            ' For preset "paper" this is known: it keeps the source\'s constants. Preset "accurate" keeps the volume.'
        )
    return " See the compression under numerical health; more solver.substeps compress less."


def _why_gained(run: Run) -> str:
    across = run.health.get("particles_across")
    if across is None or across >= FEW_ACROSS:
        return ""
    return (
        f" Only {across:.1f} particles lie side by side between the walls, where the paper has four: "
        "make solver.radius_mm smaller."
    )
