"""Repeated readings: their passes along the crack, the error of these, and declared errors that repeats exceed."""

import numpy as np

from sealtwin.core.records import Floats, Profile
from validate.settings import DIGIT_MM, PASS_MM, Readings, Uncertainty
from validate.uncertainty.budget import Component, Source, chi_squared, draws_for, normals, uniforms

FREEDOM_OF_PASSES = 4.0  # Degrees of freedom of the half-t prior of a pass, few so that repeats may exceed it
FALSE_ALARM = 0.01  # Probability that the repeats exceed a true declaration


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


RESOLUTION_LIMIT = 1.2
"""Resolution, in standard deviations, above which rounding hides the scatter, and repeats share the error of rounding.
Below it, rounding counts as an independent error (Sheppard)."""


def contradicted(measured: Profile, settings: Readings, declared: Uncertainty) -> tuple[str, ...]:
    """Return a sentence for each declared error that the repeats exceed, which happens by chance in 1 of 100 sheets.

    The scatter of the repeats is compared with ``repeatability_mm``, and the offsets of the passes with ``pass_mm``.
    """
    repeats_mm, residual_mm = repeats_of(measured)
    own_mm, shapes, per_pass = without_passes(residual_mm, measured.s_mm, None)
    count, passes = (~np.isnan(repeats_mm)).sum(axis=1), repeats_mm.shape[1]
    freedom = float((count - 1).sum()) * (1 - shapes.shape[1] / len(count))
    if freedom <= 0:
        return ()
    digit_mm2, scatter_mm2 = (settings.resolution_mm or DIGIT_MM) ** 2 / 12, float(np.nansum(own_mm**2)) / freedom
    offsets_mm2, noise_mm2 = float((per_pass[0] ** 2).sum()) / (passes - 1), scatter_mm2 * passes / count.sum()
    seen = {"repeatability_mm": (scatter_mm2, freedom, 0.0), "pass_mm": (offsets_mm2, passes - 1.0, noise_mm2)}
    sentences = list[str]()
    for key, (variance_mm2, of_variance, also_mm2) in seen.items():
        error_mm = getattr(declared, key)
        limit = chi_squared(1 - FALSE_ALARM, of_variance) / of_variance
        if error_mm is not None and variance_mm2 > (error_mm**2 + also_mm2 + digit_mm2) * limit:
            sentences.append(f"uncertainty.{key} is {error_mm:g}, but the repeats show {np.sqrt(variance_mm2):.2g} mm.")
    return tuple(sentences)
