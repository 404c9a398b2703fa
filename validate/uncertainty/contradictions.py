"""Refuse declared errors that the readings contradict, including passes, at a stated rate of false alarms."""

import numpy as np

from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats, Profile
from validate.settings import DIGIT_MM, PASS_MM, Readings, Uncertainty
from validate.uncertainty.budget import Component, Source, chi_squared, draws_for, normals, uniforms

FREEDOM_OF_PASSES = 4.0  # Degrees of freedom of the half-t prior of a pass, few so that repeats may exceed it
FALSE_ALARM = 0.01  # Probability that a true declaration is refused
ROUNDING_MM2 = 1e-12  # Square of a difference due to the rounding of binary fractions


def repeats_of(measured: Profile) -> tuple[Floats, Floats]:
    """Return the readings at each station, (n, r), and their differences from the station's mean."""
    repeats_mm = measured.repeats_mm if measured.repeats_mm is not None else measured.level_mm[:, None]
    return repeats_mm, repeats_mm - np.nanmean(repeats_mm, axis=1, keepdims=True)


def without_passes(residual_mm: Floats, s_mm: Floats, pass_mm: float | None) -> tuple[Floats, Floats, Floats]:
    """Remove passes from residuals. Returns the residuals without passes, (n, r), and the passes.

    The passes are their shapes, (n, k), and each repeat's coefficients, (k, r).
    """
    shapes = np.zeros((len(s_mm), 0)) if pass_mm == 0 else shapes_of_passes(s_mm)
    per_pass = coefficients(residual_mm, shapes)
    own_mm = residual_mm - shapes @ per_pass
    return own_mm - np.nanmean(own_mm, axis=1, keepdims=True), shapes, per_pass


