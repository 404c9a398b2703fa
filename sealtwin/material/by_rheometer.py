"""Fit a paste's Herschel-Bulkley law, or a Bingham line, to a rheometer's flow curve at the shear rates of a fill."""

from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field, field_validator

from sealtwin.core.errors import InputError
from sealtwin.core.plain_files import read_columns
from sealtwin.core.records import Floats
from sealtwin.material import MeasuredPaste, PasteSettings, four_digits, measured_material
from sealtwin.material.flow_law import FlowLaw, fit_flow_law

RATE, STRESS = "shear_rate_per_s", "stress_pa"  # Names of the columns in the file
MAX_ROWS = 10_000
MIN_ROWS = 5
MIN_RANGE = 3.0  # Smallest ratio of the largest to the smallest shear rate. A smaller range does not determine a law
EDGE = 0.02  # Fraction by which a row may be outside the shear rates. Rheometers regulate the rate to about 1 %
THINNEST_PA_S = 0.005  # Smallest apparent viscosity at the largest rate. Water has 0.001, injection resins have 0.1
SMALLEST_PA, STIFFEST_PA = 1e-3, 1e4  # Bounds of a stress. The largest is also the largest yield stress of a run
MAX_ERROR = 0.5  # Largest relative standard uncertainty of a viscosity. Above it, the 95 % interval includes 0
MIN_RISE = 0.01  # Smallest relative increase of the stress over the rates. Less may be a drift of the instrument
MAX_MISS = 0.1  # Largest RMS relative misfit of a law. Rheometers repeat to a few percent
MISFITS = 3.0  # Largest deviation of a slow row beyond the yield stress' interval, in RMS misfits
Rate = Annotated[float, Field(gt=0, le=1e9)]
INDEX = (0.2, 2.0)  # Range of fluid.flow_index
BY_HAND = "by hand in [fluid], and note how you found them"
NOT_FOR = (
    "shear rates outside the measured range, in particular lower rates, at which the paste's curve deviates from the "
    "law",
    "a paste of another age, batch or temperature",
    "comparison with a number from another geometry, unless both geometries are named: different rheometers differ "
    "more than repeats on one of them",
)


class FlowCurve(PasteSettings):
    """Settings of a flow curve: options of 'sealtwin material rheometer'."""

    shear_rates: tuple[Rate, Rate] = (1.0, 100.0)
    """Smallest and largest shear rate in 1/s that the fit uses: those of the fill. The default is for the paper's
    nozzle, flow and crack. For a flow Q, the largest rate is that at the wall of a nozzle of diameter D,
    32 Q / (pi D^3), or at the walls of a crack of width w, 6 Q / w^3. The smallest is a thirtieth of the latter: the
    yield stress dominates at lower rates."""

    @field_validator("shear_rates")
    @classmethod
    def _in_order(cls, ends: tuple[float, float]) -> tuple[float, float]:
        if not ends[0] < ends[1]:
            raise ValueError(f"{ends[0]:g} to {ends[1]:g} is not a range; give the smaller number first")
        return ends

    def _check(self) -> None:
        if self.spread_of_density > self.density_kg_m3 / 2:
            raise ValueError(
                f"density_error_kg_m3 is {self.spread_of_density:g}, more than half of density_kg_m3 = "
                f"{self.density_kg_m3:g}; give the standard uncertainty of the density, or omit density_error_kg_m3"
            )


