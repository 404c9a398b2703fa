"""The level of a run without readings as a prediction: its 95 % band by numerics and by what is known of the inputs."""

import numpy as np

from sealtwin.core.records import Floats, Profile
from validate.result import PredictedLevel, PredictedPart
from validate.settings import NO_INPUTS, Uncertainty
from validate.uncertainty.budget import Budget, Curve, Kind, half_width, rms
from validate.uncertainty.numerics import numerical_errors
from validate.uncertainty.validation import COVERAGE, Spread

PLACES = 101  # At which the band is told; more get fewer draws
DIGITS = 4  # Of a millimetre


def predict(
    simulated: Profile, spread: Spread, declared: Uncertainty, volume_level_mm: float | None = None
) -> PredictedLevel | None:
    """Return the band about a simulated level by the results of extra runs, as ``error_uncertainty`` has them.

    None if nothing is known to make a band of: no input was moved, and each particle size was run once.
    ``volume_level_mm`` is the level that volume gained by the numerics makes, if it is known.
    """
    # The level is told at the very places that are written, since it may fall steeply between them.
    s_mm = np.round(np.linspace(simulated.s_mm[0], simulated.s_mm[-1], PLACES), DIGITS)
    level_mm = np.interp(s_mm, simulated.s_mm, simulated.level_mm)
    sizes, moved = spread.at(s_mm), spread.inputs_at(s_mm)
    computed = numerical_errors(sizes, volume_level_mm) if sizes is not None else []
    budget = Budget(PLACES, (*computed, *moved.errors()))
    if not budget.components:
        return None
    weights = Curve.of(s_mm, level_mm, s_mm).weights()
    mean_mm, half_mm = float(weights[0] @ level_mm), budget.mean_mm(weights)

    def standard_mm(kind: Kind) -> Floats | None:
        parts = budget.of(kind)
        return np.round(parts.band_mm / COVERAGE, DIGITS) if parts.components else None

    effects, _ = moved.reported(s_mm)
    return PredictedLevel(
        s_mm=s_mm,
        level_mm=np.round(level_mm, DIGITS),
        band_95_mm=np.round(budget.band_mm, DIGITS),
        profile_band_95_mm=np.round(budget.profile_band_mm, DIGITS),
        numerics_mm=standard_mm("numerics"),
        inputs_mm=standard_mm("inputs"),
        mean_level_mm=mean_mm,
        mean_level_95_mm=(mean_mm - half_mm, mean_mm + half_mm),
        parts=tuple(
            PredictedPart(
                name=one.name,
                kind=one.kind,
                setting=one.setting,
                mean_level_mm=Budget(PLACES, (one,)).mean_mm(weights) / COVERAGE,
                place_mm=rms(half_width(one.draws_mm)) / COVERAGE,
            )
            for one in budget.components
        ),
        inputs=effects,
        inputs_left_out=tuple(sorted(name for name, value in declared if value is None and name not in NO_INPUTS)),
        unfit=() if spread.draws is None else spread.draws.unfit,
    )
