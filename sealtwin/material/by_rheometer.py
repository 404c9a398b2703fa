"""A rheometer's flow curve: yield stress and plastic viscosity by Bingham's line, with what it misses of the table."""

from datetime import date
from pathlib import Path

import numpy as np

from sealtwin.core.errors import InputError
from sealtwin.core.number_tables import read_columns
from sealtwin.core.records import DataKind, Floats
from sealtwin.core.settings import checked
from simulate.material_file import Material

BOUNDS = {"shear_rate_per_s": (1e-6, 1e6), "stress_pa": (1e-6, 1e6)}
ROWS = (5, 5000)
LEAST_RANGE = 3.0  # Least ratio of the largest to the smallest shear rate: a line through one decade's third is none
TORQUE = 0.03  # Relative standard uncertainty of a rheometer's stress that all rows share: gap and calibration
MOST_ERROR = 0.5  # Standard uncertainty of a viscosity over its value from which the 95 % interval reaches 0
LEAST_RISE = 0.01  # Least rise of the line over the rates, over its stress, that is no drift of the instrument
LEAST_SWEEP = 3  # Rows one after the other whose rates rise, or fall: fewer are rates in no order
SWEEPS_APART = 0.05  # Least difference of two sweeps' mean stress at the same rates that a repeat does not show
MOST_MISS = 0.2  # RMS of the line's misses over the stress beyond which the paste's curve is no line
BY_HAND = "by hand in [fluid], with how they were found"
NOT_FOR = (
    "shear rates outside of those measured, above all slower ones, where the line misses the paste's own curve",
    "a paste of another age, batch or temperature",
    "comparison with another geometry's number without saying both: rheometers differ by more than their repeats",
)


def material_of_table(
    path: Path, density_kg_m3: float, density_error_kg_m3: float | None, data: DataKind, day: date
) -> Material:
    """Fit a table of shear rate and stress. Raises InputError, naming the file, where it is no flow curve."""
    if (density_error_kg_m3 or 0.0) > density_kg_m3 / 2:
        raise InputError(
            f"density_error_kg_m3 is {density_error_kg_m3:g}, more than half of density_kg_m3, {density_kg_m3:g}: give "
            "the standard uncertainty of the density, or leave it out."
        )
    columns = read_columns(path, BOUNDS, list(BOUNDS), ROWS)
    rate, stress = (np.array(columns[name]) for name in BOUNDS)
    if rate.max() < LEAST_RANGE * rate.min():
        raise InputError(
            f"{path}: shear rates from {rate.min():g} to {rate.max():g} /s; a line needs a range of at least "
            f"{LEAST_RANGE:g} times."
        )
    _refuse_two_pastes(path, rate, stress)
    (yields, thick), covariance, misfit = _bingham(rate, stress)
    if misfit > MOST_MISS:
        raise InputError(
            f"{path}: Bingham's line misses the stresses by {misfit:.0%} (RMS), more than {MOST_MISS:.0%}: the "
            f"curve is no line. Give yield_stress_pa, and viscosity_pa_s or a curve with flow_index, {BY_HAND}; or "
            "measure at the rates of the fill alone."
        )
    if yields <= 0 or thick <= 0:
        raise InputError(
            f"{path}: Bingham's line through it has {yields:.3g} Pa and {thick:.3g} Pa s, of which none may be below "
            "0: the paste has no yield stress at these rates, or thins. Give viscosity_pa_s, or flow_index, by hand."
        )
    error = float(np.hypot(np.sqrt(covariance[0, 0]), TORQUE * yields))
    percent = 100 * float(np.hypot(np.sqrt(covariance[1, 1]) / thick, TORQUE))
    rise = thick * float(rate.max() - rate.min()) / yields
    if percent > 100 * MOST_ERROR or rise < LEAST_RISE:
        raise InputError(
            f"{path}: rates from {rate.min():g} to {rate.max():g} /s show no viscosity_pa_s: Bingham's line rises by "
            f"{100 * rise:.2g} % of its {yields:.3g} Pa over them, and its viscosity is known to {percent:.2g} %; "
            f"{100 * LEAST_RISE:g} % or more, and {100 * MOST_ERROR:g} % or better, are needed. Measure at faster "
            f"rates, or give it {BY_HAND}."
        )
    return checked(
        Material,
        path,
        {
            "method": "rheometer's flow curve, Bingham's line by least squares of relative differences",
            "date": day.isoformat(),
            "data": data,
            "yield_stress_pa": float(f"{yields:.4g}"),
            "yield_stress_error_pa": float(f"{error:.4g}"),
            "yield_stress_95_pa": (max(0.0, float(f"{yields - 2 * error:.4g}")), float(f"{yields + 2 * error:.4g}")),
            "viscosity_pa_s": float(f"{thick:.4g}"),
            "viscosity_error_percent": float(f"{percent:.4g}"),
            "density_kg_m3": density_kg_m3,
            "density_error_kg_m3": density_error_kg_m3 or 0.01 * density_kg_m3,
            "basis": (
                f"{len(rate)} rows from {rate.min():g} to {rate.max():g} /s",
                f"RMS of the line's misses {misfit:.1%} of the stress, which the uncertainty holds",
            ),
            "not_for": NOT_FOR,
        },
    )


