"""Finished runs compared: what differs, which is nearest, whose readings are the same, what replicates show."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sealtwin.records import Profile
from validate.comparison.curves import Difference, Pieces
from validate.studies.replicates import FEWEST, area_validation_metric

SAME_MM = 0.01
"""By which readings may differ at every station and still be the same ones: the last digit of a caliper. Readings taken
again scatter by ten times that."""


@dataclass(frozen=True)
class Side:
    """One run."""

    name: str
    """By which it is told from the others."""
    settings: Mapping[str, Any]
    """By dotted name."""
    profile: Profile
    readings: Profile | None
    metrics: Mapping[str, Any]
    """Its comparison.json; empty where it has no readings."""
    facts: Mapping[str, float | None]
    """What is known of the run itself, by name with unit."""
    replicate_of: str
    """The same where crack as it was ordered, path, paste and solver are: runs of one trial, done again."""
    volume_ratio: float
    """What the settled sealant fills over what was dispensed."""
    escaped_particles: int = 0
    """That went through a wall."""
    edited: Sequence[str] = ()
    """Its files that somebody changed after the run."""

    @property
    def counts(self) -> bool:
        """Whether its levels are a run's own, and of one that may be used: else it is nearest to nothing."""
        return not self.edited and not self.escaped_particles


def differing(sides: Sequence[Side]) -> dict[str, list[Any]]:
    """Settings that are not the same in all runs, each with its values in their order; None where a run has none."""
    names = list(dict.fromkeys(name for side in sides for name in side.settings))
    values = {name: [side.settings.get(name) for side in sides] for name in names}
    return {name: found for name, found in values.items() if any(value != found[0] for value in found[1:])}


def first_with_readings(sides: Sequence[Side]) -> list[int | None]:
    """For each run the first one, from 0, that has the same readings, maybe itself; None where it has none.

    The same numbers are the same readings, whatever sheet they were copied into.
    """
    found: list[int | None] = []
    for index, side in enumerate(sides):
        before = (first for first in range(index) if _same(sides[first].readings, side.readings))
        found.append(None if side.readings is None else next(before, index))
    return found


def nearest(sides: Sequence[Side]) -> int | None:
    """Index of the run with the least mean error, of those that count.

    None where these are held against different readings, of which some are easier to meet, or against none.
    """
    held = [index for index, side in enumerate(sides) if side.metrics and side.counts]
    firsts = first_with_readings(sides)
    if not held or len({firsts[index] for index in held}) > 1:
        return None
    return min(held, key=lambda index: sides[index].metrics["mean_error_mm"])


def replicate_words(sides: Sequence[Side]) -> list[str]:
    """The area validation metric of each trial that was done again, in sentences; or what it would take."""
    groups: dict[str, list[int]] = {}
    for index, side in enumerate(sides):
        if side.readings is not None and side.counts:
            groups.setdefault(side.replicate_of, []).append(index)
    first_with, told, found = first_with_readings(sides), [], False
    for members in groups.values():
        copies: dict[int | None, list[int]] = {}
        for index in members:
            copies.setdefault(first_with[index], []).append(index)
        told += [
            f"{numbered(same).capitalize()} hold the same readings, to {SAME_MM:g} mm at every station: copies are no "
            "replicates, and only the first one counts."
            for same in copies.values()
            if len(same) > 1
        ]
        own = [same[0] for same in copies.values()]
        if len(own) < FEWEST:
            continue
        simulated_mm, measured_mm = np.array([_mean_levels_mm(sides[index]) for index in own]).T
        metric_mm = area_validation_metric(simulated_mm, measured_mm)
        found = True
        told.append(
            f"Area validation metric of the mean level over {len(own)} replicates ({numbered(own)}): "
            f"{metric_mm:.3f} mm."
        )
    if not found:
        told.append(
            f"No area validation metric: it takes {FEWEST} or more replicates of a trial, the same settings with "
            "readings of their own each, and there are none among these runs."
        )
    return told


def numbered(indices: Sequence[int]) -> str:
    """Runs as a page calls them: "runs 1, 2 and 5"."""
    *before, last = [str(index + 1) for index in indices]
    return f"runs {', '.join(before)} and {last}" if before else f"run {last}"


def _same(one: Profile | None, other: Profile | None) -> bool:
    if one is None or other is None or len(one.s_mm) != len(other.s_mm):
        return False
    pairs = ((one.s_mm, other.s_mm), (one.level_mm, other.level_mm))
    return all(np.allclose(first, second, rtol=0, atol=SAME_MM) for first, second in pairs)


def _mean_levels_mm(side: Side) -> tuple[float, float]:
    """Simulated and measured, over the stretch of s that both have."""
    assert side.readings is not None, "asked of runs with readings alone"
    profile, readings = side.profile, side.readings
    error = Difference(profile.s_mm, profile.level_mm, readings.s_mm, readings.level_mm)
    measured = Pieces(error.x, np.interp(error.x, readings.s_mm, readings.level_mm)).mean()
    return measured + error.mean(), measured
