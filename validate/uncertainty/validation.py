"""Conclusions about a level: according to ASME V&V 20 (2009) with readings, or the band of a prediction without."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sealtwin.core.facts import Fact
from sealtwin.core.records import Floats, Profile, Run, Trajectory
from sealtwin.core.regime import GRAVITY_M_S2
from validate.intervals import BudgetPart, MeanLevelBudget, PredictedLevel, StationErrors
from validate.sentences import stated
from validate.settings import Uncertainty
from validate.uncertainty.budget import Budget, Component, Curve, Kind, draws_for, normals
from validate.uncertainty.computed import Spread
from validate.uncertainty.meniscus import Mouth

MEAN_LEVEL = "validation.mean-level"  # Key of the conclusion according to ASME V&V 20
COVERAGE = 2.0  # Coverage factor k of a 95 % interval of a normal distribution


def mean_level_budget(
    error_mm: float,
    validation_mm: float,
    data_mm: float,
    numerics_mm: float | None = None,
    inputs_mm: float | None = None,
    inputs_waiting: bool = False,
    volume_level_mm: float | None = None,
) -> MeanLevelBudget:
    """Return the error E = S - D of the mean level, and its standard uncertainties. S is simulated, D measured.

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
    """Return the findings about the mean level and about the stations.

    If numerics and inputs are included, the first finding is the conclusion according to ASME V&V 20. Otherwise it
    states that V&V 20 was not assessed. If the model was ``calibrated`` on the readings, E is not the error of a
    prediction, which V&V 20 requires. A model for ``screening`` is not assessed either.
    """
    value_mm = None if screening or mean.resolved is None else mean.error_mm
    terms = {"mean": mean, "coverage": COVERAGE, "calibrated": calibrated, "screening": screening}
    # Many stations are many tests, so a station counts as off only outside the band of all stations together.
    of_stations = stated(
        "validation.stations",
        int(stations.off.sum()),
        count=len(stations.error_mm),
        high=int((stations.off & (stations.error_mm > 0)).sum()),
        above=int(stations.above.sum()),
        by_chance=stations.by_chance,
        included=_included(mean),
        largest=max(parts, key=lambda part: part.station_mm).name,
    )
    return stated(MEAN_LEVEL, value_mm, "mm", **terms), of_stations


def _included(mean: MeanLevelBudget) -> str:
    """Return the names of the uncertainties that are included, as words."""
    if mean.resolved is not None:
        return "readings, numerics and inputs"
    parts = ["readings"] if mean.numerics_mm is None else ["readings", "numerics"]
    return " and ".join(parts if mean.inputs_mm is None else [*parts, "some inputs"]) + " alone"


# Two models of the same paste differ most at the ends of the path. Where the nozzle stops, a mound of up to 4 tau / rho
# g remains (tau is the yield stress, rho the density, g gravity), and where it starts, paste creeps back. Two
# computations of the same physics differ there by as much as the mound, and by a quarter of it elsewhere, since the
# volume is the same. Sizes are from particles against a continuum model on pours that were not used to test the bands.
LAST, FIRST = 0.7, 0.35  # Standard deviation of the level at the path's ends, divided by the mound's height
REACH_MM = 6.0  # Distance from the path's ends over which the standard deviation falls to 1/e
MOUND = 4.0  # Height of a mound, divided by tau / rho g


@dataclass(frozen=True)
class BedEnds:
    """First and last position of the nozzle at which sealant flows, and the height of a mound."""

    first_mm: float
    last_mm: float
    mound_mm: float

    @classmethod
    def of(cls, trajectory: Trajectory, run: Run) -> "BedEnds | None":
        """Return the ends of a run's path. Returns None for a fluid without a yield stress, which becomes flat."""
        stress_pa, density_kg_m3 = run.health.yield_stress_pa, run.density_kg_m3
        if not stress_pa or density_kg_m3 is None or trajectory.dispensed_mm3 <= 0:
            return None
        places_mm = trajectory.s_mm[trajectory.giving]
        held_mm = 1e3 * stress_pa / (density_kg_m3 * GRAVITY_M_S2)
        return cls(float(places_mm[0]), float(places_mm[-1]), MOUND * held_mm)

    def errors(self, s_mm: Floats) -> Component:
        """Return the error at positions along the whole crack. Its mean is 0, because volume is conserved."""
        draws = normals("ends of the bed", 2, draws_for(len(s_mm)))
        total = np.zeros((len(draws), len(s_mm)))
        for z, place_mm, share in zip(draws.T, (self.first_mm, self.last_mm), (FIRST, LAST), strict=True):
            shape = np.exp(-np.abs(s_mm - place_mm) / REACH_MM)
            total += np.outer(z, share * self.mound_mm * (shape - shape.mean()))
        return Component("level at the ends of the path", "assumed", total, shared=True, kind="model")


PLACES = 101  # Number of positions of the band. More than 250 would get fewer draws.
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
    """Return a simulated level with the band that follows from extra runs, consistent with ``error_uncertainty``.

    ``volume_level_mm`` is the change of level due to volume that the numerics gained. None if it is unknown. ``ends``
    adds the error of the model at the path's ends. A comparison does not include this error, because it is what a
    comparison should find. ``mouth`` adds or names the meniscus, since the level in the middle is predicted. ``flat``
    is the level of the dispensed volume, for the record. Half of the difference between particles and fast model is an
    error of the model too.
    """
    # Evaluate the level at the rounded positions: it may fall steeply between two of them.
    s_mm = np.round(np.linspace(simulated.s_mm[0], simulated.s_mm[-1], PLACES), DIGITS)
    level_mm = simulated.level_at_mm(s_mm)
    of_model = [] if ends is None else [ends.errors(s_mm)]
    fast_mm, missing = None, []
    if spread.fast_mm is not None:
        fast_mm = np.interp(s_mm, spread.s_mm, spread.fast_mm)
        half_mm = normals("two models", 1, draws_for(PLACES)) * (fast_mm - level_mm) / 2
        name = "half of the difference between particles and fast model"
        of_model.append(Component(name, "computed", half_mm, shared=True, kind="model"))
    tension_n_m = declared.surface_tension_n_m
    if mouth is not None and (meniscus := mouth.meniscus(s_mm, level_mm, tension_n_m, "model")) is not None:
        (missing if tension_n_m is None else of_model).append(meniscus)
    budget = Budget(PLACES, (*spread.errors(s_mm, volume_level_mm), *of_model), tuple(missing))
    curve = Curve.of(s_mm, level_mm, s_mm)
    weights = curve.weights()
    mean_mm, half_mm = float(weights[0] @ level_mm), budget.mean_mm(weights)

    def standard_mm(kind: Kind) -> Floats | None:
        alone = budget.of_kind(kind)
        return np.round(alone.band_mm / COVERAGE, DIGITS) if alone.components else None

    effects, _ = spread.inputs_at(s_mm).reported(s_mm)
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
        parts=tuple(budget.part(component, curve) for component in budget.components),
        missing=tuple(budget.part(component, curve) for component in budget.missing),
        inputs=effects,
        inputs_left_out=declared.left_out,
        fast_level_mm=None if fast_mm is None else np.round(fast_mm, DIGITS),
        flat_level_mm=None if flat is None else np.round(flat.level_at_mm(s_mm), DIGITS),
        unfit=spread.unfit,
    )
