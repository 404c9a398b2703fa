"""How line-like a picture is at each pixel: dark against both sides, and carried on along a bending way.

Sizes are pixels of the picture that is searched. Angles count from x to y.
"""

from collections.abc import Iterator

import cv2
import numpy as np
from numpy.typing import NDArray

from digitise.pictures.raster import Map, blurred, shrunk

Stack = NDArray[np.float32]
"""One map per direction, (directions, height, width)."""

DIRECTIONS = 8
"""Over half a turn: a filter two and a half times as long as wide still answers half-way between two of them. Sixteen
found no more on 45 drawn photos, in twice the time.
"""
SIGMAS_PX = ((0.7,), (0.7, 1.4), (1.4,), (1.4,))
"""Of the dark middle's Gaussian, on the picture and on its copies halved once, twice and thrice: for lines up to 40 px
wide, each where it costs least.
"""
LEAST_SIDE_PX = 60
"""Of a halved copy; on a smaller one a line as long as a few widths no longer fits."""
ELONGATION = 2.5
"""Of the filter: longer ones lose a crack that wanders, shorter ones take grains for it."""
MIDDLE, SIDE = 0.7, 2.2
"""In sigmas: width of what counts as middle, and how far beside it the sides are measured."""
ONE_SIDED = 0.5
"""How much of the difference between both sides is taken off: an edge is dark against one side only."""
NOISE_PX = 40.0
"""Over which noise is averaged: a shadow or a patch has its own."""
LOUD = 4.0
"""Answers count for this many typical ones at most towards the noise, so that a crack is none."""
MEAN_SIZE = 1.25
"""Standard deviation of a normal distribution over its mean size."""
LEAST_NOISE = 2e-3
"""Of brightness: finer is the rounding of 8 bits."""
STRIDE_PX, STRIDES = 4.0, 6
"""Steps of the way on which a line is followed to both sides, and their number: 24 px, many grains and one gap."""
STRONGEST, WEAKEST = 6.0, -1.0
"""Noise units that one step may count for: neither a pore nor a gap decides over the whole way."""
CLEAREST = 6.0
"""Standard deviations that a line of full strength always counts for, on ground however patterned."""
LOW, TYPICAL, HIGH = 16, 50, 84
"""Percentiles of the support on plain ground, a standard deviation apart."""
LOPSIDED = 1.4
"""Upper spread over lower one, where there is nothing but grain: the best of many ways is seldom bad. Seen are 1.2 to
1.3 in drawn noise, 1.4 to 1.6 in pictures of asphalt.
"""


def strength(even: Map, allowed: NDArray[np.bool_]) -> Map:
    """Answer of the best line through each pixel, of any width and direction, in units of the noise around.

    ``even`` is brightness over its local mean.
    """
    best = np.zeros_like(even)
    for answers in _octaves(even, allowed):
        np.maximum(best, _resized(answers.max(axis=0), even.shape), out=best)
    return best


def support(even: Map, allowed: NDArray[np.bool_]) -> Map:
    """How well the best way through each pixel is a line, over ``STRIDES`` steps to both sides.

    0 is typical of the picture, and 1 one standard deviation of plain ground above that. Lines wider than 6 px count a
    third: stains and patches have rims, a wide crack is far darker than those.
    """
    octaves = [
        _resized(_spread_from(_followed(answers), _halved(allowed, octave)), even.shape)
        for octave, answers in enumerate(_octaves(even, allowed))
    ]
    # Thin lines answer to both, rims and rows of grains to one.
    thin = np.mean(octaves[:2], axis=0)
    wide = np.max(octaves[2:], axis=0, initial=-np.inf) / 3
    return np.maximum(thin, wide).astype(np.float32)


def _octaves(even: Map, allowed: NDArray[np.bool_]) -> Iterator[Stack]:
    """Answers on the picture and on its halved copies."""
    for octave, sigmas_px in enumerate(SIGMAS_PX):
        size = (even.shape[1] >> octave, even.shape[0] >> octave)
        if octave > 0 and min(size) < LEAST_SIDE_PX:
            return
        picture = even if octave == 0 else shrunk(even, size)
        usable = _halved(allowed, octave)
        answers = np.zeros((DIRECTIONS, *picture.shape), dtype=np.float32)
        for sigma_px in sigmas_px:
            own = np.array([_answer(picture, sigma_px, direction) for direction in range(DIRECTIONS)])
            own /= _noise(own, usable, NOISE_PX / 2**octave)
            np.maximum(answers, own, out=answers)
        yield answers


