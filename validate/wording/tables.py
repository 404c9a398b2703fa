"""Tables of the report: the numbers in them, for the blocks of report_words.j2 that have their rows."""

from collections.abc import Iterator
from typing import Any

from sealtwin.core.arc_length import arc_length
from sealtwin.core.run_figures import RunHealth
from validate.intervals import ErrorUncertainty
from validate.result import Evidence
from validate.sentences import table
from validate.uncertainty.budget import UNDECLARED_MM
from validate.units import PageTable, plain, words
from validate.wording.report_facts import HEALTH_LABELS, tilt_words, volumes

SHOWN_HEALTH = (
    *("density_error_p95", "density_error_max", "moving_most", "viscosity_iterations_mean", "finer"),
    *("particles_across", "viscosity_m2_s", "viscosity_pa_s", "viscosity_added_m2_s", "reynolds", "bond", "bingham"),
    *("flat_mm", "to_rest_mm", "setup_s", "frames_s"),
)
"""Figures of a run's health on the page. report.json has all of them."""


def comparison_tables(evidence: Evidence) -> Iterator[PageTable]:
    """Yield the tables of the error's metrics, and of the readings: their file, format and scatter."""
    parts = {"m": evidence.comparison, "readings": evidence.readings, "sheet": evidence.sheet}
    yield table("table_agreement", **parts)
    yield table("table_readings", **parts)


def uncertainty_tables(uncertainty: ErrorUncertainty) -> list[PageTable]:
    """Return the tables of the intervals, the error budget, the alignment, the particle size and the inputs."""
    names = "intervals", "budget", "missing", "alignment", "sizes", "inputs"
    tables = (table(f"table_{name}", u=uncertainty, undeclared_mm=UNDECLARED_MM) for name in names)
    return [each for each in tables if each.rows]


def balance_table(evidence: Evidence) -> PageTable:
    """Return the table of the dispensed sealant's volume at each place."""
    return table("table_places", e=evidence, places=volumes(evidence))


def geometry_table(evidence: Evidence) -> PageTable:
    return table("table_geometry", e=evidence, tilt=tilt_words(evidence))


def path_table(evidence: Evidence) -> PageTable:
    trajectory = evidence.trajectory
    giving = trajectory.giving
    begins_mm, ends_mm = trajectory.s_mm[giving][[0, -1]]
    leads = trajectory.position_mm[: giving.start + 1], trajectory.position_mm[giving.stop - 1 :]
    before_mm, after_mm = (arc_length(points)[-1] for points in leads)
    return table(
        "table_path",
        e=evidence,
        begins_mm=begins_mm,
        ends_mm=ends_mm,
        before_mm=before_mm,
        after_mm=after_mm,
        speed_mm_s=trajectory.speed_mm_s[:-1],
        flow_mm3_s=trajectory.flow_mm3_s[giving.start : giving.stop - 1],
        height_mm=trajectory.position_mm[:, 2].mean(),
    )


def health_table(health: RunHealth) -> PageTable:
    """Return the figures of the page that the run recorded, in the run's order."""
    figures = []
    for key, value in health.recorded().items():
        if key in SHOWN_HEALTH and value is not None:
            label, factor, shape = HEALTH_LABELS[key]
            figures.append((label, shape.format(factor * value)))
    return table("table_health", health=health, figures=figures)


def settings_table(settings: dict[str, Any]) -> PageTable:
    """Return the settings in effect, a row for each table; the seed is in the table of versions."""
    groups: dict[str, list[str]] = {}
    for group, content in settings.items():
        if isinstance(content, dict):
            tables = {key: value if isinstance(value, dict) else {"": value} for key, value in content.items()}
            groups[group] = [
                f"{words(key)} {words(name)} ".replace("  ", " ") + _in_short(value)
                for key, part in tables.items()
                for name, value in part.items()
                if value is not None
            ]
    return table("table_settings", groups=groups)


def _in_short(value: Any) -> str:
    """Return a setting as text. A list of numbers becomes its length and its first and last value."""
    if not isinstance(value, list | tuple) or not value or not all(isinstance(one, int | float) for one in value):
        return plain(value)
    return f"{len(value)} rows, {value[0]:.4g} to {value[-1]:.4g}"