def shapes_of_passes(s_mm: Floats) -> Floats:
    """Return an offset, a tilt and a bend along the crack, (n, k).

    They are orthogonal, and each has a root mean square of 1.

    Fewer than six stations allow only the first two, and fewer than four only the offset.
    """
    most = min(3, max(1, len(s_mm) // 2))
    position = (s_mm - s_mm.mean()) / np.ptp(s_mm)
    orthogonal, _ = np.linalg.qr(np.vander(position, most, increasing=True))
    return orthogonal * np.sqrt(len(s_mm))


def coefficients(residual_mm: Floats, shapes: Floats) -> Floats:
    """Return each repeat's coefficient for each shape, (k, repeats), minus the mean of all repeats."""
    columns: list[Floats] = []
    for repeat_mm in residual_mm.T:
        read = ~np.isnan(repeat_mm)
        columns.append(np.linalg.lstsq(shapes[read], repeat_mm[read])[0] if shapes.shape[1] else np.zeros(0))
    by_repeat = np.array(columns).T
    return by_repeat - by_repeat.mean(axis=1, keepdims=True)


def passes_error(
    declared_mm: float | None, per_pass: Floats, noise_mm2: Floats, shapes: Floats, read: Floats
) -> Component:
    """Draw the error that passes over all stations, or operators, cause in the mean of the repeats.

    Each shape has its own standard deviation t among passes. The posterior of t combines a half-t prior, whose scale is
    declared, with the spread of the coefficients, whose variance is t² plus the variance of the scatter. The error of
    the mean is drawn with this t, because repeats do not show an error of their own mean.
    """
    scale_mm = PASS_MM if declared_mm is None else declared_mm
    passes = read.shape[1]
    share = read / read.sum(axis=1, keepdims=True)
    draws = draws_for(len(read))
    total_mm = np.zeros((draws, len(read)))
    for number, (noise, shape) in enumerate(zip(noise_mm2, shapes.T, strict=True)):
        squares = float((per_pass[number] ** 2).sum())
        t_mm = np.geomspace(1e-3 * scale_mm, 30 * (scale_mm + np.sqrt(squares)), 400)
        prior = -(FREEDOM_OF_PASSES + 1) / 2 * np.log1p((t_mm / scale_mm) ** 2 / FREEDOM_OF_PASSES)
        spread = noise + t_mm**2
        # Even steps of ln t: multiply the density of t by t.
        chance = prior - (passes - 1) / 2 * np.log(spread) - squares / (2 * spread) + np.log(t_mm)
        below = np.cumsum(np.exp(chance - chance.max()))
        drawn_mm = np.interp(uniforms(f"pass {number}", 1, draws)[:, 0], below / below[-1], t_mm)
        pass_mm = normals(f"passes {number}", passes, draws) * drawn_mm[:, None]
        total_mm += (pass_mm @ share.T) * shape
    source: Source = "allowed for" if declared_mm is None else "declared"
    return Component("passes or operators", source, total_mm, shared=True, setting="uncertainty.pass_mm")


def _require_pass_mm(residual_mm: Floats, s_mm: Floats, pass_mm: float, source: str) -> None:
    """Raise InputError if the columns of repeats differ more than the declared ``pass_mm`` allows.

    ``residual_mm`` are the repeats minus the mean of their station, (n, r). The variance of the columns' offsets, tilts
    and bends is compared with that of the passes and of the scatter (F test). ``FALSE_ALARM`` is divided among the
    three. Small differences are accepted, because a pass need not have all three.
    """
    from scipy.special import fdtrc

    squares_mm2, freedom = _scatter(residual_mm, s_mm, None)
    passes = residual_mm.shape[1]
    if passes < 2 or freedom <= 0:
        return
    *_, per_pass = without_passes(residual_mm, s_mm, None)
    noise_mm2 = squares_mm2 / freedom / (~np.isnan(residual_mm)).sum(axis=0).mean()
    variance_mm2 = pass_mm**2 + noise_mm2 + ROUNDING_MM2
    chance = fdtrc(passes - 1, freedom, (per_pass**2).sum(axis=1) / (passes - 1) / variance_mm2)
    if chance.min() > FALSE_ALARM / len(chance):
        return
    repeat = int(np.abs(per_pass[chance.argmin()]).argmax())
    off_mm = np.sqrt((per_pass[:, repeat] ** 2).sum())
    raise InputError(
        f"{source}: the repeats contradict uncertainty.pass_mm = {pass_mm:g}: repeat {repeat + 1} is {off_mm:.2f} mm "
        "off the mean of all (rms along the crack), more than in 99 of 100 sheets with this pass_mm. Remove pass_mm, "
        "or set it to the standard deviation of the passes."
    )


RESOLUTION_LIMIT = 1.2
"""Resolution, in standard deviations, above which rounding hides the scatter, and repeats share the error of rounding.
Below it, rounding counts as an independent error (Sheppard)."""
WRITTEN_MM = 0.006  # Distance from a multiple of an inch's fraction that is written in hundredths of a millimetre
ODD_SHARE = 0.05  # Fraction of readings that need not be multiples of the last digit, such as between two marks


def refuse_contradicted(measured: Profile, settings: Readings, declared: Uncertainty) -> None:
    """Raise InputError for a declared error that the readings contradict. The message names the key.

    The height of a datum, a limit of error, the probe's width, a shift of all stations and an error that all repeats
    share leave no trace in the readings, and are accepted as declared.
    """
    source, (repeats_mm, residual_mm) = measured.source or "readings", repeats_of(measured)
    digit_mm = settings.resolution_mm or DIGIT_MM
    _require_resolution(repeats_mm, digit_mm, source)
    if declared.pass_mm is not None:
        _require_pass_mm(residual_mm, measured.s_mm, declared.pass_mm, source)
    if (declared_mm := declared.repeatability_mm) is not None:
        if (~np.isnan(repeats_mm)).sum(axis=1).max() > 1:
            squares_mm2, freedom = _scatter(residual_mm, measured.s_mm, declared.pass_mm)
            variance_mm2 = declared_mm**2 + digit_mm**2 / 12
            if squares_mm2 > variance_mm2 * chi_squared(1 - FALSE_ALARM, freedom):
                raise InputError(
                    f"{source}: the repeats contradict uncertainty.repeatability_mm = {declared_mm:g}: they scatter by "
                    f"{np.sqrt(squares_mm2 / freedom):.2g} mm ({freedom:.0f} degrees of freedom), more than 99 of 100 "
                    "sheets with this repeatability. Remove repeatability_mm, since the repeats show the scatter."
                )
        else:
            own_mm = declared_mm * np.ones(len(measured.s_mm))
            _require_rough(measured, own_mm, "repeatability_mm", declared_mm, source)
    if declared.station_each_mm is not None:
        own_mm = declared.station_each_mm * np.abs(np.gradient(measured.level_mm, measured.s_mm))
        _require_rough(measured, own_mm, "station_each_mm", declared.station_each_mm, source)


def _require_resolution(repeats_mm: Floats, resolution_mm: float, source: str) -> None:
    """Refuse a last digit that the readings do not have, for any height of the datum."""
    read_mm = repeats_mm[~np.isnan(repeats_mm)]
    if resolution_mm <= DIGIT_MM:
        return
    times = (read_mm - np.unique(read_mm)[: len(read_mm) // 2 + 1, None]) / resolution_mm
    odd = np.abs(times - np.round(times)) * resolution_mm > max(WRITTEN_MM, 0.02 * resolution_mm)
    count = int(odd.sum(axis=1).min())
    if count > ODD_SHARE * len(read_mm):
        raise InputError(
            f"{source}: the readings contradict readings.resolution_mm = {resolution_mm:g}: {count} of {len(read_mm)} "
            "are not multiples of it from any datum. Set resolution_mm to the caliper's last digit, and declare other "
            "errors in [uncertainty]."
        )


def _scatter(residual_mm: Floats, s_mm: Floats, pass_mm: float | None) -> tuple[float, float]:
    """Return the repeats' sum of squares about their stations' means, without passes, and degrees of freedom."""
    own_mm, shapes, _ = without_passes(residual_mm, s_mm, pass_mm)
    freedom = ((~np.isnan(residual_mm)).sum(axis=1) - 1).sum() * (1 - shapes.shape[1] / len(s_mm))
    return float(np.nansum(own_mm**2)), float(freedom)


def _require_rough(measured: Profile, own_mm: Floats, key: str, declared_mm: float, source: str) -> None:
    """Refuse independent errors of the stations that would make the level rougher than it is.

    ``own_mm`` are the standard deviations of these errors. For sealant of any shape, large second differences along the
    crack are at least as likely as for the errors alone (Anderson 1955, Proc. Am. Math. Soc. 6:170). At most the
    fraction ``FALSE_ALARM`` of all sheets is therefore refused wrongly.
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
            f"{source}: the readings contradict uncertainty.{key} = {declared_mm:g}: stations differ from the line "
            f"between their neighbours by {bends_mm:.2g} mm (rms). With such an error they would differ by at least "
            f"{least_mm:.2g} mm in 99 of 100 sheets, for any level. Declare a smaller error. Declare an error that "
            "neighbours share as uncertainty.common_mm."
        )
