"""The verdict in one line, and the numbers that one looks for first."""

from sealtwin.records import Outcome
from validate.comparison.verdict import edited_by_hand, leak
from validate.evidence import Evidence


def headline(evidence: Evidence) -> tuple[str, Outcome]:
    """The verdict line, and how it ended."""
    comparison = evidence.comparison
    if comparison is None and evidence.run.escaped_particles:
        return f"{leak(evidence.run.escaped_particles)}. There are no readings.", "failed"
    if comparison is None and evidence.edited:
        return f"{edited_by_hand(evidence.edited)}: no verdict. There are no readings.", "undecided"
    if comparison is None:
        return "No readings: this is the simulated fill alone, held against nothing.", "open"
    return comparison.verdict, comparison.outcome


def findings(evidence: Evidence) -> tuple[str, ...]:
    """To be read with the verdict."""
    return () if evidence.comparison is None else evidence.comparison.findings


def key_figures(evidence: Evidence) -> list[tuple[str, str]]:
    """The numbers that one looks for first, each with its unit."""
    run, comparison = evidence.run, evidence.comparison
    figures = []
    if comparison is not None:
        figures.append(("mean error", f"{comparison.mean_error_mm:.2f} mm"))
        if (assessed := comparison.metrics.get("uncertainty")) is not None:
            low_mm, high_mm = assessed["mean_error_mm"]
            figures.append(("its 95 % interval by the readings", f"{low_mm:.2f} to {high_mm:.2f} mm"))
        figures += [
            ("readings", comparison.metrics["role"]),
            (f"worst error (at s = {comparison.worst_at_mm:.1f} mm)", f"{comparison.worst_error_mm:.2f} mm"),
        ]
    return [
        *figures,
        ("volume ratio", f"{evidence.volume_ratio:.3f}"),
        ("escaped particles", f"{run.escaped_particles}"),
        ("spilled particles", f"{run.spilled_particles}"),
        ("particles", f"{len(run.position_mm):,}"),
    ]
