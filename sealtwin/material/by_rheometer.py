"""Fit Bingham's line to a rheometer's flow curve, which gives the yield stress and the plastic viscosity."""

from datetime import date
from pathlib import Path

import numpy as np

from sealtwin.core.errors import InputError
from sealtwin.core.number_tables import read_columns
from sealtwin.core.records import DataKind, Floats
from sealtwin.material.paste import PasteOnPlate, PasteValue, measured_material
from simulate.material_file import Material

BOUNDS = {"shear_rate_per_s": (1e-6, 1e6), "stress_pa": (1e-6, 1e6)}
ROWS = (5, 5000)
LEAST_RANGE = 3.0  # Least ratio of the largest to the smallest shear rate: a smaller range does not determine a line
TORQUE = 0.03  # Relative standard uncertainty of the stress that is common to all rows: gap and calibration
MOST_ERROR = 0.5  # Largest relative standard uncertainty of a viscosity: above it the 95 % interval includes 0
LEAST_RISE = 0.01  # Least rise of the line over the rates, over its stress: less may be drift of the instrument
LEAST_AGAIN = 3  # Least number of repeated rates by which a change of the paste is detected
MOST_CHANGE = 0.05  # Largest mean change of stress at repeated rates if the paste has not changed
MOST_ALIKE = 0.8  # Share of these changes with one sign from which they are systematic
WIDEST_GAP = 3.0  # Largest ratio of neighbouring rates between which the stress is interpolated, in logarithms
MOST_MISS = 0.2  # Largest RMS of the misfit over the stress: above it the curve is not a line
BY_HAND = "by hand in [fluid], and note how they were found"
NOT_FOR = (
    "shear rates outside the measured range, in particular lower ones, at which the paste's curve deviates from the "
    "line",
    "a paste of another age, batch or temperature",
    "comparison with a number from another geometry, unless both geometries are named: rheometers differ by more "
    "than repeats on one of them",
)


def material_of_table(path: Path, paste: PasteOnPlate, data: DataKind, day: date) -> Material:
    """Fit Bingham's line to a table of shear rate and stress. Raises InputError if it is not a flow curve."""
    if paste.spread_of_density > paste.density_kg_m3 / 2:
        raise InputError(
            f"density_error_kg_m3 is {paste.spread_of_density:g}, more than half of density_kg_m3, "
            f"{paste.density_kg_m3:g}: give the standard uncertainty of the density, or omit it."
        )
    columns = read_columns(path, BOUNDS, list(BOUNDS), ROWS)
    rate, stress = (np.array(columns[name]) for name in BOUNDS)
    if rate.max() < LEAST_RANGE * rate.min():
        raise InputError(
            f"{path}: shear rates from {rate.min():g} to {rate.max():g} /s; for a line they must differ by a "
            f"factor of at least {LEAST_RANGE:g}."
        )
    _refuse_two_pastes(path, rate, stress)
    (yields, thick), covariance, misfit = _bingham(rate, stress)
    if misfit > MOST_MISS:
        raise InputError(
            f"{path}: Bingham's line misfits the stresses by {misfit:.0%} (RMS, limit {MOST_MISS:.0%}): the "
            f"curve is not a line. Give yield_stress_pa, and viscosity_pa_s or a curve with flow_index, {BY_HAND}; or "
            "measure only at the shear rates of the fill."
        )
    if yields <= 0 or thick <= 0:
        raise InputError(
            f"{path}: Bingham's line has a yield stress of {yields:.3g} Pa and a viscosity of {thick:.3g} Pa s; both "
            "must be above 0. The paste has no yield stress at these rates, or it thins with shear. Give "
            "viscosity_pa_s, or flow_index, by hand."
        )
    error = float(np.hypot(np.sqrt(covariance[0, 0]), TORQUE * yields))
    percent = 100 * float(np.hypot(np.sqrt(covariance[1, 1]) / thick, TORQUE))
    rise = thick * float(rate.max() - rate.min()) / yields
    if percent > 100 * MOST_ERROR or rise < LEAST_RISE:
        raise InputError(
            f"{path}: rates from {rate.min():g} to {rate.max():g} /s do not determine viscosity_pa_s: over them "
            f"Bingham's line rises by {100 * rise:.2g} % of its {yields:.3g} Pa (at least {100 * LEAST_RISE:g} %), and "
            f"its viscosity is uncertain by {percent:.2g} % (at most {100 * MOST_ERROR:g} %). Measure at higher "
            f"rates, or give it {BY_HAND}."
        )
    return measured_material(
        path,
        data,
        day,
        paste,
        PasteValue(yields, error, (max(0.0, yields - 2 * error), yields + 2 * error)),
        (thick, percent),
        method="rheometer's flow curve, Bingham's line by least squares of relative differences",
        basis=(
            f"{len(rate)} rows from {rate.min():g} to {rate.max():g} /s",
            f"RMS misfit of the line {misfit:.1%} of the stress, which the uncertainty includes",
        ),
        not_for=NOT_FOR,
    )


