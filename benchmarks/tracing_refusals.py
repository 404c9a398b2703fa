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
from digitise.settings import Marker, PhotoInput
from fixtures.generate.recipe import Recipe
from fixtures.generate.specimen import MARKER_MM, MARKER_OFFSET_MM, Specimen, make_specimen
from sealtwin.core.errors import InputError

Image = NDArray[np.uint8]
SMALL = Recipe(face_mm=(80, 40), length_mm=55)
NO_CRACK = replace(SMALL, width_mm=1e-4, roughness_mm=0.0)
"""A thousandth of a pixel wide, as walls without roughness are: nobody sees it."""


@dataclass
class Shot:
    """A photo to be spoilt, with its hints."""

    truth: Specimen
    settings: PhotoInput
    """With the true ends."""
    image: Image
    """BGR."""

    def hint(self, **changes: object) -> None:
        self.settings = self.settings.model_copy(update=changes)

    def patch(self, marker: Marker) -> Image:
        """Return the part of the photo that shows a marker and some white around it, to be written into."""
        reach_mm = (MARKER_MM / 2 + MARKER_OFFSET_MM - 1) / 2
        x_mm, y_mm = marker.x_mm, marker.y_mm
        corners_mm = [[x_mm - reach_mm, y_mm + reach_mm], [x_mm + reach_mm, y_mm - reach_mm]]
        (left, top), (right, bottom) = np.maximum(np.rint(self.truth.to_px(np.array(corners_mm))).astype(int), 0)
        return self.image[top:bottom, left:right]


@dataclass(frozen=True)
class Refusal:
    """A spoilt photo or hint, and the pattern of what must be said."""

    name: str
    says: str
    spoil: Callable[[Shot], object]
    recipe: Recipe = SMALL


def refused(case: Refusal, seed: int, folder: Path) -> str | None:
    """Return None if the tool refuses in the words wanted, else what it did instead."""
    truth = make_specimen(seed, case.recipe)
    image = np.array(cv2.imdecode(np.frombuffer(truth.jpeg, np.uint8), cv2.IMREAD_COLOR), dtype=np.uint8)
    shot = Shot(truth, truth.photo_input(folder / "spoilt.png"), image)
    case.spoil(shot)
    settings = shot.settings
    cv2.imwrite(str(settings.file), shot.image)
    try:
        photo = load_photo(settings, folder)
        path = find_path(photo, settings.ends_px, settings.via_px, settings.roi_px)
        outline = trace_outline(photo, path)
    except InputError as refusal:
        return None if re.search(case.says, str(refusal)) else f"said otherwise: {refusal}"
    return f"traced a crack {outline.length_mm:.0f} mm long"


def _cover_markers(shot: Shot) -> None:
    for marker in shot.truth.board.markers:
        shot.patch(marker)[:] = 200


def _show_marker_twice(shot: Shot) -> None:
    first, *_, last = shot.truth.board.markers
    covered = shot.patch(last)
    covered[:] = cv2.resize(shot.patch(first), covered.shape[1::-1])


def _misplace_marker(shot: Shot) -> None:
    first, *others = shot.truth.board.markers
    moved = first.model_copy(update={"x_mm": first.x_mm + 3})
    shot.hint(markers=shot.truth.board.model_copy(update={"markers": (moved, *others)}))


def _show_face_only(shot: Shot) -> None:
    _cover_markers(shot)
    shot.hint(markers=None)


def _double(shot: Shot) -> None:
    """Show the photo twice, side by side: neither crack is the main one."""
    shot.image = np.hstack([shot.image, shot.image])
    shot.settings = PhotoInput(file=shot.settings.file, data="synthetic", mm_per_px=shot.truth.recipe.mm_per_px)


def _put_end_beside(shot: Shot) -> None:
    (x, y), other = shot.truth.ends_px
    shot.hint(ends_px=((x + 150, y), other))


def _put_ends_alike(shot: Shot) -> None:
    x, y = shot.truth.ends_px[0]
    shot.hint(ends_px=((x, y), (x + 5, y)))


def _put_via_beside(shot: Shot) -> None:
    x, y = np.mean(shot.truth.ends_px, axis=0).tolist()
    shot.hint(via_px=((x + 150, y),))


def _put_region_beside(shot: Shot) -> None:
    low, high = shot.truth.to_px(np.array([[2.0, 38.0], [12.0, 2.0]])).tolist()
    shot.hint(ends_px=None, roi_px=(tuple(low), tuple(high)))


def _bring_another_mask(shot: Shot) -> None:
    mask = shot.settings.file.with_name("mask.png")
    cv2.imwrite(str(mask), np.zeros_like(shot.image[:, 100:, 0]))
    shot.hint(mask=mask)


REFUSALS = (
    Refusal("no crack, searched for", r"no crack found", lambda shot: shot.hint(ends_px=None), NO_CRACK),
    Refusal("no crack, ends given", r"no crack between the ends|is not on a crack", lambda shot: None, NO_CRACK),
    Refusal("two cracks", r"2 cracks compete|Choose one by its number", _double),
    Refusal("no markers", r"found 0 of 8 markers", _cover_markers),
    Refusal("marker twice", r"marker 0 is in the photo more than once", _show_marker_twice),
    Refusal("marker misplaced", r"markers misfit by", _misplace_marker),
    Refusal(
        "face not there",
        r"no face .* stands out|the detected face is",
        _show_face_only,
        replace(SMALL, board=SMALL.mortar, gap_mm=0),
    ),
    Refusal("black", r"the photo is black", lambda shot: shot.image.fill(0)),
    Refusal("end beside the crack", r"is not on a crack", _put_end_beside),
    Refusal(
        "end outside the photo",
        r"is outside the photo",
        lambda shot: shot.hint(ends_px=(shot.truth.ends_px[0], (shot.image.shape[1] + 40.0, 10.0))),
    ),
    Refusal("via point beside the crack", r"the via point .* (is not on a crack|the path runs back)", _put_via_beside),
    Refusal("region beside the crack", r"no crack found", _put_region_beside),
    Refusal("mask of another photo", r"the mask is \d+ x \d+ px, but the photo", _bring_another_mask),
    Refusal("both ends in one place", r"only 5 px apart", _put_ends_alike),
)