def _answer(picture: Map, sigma_px: float, direction: int) -> Map:
    """Brightness of both sides over the middle, less half of what the sides differ by."""
    middle = np.asarray(cv2.filter2D(picture, cv2.CV_32F, _bar(sigma_px, direction)), dtype=np.float32)
    angle = np.pi * direction / DIRECTIONS + np.pi / 2
    left, right = _moved(middle, SIDE * sigma_px, angle), _moved(middle, -SIDE * sigma_px, angle)
    return np.asarray((left + right - ONE_SIDED * np.abs(left - right)) / 2 - middle, dtype=np.float32)


def _bar(sigma_px: float, direction: int) -> Map:
    """Weights of a mean along a direction."""
    reach = int(np.ceil(3 * ELONGATION * sigma_px))
    y, x = np.mgrid[-reach : reach + 1, -reach : reach + 1]
    angle = np.pi * direction / DIRECTIONS
    along, across = x * np.cos(angle) + y * np.sin(angle), y * np.cos(angle) - x * np.sin(angle)
    weight = np.exp(-((along / ELONGATION) ** 2 + (across / MIDDLE) ** 2) / (2 * sigma_px**2))
    return (weight / weight.sum()).astype(np.float32)


def _noise(answers: Stack, usable: NDArray[np.bool_], sigma_px: float) -> Map:
    """Standard deviation of the answers around each pixel, from their mean size, cracks left out of it."""
    few = np.abs(answers[:: DIRECTIONS // 4])
    limit = LOUD * float(np.median(few[:, usable])) if usable.any() else 0.0
    size = np.where(usable, np.minimum(few, limit).mean(axis=0), 0).astype(np.float32)
    mean = _broadly(size, sigma_px) / np.maximum(_broadly(usable.astype(np.float32), sigma_px), 1e-3)
    return np.maximum(MEAN_SIZE * mean, LEAST_NOISE).astype(np.float32)


def _broadly(picture: Map, sigma_px: float) -> Map:
    """A wide Gaussian blur, on a copy small enough for it to be quick."""
    times = max(1, int(sigma_px / 5))
    small = shrunk(picture, (max(1, picture.shape[1] // times), max(1, picture.shape[0] // times)))
    return _resized(blurred(small, sigma_px / times), picture.shape)


def _followed(answers: Stack) -> Map:
    """Mean answer along the best way through each pixel (dynamic programming over place and direction).

    From step to step a way turns by one direction at most.
    """
    gain = np.clip(answers, WEAKEST, STRONGEST)
    ahead = np.concatenate([gain, gain])  # both ways along each direction
    for _ in range(STRIDES - 1):
        moved = np.array([_moved(onward, STRIDE_PX, np.pi * way / DIRECTIONS) for way, onward in enumerate(ahead)])
        for direction in range(2 * DIRECTIONS):
            onward = np.maximum(moved[direction - 1], moved[(direction + 1) % (2 * DIRECTIONS)])
            ahead[direction] = gain[direction % DIRECTIONS] + np.maximum(onward, moved[direction])
    best = (ahead[:DIRECTIONS] + ahead[DIRECTIONS:] - gain).max(axis=0)
    return best / (2 * STRIDES - 1)


def _moved(picture: Map, distance_px: float, angle: float) -> Map:
    """The picture as seen so far on in a direction."""
    step = np.array([[1, 0, -distance_px * np.cos(angle)], [0, 1, -distance_px * np.sin(angle)]])
    size = (picture.shape[1], picture.shape[0])
    moved = cv2.warpAffine(picture, step, size, flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT)
    return np.asarray(moved, dtype=np.float32)


def _spread_from(value: Map, usable: NDArray[np.bool_]) -> Map:
    """In standard deviations of plain ground above its typical value."""
    if not usable.any():
        return np.zeros_like(value)
    low, typical, high = np.percentile(value[usable], (LOW, TYPICAL, HIGH))
    # Joints and holes reach far and raise the upper spread; very quiet parts of a picture widen the lower one.
    spread = np.sqrt((high - typical) * LOPSIDED * (typical - low))
    spread = min(spread, (STRONGEST - typical) / CLEAREST)
    return ((value - typical) / max(spread, 1e-6)).astype(np.float32)


def _halved(allowed: NDArray[np.bool_], times: int) -> NDArray[np.bool_]:
    if times == 0:
        return allowed
    size = (allowed.shape[1] >> times, allowed.shape[0] >> times)
    return shrunk(allowed.astype(np.float32), size) > 0.99


def _resized(picture: Map, shape: tuple[int, ...]) -> Map:
    if picture.shape == shape:
        return picture
    return np.asarray(cv2.resize(picture, (shape[1], shape[0]), interpolation=cv2.INTER_LINEAR), dtype=np.float32)
