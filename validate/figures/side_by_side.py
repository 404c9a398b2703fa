"""Comparison of finished runs: settings that differ, the nearest run, shared readings, replicates."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sealtwin.core.facts import Fact
from sealtwin.core.records import Profile
from validate.metrics.curve_distances import Difference, level_difference
from validate.metrics.verdict import SOUND, kept_volume
from validate.result import Comparison
from validate.units import counted

FEWEST = 2  # Least number of replicates; a single one does not show a distribution
SAME_MM = 0.01
"""Largest difference at any station between copies of the same readings: the last digit of a caliper. Repeated readings
differ by ten times that."""
LONGEST_VALUE = 120
"""Largest number of characters of a setting that are shown; a board of markers has a thousand."""


def setting_words(value: Any) -> str:
    """Return a setting's value as text; "-" if it is not set."""
    match value:
        case None:
            words = "-"
        case bool():
            words = "yes" if value else "no"
        case float():
            words = f"{value:.10g}"
        case dict():
            words = ", ".join(f"{name} {setting_words(inner)}" for name, inner in value.items())
        case list() | tuple() if any(isinstance(inner, dict | list | tuple) for inner in value):
            words = f"{len(value)}: {' '.join(f'({setting_words(inner)})' for inner in value)}"
        case list() | tuple():
            words = ", ".join(map(setting_words, value))
        case _:
            words = str(value)
    return words if len(words) <= LONGEST_VALUE else f"{words[:LONGEST_VALUE]} ..."


@dataclass(frozen=True)
class Side:
    """One run of a comparison."""

    name: str  # Unique name
    settings: Mapping[str, Any]  # Settings by dotted name
    profile: Profile
    readings: Profile | None
    comparison: Comparison | None  # None without readings
    facts: Mapping[str, float | None]  # Figures of the run itself, by name with unit
    replicate_of: str  # Key of crack, path, paste and solver as set; runs with the same key are replicates of one trial
    volume_ratio: float  # Volume of the settled sealant over the dispensed volume
    escaped_particles: int = 0  # Number of particles that went through a wall
    edited: Sequence[str] = ()  # Names of its files that were changed after the run
    fluid_warnings: Sequence[Fact] = ()  # Faults of its fluid
    without_effect: frozenset[str] = frozenset()  # Settings that change neither its level nor the error of its level

    @property
    def error(self) -> Difference | None:
        """Simulated minus measured level; None if there are no readings."""
        return None if self.readings is None else level_difference(self.profile, self.readings)

    @property
    def counts(self) -> bool:
        """True if the run is ranked."""
        return not self.unranked

    @property
    def unranked(self) -> str:
        """Reasons why the run is not ranked; empty if it is ranked."""
        low, high = SOUND
        reasons = {
            f"files were edited by hand after the run ({', '.join(self.edited)})": self.edited,
            "particles went through a wall": self.escaped_particles,
            f"{self.volume_ratio:.3f} of the dispensed volume settled ({low:g} to {high:g} is sound)": not kept_volume(
                self.volume_ratio
            ),
        }
        return " and ".join(reason for reason, applies in reasons.items() if applies)

    @property
    def held_out(self) -> bool:
        """True if the run's readings were not used for calibration."""
        return self.comparison is not None and self.comparison.role == "held-out"


@dataclass(frozen=True)
class DifferingSettings:
    """Settings that differ among runs, with the value in every run; None if it is not set."""

    shown: Mapping[str, list[Any]]
    left_out: Mapping[str, list[Any]]

    @property
    def words(self) -> str:
        """Sentence on the settings that are left out; empty if there are none."""
        if not self.left_out:
            return ""
        tables = Counter(name.rpartition(".")[0] for name in self.left_out)
        named = ", ".join(f"[{table}] {count}" for table, count in tables.items())
        number = counted(len(self.left_out), "differing setting")
        return (
            f"Not listed, since without effect on the level and its error: {number} ({named}). "
            "'sealtwin compare --all' lists them."
        )


