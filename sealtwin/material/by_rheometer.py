"""Fit a paste's Herschel-Bulkley law, or a Bingham line, to a rheometer's flow curve at the shear rates of a fill."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Self

import numpy as np
from pydantic import Field, field_validator, model_validator

from sealtwin.core.errors import InputError
from sealtwin.core.plain_files import read_columns
from sealtwin.core.records import Booleans, Floats, Integers
from sealtwin.material import MeasuredPaste, PasteSettings, four_digits, measured_material
from sealtwin.material.flow_law import FlowLaw, fit_flow_law

RATE, STRESS = "shear_rate_per_s", "stress_pa"  # Names of the columns in the file
MAX_ROWS = 10_000
MIN_ROWS = 5
MIN_RANGE = 3.0  # Smallest ratio of the largest to the smallest shear rate. A smaller range does not determine a law
SLOWEST = 1 / 30
"""Smallest relevant shear rate, as a fraction of the shear rate in the crack.

At this rate and with n = 0.5, the viscous stress is less than a fifth of its value in the flow. The yield stress then
dominates."""
EDGE = 0.02  # Fraction by which a row may be outside the shear rates. Rheometers regulate the rate to about 1 %
THINNEST_PA_S = 0.005  # Smallest apparent viscosity at the largest rate. Water has 0.001, injection resins have 0.1
STIFFEST_PA = 1e4  # Largest stress, which is also the largest yield stress of a run
MAX_ERROR = 0.5  # Largest relative standard uncertainty of a viscosity. Above it, the 95 % interval includes 0
MIN_RISE = 0.01  # Smallest relative increase of the stress over the rates. Less may be a drift of the instrument
MIN_AGAIN = 3  # Smallest number of repeated rates for which a change of the paste is detected
MAX_CHANGE = 0.05  # Largest mean relative change of the stress at repeated rates for an unchanged paste
MAX_ALIKE = 0.8  # Changes are systematic if at least this fraction of them has the same sign
WIDEST_GAP = 3.0  # Largest ratio of neighbouring rates between which the stress is interpolated (in logarithms)
MAX_MISS = 0.1  # Largest RMS relative misfit of a law. Rheometers repeat to a few percent
MISFITS = 3.0  # Largest deviation of a slow row beyond the yield stress' interval, in RMS misfits
Rate = Annotated[float, Field(gt=0, le=1e9)]
Row = Annotated[int, Field(ge=1, le=MAX_ROWS + 1)]
INDEX = (0.2, 2.0)  # Allowed range of fluid.flow_index
BY_HAND = "by hand in [fluid], and note how you found them"
NOT_FOR = (
    "shear rates outside the measured range, in particular lower rates, at which the paste's curve deviates from the "
    "law",
    "a paste of another age, batch or temperature",
    "comparison with a number from another geometry, unless both geometries are named: different rheometers differ "
    "more than repeats on one of them",
)


class FlowCurve(PasteSettings):
    """Settings of a flow curve, and of the fill for which it was measured: options of 'sealtwin material rheometer'.

    The default nozzle, flow and width are from the paper. They give shear rates of 1 to 100 /s.
    """

    nozzle_mm: float = Field(default=2.4, ge=0.01, le=100)
    """Inner diameter of the nozzle, from which the largest shear rate follows."""
    flow_mm3_s: float = Field(default=160.0, ge=1e-3, le=1e6)
    """Flow of the fill."""
    width_mm: float = Field(default=3.1, ge=0.01, le=1000)
    """Width of the crack."""
    shear_rates: tuple[Rate, Rate] | None = None
    """Smallest and largest shear rate in 1/s that the fit uses. Default: computed from nozzle, flow and crack."""
    rows: tuple[Row, Row] | None = None
    """First and last row that the fit uses, to select one of several sweeps. Row 1 is the header."""

    @field_validator("shear_rates", "rows")
    @classmethod
    def _in_order(cls, ends: tuple[float, float] | None) -> tuple[float, float] | None:
        if ends is not None and not ends[0] < ends[1]:
            raise ValueError(f"{ends[0]:g} to {ends[1]:g} is not a range; give the smaller number first")
        return ends

    @model_validator(mode="after")
    def _shear_rates_once(self) -> Self:
        if self.shear_rates and (others := self.model_fields_set & {"nozzle_mm", "flow_mm3_s", "width_mm"}):
            raise ValueError(
                f"shear_rates cannot be combined with {' and '.join(sorted(others))}; give only one of them"
            )
        if self.spread_of_density > self.density_kg_m3 / 2:
            raise ValueError(
                f"density_error_kg_m3 is {self.spread_of_density:g}, more than half of density_kg_m3 = "
                f"{self.density_kg_m3:g}; give the standard uncertainty of the density, or omit density_error_kg_m3"
            )
        return self

    @property
    def shear_rates_per_s(self) -> tuple[float, float]:
        """Smallest and largest relevant shear rate. They are rounded to one digit if they follow from the fill.

        The shear rate at the nozzle's wall is 32 Q / (pi D^3), for a flow Q and a diameter D. The shear rate at the
        crack's walls is 6 Q / w^3, for a stream as wide as the crack's width w. The largest relevant rate is the larger
        of the two. The smallest is the rate in the crack, multiplied by ``SLOWEST``.
        """
        if self.shear_rates is not None:
            return self.shear_rates
        crack = 6 * self.flow_mm3_s / self.width_mm**3
        nozzle = 32 * self.flow_mm3_s / (np.pi * self.nozzle_mm**3)
        return float(f"{SLOWEST * crack:.1g}"), float(f"{max(crack, nozzle):.1g}")


@dataclass(frozen=True)
class _Rows:
    """Rows of a flow curve: shear rates, stresses, and row numbers in the file, (n,) each."""

    path: Path
    rate: Floats
    stress: Floats
    number: Integers

    def __len__(self) -> int:
        return len(self.rate)

    def only(self, kept: Booleans) -> "_Rows":
        return _Rows(self.path, self.rate[kept], self.stress[kept], self.number[kept])


def material_of_table(path: Path, paste: FlowCurve) -> MeasuredPaste:
    """Fit a law to the flow curve in a CSV file. Raises InputError if neither law fits."""
    low, high = paste.shear_rates_per_s
    columns = read_columns(path, {RATE: (0, 1e9), STRESS: (-1e9, 1e9)}, (RATE, STRESS), (1, MAX_ROWS))
    every = _Rows(path, np.array(columns[RATE]), np.array(columns[STRESS]), np.array(columns["row"], dtype=int))
    first, last = paste.rows or (0, MAX_ROWS + 1)
    every = every.only((every.number >= first) & (every.number <= last))
    if not len(every):
        raise InputError(f"{path}: there are no rows {first} to {last}; row 1 is the header.")
    slower, faster = every.rate < low * (1 - EDGE), every.rate > high * (1 + EDGE)
    curve = every.only(~(slower | faster))
    _refuse_no_curve(curve, every, low, high)
    _refuse_two_pastes(curve)
    rate, law = curve.rate, fit_flow_law(curve.rate, curve.stress)
    _refuse_misfit(path, law, rate)
    k, n, bingham = law.consistency_pa_s_n, law.flow_index, law.is_bingham
    name, includes = ("Bingham line", "includes") if bingham else ("Herschel-Bulkley law", "excludes")
    n_95 = [*map(four_digits, n.interval)]
    thick = {"consistency_pa_s_n": k.value, "consistency_95_pa_s_n": k.interval, "flow_index": n.value}
    doubts = _left_out(law, every.only(slower))
    material = measured_material(
        path,
        paste,
        law.yield_stress_pa,
        method=f"rheometer's flow curve: {name}, fitted by least squares of relative differences",
        viscosity_error_percent=law.viscosity_percent,
        flow_index_95=n.interval,
        shear_rates_per_s=(rate.min(), rate.max()),
        basis=(
            f"{len(curve)} of {len(every)} rows, {rate.min():g} to {rate.max():g} /s, are within the shear rates of "
            f"the fill, {low:g} to {high:g} /s",
            f"{name}, since the 95 % interval of n, {n_95[0]:.3g} to {n_95[1]:.3g}, {includes} 1; the RMS misfit is "
            f"{100 * law.misfit:.2g} %, and {100 * law.bingham_misfit:.2g} % for the Bingham line",
            f"rows {curve.number[0]} to {curve.number[-1]} of the file",
            "intervals include the misfit, and common errors of all rows: 3 % of the stress and 2 % of the rate",
        ),
        not_for=NOT_FOR,
        doubts=doubts,
        **({"viscosity_pa_s": k.value} if bingham else thick),
    )
    figures = {
        "free_flow_index": four_digits(law.free_index),
        "misfit_percent": four_digits(100 * law.misfit),
        "bingham_misfit_percent": four_digits(100 * law.bingham_misfit),
    }
    return MeasuredPaste(material, figures, doubts)


def _left_out(law: FlowLaw, slower: _Rows) -> tuple[str, ...]:
    """Return a sentence about rows at lower shear rates that differ from the law by more than its uncertainty.

    Sealant at rest is held by the stresses at low shear rates. A law that was fitted at higher rates does not describe
    them.
    """
    law_pa = law.stress_pa(slower.rate)
    off_pa = slower.stress - law_pa
    count = int((np.abs(off_pa) > np.ptp(law.yield_stress_pa.interval) / 2 + MISFITS * law.misfit * law_pa).sum())
    if not count:
        return ()
    far = int(np.abs(off_pa).argmax())
    slope = "steeper" if off_pa[far] > 0 else "flatter"
    return (
        f"{count} of {len(slower)} rows at lower shear rates, which were not fitted, differ from the law by more than "
        f"its uncertainty. At {slower.rate[far]:g} /s, the stress is {slower.stress[far] / law_pa[far]:.2g} times the "
        f"law's stress, so sealant at rest may be {slope}. To include this, declare uncertainty.yield_stress_pa = "
        f"{abs(off_pa[far]) / 2:.2g}, or fluid.structuration_pa_per_s.",
    )


def _refuse_no_curve(curve: _Rows, every: _Rows, low: float, high: float) -> None:
    """Raise InputError if too few rows are within the shear rates, or if a stress is not possible for a paste."""
    path, rate, stress = curve.path, curve.rate, curve.stress
    if len(rate) < MIN_ROWS or rate.max() < MIN_RANGE * rate.min():
        raise InputError(
            f"{path}: {len(rate)} of {len(every)} rows have shear rates from {low:g} to {high:g} /s, but a fit needs "
            f"{MIN_ROWS} rows with rates that differ by a factor of at least {MIN_RANGE:g}. The file has rates "
            f"from {every.rate.min():g} to {every.rate.max():g} /s. Measure more rows in this range, or give the shear "
            "rates of your fill (--nozzle-mm, --flow-mm3-s and --width-mm, or --shear-rates)."
        )
    odd = (stress <= 0) | (stress > STIFFEST_PA)
    if odd.any():
        row = int(odd.argmax())
        raise InputError(
            f"{path}, row {curve.number[row]}, column {STRESS}: {stress[row]:g} Pa, but the stress of a flowing paste "
            f"is above 0 and at most {STIFFEST_PA:g} Pa. Check the unit, and select the rows of one sweep (--rows)."
        )
    row = int(rate.argmax())
    if (thin := stress[row] / rate[row]) < THINNEST_PA_S:
        raise InputError(
            f"{path}, row {curve.number[row]}, column {STRESS}: {stress[row]:.3g} Pa at {rate[row]:.3g} /s gives a "
            f"viscosity of {thin:.2g} Pa s. Below {THINNEST_PA_S:g} Pa s, a paste would be nearly as thin as water. "
            "Check the unit of the stress: is it kPa?"
        )


def _refuse_misfit(path: Path, law: FlowLaw, rate: Floats) -> None:
    """Raise InputError if neither law fits, or if the rows do not determine the law."""
    if law.misfit > MAX_MISS:
        raise InputError(
            f"{path}: the misfit of the Herschel-Bulkley law is {law.misfit:.0%} (RMS, limit {MAX_MISS:.0%}), and the "
            f"misfit of the Bingham line is {law.bingham_misfit:.0%}. Possible causes are two pastes, a paste that "
            "changed while it was sheared, wall slip, or a wrong column. Measure again, keep the rows of one sweep "
            "(--rows), or restrict --shear-rates."
        )
    n, thick = law.flow_index.value, law.consistency_pa_s_n.value
    at_ends = law.stress_pa(np.array([rate.min(), rate.max()]))
    rise = float(at_ends[1] / at_ends[0]) - 1
    if law.viscosity_percent > 100 * MAX_ERROR or rise < MIN_RISE or thick <= 0:
        raise InputError(
            f"{path}: rates from {rate.min():g} to {rate.max():g} /s do not determine viscosity_pa_s. The stress "
            f"increases by {100 * rise:.2g} % from {at_ends[0]:.3g} Pa (at least {100 * MIN_RISE:g} % is required), "
            f"and the viscous stress has an uncertainty of {law.viscosity_percent:.2g} % (at most "
            f"{100 * MAX_ERROR:g} % is allowed). Measure at higher rates, or give yield_stress_pa and viscosity_pa_s "
            f"{BY_HAND}."
        )
    if not INDEX[0] <= n <= INDEX[1]:
        raise InputError(
            f"{path}: flow_index is {n:.3g}, but {INDEX[0]:g} to {INDEX[1]:g} is allowed. The curve "
            f"{'is nearly flat, as with wall slip' if n < 1 else 'bends upward; the gap or sample may be unstable'}. "
            "Measure again, or restrict --shear-rates."
        )


def _refuse_two_pastes(curve: _Rows) -> None:
    """Raise InputError if nearly all stresses at repeated rates are higher, or nearly all are lower, than before.

    Then shear has changed the paste between two sweeps, or the table contains the stresses of two pastes.
    """
    rows, changes = list[int](), list[float]()
    logs, log_stress = np.log(curve.rate), np.log(curve.stress)
    for row in range(2, len(curve)):
        # Earlier rows at the same rate are replaced by their mean.
        earlier, of_rate = np.unique(logs[:row], return_inverse=True)
        level = np.bincount(of_rate, log_stress[:row]) / np.bincount(of_rate)
        after = int(np.searchsorted(earlier, logs[row]))
        before = int(np.searchsorted(earlier, logs[row], side="right")) - 1
        if before >= 0 and after < len(earlier) and earlier[after] - earlier[before] <= np.log(WIDEST_GAP):
            rows.append(curve.number[row])
            changes.append(float(np.exp(log_stress[row] - np.interp(logs[row], earlier, level))) - 1)
    if len(changes) < MIN_AGAIN:
        return
    mean = float(np.mean(changes))
    if abs(mean) < MAX_CHANGE or float((np.sign(changes) == np.sign(mean)).mean()) < MAX_ALIKE:
        return
    raise InputError(
        f"{curve.path}: {len(rows)} rows, {min(rows)} to {max(rows)}, repeat earlier rates, with stresses that are "
        f"{abs(mean):.0%} {'lower' if mean < 0 else 'higher'} on average. Shear changed the paste between two sweeps, "
        "or the table has two pastes. Keep the rows of one sweep (--rows); use the last sweep for a flowing paste."
    )
