"""Conclusions from the errors of a level: with readings, after ASME V&V 20 (2009); else the band of a prediction."""

from collections.abc import Iterable, Sequence

import numpy as np

from sealtwin.core.facts import Fact
from sealtwin.core.records import Floats, Profile
from validate.comparison import BudgetPart, MeanLevelBudget, StationErrors
from validate.result import PredictedLevel, PredictedPart
from validate.settings import Uncertainty
from validate.uncertainty.bed_ends import BedEnds
from validate.uncertainty.budget import Budget, Component, Curve, Kind, draws_for, half_width, normals, rms
from validate.uncertainty.computed import Spread, numerical_errors
from validate.uncertainty.meniscus import Mouth
from validate.units import counted, signed

MEAN_LEVEL = "validation.mean-level"  # Key of the conclusion according to ASME V&V 20
COVERAGE = 2.0  # Coverage factor k of a 95 % interval of a normal distribution

NOT_ASSESSED = "ASME V&V 20 is not assessed: run 'sealtwin validate RUN --uncertainty'."
NO_INPUT = "ASME V&V 20 is not assessed: declare an input of the run, such as volume_ml, in [uncertainty]."


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

    ``resolved`` is None until numerics and all declared inputs are included.
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


def level_findings(
    mean: MeanLevelBudget,
    stations: StationErrors,
    parts: Sequence[BudgetPart],
    *,
    calibrated: bool = False,
    screening: bool = False,
) -> tuple[Fact, Fact]:
    """Return the findings on the mean level and on the stations.

    The first is the conclusion according to ASME V&V 20 if numerics and inputs are included. Otherwise it states that
    V&V 20 is not assessed. If the model was ``calibrated`` on the readings, E is not the error of a prediction, which
    V&V 20 requires; a model for ``screening`` is not assessed either.
    """
    if screening:
        text = "ASME V&V 20 is not assessed, since the fast model computed the level."
        return Fact(MEAN_LEVEL, text), _of_stations(stations, parts, _included(mean))
    if mean.resolved is None:
        no_input = mean.numerics_mm is not None and mean.inputs_mm is None and not mean.inputs_waiting
        text = NO_INPUT if no_input else NOT_ASSESSED
        return Fact(MEAN_LEVEL, text), _of_stations(stations, parts, _included(mean))
    half_mm = COVERAGE * mean.validation_mm
    span = f"{signed(mean.error_mm - half_mm, 2)} and {signed(mean.error_mm + half_mm, 2)} mm"
    figures = f"ASME V&V 20: E = {signed(mean.error_mm, 2)} mm, {COVERAGE:g} u_val = {half_mm:.2f} mm"
    if mean.resolved:
        way = "high" if mean.error_mm > 0 else "low"
        text = f"The model's mean level is too {way} ({figures}): its error is between {span}."
    else:
        text = (
            f"The mean level is consistent with the readings ({figures}): the model's error in it is between {span}. "
            "This does not show that the model is right."
        )
    if calibrated:
        text += " The model was calibrated on these readings, which makes E smaller than that of a prediction."
    conclusion = Fact(MEAN_LEVEL, text, mean.error_mm, "mm")
    return conclusion, _of_stations(stations, parts, "readings, numerics and inputs")


def _included(mean: MeanLevelBudget) -> str:
    """Return the names of the included uncertainties if some are missing."""
    parts = ["readings"] if mean.numerics_mm is None else ["readings", "numerics"]
    return " and ".join(parts if mean.inputs_mm is None else [*parts, "some inputs"]) + " alone"


def _of_stations(stations: StationErrors, parts: Sequence[BudgetPart], included: str) -> Fact:
    """Return the finding on the stations.

    ``included`` names the uncertainties in the bands, ``parts`` are their errors. Many stations are many tests, so a
    station counts as off if its error is outside the band of all stations together.
    """
    count, off = len(stations.error_mm), stations.off
    above = int(stations.above.sum())
    high = int((off & (stations.error_mm > 0)).sum())
    where = f" ({high} too high, {int(off.sum()) - high} too low)" if off.any() else ""
    chance = f"about {stations.by_chance:.0f}" if stations.by_chance >= 0.5 else "fewer than 1"
    largest = max(parts, key=lambda one: one.station_mm).name
    text = (
        f"The level is outside the 95 % band of the whole profile at {int(off.sum()) or 'none'} of "
        f"{counted(count, 'station')}{where}, and outside the station's own band at {above or 'none'} ({chance} by "
        f"chance, if no error is missing). The bands include the errors of {included}, mostly {largest}."
    )
    return Fact("validation.stations", text, int(off.sum()))


