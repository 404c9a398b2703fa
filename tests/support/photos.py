"""Photos for tests: drawn specimens, and plain pictures with a line in them."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from digitise.geometry.polyline import left_normals
from digitise.photo import Photo, load_photo
from digitise.settings import PhotoInput
from fixtures.generate.specimen import Specimen
from sealtwin.core.records import Floats

SMALL_FACE = {"face_mm": (70.0, 40.0), "length_mm": 50.0}
"""A recipe's part that draws four times faster than the paper's."""


def photo_of(specimen: Specimen, folder: Path) -> Photo:
    """The specimen's photo, scaled by its markers."""
    specimen.write(folder)
    return load_photo(specimen.photo_input(), folder)


def how_traced(**settings: Any) -> PhotoInput:
    """Settings on how a crack is measured, of a photo whose file and scale are no matter."""
    return PhotoInput(file=Path("photo.png"), data="synthetic", mm_per_px=0.1, **settings)


def write_png(path: Path, brightness: Floats) -> Path:
    """A grey photo from brightness that is linear in light, 0 to 1."""
    cv2.imwrite(str(path), np.rint(255 * np.clip(brightness, 0, 1) ** (1 / 2.2)).astype(np.uint8))
    return path


def mortar(size_px: tuple[int, int] = (500, 300), seed: int = 1) -> Floats:
    """Plain grainy brightness without a crack, (height, width)."""
    grain = np.random.default_rng(seed).standard_normal(size_px[::-1])
    return 0.35 * (1 + 0.3 * cv2.GaussianBlur(grain, (0, 0), 1.5))


def with_crack(brightness: Floats, points_px: Sequence[tuple[float, float]], width_px: int = 14) -> Floats:
    """The same with a dark line drawn into it, soft-edged."""
    cover = np.zeros(brightness.shape, dtype=np.uint8)
    cv2.polylines(cover, [np.array(points_px, dtype=np.int32)], False, 255, width_px, cv2.LINE_AA)
    cover = cv2.GaussianBlur(cover.astype(float) / 255, (0, 0), 1.0)
    return brightness * (1 - 0.93 * cover)


def wandering(points_px: Sequence[tuple[float, float]], aside_px: float = 7.0) -> list[tuple[float, float]]:
    """A polyline that turns every 25 px or so, as cracks do: without ends, a straight line may be a joint."""
    line_px, turned = np.array(points_px, dtype=float), []
    for start, end in pairwise(line_px):
        places = np.linspace(0, 1, max(2, round(float(np.linalg.norm(end - start)) / 25) + 1))
        normal = left_normals(np.array([start, end]))[0]
        side = np.where(np.arange(len(places)) % 2, 1.0, -1.0) * aside_px
        side[[0, -1]] = 0
        turned += (start + places[:, None] * (end - start) + side[:, None] * normal).tolist()
    return [(x, y) for x, y in turned]


def evenly_scaled(path: Path, mm_per_px: float = 0.1) -> Photo:
    return load_photo(PhotoInput(file=path, data="synthetic", mm_per_px=mm_per_px), path.parent)


def photo_of_light(folder: Path, brightness: Floats, mm_per_px: float = 0.1) -> Photo:
    """The photo of a brightness that is linear in light, 0 to 1."""
    return evenly_scaled(write_png(folder / "photo.png", brightness), mm_per_px)


def with_paint(photo: Photo, drawn: NDArray[np.bool_]) -> Photo:
    """The photo with a mask, and a faint crack under its paint: a mask over plain ground is refused."""
    return replace(photo, drawn=drawn, brightness=np.where(drawn, 0.8 * photo.brightness, photo.brightness))


def distance_to(points: Floats, line: Floats) -> Floats:
    """From each point to the nearest place on a polyline, (n,)."""
    start, step = line[:-1], np.diff(line, axis=0)
    # A wall pulled tight round a corner stands still for some stations.
    along = np.sum((points[:, None] - start) * step, axis=2) / np.maximum(np.sum(step**2, axis=1), 1e-12)
    foot = start + np.clip(along, 0, 1)[..., None] * step
    return np.linalg.norm(points[:, None] - foot, axis=2).min(axis=1)


def rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def edge_of_patch() -> Floats:
    """A line along the edge of a lighter patch: not surely a crack."""
    edge = [(30, 160), (130, 176), (240, 154), (350, 172), (470, 158)]
    below = np.zeros((300, 500), dtype=np.uint8)
    cv2.fillPoly(below, [np.array([(0, 162), *edge, (500, 158), (500, 300), (0, 300)], dtype=np.int32)], [1])
    return with_crack(mortar() * np.where(below, 1.9, 1.0), edge)
