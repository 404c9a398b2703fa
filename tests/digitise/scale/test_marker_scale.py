import io
import json
import re
import tomllib
from pathlib import Path

import numpy as np
import pypdf
import pytest

from digitise.geometry.polyline import coverage, rectangle
from digitise.image.raster import blurred
from digitise.photo import Photo, load_photo, read_pixels
from digitise.scale.marker_scale import (
    BOARD_MM,
    CUT_GREY,
    CUT_MM,
    PRINT,
    board_around,
    board_toml,
    check_level,
    corners_mm,
    find_markers,
    frame_pdf,
)
from digitise.scale.view import View
from digitise.settings import Dictionary, MarkerBoard, PhotoInput
from fixtures.generate.recipe import Recipe
from fixtures.generate.rendering import BOARD, GAP, MORTAR
from fixtures.generate.specimen import Specimen, make_specimen
from sealtwin.core.errors import InputError
from tests.support.marker_boards import face_grid_mm
from tests.support.photos import SMALL_FACE, photo_of, write_png
from tests.support.sheets import Page, read_pdf

BENT = Recipe(**SMALL_FACE, lens_k1=-0.2, camera_mm=262.0, tilt_deg=4.0)
GRID_MM = face_grid_mm() * (70 / 160, 1.0)


@pytest.fixture(scope="module")
def bent() -> Specimen:
    """A wide lens close by: without its radial term, lengths are off by up to 1 %."""
    return make_specimen(1, BENT)


@pytest.fixture(scope="module")
def bent_photo(bent, tmp_path_factory) -> Photo:
    return photo_of(bent, tmp_path_factory.mktemp("bent"))


def errors(photo: Photo, specimen: Specimen) -> tuple[float, float]:
    """Relative errors of lengths between points all over the face: the mean, and the worst of those above 10 mm."""
    seen_mm = photo.to_mm(specimen.to_px(GRID_MM))
    first, second = np.triu_indices(len(GRID_MM), 1)
    true_mm = np.linalg.norm(GRID_MM[first] - GRID_MM[second], axis=1)
    off = np.linalg.norm(seen_mm[first] - seen_mm[second], axis=1) / true_mm - 1
    return abs(float(np.mean(off))), float(np.abs(off[true_mm > 10]).max())


@pytest.fixture
def load(bent, tmp_path):
    """Loads the bent photo with other settings."""

    def load(**changes) -> Photo:
        bent.write(tmp_path)
        return load_photo(bent.photo_input().model_copy(update=changes), tmp_path)

    return load


def test_lens_distortion_does_not_change_measured_lengths(bent, bent_photo, load):
    """The requirement is 0.3 %. The design note reached 0.07 % in the mean and 0.14 % in the worst length."""
    four = tuple(marker for marker in bent.board.markers if marker.id in (0, 2, 5, 7))
    for photo in (bent_photo, load(markers=MarkerBoard(size_mm=bent.board.size_mm, markers=four))):
        mean, worst = errors(photo, bent)
        assert mean < 0.0002
        assert worst < 0.0005
        assert photo.scale_source.endswith(", lens fitted")
        assert photo.scale_residual_mm is not None
        assert photo.scale_residual_mm < 0.01


def test_markers_off_the_face_plane_or_printed_too_small_raise_the_scale_uncertainty(bent, bent_photo, load):
    """Markers 5 mm lower at 262 mm make lengths 1.9 % larger than the edges of the face imply.

    A frame that a printer made smaller has the same effect; the length of its printed ruler corrects the scale.
    """
    grown = 1 + 5 / 262
    board = bent.board.model_dump()
    board["size_mm"] *= grown
    for marker in board["markers"]:
        marker["x_mm"] = 35 + grown * (marker["x_mm"] - 35)
        marker["y_mm"] = 20 + grown * (marker["y_mm"] - 20)
    photo = load(markers=MarkerBoard(**board), camera_distance_mm=262.0)
    assert photo.scale_uncertainty == pytest.approx(grown - 1, rel=0.2)
    assert any("mm below the face, 262 mm from the camera" in warning.text for warning in photo.warnings)
    assert any("2.0%" in warning.text for warning in photo.warnings)
    assert re.search(r" 9[78]\.\d% \(.*photo\.markers\.printed_ruler_mm", photo.warnings[0].text)
    mended = load(markers=MarkerBoard(**board | {"printed_ruler_mm": 100 / grown}), camera_distance_mm=262.0)
    assert mended.mm_per_px == pytest.approx(bent_photo.mm_per_px, rel=1e-4)
    assert mended.warnings == ()
    assert mended.scale_uncertainty == pytest.approx(BOARD_MM * grown / 100, rel=0.2)


def test_an_unchecked_print_of_markers_adds_scale_uncertainty_with_a_warning(bent, load):
    """Without a face or a ruler to compare with, a frame printed at 97 % gives lengths that are 3 % off."""
    by_ruler = MarkerBoard(**bent.board.model_dump() | {"printed_ruler_mm": 100.0})
    for board, least, most in ((bent.board, PRINT, 1.01 * PRINT), (by_ruler, BOARD_MM / 100, 1.5 * BOARD_MM / 100)):
        photo = load(markers=board, face_mm=None)
        assert photo.scale_uncertainty is not None
        assert least <= photo.scale_uncertainty < most
        named = any("photo.markers.printed_ruler_mm" in warning.text for warning in photo.warnings)
        assert named == (board is bent.board)


