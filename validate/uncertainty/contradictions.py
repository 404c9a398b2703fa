"""Declared errors that the readings contradict: each is refused by a test with a stated rate of false alarms."""

import numpy as np

from sealtwin.core.errors import InputError, present
from sealtwin.core.records import Floats, Profile
from validate.settings import Readings, Uncertainty
from validate.uncertainty.budget import draws_for, normals
from validate.uncertainty.passes import FALSE_ALARM, coefficients, require_pass_mm, shapes_of_passes

COARSE = 1.2
"""Last digits larger than this many standard deviations hide the scatter, and are modelled as cut off. Below it they
are as good as an error of their own (Sheppard)."""
WRITTEN_MM = 0.006  # Distance from a multiple of an inch's fraction that is written in hundredths of a millimetre
ODD_SHARE = 0.05  # Share of readings that may be no multiple of the last digit, as read between two marks


def refuse_contradicted(measured: Profile, settings: Readings, declared: Uncertainty) -> None:
    """Refuse declared errors that the readings contradict, naming the key. Raises InputError.

    A datum's height, a limit of error, the probe's width, a shift of all stations and an error that all repeats share
    leave no trace in readings alone, and are taken as declared.
    """
    source = measured.source or "readings"
    repeats_mm = measured.repeats_mm if measured.repeats_mm is not None else measured.level_mm[:, None]
    _require_resolution(repeats_mm, settings.resolution_mm, source)
    residual_mm = repeats_mm - np.nanmean(repeats_mm, axis=1, keepdims=True)
    if declared.pass_mm is not None:
        require_pass_mm(residual_mm, measured.s_mm, declared.pass_mm, source)
    if declared.repeatability_mm is not None:
        own_mm = declared.repeatability_mm * np.ones(len(measured.s_mm))
        if (~np.isnan(repeats_mm)).sum(axis=1).max() > 1:
            _require_scatter(residual_mm, measured.s_mm, declared, settings.resolution_mm, source)
        else:
            _require_rough(measured, own_mm, "repeatability_mm", declared.repeatability_mm, source)
    if declared.station_each_mm is not None:
        own_mm = declared.station_each_mm * np.abs(np.gradient(measured.level_mm, measured.s_mm))
        _require_rough(measured, own_mm, "station_each_mm", declared.station_each_mm, source)