def _refuse_two_pastes(path: Path, rate: Floats, stress: Floats) -> None:
    """Raise InputError if stresses at repeated rates are nearly all higher, or nearly all lower, than before.

    Shear has then changed the paste between two sweeps, or the table has the stresses of two pastes.
    """
    changes = [(row, change) for row in range(2, len(rate)) if (change := _change(rate, stress, row)) is not None]
    if len(changes) < LEAST_AGAIN:
        return
    rows, change = np.array([row for row, _ in changes]), np.array([change for _, change in changes])
    mean = float(change.mean())
    same_sign = float((np.sign(change) == np.sign(mean)).mean())
    if abs(mean) < MOST_CHANGE or same_sign < MOST_ALIKE:
        return
    # Row 1 is the header.
    raise InputError(
        f"{path}: {len(rows)} rows, {rows.min() + 2} to {rows.max() + 2}, repeat earlier rates with stresses "
        f"{abs(mean):.0%} {'lower' if mean < 0 else 'higher'} on average: shear changed the paste between two sweeps, "
        "or the table has two pastes. Keep the rows of one sweep; use the last one for a paste that flows."
    )


def _change(rate: Floats, stress: Floats, row: int) -> float | None:
    """Return the relative change of a row's stress since earlier rows at its rate; None if no rates bracket its own."""
    order = np.argsort(rate[:row], kind="stable")
    earlier, levels = np.log(rate[order]), np.log(stress[order])
    at = np.log(rate[row])
    after = int(np.searchsorted(earlier, at))
    before = int(np.searchsorted(earlier, at, side="right")) - 1
    if not (before >= 0 and after < row and earlier[after] - earlier[before] <= np.log(WIDEST_GAP)):
        return None
    # Several earlier rows at the same rate: their mean.
    expected = levels[after : before + 1].mean() if after <= before else np.interp(at, earlier, levels)
    return float(stress[row] / np.exp(expected) - 1)


def _bingham(rate: Floats, stress: Floats) -> tuple[Floats, Floats, float]:
    """Return yield stress and viscosity, their covariance from the scatter, and the relative RMS misfit.

    If the paste does not follow the line, neighbouring rows have similar misfits. The number of independent rows is
    therefore taken as the number of sign changes of the misfit.
    """
    slopes = np.column_stack([1 / stress, rate / stress])
    line = np.linalg.lstsq(slopes, np.ones(len(rate)), rcond=None)[0]
    miss = slopes @ line - 1
    in_order = miss[np.argsort(rate, kind="stable")]
    changes = int((np.sign(in_order[1:]) != np.sign(in_order[:-1])).sum())
    free = max(1, min(len(rate) - 2, changes + 1))
    variance = float(miss @ miss) / free
    covariance = variance * np.linalg.inv(slopes.T @ slopes) * max(1.0, (len(rate) - 2) / free / 2)
    return np.asarray(line, dtype=float), np.asarray(covariance, dtype=float), float(np.sqrt(np.mean(miss**2)))