def test_face_corners_in_the_wrong_order_are_refused_even_with_markers(bent, load):
    turned = tuple((float(x), float(y)) for x, y in bent.to_px(rectangle((0, 0, 70, 40)))[::-1])
    with pytest.raises(InputError, match=r"photo\.jpg: face_corners_px = \(\("):
        load(face_corners_px=turned)


@pytest.fixture(scope="module")
def specimen() -> Specimen:
    """A photo of 1220 x 920 px, so that markers are first searched for on a copy of 1000 px."""
    return make_specimen(1, Recipe(**SMALL_FACE))


@pytest.fixture(scope="module")
def photo(specimen, tmp_path_factory):
    return photo_of(specimen, tmp_path_factory.mktemp("photo"))


FACE_MM = (160.0, 40.0)
PX_PER_MM = 6.0


def frame_of(face_mm=FACE_MM, size_mm=16.0, dictionary: Dictionary = "4x4_50", count=8, paper="a4") -> bytes:
    return frame_pdf(face_mm, board_around(face_mm, size_mm, dictionary, count), paper)


def printed(folder: Path, **changes) -> Page:
    (folder / "frame.pdf").write_bytes(frame_of(**changes))
    return read_pdf(folder / "frame.pdf")


@pytest.fixture(scope="module")
def page(tmp_path_factory) -> Page:
    """The default frame."""
    return printed(tmp_path_factory.mktemp("page"))


def test_a_scan_of_the_printed_marker_frame_has_the_scale_of_the_marker_table(tmp_path):
    """The page is rastered at 6 px/mm. Tolerances: 10 µm for the markers and 0.01 % for the scale."""
    face_mm = (70.0, 40.0)
    page = printed(tmp_path, face_mm=face_mm, size_mm=20.0, dictionary="apriltag_36h11", count=4)
    text = board_toml(face_mm, board_around(face_mm, 20.0, "apriltag_36h11", 4))
    board = MarkerBoard.model_validate_json(json.dumps(tomllib.loads(text)["photo"]["markers"]))
    file = write_png(tmp_path / "scan.png", page.light(PX_PER_MM))
    photo = load_photo(PhotoInput(file=file, data="synthetic", markers=board), tmp_path)
    assert photo.mm_per_px == pytest.approx(1 / PX_PER_MM, rel=1e-4)
    assert (photo.scale_residual_mm or 1.0) < 0.01


def test_the_printed_opening_and_markers_have_the_positions_of_the_marker_table(page, tmp_path):
    """The opening's lower left corner is the table's origin; the cutting line lies inside the opening."""
    board = board_around(FACE_MM, 16.0, "4x4_50", 8)
    ((*cut_mm, _),) = [bar for bar in page.bars if bar[4] == pytest.approx(CUT_GREY / 255, abs=1e-3)]
    low_mm = np.array(cut_mm[:2]) - CUT_MM / 2
    assert np.array(cut_mm[2:]) + CUT_MM == pytest.approx(FACE_MM, abs=5e-3)
    file = write_png(tmp_path / "scan.png", page.light(PX_PER_MM))
    scan = read_pixels(PhotoInput(file=file, data="synthetic", mm_per_px=1), tmp_path)
    corners_px = find_markers(scan, "4x4_50", set(range(8)))
    for marker in board.markers:
        place_mm = (corners_px[marker.id] + 0.5) / PX_PER_MM
        place_mm[:, 1] = page.size_mm[1] - place_mm[:, 1]
        assert place_mm - low_mm == pytest.approx(corners_mm(board, marker), abs=0.01)


def test_the_printed_ruler_is_100_mm_between_its_outer_edges(page):
    (line,) = [bar for bar in page.bars if bar[2] == pytest.approx(100, abs=5e-3) and bar[3] < 1]
    bars = np.array([bar[:4] for bar in page.bars])
    marks = bars[(abs(bars[:, 2] - line[3]) < 5e-3) & (abs(bars[:, 1] - line[1]) < 5e-3)]
    assert len(marks) == 11
    assert (marks[:, 0].min(), (marks[:, 0] + marks[:, 2]).max()) == pytest.approx((line[0], line[0] + 100), abs=5e-3)
    assert np.diff(np.sort(marks[:, 0] + marks[:, 2] / 2)[1:-1]) == pytest.approx(10, abs=5e-3)


def test_the_pdf_of_a_marker_frame_is_unscaled_and_reproducible():
    """The file has no date and no random names, so that a repeated frame is recognised as the existing file."""
    reader = pypdf.PdfReader(io.BytesIO(frame_of()), strict=True)
    assert reader.viewer_preferences is not None
    assert reader.viewer_preferences.print_scaling == "/None"
    assert frame_of() == frame_of()


