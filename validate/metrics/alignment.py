"""The choice of s = 0, and the errors that other choices would give."""

from dataclasses import replace

from sealtwin.core.records import Profile
from validate.comparison import Alignment, ShiftedError
from validate.metrics.curve_distances import level_difference

CHOICE = "s from the first end given, on both curves; neither is shifted to fit the other"
SHIFTS_MM = (-2.0, -1.0, 0.0, 1.0, 2.0)  # Shifts by which a station set by hand, or the end of a crack, may be off


def alignment(simulated: Profile, measured: Profile) -> Alignment:
    """Return mean error and bias with the readings moved along the crack by each of the shifts."""
    errors = [level_difference(simulated, replace(measured, s_mm=measured.s_mm + shift_mm)) for shift_mm in SHIFTS_MM]
    shifts = [
        ShiftedError(shift_mm, error.mean_error, error.mean())
        for shift_mm, error in zip(SHIFTS_MM, errors, strict=True)
    ]
    return Alignment(choice=CHOICE, shifts=tuple(shifts))
