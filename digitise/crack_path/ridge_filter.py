"""Measure how much each pixel looks like part of a dark line, straight or bending. Angles count from x to y."""

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from digitise.image.raster import Map, blurred, resized, shrunk

Stack = NDArray[np.float32]  # One map per direction, (directions, height, width)


@dataclass(frozen=True)
class LineFilter:
    """Shape of the line filter, its unit of noise, and how far it follows lines. Lengths are pixels of the search map.

    Chosen on drawn photos and on asphalt. A longer filter loses cracks that wander, and a shorter one finds grains. A
    longer stride bridges more gaps.
    """

    directions: int = 8  # Directions over half a turn; sixteen found no more on 45 drawn photos, in twice the time
    sigmas: tuple[tuple[float, ...], ...] = ((0.7,), (0.7, 1.4), (1.4,), (1.4,))  # Of the dark middle, for each copy
    least_side: int = 60  # Least side of a halved copy; a line as long as a few widths does not fit on a smaller one
    elongation: float = 2.5  # Length over width
    middle: float = 0.7  # Width of the middle, in sigmas
    side: float = 2.2  # Distance of the sides from the middle, in sigmas
    one_sided: float = 0.5  # Share of the sides' difference that is subtracted: an edge is dark against one side only
    noise: float = 40.0  # Sigma over which noise is averaged: a shadow or a patch has noise of its own
    loud: float = 4.0  # Most typical responses that one response adds to the noise, so that a crack is not noise
    mean_size: float = 1.25  # Standard deviation of a normal distribution over its mean absolute value
    least_noise: float = 2e-3  # Least noise of brightness: the rounding of 8 bits
    stride: float = 4.0  # Length of a step along a line
    strides: int = 6  # Steps to each side: 24 px, many grains and one gap
    strongest: float = 6.0  # Largest response of one step, in noise units, so that no pore decides over the whole path
    weakest: float = -1.0  # Smallest response of one step, so that no gap decides
    clearest: float = 6.0  # Least standard deviations of a line of full strength, on ground of any pattern
    low: int = 16  # Percentiles of the support on plain ground, a standard deviation apart
    typical: int = 50
    high: int = 84
    lopsided: float = 1.4  # Upper spread over lower one on plain grain: 1.2 to 1.3 when drawn, 1.4 to 1.6 on asphalt


FILTER = LineFilter()


def strength(even: Map, allowed: NDArray[np.bool_]) -> Map:
    """Return the best filter response at each pixel, in units of noise. ``even`` is light divided by its local mean."""
    best = np.zeros_like(even)
    for responses in _octaves(even, allowed):
        np.maximum(best, resized(responses.max(axis=0), even.shape), out=best)
    return best


def support(even: Map, allowed: NDArray[np.bool_]) -> Map:
    """Return how line-like the best path through each pixel is, in standard deviations above plain ground."""
    octaves = [
        resized(_spread_from(_followed(responses), _halved(allowed, octave)), even.shape)
        for octave, responses in enumerate(_octaves(even, allowed))
    ]
    # A thin line shows at both fine scales, a rim or a row of grains at one.
    thin = np.mean(octaves[:2], axis=0)
    wide = np.max(octaves[2:], axis=0, initial=-np.inf) / 3
    return np.maximum(thin, wide).astype(np.float32)


def _octaves(even: Map, allowed: NDArray[np.bool_]) -> Iterator[Stack]:
    """Yield the filter responses on the picture and on its halved copies."""
    for octave, sigmas_px in enumerate(FILTER.sigmas):
        size = (even.shape[1] >> octave, even.shape[0] >> octave)
        if octave > 0 and min(size) < FILTER.least_side:
            return
        picture = even if octave == 0 else shrunk(even, size)
        usable = _halved(allowed, octave)
        responses = np.zeros((FILTER.directions, *picture.shape), dtype=np.float32)
        for sigma_px in sigmas_px:
            own = np.array([_response(picture, sigma_px, direction) for direction in range(FILTER.directions)])
            own /= _noise(own, usable, FILTER.noise / 2**octave)
            np.maximum(responses, own, out=responses)
        yield responses


