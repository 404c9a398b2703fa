"""Photos that nobody can measure a crack in, and the words in which the tool must say so."""

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from digitise.crack_path.find_path import find_path
from digitise.outline import trace_outline
from digitise.photo import load_photo
from digitise.settings import PhotoInput
from fixtures.generate.recipe import Recipe
from fixtures.generate.specimen import MARKER_MM, MARKER_OFFSET_MM, Specimen, make_specimen
from sealtwin.core.errors import InputError

Image = NDArray[np.uint8]
SMALL = Recipe(face_mm=(80, 40), length_mm=55)
NO_CRACK = replace(SMALL, width_mm=1e-4, roughness_mm=0.0)
"""A thousandth of a pixel wide, as walls without roughness are: nobody sees it."""


@dataclass(frozen=True)
class Refusal:
    """A spoilt photo or hint, and the pattern of what must be said."""

    name: str
    says: str
    spoilt: Callable[[Specimen, PhotoInput, Image], tuple[PhotoInput, Image]]
    """From a specimen, its settings with true ends and its BGR photo."""
    recipe: Recipe = SMALL


def refused(case: Refusal, seed: int, folder: Path) -> str | None:
    """None where the tool refuses in the words wanted, else what it did instead."""
    truth = make_specimen(seed, case.recipe)
    image = np.asarray(cv2.imdecode(np.frombuffer(truth.jpeg, np.uint8), cv2.IMREAD_COLOR), dtype=np.uint8)
    settings, image = case.spoilt(truth, truth.photo_input(folder / "spoilt.png"), image)
    cv2.imwrite(str(settings.file), image)
    try:
        photo = load_photo(settings, folder)
        path = find_path(photo, settings.ends_px, settings.via_px, settings.roi_px)
        outline = trace_outline(photo, path)
    except InputError as refusal:
        return None if re.search(case.says, str(refusal)) else f"said otherwise: {refusal}"
    return f"traced a crack {outline.length_mm:.0f} mm long"


def _as_it_is(truth: Specimen, settings: PhotoInput, image: Image) -> tuple[PhotoInput, Image]:
    return settings, image


def _without_ends(truth: Specimen, settings: PhotoInput, image: Image) -> tuple[PhotoInput, Image]:
    return settings.model_copy(update={"ends_px": None}), image


def _markers_covered(truth: Specimen, settings: PhotoInput, image: Image) -> tuple[PhotoInput, Image]:
    for marker in truth.board.markers:
        _patch(truth, image, marker.x_mm, marker.y_mm)[:] = 200
    return settings, image


def _marker_twice(truth: Specimen, settings: PhotoInput, image: Image) -> tuple[PhotoInput, Image]:
    first, last = truth.board.markers[0], truth.board.markers[-1]
    copied, covered = (_patch(truth, image, marker.x_mm, marker.y_mm) for marker in (first, last))
    covered[:] = cv2.resize(copied, covered.shape[1::-1])
    return settings, image


def _marker_misplaced(truth: Specimen, settings: PhotoInput, image: Image) -> tuple[PhotoInput, Image]:
    first, *others = truth.board.markers
    moved = first.model_copy(update={"x_mm": first.x_mm + 3})
    return settings.model_copy(update={"markers": truth.board.model_copy(update={"markers": (moved, *others)})}), image


def _face_only(truth: Specimen, settings: PhotoInput, image: Image) -> tuple[PhotoInput, Image]:
    settings, image = _markers_covered(truth, settings, image)
    return settings.model_copy(update={"markers": None}), image


def _black(truth: Specimen, settings: PhotoInput, image: Image) -> tuple[PhotoInput, Image]:
    return settings, np.zeros_like(image)


def _two_cracks(truth: Specimen, settings: PhotoInput, image: Image) -> tuple[PhotoInput, Image]:
    """The photo twice, side by side: neither crack is the main one."""
    twice = np.hstack([image, image])
    flat = PhotoInput(file=settings.file, data="synthetic", mm_per_px=truth.recipe.mm_per_px)
    return flat, twice