def differing(sides: Sequence[Side], *, all_settings: bool = False) -> DifferingSettings:
    """Return the settings that differ among the runs.

    Those that change the level or its error in no run are left out, or come last if ``all_settings`` is True.
    """
    names = dict.fromkeys(name for side in sides for name in side.settings)
    values = {name: [side.settings.get(name) for side in sides] for name in names}
    values = {name: each for name, each in values.items() if any(value != each[0] for value in each[1:])}
    idle = {name for name in values if all(name in side.without_effect for side in sides if name in side.settings)}
    first = {name: each for name, each in values.items() if name not in idle}
    last = {name: each for name, each in values.items() if name in idle}
    return DifferingSettings({**first, **last}, {}) if all_settings else DifferingSettings(first, last)


def first_with_readings(sides: Sequence[Side]) -> list[int | None]:
    """Return for each run the index of the first run with the same readings; None for a run without readings.

    Readings with equal numbers count as the same, even if their sheets differ.
    """
    return [
        next((first for first, other in enumerate(sides[: index + 1]) if _same(other.readings, side.readings)), None)
        for index, side in enumerate(sides)
    ]


def _same(one: Profile | None, other: Profile | None) -> bool:
    if one is None or other is None or len(one.s_mm) != len(other.s_mm):
        return False
    pairs = ((one.s_mm, other.s_mm), (one.level_mm, other.level_mm))
    return all(np.allclose(first, second, rtol=0, atol=SAME_MM) for first, second in pairs)


def nearest(sides: Sequence[Side]) -> int | None:
    """Return the index of the ranked run with the smallest mean error.

    Returns None if no ranked run has readings. Also returns None if their readings differ, since some readings are
    easier to fit than others.
    """
    errors_mm = {
        index: side.comparison.mean_error_mm
        for index, side in enumerate(sides)
        if side.comparison is not None and side.counts
    }
    firsts = first_with_readings(sides)
    return min(errors_mm, key=errors_mm.__getitem__) if len({firsts[index] for index in errors_mm}) == 1 else None


def held_out_mean_mm(sides: Sequence[Side]) -> float | None:
    """Return the average of the mean errors of the ranked held-out runs, or None if there are none."""
    comparisons = [side.comparison for side in sides if side.held_out and side.counts]
    errors_mm = [one.mean_error_mm for one in comparisons if one is not None]
    return float(np.mean(errors_mm)) if errors_mm else None


def replicate_words(sides: Sequence[Side]) -> list[str]:
    """Return sentences on the area validation metric of each trial with replicates, or on what the metric needs.

    The metric (Ferson, Oberkampf & Ginzburg 2008) is the area between the distributions of one figure over replicates,
    which are runs of the same crack, path and paste. In one dimension it is the Wasserstein distance.
    """
    from scipy.stats import wasserstein_distance

    # The runs of each trial, grouped by their readings.
    trials: dict[str, dict[int | None, list[int]]] = {}
    for index, first in enumerate(first_with_readings(sides)):
        if first is not None and sides[index].counts:
            trials.setdefault(sides[index].replicate_of, {}).setdefault(first, []).append(index)
    sentences, replicated = [], False
    for copies in trials.values():
        sentences += [
            f"{numbered(same).capitalize()} have the same readings (to {SAME_MM:g} mm at every station): copies are "
            "not replicates, so only the first run counts."
            for same in copies.values()
            if len(same) > 1
        ]
        own = [same[0] for same in copies.values()]
        if len(own) >= FEWEST:
            replicated = True
            errors = [error for index in own if (error := sides[index].error) is not None]
            measured_mm = np.array([error.base.mean() for error in errors])
            metric_mm = wasserstein_distance(measured_mm + [error.mean() for error in errors], measured_mm)
            sentences.append(
                f"Area validation metric of the mean level over {len(own)} replicates ({numbered(own)}): "
                f"{metric_mm:.3f} mm."
            )
    if not replicated:
        sentences.append(
            f"No area validation metric: it needs at least {FEWEST} replicates, which are runs of a trial with "
            "the same settings and different readings."
        )
    return sentences


def numbered(indices: Sequence[int]) -> str:
    """Return the numbers of runs in words, for example "runs 1, 2 and 5"."""
    *before, last = [str(index + 1) for index in indices]
    return f"runs {', '.join(before)} and {last}" if before else f"run {last}"