def _response(picture: Map, sigma_px: float, direction: int) -> Map:
    """Return how much brighter both sides are than the middle, less half of the sides' difference."""
    middle = np.asarray(cv2.filter2D(picture, cv2.CV_32F, _bar(sigma_px, direction)), dtype=np.float32)
    angle = np.pi * direction / FILTER.directions + np.pi / 2
    left, right = _moved(middle, FILTER.side * sigma_px, angle), _moved(middle, -FILTER.side * sigma_px, angle)
    return np.asarray((left + right - FILTER.one_sided * np.abs(left - right)) / 2 - middle, dtype=np.float32)


def _bar(sigma_px: float, direction: int) -> Map:
    """Return the weights of a Gaussian mean along a direction."""
    reach = int(np.ceil(3 * FILTER.elongation * sigma_px))
    y, x = np.mgrid[-reach : reach + 1, -reach : reach + 1]
    angle = np.pi * direction / FILTER.directions
    along, across = x * np.cos(angle) + y * np.sin(angle), y * np.cos(angle) - x * np.sin(angle)
    weight = np.exp(-((along / FILTER.elongation) ** 2 + (across / FILTER.middle) ** 2) / (2 * sigma_px**2))
    return (weight / weight.sum()).astype(np.float32)


def _noise(responses: Stack, usable: NDArray[np.bool_], sigma_px: float) -> Map:
    """Return the standard deviation of the responses around each pixel, estimated from their mean size off cracks."""
    few = np.abs(responses[:: FILTER.directions // 4])
    limit = FILTER.loud * float(np.median(few[:, usable])) if usable.any() else 0.0
    size = np.where(usable, np.minimum(few, limit).mean(axis=0), 0).astype(np.float32)
    mean = _broadly(size, sigma_px) / np.maximum(_broadly(usable.astype(np.float32), sigma_px), 1e-3)
    return np.maximum(FILTER.mean_size * mean, FILTER.least_noise).astype(np.float32)


def _broadly(picture: Map, sigma_px: float) -> Map:
    """Blur widely. The blur is computed on a smaller copy to save time."""
    times = max(1, int(sigma_px / 5))
    small = shrunk(picture, (max(1, picture.shape[1] // times), max(1, picture.shape[0] // times)))
    return resized(blurred(small, sigma_px / times), picture.shape)


def _followed(responses: Stack) -> Map:
    """Return the mean response along the best path through each pixel; a path turns by at most one direction a step."""
    gain = np.clip(responses, FILTER.weakest, FILTER.strongest)
    ahead = np.concatenate([gain, gain])  # both ways along each direction
    angles = np.pi * np.arange(2 * FILTER.directions) / FILTER.directions
    for _ in range(FILTER.strides - 1):
        came = np.array([_moved(onward, FILTER.stride, angle) for onward, angle in zip(ahead, angles, strict=True)])
        for direction in range(2 * FILTER.directions):
            onward = np.maximum(came[direction - 1], came[(direction + 1) % (2 * FILTER.directions)])
            ahead[direction] = gain[direction % FILTER.directions] + np.maximum(onward, came[direction])
    best = (ahead[: FILTER.directions] + ahead[FILTER.directions :] - gain).max(axis=0)
    return best / (2 * FILTER.strides - 1)


def _moved(picture: Map, distance_px: float, angle: float) -> Map:
    """Return at each pixel the value that is ``distance_px`` away in the direction ``angle``."""
    motion = np.array([[1, 0, -distance_px * np.cos(angle)], [0, 1, -distance_px * np.sin(angle)]])
    size, mirrored = picture.shape[::-1], cv2.BORDER_REFLECT
    return np.asarray(cv2.warpAffine(picture, motion, size, flags=cv2.INTER_LINEAR, borderMode=mirrored), np.float32)


def _spread_from(value: Map, usable: NDArray[np.bool_]) -> Map:
    """Convert values to standard deviations above the typical value of plain ground."""
    if not usable.any():
        return np.zeros_like(value)
    low, typical, high = np.percentile(value[usable], (FILTER.low, FILTER.typical, FILTER.high))
    # Joints and holes raise the upper spread; very quiet parts of a picture widen the lower one.
    spread = np.sqrt((high - typical) * FILTER.lopsided * (typical - low))
    spread = min(spread, (FILTER.strongest - typical) / FILTER.clearest)
    return ((value - typical) / max(spread, 1e-6)).astype(np.float32)


def _halved(allowed: NDArray[np.bool_], times: int) -> NDArray[np.bool_]:
    if times == 0:
        return allowed
    size = (allowed.shape[1] >> times, allowed.shape[0] >> times)
    return shrunk(allowed.astype(np.float32), size) > 0.99
