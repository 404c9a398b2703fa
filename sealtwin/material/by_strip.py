"""The share of a paste's stress that a wall takes up, from strips of paste that slide on the sample's tilted cut face.

A strip of mass m on an area A slides as a whole once m g sin(alpha) / A exceeds the stress that the face takes up.
Pressure within the strip has no part in that balance, since both ends are free.
"""

from dataclasses import dataclass, field
from datetime import date
from pathlib import Path

import numpy as np
from pydantic import Field

from sealtwin.core.errors import InputError
from sealtwin.core.number_tables import read_columns
from sealtwin.core.records import DataKind, Floats
from sealtwin.core.settings import Settings, checked
from sealtwin.material.paste import MeasuredPaste, PasteValue, four_digits
from simulate.material_file import LEAST_WALL_SHARE, Material
from simulate.spread_law import GRAVITY_M_S2

COLUMNS = {
    "mass_g": (0.01, 1e5),
    "length_mm": (1.0, 1e4),
    "width_mm": (1.0, 1e4),
    "rise_mm": (0.01, 1e4),
    "over_mm": (1.0, 1e4),
}
"""Columns of the table and their bounds: mass, length and width of a strip; rise of the face's end at which the strip
slides, and distance from the edge on which the face turns to that end, along the face."""
LEAST_SINE = 0.01  # Of the angle at which a strip slides: 0.6 degrees, at which a bench is no longer level
UNLIKE = 0.25  # Scatter of the strips' stresses over their mean, from which they are doubted
FEWEST, MOST = 3, 100  # Strips: three show a scatter
STRIPS = "strips of paste"
LEAST_DEGREES = 2.0  # Degrees of freedom of the interval, at least; with fewer it would be wider than any share


class StripErrors(Settings):
    """Errors that all strips share."""

    mass_error_g: float = Field(default=0.05, gt=0, le=100)
    """Standard uncertainty of a strip's mass: of the scale, and of paste that stays on the mould."""
    side_error_mm: float = Field(default=0.3, gt=0, le=100)
    """Standard uncertainty of a strip's length and width."""
    rise_error_mm: float = Field(default=0.3, gt=0, le=100)
    """Standard uncertainty of the rise: the motion is seen late, and a ruler is read."""


@dataclass(frozen=True)
class WallShare:
    share: PasteValue
    stress_pa: Floats  # (n,): stress at which each strip slid
    parts: dict[str, float] = field(default_factory=dict)  # Relative standard uncertainties of the share by source


def share_of(
    strips: dict[str, Floats], errors: StripErrors, yield_stress_pa: float, yield_stress_error_pa: float
) -> WallShare:
    """Return the share with its 95 % interval, at most 1.

    ``strips`` has ``COLUMNS``, (n,) each. The interval is by Student's t: the scatter of the strips has n - 1 degrees
    of freedom, the errors that they share have any number (Welch and Satterthwaite). Raises InputError if the face took
    up more than the paste bears.
    """
    mass_g, length_mm, width_mm = strips["mass_g"], strips["length_mm"], strips["width_mm"]
    stress_pa = 1e3 * mass_g * GRAVITY_M_S2 * strips["rise_mm"] / strips["over_mm"] / (length_mm * width_mm)
    mean_pa, count = float(stress_pa.mean()), len(stress_pa)
    parts = {
        "scatter": float(stress_pa.std(ddof=1)) / np.sqrt(count) / mean_pa,
        "mass": errors.mass_error_g / float(mass_g.mean()),
        "sides": errors.side_error_mm * float(np.hypot(1 / length_mm.mean(), 1 / width_mm.mean())),
        "rise": errors.rise_error_mm / float(strips["rise_mm"].mean()),
        "yield stress": yield_stress_error_pa / yield_stress_pa,
    }
    share, wide = mean_pa / yield_stress_pa, _half_width(parts, count)
    low, high = share * np.exp(-wide), share * np.exp(wide)
    if low > 1:
        raise InputError(
            f"the strips slid at {mean_pa:.3g} Pa, {share:.2f} times the yield stress of {yield_stress_pa:.3g} Pa "
            f"(95 % {low:.2f} to {high:.2f}), but no wall takes up more than the paste bears: test paste of the age "
            "and batch whose yield stress was measured, and check the table's units."
        )
    low, share, high = (float(np.clip(value, LEAST_WALL_SHARE, 1.0)) for value in (low, share, high))
    return WallShare(PasteValue(share, (high - low) / 4, (low, high)), stress_pa, parts)


