from pathlib import Path

import cv2
import numpy as np
import pytest

from digitise.geometry.polyline import rectangle
from digitise.photo import Photo, load_photo
from digitise.settings import PhotoInput
from fixtures.generate.specimen import Recipe, Specimen, make_specimen
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats
from tests.support.photos import SMALL_FACE, mortar, write_png

FACE = rectangle((0, 0, 70, 40))


@pytest.fixture(scope="module")
def specimen() -> Specimen:
    return make_specimen(1, Recipe(**SMALL_FACE, tilt_deg=8))


@pytest.fixture
def photo_with(specimen, tmp_path):
    """Loads the specimen's photo after a change to its settings or its pixels."""

    def load(paint=None, **changes):
        specimen.write(tmp_path)
        file = tmp_path / "photo.jpg"
        if paint is not None:
            image = np.asarray(cv2.imread(str(file)))
            paint(image)
            file = tmp_path / "changed.png"
            cv2.imwrite(str(file), image)
        settings = specimen.photo_input(Path(file.name)).model_dump() | changes
        return load_photo(PhotoInput(**settings), tmp_path)

    return load


def cover(image, _):
    image[: image.shape[0] * 2 // 3] = 200


def paste(image, specimen):
    x, y = np.rint(specimen.to_px(np.array([[-14.0, -14.0]]))[0]).astype(int)
    image[y - 330 : y - 130, x - 100 : x + 100] = image[y - 100 : y + 100, x - 100 : x + 100].copy()


def with_marker_2_moved(specimen: Specimen) -> dict:
    board = specimen.board.model_dump()
    board["markers"] = [it | {"x_mm": it["x_mm"] + 2.0 * (it["id"] == 2)} for it in board["markers"]]
    return {"markers": board}


@pytest.mark.parametrize(
    ("paint", "changes", "says"),
    [
        (cover, lambda _: {}, r"found 3 of 8 .* 4 are needed \(missing: \[3, 4, 5, 6, 7\]\)"),
        (paste, lambda _: {}, "marker 0 is in the photo more than once"),
        (None, with_marker_2_moved, r"photo\.jpg: the markers misfit by 0\.\d+ mm.* marker 2"),
        (None, lambda _: {"face_mm": (900.0, 40.0)}, "face_mm is outside the photo"),
    ],
    ids=["too few", "printed twice", "misplaced", "face outside the photo"],
)
def test_faulty_markers_and_a_face_outside_the_photo_are_refused(specimen, photo_with, paint, changes, says):
    with pytest.raises(InputError, match=says):
        photo_with(paint and (lambda image: paint(image, specimen)), **changes(specimen))


def by_corners(specimen: Specimen, folder: Path, corners_px: Floats) -> Photo:
    specimen.write(folder)
    a, b, c, d = ((float(x), float(y)) for x, y in corners_px)
    settings = PhotoInput(file=Path("photo.jpg"), data="synthetic", face_mm=(70, 40), face_corners_px=(a, b, c, d))
    return load_photo(settings, folder)


def test_clicked_corners_of_the_face_give_the_scale(specimen, tmp_path):
    photo = by_corners(specimen, tmp_path, specimen.to_px(FACE))
    inner = np.array([[20.0, 10], [50, 30]])
    assert photo.to_mm(specimen.to_px(inner)) == pytest.approx(inner, abs=1e-3)


@pytest.mark.parametrize(
    ("corners", "says"),
    [
        # Corners in another order would mirror the crack.
        (lambda corners_px: corners_px[::-1], r"photo\.jpg: face_corners_px = \(\("),
        # Another first corner distorts the crack: lengths would be wrong by a factor of 3 without a warning.
        (lambda corners_px: np.roll(corners_px, 1, axis=0), r"photo\.jpg: face_corners_px = .* 1\.75 times as wide"),
        (lambda corners_px: corners_px + np.array([[0], [9e5], [0], [0]]), r"face_corners_px = .* \d+ x \d+ px"),
        # On four neighbouring pixels.
        (
            lambda _: np.array([[100.0, 102], [103, 102], [103, 100], [100, 100]]),
            r"is \d+ mm wide, but only 0\.001 to 2",
        ),
    ],
    ids=["mirrored", "from another corner", "far off", "centimetres a pixel"],
)
def test_face_corners_in_the_wrong_order_or_of_an_impossible_size_are_refused(specimen, tmp_path, corners, says):
    with pytest.raises(InputError, match=says):
        by_corners(specimen, tmp_path, corners(specimen.to_px(FACE)))


def test_a_face_without_corners_is_no_scale(tmp_path):
    path = write_png(tmp_path / "plain.png", mortar())
    with pytest.raises(InputError, match=r"face_mm gives the scale only together with face_corners_px"):
        load_photo(PhotoInput(file=path, data="synthetic", face_mm=(160, 40)), tmp_path)