def _end_beside(truth: Specimen, settings: PhotoInput, image: Image) -> tuple[PhotoInput, Image]:
    (x, y), other = truth.ends_px
    return settings.model_copy(update={"ends_px": ((x + 150, y), other)}), image


def _end_outside(truth: Specimen, settings: PhotoInput, image: Image) -> tuple[PhotoInput, Image]:
    return settings.model_copy(update={"ends_px": (truth.ends_px[0], (image.shape[1] + 40.0, 10.0))}), image


def _ends_alike(truth: Specimen, settings: PhotoInput, image: Image) -> tuple[PhotoInput, Image]:
    x, y = truth.ends_px[0]
    return settings.model_copy(update={"ends_px": ((x, y), (x + 5, y))}), image


def _via_beside(truth: Specimen, settings: PhotoInput, image: Image) -> tuple[PhotoInput, Image]:
    x, y = np.mean(truth.ends_px, axis=0)
    return settings.model_copy(update={"via_px": ((float(x) + 150, float(y)),)}), image


def _region_beside(truth: Specimen, settings: PhotoInput, image: Image) -> tuple[PhotoInput, Image]:
    (left, top), (right, bottom) = truth.to_px(np.array([[2.0, 38.0], [12.0, 2.0]]))
    corners = ((float(left), float(top)), (float(right), float(bottom)))
    return settings.model_copy(update={"ends_px": None, "roi_px": corners}), image


def _camera_moved(truth: Specimen, settings: PhotoInput, image: Image) -> tuple[PhotoInput, Image]:
    second = settings.file.with_name("second.png")
    cv2.imwrite(str(second), np.roll(image, 40, axis=1))
    return settings.model_copy(update={"second_photo": second}), image


def _mask_of_another_photo(truth: Specimen, settings: PhotoInput, image: Image) -> tuple[PhotoInput, Image]:
    mask = settings.file.with_name("mask.png")
    cv2.imwrite(str(mask), np.zeros((image.shape[0], image.shape[1] - 100), dtype=np.uint8))
    return settings.model_copy(update={"mask": mask}), image


def _patch(truth: Specimen, image: Image, x_mm: float, y_mm: float) -> Image:
    """The part of the photo that shows a marker and some white around it."""
    reach_mm = (MARKER_MM / 2 + MARKER_OFFSET_MM - 1) / 2
    corners_px = truth.to_px(np.array([[x_mm - reach_mm, y_mm + reach_mm], [x_mm + reach_mm, y_mm - reach_mm]]))
    (left, top), (right, bottom) = np.maximum(np.rint(corners_px).astype(int), 0)
    return image[top:bottom, left:right]


REFUSALS = (
    Refusal("no crack, searched for", r"no crack found", _without_ends, NO_CRACK),
    Refusal("no crack, ends given", r"no crack between the ends|is not on a crack", _as_it_is, NO_CRACK),
    Refusal("two cracks", r"2 cracks compete", _two_cracks),
    Refusal("no markers", r"found 0 of 8 markers", _markers_covered),
    Refusal("marker twice", r"marker 0 is in the photo more than once", _marker_twice),
    Refusal("marker misplaced", r"markers misfit by", _marker_misplaced),
    Refusal(
        "face not there",
        r"face does not stand out|the face found is",
        _face_only,
        replace(SMALL, board=SMALL.mortar, gap_mm=0),
    ),
    Refusal("black", r"the photo is black", _black),
    Refusal("end beside the crack", r"is not on a crack", _end_beside),
    Refusal("end outside the photo", r"lies outside the photo", _end_outside),
    Refusal("via point beside the crack", r"via point .* is not on a crack", _via_beside),
    Refusal("region beside the crack", r"no crack found", _region_beside),
    Refusal("camera moved between two photos", r"the camera has moved|does not show the scene", _camera_moved),
    Refusal("mask of another photo", r"the mask is \d+ x \d+ px, the photo", _mask_of_another_photo),
    Refusal("both ends in one place", r"only 5 px apart", _ends_alike),
)