def _half_width(parts: dict[str, float], count: int) -> float:
    """Return half of the 95 % interval of the share's logarithm."""
    from scipy.stats import t

    variance = sum(value**2 for value in parts.values())
    scatter = parts["scatter"] ** 2
    degrees = (count - 1) * (variance / scatter) ** 2 if scatter > 0 else np.inf
    return float(t.ppf(0.975, max(LEAST_DEGREES, degrees)) * np.sqrt(variance))


def material_of_strips(path: Path, given: Material, errors: StripErrors, data: DataKind, day: date) -> MeasuredPaste:
    """Return a measured paste with the share of its stress that the strips' face takes up.

    Raises InputError if the table or the paste cannot be used.
    """
    if given.yield_stress_pa <= 0:
        raise InputError(f"{path}: the material's yield_stress_pa is 0, and a share of it has no meaning: measure it.")
    columns = read_columns(path, COLUMNS, list(COLUMNS), (FEWEST, MOST))
    rows = columns.pop("row")
    strips = {name: np.array(values) for name, values in columns.items()}
    if (steep := strips["rise_mm"] >= strips["over_mm"]).any():
        number = int(steep.argmax())
        raise InputError(
            f"{path}, row {rows[number]:g}: rise_mm is {strips['rise_mm'][number]:g} and over_mm is "
            f"{strips['over_mm'][number]:g}: a face that turns by less than 90 degrees rises by less than its length."
        )
    if (flat := strips["rise_mm"] < LEAST_SINE * strips["over_mm"]).any():
        number = int(flat.argmax())
        raise InputError(
            f"{path}, row {rows[number]:g}: rise_mm is {strips['rise_mm'][number]:g} over "
            f"{strips['over_mm'][number]:g} mm, an angle below 0.6 degrees: check the units, or test a thinner strip, "
            "which slides at a larger angle."
        )
    try:
        measured = share_of(strips, errors, given.yield_stress_pa, given.yield_stress_error_pa)
    except InputError as fault:
        raise InputError(f"{path}: {fault}") from None
    share, lowest, highest = measured.share, measured.stress_pa.min(), measured.stress_pa.max()
    by_source = ", ".join(f"{name} {100 * value:.2g} %" for name, value in measured.parts.items())
    basis = (
        f"{len(rows)} {STRIPS} ({data}, {day.isoformat()}) slid at {lowest:.3g} to {highest:.3g} Pa; relative standard "
        f"uncertainty of the walls' share by source: {by_source}"
    )
    content = given.model_dump(mode="json", exclude_none=True) | {
        "data": data if given.data == "measured" else given.data,
        "wall_share": four_digits(share.value),
        "wall_share_error": four_digits(share.error),
        "wall_share_95": [*map(four_digits, share.interval)],
        "basis": [*(line for line in given.basis if STRIPS not in line), basis[:300]],
    }
    scatter = float(measured.stress_pa.std(ddof=1) / measured.stress_pa.mean())
    doubts = [
        f"The strips' stresses scatter by {100 * scatter:.0f} %: look for one that stuck or was nudged, and test again."
    ]
    stresses = [four_digits(value) for value in measured.stress_pa]
    figures = {"stress_pa": stresses, "parts": measured.parts}
    return MeasuredPaste(checked(Material, path, content), figures, doubts if scatter > UNLIKE else [])