def _require_resolution(repeats_mm: Floats, resolution_mm: float, source: str) -> None:
    """Refuse a last digit that readings do not keep, up to a common height."""
    default_mm = Readings.model_fields["resolution_mm"].default
    read_mm = repeats_mm[~np.isnan(repeats_mm)]
    if resolution_mm <= default_mm:
        return
    times = (read_mm - np.unique(read_mm)[: len(read_mm) // 2 + 1, None]) / resolution_mm
    odd = np.abs(times - np.round(times)) * resolution_mm > max(WRITTEN_MM, 0.02 * resolution_mm)
    count = int(odd.sum(axis=1).min())
    if count > ODD_SHARE * len(read_mm):
        raise InputError(
            f"{source}: readings.resolution_mm = {resolution_mm:g}: {count} of {len(read_mm)} readings are no "
            "multiples of it, whatever height they count from. It is the last digit of the caliper: give that of the "
            "readings; what else is uncertain has keys of its own in [uncertainty]."
        )


def _require_scatter(
    residual_mm: Floats, s_mm: Floats, declared: Uncertainty, resolution_mm: float, source: str
) -> None:
    """Refuse a repeatability that repeats exceed, by the chi-squared distribution of normal readings."""
    from scipy.stats import chi2

    repeatability_mm = present(declared.repeatability_mm, "uncertainty.repeatability_mm")
    variance_mm2 = repeatability_mm**2 + resolution_mm**2 / 12
    squares_mm2, freedom = _scatter(residual_mm, s_mm, declared)
    if squares_mm2 > variance_mm2 * chi2.ppf(1 - FALSE_ALARM, freedom):
        raise InputError(
            f"{source}: uncertainty.repeatability_mm = {repeatability_mm:g}: the repeats contradict it: they "
            f"scatter by {np.sqrt(squares_mm2 / freedom):.2g} mm ({freedom:.0f} degrees of freedom), as in fewer than "
            "1 of 100 sheets of normal readings with that repeatability. Leave it out: the repeats show the scatter."
        )


def unused_repeatability(measured: Profile, declared: Uncertainty, resolution_mm: float) -> tuple[str, ...]:
    """Return a sentence on a declared repeatability that repeats stay below; it enters no interval beside repeats.

    The test is that of ``_require_scatter``, at the other end; there is none if the last digit hides the scatter.
    """
    from scipy.stats import chi2

    declared_mm, repeats_mm = declared.repeatability_mm, measured.repeats_mm
    if declared_mm is None or repeats_mm is None or resolution_mm > COARSE * declared_mm:
        return ()
    residual_mm = repeats_mm - np.nanmean(repeats_mm, axis=1, keepdims=True)
    squares_mm2, freedom = _scatter(residual_mm, measured.s_mm, declared)
    variance_mm2 = declared_mm**2 + resolution_mm**2 / 12
    if freedom <= 0 or squares_mm2 >= variance_mm2 * chi2.ppf(FALSE_ALARM, freedom):
        return ()
    return (
        f"uncertainty.repeatability_mm = {declared_mm:g} is not used: the repeats show the scatter, "
        f"{np.sqrt(squares_mm2 / freedom):.2g} mm ({freedom:.0f} degrees of freedom), and so little in fewer than "
        "1 of 100 sheets of normal readings with that repeatability.",
    )


def _scatter(residual_mm: Floats, s_mm: Floats, declared: Uncertainty) -> tuple[float, float]:
    """Return the sum of squares of the repeats about their stations' means, passes taken off, and its freedom."""
    shapes = np.zeros((len(s_mm), 0)) if declared.pass_mm == 0 else shapes_of_passes(s_mm)
    own_mm = residual_mm - shapes @ coefficients(residual_mm, shapes)
    own_mm -= np.nanmean(own_mm, axis=1, keepdims=True)
    freedom = ((~np.isnan(residual_mm)).sum(axis=1) - 1).sum() * (1 - shapes.shape[1] / len(s_mm))
    return float(np.nansum(own_mm**2)), float(freedom)


def _require_rough(measured: Profile, own_mm: Floats, key: str, declared_mm: float, source: str) -> None:
    """Refuse errors of each station by itself, of the standard deviations ``own_mm``, that would leave a rougher level.

    A bed of any shape makes it less probable that second differences along the crack are small than the errors alone do
    (Anderson 1955, Proc. Am. Math. Soc. 6:170), so that at most ``FALSE_ALARM`` of all sheets are refused wrongly.
    """
    s_mm, level_mm = measured.s_mm, measured.level_mm
    if len(s_mm) < 4 or not own_mm.any():
        return
    before, after = np.diff(s_mm)[:-1], np.diff(s_mm)[1:]

    def bends(values_mm: Floats) -> Floats:
        middle_mm = (values_mm[..., :-2] * after + values_mm[..., 2:] * before) / (before + after)
        return np.sqrt(np.mean((values_mm[..., 1:-1] - middle_mm) ** 2, axis=-1))

    drawn_mm = bends(own_mm * normals(f"roughness, {key}", len(s_mm), draws_for(len(s_mm))))
    least_mm, bends_mm = float(np.quantile(drawn_mm, FALSE_ALARM)), float(bends(level_mm))
    if bends_mm < least_mm:
        raise InputError(
            f"{source}: uncertainty.{key} = {declared_mm:g}: the readings contradict it: stations differ from the line "
            f"between their neighbours by {bends_mm:.2g} mm (rms), and by {least_mm:.2g} mm or more in 99 of "
            "100 sheets with such an error on any bed. Declare a smaller one, or leave it out."
        )
