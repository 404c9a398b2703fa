"""Intervals of a level: its bands, the budget of its errors, and the band of a predicted level.

The docstring of a figure is its description in the published schema of report.json.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from pydantic import ConfigDict, Field, with_config

from sealtwin.core.facts import Facts
from sealtwin.core.records import Booleans, JsonRecord, Numbers
from sealtwin.core.solid_figures import Span

PART = ConfigDict(extra="forbid")


def in_unit(unit: str) -> Any:
    """Return a field with a unit for the published schema. Use it if the field's name does not end with a unit."""
    return Field(json_schema_extra={"unit": unit})


class StationBands(JsonRecord):
    """Half-widths of the 95 % bands of the measured levels at the stations, (n,) each."""

    s_mm: Numbers
    """Positions of the stations along the crack."""
    band_95_mm: Numbers
    """Half-width of the 95 % band of a single station. By chance, one station in twenty is outside its band."""
    profile_band_95_mm: Numbers
    """Half-width of the band that contains all stations at once in 95 % of cases."""


@with_config(PART)
@dataclass(frozen=True)
class BudgetPart:
    """One error of the budget and its standard uncertainties, each half the half-width of a 95 % interval.

    The intervals of the results do not include undeclared errors. The uncertainties of an undeclared error are computed
    for an assumed size of 0.2 mm, or for a meniscus of water.
    """

    name: str
    """Name of the error in words."""
    setting: str
    """Key of the trial file that declares the error. Empty if there is no such key."""
    source: str
    """Origin of the error's size: repeats, detected, declared, allowed for, assumed or computed."""
    kind: str
    """Kind of the error: readings, numerics, inputs or model."""
    mean_level_mm: float
    """Standard uncertainty of the mean level. The bias has the same uncertainty."""
    mean_error_mm: float | None
    """Standard uncertainty of the mean error, provided that this error changes the sign of the level's error at no
    position. None for a predicted level."""
    station_mm: float
    """Standard uncertainty of the level at a station, or at a position of a predicted level, as root mean square over
    all stations or positions."""


class BudgetSummary(JsonRecord):
    """All errors of a comparison, part by part."""

    parts: tuple[BudgetPart, ...]
    """Errors that the intervals include, one by one."""
    missing: tuple[BudgetPart, ...]
    """Undeclared errors that the data cannot show. Each has the effect of an assumed size of 0.2 mm, or of a meniscus
    of water."""
    scatter_known: bool
    """True if stations were read repeatedly, or if the repeatability is declared."""
    notes: Facts
    """Findings about outliers, rounding to one side, few stations, and stations that the probe cannot read."""


class MeanLevelBudget(JsonRecord):
    """Error of the mean level and its standard uncertainties, as defined by ASME V&V 20."""

    error_mm: float
    """E: simulated minus measured mean level."""
    volume_level_mm: float | None
    """Part of E that is due to volume gained by the numerics: this volume divided by the area of the fluid's surface.
    It is negative if volume was lost. None if there are no particles."""
    data_mm: float
    """Standard uncertainty due to the readings."""
    numerics_mm: float | None
    """Standard uncertainty due to particle size, scatter of runs and changes of volume. None if there are no runs at
    three particle sizes."""
    inputs_mm: float | None
    """Standard uncertainty due to the declared inputs. None if no input was varied."""
    validation_mm: float
    """Combined standard uncertainty of the available parts. It equals u_val if numerics and inputs are included."""
    resolved: bool | None
    """True if |E| exceeds twice u_val, and False if it does not. None until the numerics and all declared inputs have
    been evaluated."""
    inputs_waiting: bool
    """True if a declared input has not been varied in any run yet."""


class StationErrors(JsonRecord):
    """Error of the level at each station, and its standard uncertainties, (n,) each."""

    s_mm: Numbers
    """Positions of the stations along the crack."""
    error_mm: Numbers
    """Simulated minus measured level."""
    data_mm: Numbers
    """Standard uncertainty due to the readings."""
    numerics_mm: Numbers | None
    """Standard uncertainty due to the numerics. None if it was not computed."""
    inputs_mm: Numbers | None
    """Standard uncertainty due to the declared inputs. None if no input was varied."""
    validation_mm: Numbers
    """Combined standard uncertainty of the available parts."""
    profile_mm: Numbers
    """Half-width of the combined 95 % band that contains all stations at once."""
    by_chance: float
    """Number of stations that would be outside their own bands by chance if the model were perfect."""

    @property
    def above(self) -> Booleans:
        """True at stations at which |E| exceeds the 95 % band of the single station, (n,)."""
        return np.abs(self.error_mm) > 2 * self.validation_mm

    @property
    def off(self) -> Booleans:
        """True at stations at which |E| exceeds the 95 % band of all stations together, (n,)."""
        return np.abs(self.error_mm) > self.profile_mm


@with_config(PART)
@dataclass(frozen=True)
class StationError:
    """The error at a single station."""

    error_mm: float
    """Absolute error at the station."""
    s_mm: float
    """Position of the station along the crack."""


@with_config(PART)
@dataclass(frozen=True)
class ShiftedError:
    """Result of the comparison if the readings are shifted along the crack."""

    shift_mm: float
    """Shift of the readings along the crack."""
    mean_error_mm: float
    """Mean error with the readings shifted by ``shift_mm``."""
    bias_mm: float
    """Bias with the readings shifted by ``shift_mm``."""


