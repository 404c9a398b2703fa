"""Measure cracks that are too thin for walls: follow the darkest line to a fraction of a pixel, and fit the width.

The model of the brightness across the crack is a box, blurred by the lens, in linear light. Darkness and blur are the
same for all windows along the crack. Each window has its own width, offset, and ground whose light changes linearly
across the window. Below four pixels, the profile shows little more than the product of darkness and width. Most of the
width's uncertainty then comes from the darkness and from the camera's tone curve. Averaging along the crack does not
reduce this uncertainty.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from scipy.linalg import solve_triangular, toeplitz
from scipy.ndimage import gaussian_filter
from scipy.special import ndtr

from digitise.crack_path.hints import CrackPath
from digitise.crack_path.line_map import WORK_PX
from digitise.crack_path.profiles import unlike_length_px
from digitise.geometry.polyline import left_normals, places_beside, resampled, smoothed
from digitise.image.raster import DISPLAY_GAMMA, sampled
from digitise.photo import Photo
from digitise.walls.ends import Traced, to_its_ends
from digitise.walls.wall_profile import Patch, cheapest_way, patch_around
from sealtwin.core.arc_length import arc_length
from sealtwin.core.errors import InputError
from sealtwin.core.records import Booleans, Floats, Integers

# Assumptions about a thin crack, its camera and its ground. Lengths are in pixels.
#
# Chosen on drawn photos of cracks of 2 to 8 px so that the 95 % intervals contain the true width. They contain it in
# 381 of 399 later photos.
# A larger ``INNER_LIGHT`` or ``GAMMA_SD`` widens the intervals, and so does a smaller ``STRICTNESS``.
# Upper limit of the light inside a crack, divided by the light beside it, and the softness of this limit
INNER_LIGHT, FADE = 0.2, 0.03
GAMMA_SD = 0.12  # Standard deviation of a camera's exponent about DISPLAY_GAMMA, for exponents from 2.0 to 2.4
USUAL_BLUR, BLUR_SD = 1.0, 0.5  # Sigma of a camera's Gaussian blur, and the standard deviation of its logarithm
MIN_BLUR, MAX_BLUR = 0.35, 6.0
OFF_LINE = 0.5  # Standard deviation of the distance of the crack from its line
ROUNDS, LATER_ROUNDS = 10, 3  # Gauss-Newton steps from a rough start, and from the fit for the previous darkness
MAX_WIDER = 2.0  # Longest step of a width
MAX_BLURRIER = 0.3  # Longest step of the blur, as a fraction of the blur
# Minimum noise inside the crack, divided by the ground's noise. With less, the crack's bottom would dominate the fit
IN_THE_DARK = 0.7
WHITE = 0.03  # Fraction of the noise that is added as uncorrelated noise, because samples are closer than pixels
OUTLIER = 4.0  # The ground's noise is limited to this many standard deviations, so that single pores have no effect
# Weight of the misfit, below 1 because grain is correlated between neighbours and no lens blurs exactly as a Gaussian
STRICTNESS = 0.5
INTERVAL = 0.025, 0.975  # Probabilities at the ends of an interval
# Values of the darkness, which is 1 minus the inner light. The other parameters are fitted for each of these values
DARKNESS = np.linspace(1.0, 0.7, 13)
# Exponents of the tone curve, with the mean ``DISPLAY_GAMMA`` and the standard deviation ``GAMMA_SD``
TONES = DISPLAY_GAMMA + GAMMA_SD * np.sqrt(3) * np.array([-1, 0, 1])
TONE_WEIGHTS = np.array([1, 4, 1]) / 6  # Weights of these exponents (Gauss-Hermite)


@dataclass(frozen=True)
class BoxFit:
    """Result of the fit of a thin crack."""

    widths_px: Floats  # (windows,)
    offsets_px: Floats  # (windows,), offset of the crack's middle from the line
    mean_px: float
    interval_px: tuple[float, float]  # Ends of the mean width's 95 % interval


@dataclass(frozen=True)
class _Shape:
    """Widths, offsets and blur that fit best for one darkness and one tone curve."""

    widths_px: Floats
    offsets_px: Floats
    blur_px: float
    surprise: float = np.inf  # Twice the negative logarithm of the likelihood, plus a constant
    squares: float = np.inf  # Sum of the squares of the residuals, divided by the noise
    mean_sd_px: float = 0.0  # Standard deviation of the mean width from noise


STEP_PX = 0.5  # Spacing of samples across the line. Stations along the line are 1 px apart


# Constants for following a thin crack's line and fitting its width. "widths" are widths of the path.
#
# Chosen on the same drawn photos as the assumptions. A larger ``NEAR_PX`` corrects worse paths, but reaches more
# neighbouring lines. A longer ``WINDOW`` averages more grain, but follows fewer changes of width.
WINDOW = 10  # Number of stations in a window, whose mean profile is fitted
REACH = 1.5  # Widths to either side that are fitted, plus ``REACH_PX``. The same length beyond is the ground
REACH_PX = 6.0
CELLS = 2.0  # Largest distance of a path from the crack, in cells of the search map
NEAR_PX = 3.0  # The line is followed a second time, within half a width plus this distance
BLUR_ALONG = 2.0  # Blur along the line before it is followed, in stations
BLUR_ACROSS = 0.4  # Blur across the line, in widths
MIN_ACROSS_PX = 1.0
STIFFNESS = 0.15  # Cost of a step to a side by one sample, in darkness
MIN_SMOOTHING_PX = 4.0  # Minimum sigma of the line's smoothing, which is otherwise equal to the width
DARKEST = 1e-4  # Minimum light. Cubic interpolation may fall below 0 between pixels
MIN_WINDOWS = 5  # Minimum number of windows. With fewer, blur and width cannot be distinguished
MAX_UNLIKE = 0.5  # Largest fraction of the path with unlike sides. More means an edge, or a wall of a wide gap
NARROWEST = 0.1  # Minimum local width, as a fraction of the mean width, so that walls do not cross


class NotFittedError(InputError):
    """Raised if the width of the crack along a path cannot be fitted."""


def trace_line(photo: Photo, path: CrackPath) -> Traced:
    """Follow the darkest line along ``path``. Both walls of the result are that line."""
    line_px = _line_px(photo, path)
    return to_its_ends(photo, _patch(photo, path), (line_px, line_px, line_px), path.width_px)


def _patch(photo: Photo, path: CrackPath) -> Patch:
    return patch_around(photo, path.points_px, 3 * (REACH * path.width_px + REACH_PX))


def trace_thin(photo: Photo, path: CrackPath) -> tuple[Traced, BoxFit]:
    """Follow the darkest line along ``path`` and fit the crack's width.

    Raises NotFittedError if too little is in view, or if one side of the path is far brighter than the other.
    """
    line_px, patch = _line_px(photo, path), _patch(photo, path)
    reach = round((REACH * path.width_px + REACH_PX) / STEP_PX)
    places_px = STEP_PX * np.arange(-reach, reach + 1, dtype=float)
    cuts = np.linspace(0, len(line_px), max(1, len(line_px) // WINDOW) + 1).astype(int)
    beside_px = (2 * reach + 1) * STEP_PX
    (light, shown), *grounds = (
        _windows(photo, patch, line_px, places_px + aside_px, cuts) for aside_px in (0.0, beside_px, -beside_px)
    )
    ground = np.concatenate([values[in_view] for values, in_view in grounds])
    if unlike_length_px(photo, path.points_px, path.width_px) > MAX_UNLIKE * arc_length(path.points_px)[-1]:
        raise NotFittedError(
            "the ground on one side of the path is far brighter than on the other, so a width of about "
            f"{path.width_px:.1f} px cannot be fitted. If the path is at one wall of a wide gap or at the sample's "
            "edge, give ends_px in the middle of the crack. Otherwise give width_mm.",
            photo.file,
        )
    if min(np.count_nonzero(shown), len(ground)) < MIN_WINDOWS:
        raise NotFittedError(
            f"the crack is {path.width_px:.1f} px wide, but too little of it and of the ground beside it is in view "
            f"to fit its width: at least {MIN_WINDOWS} stretches of {WINDOW} px are needed. Move the camera closer "
            "or give width_mm, or path_only if the path is enough.",
            photo.file,
        )
    fit = fit_box(light[shown], ground, places_px, path.width_px)
    middle, station = (cuts[1:] + cuts[:-1] - 1) / 2, np.arange(len(line_px))
    widths_px, offsets_px = (
        np.interp(station, middle[shown], measured_px) for measured_px in (fit.widths_px, fit.offsets_px)
    )
    widths_px = np.maximum(widths_px, NARROWEST * fit.mean_px)
    line_px = line_px + offsets_px[:, None] * left_normals(line_px)
    half_px = (widths_px * fit.mean_px / widths_px.mean() / 2)[:, None] * left_normals(line_px)
    # y runs down in the photo, so that left in the photo is right on the face.
    lines_px = line_px, line_px - half_px, line_px + half_px
    return to_its_ends(photo, patch, lines_px, max(fit.mean_px, 1.0)), fit


def _windows(photo: Photo, patch: Patch, line_px: Floats, places_px: Floats, cuts: Integers) -> tuple[Floats, Booleans]:
    """Return the mean light of each window across the line, (windows, samples).

    Also returns a mask, (windows,), that is True for windows that show only the sample.
    """
    place_px = places_beside(line_px, places_px)
    # The photo is used instead of the patch, whose blur would hide most of a thin crack.
    light = np.maximum(sampled(photo.brightness, place_px, cv2.INTER_CUBIC).astype(float), DARKEST)
    shown = patch.on_sample(place_px, photo.to_mm(place_px)).all(axis=1)
    mean = np.add.reduceat(light, cuts[:-1], axis=0) / np.diff(cuts)[:, None]
    return mean, np.logical_and.reduceat(shown, cuts[:-1])


def _line_px(photo: Photo, path: CrackPath) -> Floats:
    """Return a smooth line along the darkest pixels near the path, (n, 2) in px."""
    line_px, width_px = smoothed(resampled(path.points_px, 1.0), BLUR_ALONG), path.width_px
    cell_px, around = max(photo.size_px) / WORK_PX, int(np.ceil((width_px + NEAR_PX) / STEP_PX))
    across = max(BLUR_ACROSS * width_px, MIN_ACROSS_PX) / STEP_PX
    for reach_px in (CELLS * cell_px + width_px + NEAR_PX, width_px / 2 + NEAR_PX):
        reach = int(np.ceil(reach_px / STEP_PX))
        places_px = STEP_PX * np.arange(-reach - around, reach + around + 1.0)
        light = sampled(photo.brightness, places_beside(line_px, places_px))
        dark = 1 - light / np.maximum(np.median(light, axis=1, keepdims=True), DARKEST)
        dark = gaussian_filter(dark.astype(float), (BLUR_ALONG, across))[:, around:-around]
        aside_px = (cheapest_way(-dark[None], STIFFNESS * np.array([1, 0, 1]))[0] - reach) * STEP_PX
        moved_px = line_px + aside_px[:, None] * left_normals(line_px)
        line_px = smoothed(resampled(moved_px, 1.0), max(width_px, MIN_SMOOTHING_PX))
    return line_px


def fit_box(light: Floats, ground: Floats, places_px: Floats, width_px: float) -> BoxFit:
    """Fit the light across a crack that is about ``width_px`` wide. ``light`` is (windows, samples).

    ``ground``, (n, samples), is the light in windows beside the crack, for the noise. ``places_px`` are the samples'
    distances from the line.
    """
    shapes, weights = [], []
    likely = 1 / (1 + np.exp((1 - DARKNESS - INNER_LIGHT) / FADE))
    for gamma, tone_weight in zip(TONES, TONE_WEIGHTS, strict=True):
        bent, beside = (values ** (gamma / DISPLAY_GAMMA) for values in (light, ground))
        whitener = _whitener(beside, places_px)
        fits = [_Shape(np.full(len(light), width_px), np.zeros(len(light)), USUAL_BLUR)]
        for darkness in DARKNESS:
            fits.append(_fitted(bent, places_px, whitener, darkness, fits[-1]))
        shapes += fits[1:]
        surprise, squares = np.array([(fit.surprise, fit.squares) for fit in fits[1:]]).T
        # If the fit is worse than the noise explains, the interval is wider.
        spread = max(1.0, squares[surprise.argmin()] / (len(light) * (len(places_px) - 4)))
        weight = likely * np.exp(-STRICTNESS / spread * (surprise - surprise.min()) / 2)
        weights.append(tone_weight * weight / weight.sum())
    weight = np.concatenate(weights)
    means_px = np.array([shape.widths_px.mean() for shape in shapes])
    sds_px = np.array([max(shape.mean_sd_px, 1e-6) for shape in shapes]) / np.sqrt(STRICTNESS)
    grid_px = np.linspace((means_px - 5 * sds_px).min(), (means_px + 5 * sds_px).max(), 4000)
    low_px, high_px = np.interp(INTERVAL, ndtr((grid_px[:, None] - means_px) / sds_px) @ weight, grid_px)
    mean_px = float(weight @ means_px)
    return BoxFit(
        weight @ np.array([shape.widths_px for shape in shapes]),
        weight @ np.array([shape.offsets_px for shape in shapes]),
        mean_px,
        (float(low_px), float(high_px)),
    )


def _fitted(light: Floats, places_px: Floats, whitener: Floats, darkness: float, start: _Shape) -> _Shape:
    """Return the fit for one darkness by Gauss-Newton steps from ``start``.

    The parameters of each window are eliminated before the common blur is computed.
    """
    # Parameters of each window: width, offset, and level and slope of the ground.
    windows = np.column_stack([start.widths_px, start.offsets_px, np.median(light, axis=1), np.zeros(len(light))])
    most = np.array([MAX_WIDER, MAX_WIDER / 2, np.inf, np.inf])
    shape, far = start, places_px / np.abs(places_px).max()
    for _ in range(LATER_ROUNDS if np.isfinite(start.surprise) else ROUNDS):
        blur_px = shape.blur_px
        width, offset, level, slope = windows.T[..., None]
        left, right = ((places_px - offset + side * width / 2) / blur_px for side in (1, -1))
        bell_left, bell_right = (np.exp(-(z**2) / 2) / np.sqrt(2 * np.pi) for z in (left, right))
        bright, share = level + slope * far, 1 - darkness * (ndtr(left) - ndtr(right))
        noise = np.maximum(share, IN_THE_DARK) * level
        by_edge = -darkness * bright / blur_px
        by = (
            by_edge * (bell_left + bell_right) / 2,  # Width
            by_edge * (bell_right - bell_left),  # Offset
            share,  # Level and slope of the ground
            share * far,
            by_edge * (bell_right * right - bell_left * left),  # Blur
        )
        columns = whitener @ (np.stack(by, axis=-1) / noise[..., None])
        rest = (light - bright * share) / noise @ whitener.T
        turned = columns.transpose(0, 2, 1)
        normal, pull = turned @ columns, (turned @ rest[..., None])[..., 0]
        normal[:, 1, 1] += OFF_LINE**-2
        pull[:, 1] -= windows[:, 1] / OFF_LINE**2
        blurrier, blur_sd_px = np.log(blur_px / USUAL_BLUR) / BLUR_SD, BLUR_SD * blur_px
        squares = (rest**2).sum()
        unlikely = 2 * np.log(noise / level).sum() + (windows[:, 1] ** 2).sum() / OFF_LINE**2 + blurrier**2
        steady = 1e-9 * np.eye(4) * np.trace(normal, axis1=1, axis2=2)[:, None, None]
        inverse = np.linalg.inv(normal[:, :4, :4] + steady)
        by_blur = (inverse @ normal[:, :4, 4:])[..., 0]
        stiff, force = ((rows[:, 4] - (by_blur * rows[:, :4]).sum(axis=1)).sum() for rows in (normal[..., 4], pull))
        stiff, force = stiff + blur_sd_px**-2, force - blurrier / blur_sd_px
        more_px = np.clip(force / stiff, -MAX_BLURRIER * blur_px, MAX_BLURRIER * blur_px)
        step = (inverse @ pull[:, :4, None])[..., 0] - by_blur * more_px
        windows = windows + np.clip(step, -most, most)
        shape = _Shape(
            windows[:, 0],
            windows[:, 1],
            np.clip(blur_px + more_px, MIN_BLUR, MAX_BLUR),
            squares + unlikely,
            squares,
            np.sqrt(inverse[:, 0, 0].sum() / len(light) ** 2 + by_blur[:, 0].mean() ** 2 / stiff),
        )
    return shape


def _whitener(ground: Floats, places_px: Floats) -> Floats:
    """Return the whitening matrix of the ground's relative noise, (samples, samples)."""
    line = np.column_stack([np.ones(len(places_px)), places_px])
    share = ground / np.median(ground, axis=1, keepdims=True) - 1
    rest = share - share @ np.linalg.pinv(line).T @ line.T
    limit = OUTLIER * 1.4826 * np.median(np.abs(rest))
    rest = np.clip(rest, -limit, limit) + 1e-12
    count = rest.shape[1]
    by_lag = np.array([(rest[:, : count - lag] * rest[:, lag:]).sum() for lag in range(count)]) / rest.size
    by_lag[0] = (1 + WHITE) * by_lag[0] + 1e-9
    return np.asarray(solve_triangular(np.linalg.cholesky(toeplitz(by_lag)), np.eye(count), lower=True), float)