def material_of_table(path: Path, paste: FlowCurve) -> MeasuredPaste:
    """Fit a law to the flow curve in a CSV file. Raises InputError if neither law fits."""
    low, high = paste.shear_rates
    bounds = {RATE: (0.0, 1e9), STRESS: (SMALLEST_PA, STIFFEST_PA)}
    columns = read_columns(path, bounds, (RATE, STRESS), (1, MAX_ROWS))
    rates, stresses = np.array(columns[RATE]), np.array(columns[STRESS])
    slower, faster = rates < low * (1 - EDGE), rates > high * (1 + EDGE)
    rate, stress = (values[~(slower | faster)] for values in (rates, stresses))
    _refuse_no_curve(path, rate, stress, f"{low:g} to {high:g} /s")
    law = fit_flow_law(rate, stress)
    _refuse_misfit(path, law, rate)
    k, n, bingham = law.consistency_pa_s_n, law.flow_index, law.is_bingham
    name, includes = ("Bingham line", "includes") if bingham else ("Herschel-Bulkley law", "excludes")
    n_95 = [*map(four_digits, n.interval)]
    thick = {"consistency_pa_s_n": k.value, "consistency_95_pa_s_n": k.interval, "flow_index": n.value}
    material = measured_material(
        path,
        paste,
        law.yield_stress_pa,
        method=f"rheometer's flow curve: {name}, fitted by least squares of relative differences",
        viscosity_error_percent=law.viscosity_percent,
        flow_index_95=n.interval,
        shear_rates_per_s=(rate.min(), rate.max()),
        basis=(
            f"{len(rate)} of {len(rates)} rows, {rate.min():g} to {rate.max():g} /s, are within the shear rates of "
            f"the fill, {low:g} to {high:g} /s",
            f"{name}, since the 95 % interval of n, {n_95[0]:.3g} to {n_95[1]:.3g}, {includes} 1; the RMS misfit is "
            f"{100 * law.misfit:.2g} %",
            "intervals include the misfit, and common errors of all rows: 3 % of the stress and 2 % of the rate",
        ),
        not_for=NOT_FOR,
        doubts=_left_out(law, rates[slower], stresses[slower]),
        **({"viscosity_pa_s": k.value} if bingham else thick),
    )
    return MeasuredPaste(material, {"misfit_percent": four_digits(100 * law.misfit)})


def _left_out(law: FlowLaw, rate: Floats, stress: Floats) -> tuple[str, ...]:
    """Return a sentence about rows at lower shear rates that differ from the law by more than its uncertainty.

    Sealant at rest is held by the stresses at low shear rates. A law that was fitted at higher rates does not describe
    them.
    """
    law_pa = law.stress_pa(rate)
    off_pa = stress - law_pa
    count = int((np.abs(off_pa) > np.ptp(law.yield_stress_pa.interval) / 2 + MISFITS * law.misfit * law_pa).sum())
    if not count:
        return ()
    far = int(np.abs(off_pa).argmax())
    slope = "steeper" if off_pa[far] > 0 else "flatter"
    return (
        f"{count} of {len(rate)} rows at lower shear rates, which were not fitted, differ from the law by more than "
        f"its uncertainty. At {rate[far]:g} /s, the stress is {stress[far] / law_pa[far]:.2g} times the law's stress, "
        f"so sealant at rest may be {slope}. To include this, declare uncertainty.yield_stress_pa = "
        f"{abs(off_pa[far]) / 2:.2g}, or fluid.structuration_pa_per_s.",
    )


def _refuse_no_curve(path: Path, rate: Floats, stress: Floats, shear_rates: str) -> None:
    """Raise InputError if too few rows are within the shear rates, or if a paste would be as thin as water."""
    if len(rate) < MIN_ROWS or rate.max() < MIN_RANGE * rate.min():
        raise InputError(
            f"{path}: {len(rate)} rows have shear rates from {shear_rates}, but a fit needs {MIN_ROWS} rows with rates "
            f"that differ by a factor of at least {MIN_RANGE:g}. Measure more rows in this range, or give the shear "
            "rates of your fill (--shear-rates)."
        )
    fastest = int(rate.argmax())
    if (thin := stress[fastest] / rate[fastest]) < THINNEST_PA_S:
        raise InputError(
            f"{path}: {stress[fastest]:.3g} Pa at {rate[fastest]:.3g} /s is a viscosity of {thin:.2g} Pa s. Below "
            f"{THINNEST_PA_S:g} Pa s, a paste would be nearly as thin as water. Check the unit of {STRESS}: is it kPa?"
        )


def _refuse_misfit(path: Path, law: FlowLaw, rate: Floats) -> None:
    """Raise InputError if neither law fits, or if the rows do not determine the law."""
    if law.misfit > MAX_MISS:
        raise InputError(
            f"{path}: the misfit of the law is {law.misfit:.0%} (RMS, limit {MAX_MISS:.0%}). Possible causes are two "
            "pastes, a paste that changed while it was sheared, wall slip, or a wrong column. Measure again, keep the "
            "rows of one sweep, or restrict --shear-rates."
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