class Alignment(JsonRecord):
    """Convention for s = 0, and the errors with other conventions."""

    choice: str
    """Sentence that states the convention for s = 0."""
    shifts: tuple[ShiftedError, ...]
    """Errors with the readings shifted along the crack, because s = 0 is a convention."""


class SizeSeries(JsonRecord):
    """A figure that was computed at three particle sizes."""

    values: tuple[float, ...] = in_unit("mm")
    """Mean over the runs at each size."""
    runs: tuple[int, ...]
    """Number of runs at each size, with different seeds."""
    scatter: float = in_unit("mm")
    """Standard deviation of a single run."""
    order_95: Span
    """Ends of the 95 % range of the order of convergence, which is within 0.5 to 2."""
    band: float = in_unit("mm")
    """Half-width of the 95 % interval of the discretisation error at the middle size. It does not include the scatter
    of single runs."""


@with_config(PART)
@dataclass(frozen=True)
class SizeStudy:
    """Mean level and mean error at three particle sizes, from the finest to the coarsest."""

    radii_mm: tuple[float, ...]
    """Radii of the particles. The trial's radius is in the middle."""
    mean_level_mm: SizeSeries
    """Mean of the simulated level over the covered length."""
    mean_error_mm: SizeSeries
    """Mean absolute error against the readings over the covered length."""


class InputEffect(JsonRecord):
    """Change of the simulated level when an input is increased by its standard uncertainty."""

    name: str
    """Key of the input in the table [uncertainty]."""
    standard: float = in_unit("that of the name")
    """Declared standard uncertainty, in the unit at the end of the name."""
    mean_level_mm: float
    """Change of the mean simulated level."""
    largest_mm: float
    """Largest absolute change of the simulated level along the crack."""
    share: float
    """First-order index: the part of the variance of the mean level that this input alone causes, as a fraction of the
    variance that all inputs cause."""
    model: str
    """Model that computed the effect: particles, or slot for the fast model."""


class InputDrawsRecord(JsonRecord):
    """Runs of the fast model in which all inputs vary at random together."""

    runs: int
    """Number of runs, without the run with unchanged inputs."""
    together: float
    """Fraction of the mean level's variance that is due to interactions between inputs."""
    unfit: Facts
    """Reasons why the fast model is not valid for this case."""


class ErrorUncertainty(JsonRecord):
    """Intervals of the error, and the parts that cause them."""

    mean_error_interval_mm: Span
    """Ends of the 95 % interval of the mean error due to the readings."""
    bias_interval_mm: Span
    """Ends of the 95 % interval of the bias due to the readings."""
    bias_systematic_mm: float
    """Systematic standard uncertainty of the bias, which more stations would not reduce."""
    levels: StationBands
    budget: BudgetSummary
    mean_level: MeanLevelBudget
    stations: StationErrors
    worst_at_a_station: StationError | None
    """Largest error at a station. None if the overall largest error is at a station."""
    findings: Facts
    """Conclusions that ASME V&V 20 allows, or the reason why it was not assessed, and findings about errors that no
    interval includes."""
    alignment: Alignment
    numerics: SizeStudy | None
    """Mean level and mean error at three particle sizes. None if there are runs at only one size."""
    inputs: tuple[InputEffect, ...]
    """Effects of the inputs that were varied."""
    input_draws: InputDrawsRecord | None
    """Runs of the fast model in which all inputs vary at random together. None if the inputs were varied with
    particles, or not at all."""
    inputs_left_out: tuple[str, ...]
    """Names of the inputs without a declared uncertainty."""
    effect_scatter_mm: float | None
    """Standard deviation of an effect due to the scatter of single runs. None if it was not computed."""
    design_radius_mm: float | None
    """Particle radius in the runs that computed the effects of the inputs. None if there are no such runs."""


class PredictedLevel(JsonRecord):
    """Level of a run without readings, and its band due to the numerics and the declared inputs."""

    s_mm: Numbers
    """Positions along the crack at which level, bands and uncertainties are given."""
    level_mm: Numbers
    """Predicted level, measured from the face."""
    band_95_mm: Numbers
    """Half-width of the 95 % band at a single position."""
    profile_band_95_mm: Numbers
    """Half-width of the band that contains the whole level in 95 % of cases."""
    numerics_mm: Numbers | None
    """Standard uncertainty due to the numerics. None if it was not computed."""
    inputs_mm: Numbers | None
    """Standard uncertainty due to the inputs. None if no input is declared."""
    model_mm: Numbers | None = None
    """Standard uncertainty due to the model. It combines up to three errors: at the ends of the path if the fluid has a
    yield stress, from the meniscus if a surface tension is declared, and half of the difference between particles and
    fast model if both were computed. None if all three are missing."""
    fast_level_mm: Numbers | None = None
    """Level computed by the fast model. None if that model is not valid here, or if it computed ``level_mm``."""
    flat_level_mm: Numbers | None = None
    """Flat level of the dispensed volume in the crack."""
    mean_level_mm: float
    """Mean of the predicted level along the crack."""
    mean_level_95_mm: Span
    """Ends of the mean level's 95 % interval."""
    parts: tuple[BudgetPart, ...]
    """Errors that the band includes, one by one."""
    missing: tuple[BudgetPart, ...] = ()
    """Undeclared errors of the model, which the band does not include."""
    inputs: tuple[InputEffect, ...]
    """Effects of the inputs that were varied."""
    inputs_left_out: tuple[str, ...]
    """Names of the inputs without a declared uncertainty."""
    unfit: Facts
    """Reasons why the fast model is not valid for this case."""
