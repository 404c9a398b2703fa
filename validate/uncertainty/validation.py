"""A trial's extra runs, and the conclusions from a difference between simulation and data, after ASME V&V 20 (2009)."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, Self

import numpy as np
from pydantic import TypeAdapter

from sealtwin.core.records import Floats, Integers, Numbers
from sealtwin.core.replicates import require_different
from validate.comparison import BudgetPart, MeanLevelBudget, StationErrors
from validate.result import Comparison
from validate.uncertainty.inputs import Effect, InputDraws, Inputs, along
from validate.uncertainty.numerics import Replicates
from validate.units import counted, signed

COVERAGE = 2.0  # Coverage factor k of a 95 % interval of a normal distribution

NOT_ASSESSED = "ASME V&V 20: not assessed: 'sealtwin validate RUN --uncertainty'"


def mean_level_budget(
    error_mm: float,
    validation_mm: float,
    data_mm: float,
    numerics_mm: float | None = None,
    inputs_mm: float | None = None,
    inputs_waiting: bool = False,
    volume_level_mm: float | None = None,
) -> MeanLevelBudget:
    """Return the error E = S - D of the mean level with its standard uncertainties.

    Whether E is above twice their sum is left open until numerics and all declared inputs are known.
    """
    assessed = numerics_mm is not None and inputs_mm is not None and not inputs_waiting
    return MeanLevelBudget(
        error_mm=error_mm,
        volume_level_mm=volume_level_mm,
        data_mm=data_mm,
        numerics_mm=numerics_mm,
        inputs_mm=inputs_mm,
        inputs_waiting=inputs_waiting,
        validation_mm=validation_mm,
        resolved=abs(error_mm) > COVERAGE * validation_mm if assessed else None,
    )


def level_sentences(
    mean: MeanLevelBudget,
    stations: StationErrors,
    parts: Sequence[BudgetPart],
    *,
    calibrated: bool = False,
    screening: bool = False,
) -> tuple[str, str]:
    """Return the sentences on the mean level and on the stations.

    The first is that of ASME V&V 20 where numerics and inputs are known; else it says that there is none. Where the
    model was ``calibrated`` on the readings, E is not the error of a prediction, which V&V 20 is about; nor is it where
    a model for ``screening`` made the level.
    """
    if screening:
        return "ASME V&V 20: not assessed: the level is the fast model's.", _station_sentence(
            stations, parts, _known(mean)
        )
    if mean.resolved is None:
        return _not_assessed(mean), _station_sentence(stations, parts, _known(mean))
    half_mm = COVERAGE * mean.validation_mm
    span = f"{signed(mean.error_mm - half_mm, 2)} and {signed(mean.error_mm + half_mm, 2)} mm"
    figures = f"ASME V&V 20: E = {signed(mean.error_mm, 2)} mm, {COVERAGE:g} u_val = {half_mm:.2f} mm"
    if mean.resolved:
        way = "high" if mean.error_mm > 0 else "low"
        text = f"The model's mean level is too {way} ({figures}): its error lies between {span}."
    else:
        text = (
            f"The mean level is consistent with the readings ({figures}): the model's error in it lies between {span}. "
            "This does not say that the model is right."
        )
    if calibrated:
        text += " The model was calibrated on these readings, which makes E smaller than that of a prediction."
    return text, _station_sentence(stations, parts, "readings, numerics and inputs")


def with_time(comparison: Comparison, extra_runs: str) -> Comparison:
    """Return a comparison whose findings state the time, in words, of the runs that V&V 20 needs."""
    if not extra_runs:
        return comparison
    timed = {f"{NOT_ASSESSED}.": f"{NOT_ASSESSED}, about {extra_runs}."}
    return comparison.model_copy(update={"findings": tuple(timed.get(one, one) for one in comparison.findings)})


def _not_assessed(mean: MeanLevelBudget) -> str:
    if mean.numerics_mm is not None and mean.inputs_mm is None and not mean.inputs_waiting:
        return "ASME V&V 20: not assessed: [uncertainty] declares no input of the run, such as volume_ml."
    return f"{NOT_ASSESSED}."


def _known(mean: MeanLevelBudget) -> str:
    """Return the names of the uncertainties that are known, where not all are."""
    parts = ["readings"] if mean.numerics_mm is None else ["readings", "numerics"]
    return " and ".join(parts if mean.inputs_mm is None else [*parts, "some inputs"]) + " alone"


def _station_sentence(stations: StationErrors, parts: Sequence[BudgetPart], known: str) -> str:
    """Return the sentence on the stations; the bands are those by what is ``known``, whose ``parts`` are named.

    Many stations are many tests, so that one is off where its error leaves the band of all together.
    """
    count, off = len(stations.error_mm), stations.off
    above = int(stations.above.sum())
    high = int((off & (stations.error_mm > 0)).sum())
    where = f" ({high} too high, {int(off.sum()) - high} too low)" if off.any() else ""
    chance = f"about {stations.by_chance:.0f}" if stations.by_chance >= 0.5 else "fewer than 1"
    largest = max(parts, key=lambda one: one.station_mm).name
    verb, whose = ("lies", "its") if above == 1 else ("lie", "their")
    return (
        f"At {int(off.sum()) or 'none'} of {counted(count, 'station')} the level leaves the 95 % band of the whole "
        f"profile{where}, by {known}. {above or 'None'} {verb} outside {whose} own band; {chance} would by chance, if "
        f"the budget of errors (mostly {largest}) is complete."
    )


def missing_sentence(missing: Sequence[BudgetPart]) -> str:
    """Return the sentence on errors of the readings that are in no interval."""
    names = ", ".join(one.name for one in missing)
    return f"In no interval (declare it to include it): {names}."


def two_level_design(inputs: int) -> Integers:
    """Return -1 or 1 for each run and input, (runs, inputs): columns of a Hadamard matrix, balanced and orthogonal.

    Up to 1, 3, 7 or 15 inputs take 2, 4, 8 or 16 runs (Plackett & Burman 1946). An effect is a difference of two
    halves of all runs, which averages out most of the scatter of single runs; the interaction of two inputs is
    confounded with the effect of a third one.
    """
    return _matrix(inputs)[:, 1 : inputs + 1]


def effects_of(results: Floats, inputs: int) -> tuple[Floats, float | None]:
    """Return the effect of each input, from its middle to its upper value, (inputs, k), and its scatter by chance.

    ``results``, (runs, k), are in the order of ``two_level_design``. The scatter is a standard deviation, root mean
    square over k, from the columns without an input; None where every column has one.
    """
    contrasts = _matrix(inputs).T @ results / len(results)
    spare = contrasts[inputs + 1 :]
    return contrasts[1 : inputs + 1], float(np.sqrt(np.mean(spare**2))) if len(spare) else None


def _matrix(inputs: int) -> Integers:
    from scipy.linalg import hadamard

    return np.asarray(hadamard(2 ** max(1, inputs.bit_length())), dtype=np.int64)


@dataclass(frozen=True)
class SizeRuns:
    """Levels of runs with particles of one size and the same physics, which differ in seed."""

    radius_mm: float
    levels_mm: Numbers  # (runs, k)


@dataclass(frozen=True)
class Spread:
    """Levels of all extra runs at ``s_mm``, (k,)."""

    s_mm: Numbers
    sizes: tuple[SizeRuns, SizeRuns, SizeRuns] | None
    """Runs with finer particles, with the trial's own, its run first, and with coarser ones; None of the fast model."""
    effects: tuple[Effect, ...]  # Effects of the inputs whose standard uncertainty is declared, by particles
    effect_scatter_mm: float | None
    """Standard deviation of an effect by the scatter of single runs; None where it is not known."""
    design_radius_mm: float | None  # Particle radius in the runs of the effects; None where there are none
    draws: InputDraws | None = None  # Runs of the fast model with moved inputs, in place of effects by particles

    def __post_init__(self) -> None:
        """Raise InputError if runs of one size are copies of each other."""
        for size in self.sizes or ():
            seeds = [f"with seed + {number}" for number in range(len(size.levels_mm))]
            require_different(size.levels_mm, seeds, f"extra runs at a radius of {size.radius_mm:.4g} mm")

    def at(self, s_mm: Floats) -> Replicates | None:
        """Return the levels of the runs of each size at other places; None where there are none."""
        if self.sizes is None:
            return None
        levels_mm = [along(s_mm, self.s_mm, size.levels_mm) for size in self.sizes]
        return Replicates([size.radius_mm for size in self.sizes], levels_mm)

    def inputs_at(self, s_mm: Floats) -> Inputs:
        """Return the effects of the inputs at other places."""
        if self.draws is not None:
            return self.draws.inputs.at(self.draws.s_mm, s_mm)
        return Inputs("particles", self.effects).at(self.s_mm, s_mm)

    def content(self) -> dict[str, Any]:
        """Return the content of a JSON file."""
        return {"version": 2, **asdict(self)}

    @classmethod
    def of(cls, content: dict[str, Any]) -> Self:
        """Return the spread from the content of a JSON file. Raises ValueError for others."""
        if content.get("version") == 1:
            # Of one run at each size.
            sizes = [{"radius_mm": one["radius_mm"], "levels_mm": [one["level_mm"]]} for one in content["sizes"]]
            content = content | {"sizes": sizes}
        spread = TypeAdapter(cls).validate_python(content)
        levels_mm = [*(size.levels_mm for size in spread.sizes or ()), *(one.level_mm[None] for one in spread.effects)]
        if any(each.ndim != 2 or each.shape[1] != len(spread.s_mm) for each in levels_mm):
            raise ValueError("not one level for each s_mm")
        if (draws := spread.draws) is not None and draws.moved_mm.shape[1:] != draws.s_mm.shape:
            raise ValueError("not one level of each run with moved inputs for each s_mm")
        return spread