@pytest.mark.parametrize(
    ("changes", "refused"),
    [
        ({"face_mm": (300.0, 200.0)}, r"368 x 302 mm .* a4 .* 210 x 297 mm, .* --paper"),
        ({"face_mm": (400.0, 300.0), "paper": "a3"}, r"468 x 402 mm .* a3 .* 297 x 420 mm"),
        ({"face_mm": (40.0, 15.0), "size_mm": 20.0}, r"8 markers of 20 mm .* 25\.0 mm .* 27\.5 mm"),
        ({"face_mm": (20.0, 10.0), "size_mm": 20.0}, r"22\.5 mm .* 27\.5 mm"),
    ],
)
def test_the_error_for_a_marker_frame_that_cannot_be_printed_gives_the_sizes(changes, refused):
    with pytest.raises(InputError, match=refused):
        frame_of(**changes)


FILE = Path("photo.jpg")
LEVEL_FACE_MM = (0.0, 0.0, 70.0, 40.0)
DISTANCE_MM = 300.0
PX = np.array([[0.1, 0, -10], [0, -0.1, 50], [0, 0, 1.0]])
"""A tenth of a millimetre per pixel; the face lies 100 px from each border."""
SIZE_PX = (900, 600)


def looked_at_mm(grown: float) -> View:
    """The mapping of markers that lie below the face by ``grown`` of their distance: it looks larger by as much."""
    middle_mm = np.array([35.0, 20.0])
    shift = np.array([[1 + grown, 0, -grown * middle_mm[0]], [0, 1 + grown, -grown * middle_mm[1]], [0, 0, 1]])
    return View(shift @ PX)


def picture(gap_px: float = 0.0, board: float = BOARD) -> np.ndarray:
    corners_px = View(PX).to_px(rectangle(LEVEL_FACE_MM))
    middle_px = corners_px.mean(axis=0)
    outer_px = corners_px + gap_px * np.sign(corners_px - middle_px)
    face, gap = coverage(corners_px, SIZE_PX), coverage(outer_px, SIZE_PX)
    grain = blurred(np.random.default_rng(1).standard_normal(SIZE_PX[::-1], dtype=np.float32), 1.2)
    light = board * (1 - gap) + GAP * (gap - face) + MORTAR * face * (1 + 0.09 * grain / grain.std())
    light[:, 400:440] = np.where(face[:, 400:440] > 0.5, 0.02, light[:, 400:440])
    return blurred(light.astype(np.float32), 0.9)


@pytest.mark.parametrize("gap_px", [0.0, 5.0, 20.0])
def test_markers_level_with_the_face_give_no_warning(gap_px):
    """The sample's edge meets the board, or a dark gap of some width separates them."""
    assert check_level(picture(gap_px), looked_at_mm(0.0), LEVEL_FACE_MM, None, DISTANCE_MM, FILE) == (0, ())


@pytest.mark.parametrize(("below_mm", "side", "gap_px"), [(-5.0, "above", 5.0), (5.0, "below", 20.0)])
def test_markers_off_the_plane_of_the_face_give_a_warning_with_their_offset(below_mm, side, gap_px):
    """5 mm at 300 mm is 1.7 % of every length. Tolerance: half a millimetre of offset, 0.17 %."""
    grown = below_mm / DISTANCE_MM
    excess, warnings = check_level(picture(gap_px), looked_at_mm(grown), LEVEL_FACE_MM, None, DISTANCE_MM, FILE)
    assert excess == pytest.approx(grown, abs=0.0017)
    (warning,) = warnings
    size = f"{70 * (1 + grown):.1f} x {40 * (1 + grown):.1f} mm, but face_mm is 70 x 40"
    assert all(words in warning.text for words in ("1.7%", f"mm {side} the face, 300 mm from the camera", size))


def test_markers_40_mm_below_the_face_are_refused():
    """Markers on the table beside a sample 40 mm high change every length by 13 %."""
    corners_px = View(PX).to_px(rectangle(LEVEL_FACE_MM))
    with pytest.raises(InputError, match=r"79\.3 x 45\.3 mm.* face_mm is 70 x 40.* markers 40\.0 mm below"):
        check_level(picture(), looked_at_mm(40 / DISTANCE_MM), LEVEL_FACE_MM, corners_px, DISTANCE_MM, FILE)


@pytest.mark.parametrize(
    ("light", "face_mm", "distance_mm", "words"),
    [
        (
            picture(board=MORTAR),
            LEVEL_FACE_MM,
            262.0,
            (
                "no edges of the face",
                "At 262 mm from the camera, each mm above or below the face changes every length by 0.38%",
            ),
        ),
        (picture(), None, None, ("face_mm is not given", "changes every length by 0.40%")),
    ],
    ids=["hidden", "unmeasured"],
)
def test_an_unknown_marker_offset_gives_a_warning_with_the_error_per_millimetre(light, face_mm, distance_mm, words):
    excess, (warning,) = check_level(light, looked_at_mm(0.0), face_mm, None, distance_mm, FILE)
    assert excess is None
    assert all(word in warning.text for word in words)
