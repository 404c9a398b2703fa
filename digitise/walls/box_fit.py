"""Fit the width of a thin crack: a box, blurred by the lens, in linear light.

Lengths are pixels. All windows along the crack share darkness and blur; each has its own width, offset and sloping
ground. Below four pixels the profile shows little more than darkness times width. Most of the width's uncertainty then
comes from the darkness and the camera's tone curve, and averaging along the crack does not reduce it.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular
from scipy.special import ndtr

from digitise.image.tone_curve import DISPLAY_GAMMA
from sealtwin.core.records import Floats


@dataclass(frozen=True)
class BoxModel:
    """Assumptions about a thin crack, its camera and its ground. Lengths are pixels.

    Set on drawn photos of cracks of 2 to 8 px so that the 95 % intervals hold: on 399 photos drawn afterwards 381 do. A
    larger ``inner_light`` or ``gamma_sd`` widens the intervals, and so does a smaller ``strictness``.
    """

    inner_light: float = 0.2  # Largest light inside a crack over the light next to it, about
    fade: float = 0.03  # Softness of that bound
    gamma_sd: float = 0.12  # Standard deviation of a camera's exponent about DISPLAY_GAMMA: of any from 2.0 to 2.4
    usual_blur: float = 1.0  # Gaussian sigma of a camera's blur
    blur_sd: float = 0.5  # Standard deviation of its logarithm
    least_blur: float = 0.35
    most_blur: float = 6.0
    off_line: float = 0.5  # Standard deviation of the crack from its line: half a pixel off looks wider and paler
    rounds: int = 10  # Gauss-Newton steps from a rough start
    later_rounds: int = 3  # The same from the fit for the next darkness
    most_wider: float = 2.0  # Longest step of a width
    most_blurrier: float = 0.3  # Longest step of the blur, as a share of it
    in_the_dark: float = 0.7  # Least noise inside the crack over the ground's; with less its bottom shapes the fit
    white: float = 0.03  # Least share of the noise that is not shared with neighbours: samples are closer than pixels
    outlier: float = 4.0  # Standard deviations at which the ground's noise is cut off, so that one pore does not count
    strictness: float = 0.5  # Share of the misfit that counts: neighbours share grain, and no lens blurs as a Gaussian


MODEL = BoxModel()
INTERVAL = 0.025, 0.975  # Probabilities of the ends of an interval
MOST_DIRTY = 0.75  # Largest share of a crack that dirty edges may be
HALO_PX = 5.0  # Breadth of a dirty edge
LEAST_DARK_PX = 0.4  # Width of a crack as dark as those halves, from which on they count: clean edges have at most 0.3
DARKNESS = np.linspace(1.0, 0.7, 13)  # Values of the darkness, 1 less the inner light, for which the rest is fitted
TONES = DISPLAY_GAMMA + MODEL.gamma_sd * np.sqrt(3) * np.array([-1, 0, 1])  # Exponents with that mean and deviation
TONE_WEIGHTS = np.array([1, 4, 1]) / 6  # Their weights (Gauss-Hermite)


@dataclass(frozen=True)
class BoxFit:
    """The result of the fit of a thin crack."""

    widths_px: Floats  # (windows,)
    offsets_px: Floats  # (windows,): of the crack's middle from the line
    mean_px: float
    interval_px: tuple[float, float]  # Ends of the 95 % interval of the mean


@dataclass(frozen=True)
class _Shape:
    """Widths, offsets and blur that fit best for a given darkness and tone curve."""

    widths_px: Floats
    offsets_px: Floats
    blur_px: float
    surprise: float = np.inf  # Twice the negative logarithm of the likelihood, plus a constant
    squares: float = np.inf  # Sum of squares over the noise
    mean_sd_px: float = 0.0  # Standard deviation of the mean width by the noise


def fit_box(light: Floats, ground: Floats, places_px: Floats, width_px: float) -> BoxFit:
    """Fit windows of light across a crack about ``width_px`` wide, (windows, places).

    ``ground``, (n, places), are windows next to the crack, which show the noise.
    """
    shapes, weights = list[_Shape](), list[Floats]()
    likely = 1 / (1 + np.exp((1 - DARKNESS - MODEL.inner_light) / MODEL.fade))
    for gamma, tone_weight in zip(TONES, TONE_WEIGHTS, strict=True):
        bent, beside = (values ** (gamma / DISPLAY_GAMMA) for values in (light, ground))
        whitener, fits = _whitener(beside, places_px), list[_Shape]()
        shape = _Shape(np.full(len(light), width_px), np.zeros(len(light)), MODEL.usual_blur)
        for darkness in DARKNESS:
            shape = _fitted(
                bent, places_px, whitener, float(darkness), shape, MODEL.later_rounds if fits else MODEL.rounds
            )
            fits.append(shape)
        surprise = np.array([fit.surprise for fit in fits])
        # A worse fit widens the interval.
        spread = max(1.0, fits[int(surprise.argmin())].squares / (len(light) * (len(places_px) - 4)))
        weight = likely * np.exp(-MODEL.strictness / spread * (surprise - surprise.min()) / 2)
        shapes += fits
        weights.append(tone_weight * weight / weight.sum())
    weight = np.concatenate(weights)
    means_px = np.array([shape.widths_px.mean() for shape in shapes])
    sds_px = np.array([max(shape.mean_sd_px, 1e-6) for shape in shapes]) / np.sqrt(MODEL.strictness)
    grid_px = np.linspace((means_px - 5 * sds_px).min(), (means_px + 5 * sds_px).max(), 4000)
    below = ndtr((grid_px[:, None] - means_px) / sds_px) @ weight
    low_px, high_px = np.interp(INTERVAL, below, grid_px)
    mean_px = float(weight @ means_px)
    return BoxFit(
        widths_px=weight @ np.array([shape.widths_px for shape in shapes]),
        offsets_px=weight @ np.array([shape.offsets_px for shape in shapes]),
        mean_px=mean_px,
        interval_px=(float(low_px - min(_dirty_px(light, places_px, mean_px), MOST_DIRTY * low_px)), float(high_px)),
    )


def _dirty_px(light: Floats, places_px: Floats, width_px: float) -> float:
    """Return the width that dirty edges may have added to a crack: three times what is dark in their outer halves."""
    dark = 1 - np.median(light / light[:, [0, -1]].mean(axis=1, keepdims=True), axis=0)
    beside_px = np.abs(places_px) - width_px / 2
    outer = dark[(beside_px > HALO_PX / 2) & (beside_px < HALO_PX)]
    dark_px = (places_px[1] - places_px[0]) * outer.sum() / dark.max()
    return 3 * dark_px * (dark_px > LEAST_DARK_PX)


def _fitted(light: Floats, places_px: Floats, whitener: Floats, darkness: float, start: _Shape, rounds: int) -> _Shape:
    """Fit by Gauss-Newton. Each window's own parameters are eliminated before the shared blur is solved for."""
    widths_px, offsets_px, blur_px = start.widths_px, start.offsets_px, start.blur_px
    far = places_px / np.abs(places_px).max()
    level, slope = np.median(light, axis=1), np.zeros(len(light))
    surprise, squares, mean_sd_px = np.inf, np.inf, 0.0
    for _ in range(rounds):
        left, right = ((places_px - offsets_px[:, None] + side * widths_px[:, None] / 2) / blur_px for side in (1, -1))
        bell_left, bell_right = (np.exp(-(z**2) / 2) / np.sqrt(2 * np.pi) for z in (left, right))
        bright, share = level[:, None] + slope[:, None] * far, 1 - darkness * (ndtr(left) - ndtr(right))
        noise = np.maximum(share, MODEL.in_the_dark) * level[:, None]
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
        normal[:, 1, 1] += MODEL.off_line**-2
        pull[:, 1] -= offsets_px / MODEL.off_line**2
        blurrier = np.log(blur_px / MODEL.usual_blur) / MODEL.blur_sd
        squares = float((rest**2).sum())
        surprise = squares + float(
            2 * np.log(noise / level[:, None]).sum() + (offsets_px**2).sum() / MODEL.off_line**2 + blurrier**2
        )
        inverse = np.linalg.inv(
            normal[:, :4, :4] + 1e-9 * np.eye(4) * np.trace(normal, axis1=1, axis2=2)[:, None, None]
        )
        by_blur = (inverse @ normal[:, :4, 4:])[..., 0]
        stiff = float((normal[:, 4, 4] - (by_blur * normal[:, :4, 4]).sum(axis=1)).sum())
        stiff += (MODEL.blur_sd * blur_px) ** -2
        force = float((pull[:, 4] - (by_blur * pull[:, :4]).sum(axis=1)).sum()) - blurrier / (MODEL.blur_sd * blur_px)
        more_px = float(np.clip(force / stiff, -MODEL.most_blurrier * blur_px, MODEL.most_blurrier * blur_px))
        step = (inverse @ pull[:, :4, None])[..., 0] - by_blur * more_px
        mean_sd_px = float(np.sqrt(inverse[:, 0, 0].sum() / len(light) ** 2 + by_blur[:, 0].mean() ** 2 / stiff))
        widths_px = widths_px + np.clip(step[:, 0], -MODEL.most_wider, MODEL.most_wider)
        offsets_px = offsets_px + np.clip(step[:, 1], -MODEL.most_wider / 2, MODEL.most_wider / 2)
        level, slope = level + step[:, 2], slope + step[:, 3]
        blur_px = float(np.clip(blur_px + more_px, MODEL.least_blur, MODEL.most_blur))
    return _Shape(widths_px, offsets_px, blur_px, surprise, squares, mean_sd_px)


def _whitener(ground: Floats, places_px: Floats) -> Floats:
    """Return the matrix, (places, places), that makes the ground's noise over its level white, with deviation 1."""
    line = np.column_stack([np.ones(len(places_px)), places_px])
    share = ground / np.median(ground, axis=1, keepdims=True) - 1
    rest = share - share @ np.linalg.pinv(line).T @ line.T
    limit = MODEL.outlier * 1.4826 * np.median(np.abs(rest))
    rest = np.clip(rest, -limit, limit) + 1e-12
    count = rest.shape[1]
    by_lag = np.array([(rest[:, : count - lag] * rest[:, lag:]).sum() for lag in range(count)]) / rest.size
    by_lag[0] = (1 + MODEL.white) * by_lag[0] + 1e-9
    index = np.arange(count)
    covariance = by_lag[np.abs(index[:, None] - index)]
    return np.asarray(solve_triangular(np.linalg.cholesky(covariance), np.eye(count), lower=True), dtype=float)
