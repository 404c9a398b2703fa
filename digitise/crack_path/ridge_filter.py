"""Likeness of a picture to a dark line, in its pixels, also along a bending path; angles count from x to y."""

from collections.abc import Iterator

import cv2
import numpy as np
from numpy.typing import NDArray

from digitise.image.raster import Map, blurred, moved, resized, shrunk

Stack = NDArray[np.float32]  # One map per direction, (directions, height, width)

DIRECTIONS = 8  # Filter directions over half a turn; sixteen found no more on 45 drawn photos, in twice the time
SIGMAS_PX = ((0.7,), (0.7, 1.4), (1.4,), (1.4,))  # Of the dark middle, by halvings of the picture
LEAST_SIDE_PX = 60  # Least side of a halved copy; a line as long as a few widths does not fit on a smaller one
ELONGATION = 2.5  # Length of the filter over its width: longer ones lose a crack that wanders, shorter ones find grains
MIDDLE, SIDE = 0.7, 2.2  # Width of the middle, and distance of the sides from it, in sigmas
ONE_SIDED = 0.5  # Share of the difference between both sides that is subtracted: an edge is dark against one side only
NOISE_PX = 40.0  # Gaussian sigma over which noise is averaged: a shadow or a patch has its own
LOUD = 4.0  # Most typical answers that one answer adds to the noise, so that a crack is no noise
MEAN_SIZE = 1.25  # Standard deviation of a normal distribution over its mean size
LEAST_NOISE = 2e-3  # Least noise of brightness: the rounding of 8 bits
STRIDE_PX, STRIDES = 4.0, 6  # Steps over which a line is followed to both sides: 24 px, many grains and one gap
STRONGEST, WEAKEST = 6.0, -1.0  # Bounds on one step's noise units, lest a pore or gap decide over the whole path
CLEAREST = 6.0  # Least standard deviations of a line of full strength, on ground however patterned
LOW, TYPICAL, HIGH = 16, 50, 84  # Percentiles of the support on plain ground, a standard deviation apart
LOPSIDED = 1.4  # Upper spread over lower one on plain grain: 1.2 to 1.3 in drawn noise, 1.4 to 1.6 in asphalt


def strength(even: Map, allowed: NDArray[np.bool_]) -> Map:
    """Answer of the best line through each pixel, in units of the noise; ``even`` is light over its local mean."""
    best = np.zeros_like(even)
    for answers in _octaves(even, allowed):
        np.maximum(best, resized(answers.max(axis=0), even.shape), out=best)
    return best


def support(even: Map, allowed: NDArray[np.bool_]) -> Map:
    """Likeness to a line of the best path through each pixel, in standard deviations above plain ground's usual one."""
    octaves = [
        resized(_spread_from(_followed(answers), _halved(allowed, octave)), even.shape)
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
    """Brightness of both sides over the middle, less half of their difference."""
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
    return resized(blurred(small, sigma_px / times), picture.shape)


def _followed(answers: Stack) -> Map:
    """Mean answer along the best path through each pixel that turns by at most one direction a step."""
    gain = np.clip(answers, WEAKEST, STRONGEST)
    ahead = np.concatenate([gain, gain])  # both ways along each direction
    for _ in range(STRIDES - 1):
        came = np.array([_moved(onward, STRIDE_PX, np.pi * way / DIRECTIONS) for way, onward in enumerate(ahead)])
        for direction in range(2 * DIRECTIONS):
            onward = np.maximum(came[direction - 1], came[(direction + 1) % (2 * DIRECTIONS)])
            ahead[direction] = gain[direction % DIRECTIONS] + np.maximum(onward, came[direction])
    best = (ahead[:DIRECTIONS] + ahead[DIRECTIONS:] - gain).max(axis=0)
    return best / (2 * STRIDES - 1)


def _moved(picture: Map, distance_px: float, angle: float) -> Map:
    """The picture shifted by a distance against a direction."""
    x_px, y_px = -distance_px * np.cos(angle), -distance_px * np.sin(angle)
    return moved(picture, x_px, y_px, cv2.INTER_LINEAR, cv2.BORDER_REFLECT)


def _spread_from(value: Map, usable: NDArray[np.bool_]) -> Map:
    """Values in standard deviations of plain ground above its typical value."""
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