def missing_errors(missing: Sequence[BudgetPart]) -> Fact:
    """Return the finding on errors of the readings that no interval includes."""
    names = ", ".join(one.name for one in missing)
    text = f"Not covered by any interval (declare it to include it): {names}."
    return Fact("validation.missing", text, len(missing))


PLACES = 101  # Number of positions of the band; over 250 would get fewer draws
DIGITS = 4  # Decimals of a level in mm


def predict(
    simulated: Profile,
    spread: Spread,
    declared: Uncertainty,
    volume_level_mm: float | None = None,
    ends: BedEnds | None = None,
    mouth: Mouth | None = None,
    flat: Profile | None = None,
) -> PredictedLevel:
    """Return the band of a simulated level that follows from extra runs. It is consistent with ``error_uncertainty``.

    ``volume_level_mm`` is the change of level due to volume that the numerics gained; None if it is unknown. ``ends``
    adds the error of the model at the path's ends. A comparison does not include it: there it is what is looked for.
    ``mouth`` adds or names the meniscus, since the level in the middle is predicted. ``flat`` is the level of the
    dispensed volume, for the record. Half of the difference of particles and fast model is an error of the model too.
    """
    # Evaluate the level at the rounded positions: it may fall steeply between two of them.
    s_mm = np.round(np.linspace(simulated.s_mm[0], simulated.s_mm[-1], PLACES), DIGITS)
    level_mm = np.interp(s_mm, simulated.s_mm, simulated.level_mm)
    sizes, moved = spread.at(s_mm), spread.inputs_at(s_mm)
    computed = numerical_errors(sizes, volume_level_mm) if sizes is not None else []
    of_model = [] if ends is None else [ends.errors(s_mm)]
    fast_mm, missing = None, []
    if spread.fast_mm is not None:
        fast_mm = np.interp(s_mm, spread.s_mm, spread.fast_mm)
        half_mm = normals("two models", 1, draws_for(PLACES)) * (fast_mm - level_mm) / 2
        name = "half of the difference of particles and fast model"
        of_model.append(Component(name, "computed", half_mm, shared=True, kind="model"))
    tension_n_m = declared.surface_tension_n_m
    if mouth is not None and (meniscus := mouth.meniscus(s_mm, level_mm, tension_n_m, "model")) is not None:
        (missing if tension_n_m is None else of_model).append(meniscus)
    budget = Budget(PLACES, (*computed, *moved.errors(), *of_model))
    weights = Curve.of(s_mm, level_mm, s_mm).weights()
    mean_mm, half_mm = float(weights[0] @ level_mm), budget.mean_mm(weights)

    def standard_mm(kind: Kind) -> Floats | None:
        alone = budget.of(kind)
        return np.round(alone.band_mm / COVERAGE, DIGITS) if alone.components else None

    def parts(components: Iterable[Component]) -> tuple[PredictedPart, ...]:
        return tuple(
            PredictedPart(
                name=one.name,
                kind=one.kind,
                setting=one.setting,
                mean_level_mm=Budget(PLACES, (one,)).mean_mm(weights) / COVERAGE,
                place_mm=rms(half_width(one.draws_mm)) / COVERAGE,
            )
            for one in components
        )

    effects, _ = moved.reported(s_mm)
    return PredictedLevel(
        s_mm=s_mm,
        level_mm=np.round(level_mm, DIGITS),
        band_95_mm=np.round(budget.band_mm, DIGITS),
        profile_band_95_mm=np.round(budget.profile_band_mm, DIGITS),
        numerics_mm=standard_mm("numerics"),
        inputs_mm=standard_mm("inputs"),
        model_mm=standard_mm("model"),
        mean_level_mm=mean_mm,
        mean_level_95_mm=(mean_mm - half_mm, mean_mm + half_mm),
        parts=parts(budget.components),
        missing=parts(missing),
        inputs=effects,
        inputs_left_out=declared.left_out,
        fast_level_mm=None if fast_mm is None else np.round(fast_mm, DIGITS),
        flat_level_mm=None if flat is None else np.round(np.interp(s_mm, flat.s_mm, flat.level_mm), DIGITS),
        unfit=spread.unfit,
    )