def _refuse_two_pastes(path: Path, rate: Floats, stress: Floats) -> None:
    """Raise InputError for rates that rise and fall with stresses apart: shear has changed the paste on the way."""
    sweeps = np.split(np.arange(len(rate)), _starts_of_sweeps(rate))
    if len(sweeps) < 2 or any(len(rows) < LEAST_SWEEP for rows in sweeps):
        return
    ordered = [rows[np.argsort(rate[rows])] for rows in sweeps]
    low, high = max(rate[rows[0]] for rows in ordered), min(rate[rows[-1]] for rows in ordered)
    shared = np.geomspace(low, high, 20) if low < high else np.array([low])
    levels_pa = [float(np.interp(np.log(shared), np.log(rate[rows]), stress[rows]).mean()) for rows in ordered]
    if max(levels_pa) - min(levels_pa) < SWEEPS_APART * float(np.mean(levels_pa)):
        return
    # Row 1 is the header.
    said = ", ".join(
        f"rows {rows.min() + 2} to {rows.max() + 2} have {level_pa:.3g} Pa"
        for rows, level_pa in zip(sweeps, levels_pa, strict=True)
    )
    raise InputError(
        f"{path}: the shear rates rise and fall, in {len(sweeps)} sweeps whose stresses differ: at {low:g} to "
        f"{high:g} /s {said} on average. Shear changes such a paste: keep the rows of one sweep. The way down is that "
        "of a paste that flows."
    )


def _starts_of_sweeps(rate: Floats) -> list[int]:
    """Return the rows after which rates go the other way; the second of two equal ones belongs to the later sweep."""
    starts, before = list[int](), 0.0
    for row, way in enumerate(np.sign(np.diff(rate)).tolist()):
        if way and before and way != before:
            starts.append(row if rate[row] == rate[row - 1] else row + 1)
        before = way or before
    return starts


def _bingham(rate: Floats, stress: Floats) -> tuple[Floats, Floats, float]:
    """Return yield stress and viscosity, their covariance by the scatter, and the relative RMS miss.

    Neighbouring rows of a sweep share their misses where the line is not the paste's law, so that they count as few:
    as many as the misses change sign.
    """
    slopes = np.column_stack([1 / stress, rate / stress])
    found = np.linalg.lstsq(slopes, np.ones(len(rate)), rcond=None)[0]
    miss = slopes @ found - 1
    in_order = miss[np.argsort(rate, kind="stable")]
    changes = int((np.sign(in_order[1:]) != np.sign(in_order[:-1])).sum())
    free = max(1, min(len(rate) - 2, changes + 1))
    variance = float(miss @ miss) / free
    covariance = variance * np.linalg.inv(slopes.T @ slopes) * max(1.0, (len(rate) - 2) / free / 2)
    return np.asarray(found, dtype=float), np.asarray(covariance, dtype=float), float(np.sqrt(np.mean(miss**2)))
