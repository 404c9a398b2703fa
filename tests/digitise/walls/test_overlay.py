from dataclasses import replace

import numpy as np
import pytest

from digitise.crack_path.candidates import FoundCrack
from digitise.crack_path.find_path import find_path
from digitise.drawing.given_lines import outline_of_line
from digitise.geometry.polyline import resampled
from digitise.outline import trace_outline
from digitise.settings import NozzlePath
from digitise.trajectory import plan_trajectory
from digitise.walls.overlay import CENTRE, ENDS, LEFT, NOZZLE, RIGHT, draw_cracks, draw_overlay, straight_view
from fixtures.generate.specimen import Recipe, make_specimen
from tests.support.photos import SMALL_FACE, photo_of


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    specimen = make_specimen(1, Recipe(**SMALL_FACE))
    photo = photo_of(specimen, tmp_path_factory.mktemp("overlay"))
    outline = trace_outline(photo, find_path(photo, specimen.ends_px))
    return photo, outline, draw_overlay(photo, outline)


def pixels(picture, shown_px, points_px) -> np.ndarray:
    """The picture's colours, (n, 3), where it shows points of the photo. It shows the box ``shown_px`` of the photo."""
    low_px, high_px = np.rint(shown_px)
    scale = picture.shape[1] / (high_px - low_px)[0]
    x, y = np.rint((points_px - low_px + 0.5) * scale - 0.5).astype(int).T
    return picture[y, x]


def share_of_colour(picture, shown_px, points_px, colour) -> float:
    """Fraction of the points that have about that colour."""
    return float(np.mean(np.abs(pixels(picture, shown_px, points_px).astype(float) - colour).max(axis=1) < 90))


def test_walls_centreline_and_ends_are_drawn_at_their_positions(scene):
    """Broken on purpose, with lines one photo pixel aside, this fails."""
    _, outline, picture = scene
    inner = slice(40, -40)  # clear of labels and of what lies outside the face
    lines = ((outline.left_wall_px, LEFT), (outline.right_wall_px, RIGHT), (outline.centreline_px, CENTRE))
    for points_px, colour in lines:
        assert share_of_colour(picture, outline.shown_px, points_px[inner], colour) > 0.9
    assert share_of_colour(picture, outline.shown_px, outline.centreline_px[[0, -1]], ENDS) == 1


def test_each_crack_is_numbered_in_the_picture_of_possible_cracks(scene):
    photo, outline, _ = scene
    crack = FoundCrack(outline.centreline_px, 31.0, 1.0, unlike=0.0)
    picture = draw_cracks(photo, (crack,))
    scale = picture.shape[1] / photo.size_px[0]
    clear = np.linalg.norm(crack.outline_px - crack.middle_px, axis=1) > 60 / scale
    assert share_of_colour(picture, [(0, 0), photo.size_px], crack.outline_px[clear], ENDS) > 0.9
    x, y = np.rint((crack.middle_px + 0.5) * scale - 0.5).astype(int)
    disc = picture[y - 12 : y + 12, x - 12 : x + 12].reshape(-1, 3)
    assert np.mean(disc.max(axis=1) < 60) > 0.3
    assert np.mean(disc.min(axis=1) > 200) > 0.05


def test_the_nozzle_path_is_drawn_along_the_dispensing_stretch_only(scene):
    """The path is drawn as dots, so that the centreline is visible between them."""
    photo, outline, bare = scene
    trajectory = plan_trajectory(outline, NozzlePath(volume_ml=1.0, trim_mm=15.0), cavity_volume_mm3=1e3)
    picture = draw_overlay(photo, outline, trajectory)
    nozzle_px = photo.to_px(trajectory.position_mm[trajectory.giving, :2])
    assert share_of_colour(picture, outline.shown_px, nozzle_px[[0, -1]], NOZZLE) == 1
    assert 0.2 < share_of_colour(picture, outline.shown_px, resampled(nozzle_px, 1.0), NOZZLE) < 0.6
    off_mm = np.linalg.norm(outline.centreline_mm - outline.centreline_mm[0], axis=1)
    trimmed_px = outline.centreline_px[(off_mm > 6) & (off_mm < 13)]
    assert np.array_equal(*(pixels(drawn, outline.shown_px, trimmed_px) for drawn in (picture, bare)))


@pytest.mark.parametrize("angle_deg", [0.0, 35.0, 90.0])
def test_no_text_is_drawn_over_the_crack(angle_deg):
    """The photo ends 15 mm beside the crack, where a name of an end has too little room."""
    angle = np.radians(angle_deg)
    line_mm = np.linspace(0.0, 60.0, 121)[:, None] * (np.cos(angle), np.sin(angle))
    outline, photo = outline_of_line(line_mm, np.array([[0.0, 3.0]]), None, "line")
    picture = draw_overlay(photo, outline)
    beyond_the_dots = slice(4, -4)
    lines = ((outline.centreline_px[beyond_the_dots], CENTRE), (outline.left_wall_px, LEFT))
    for points_px, colour in (*lines, (outline.right_wall_px, RIGHT), (outline.centreline_px[[0, -1]], ENDS)):
        assert share_of_colour(picture, outline.shown_px, points_px, colour) > 0.95


X_MM = np.linspace(0.0, 60.0, 121)
LINE_MM = np.column_stack([X_MM, 8 * np.sin(X_MM / 15)])


def test_a_bent_crack_is_drawn_straight_with_its_left_side_up():
    outline, photo = outline_of_line(LINE_MM, np.array([[0.0, 3.0]]), None, "line")
    # A white spot 3 mm to the left of the crack's middle at s = 20 mm.
    station = int(np.argmin(np.abs(outline.s_mm - 20.0)))
    ahead = outline.centreline_mm[station + 1] - outline.centreline_mm[station]
    left = np.array([-ahead[1], ahead[0]]) / np.linalg.norm(ahead)
    column, row = photo.to_px((outline.centreline_mm[station] + 3.0 * left)[None])[0].round().astype(int)
    image = photo.image.copy()
    image[row - 2 : row + 3, column - 2 : column + 3] = 255
    straight = straight_view(replace(photo, image=image), outline)
    height, width, _ = straight.shape
    mm_per_px = outline.length_mm / (width - 1)
    dark = straight[:, :, 0] < 120
    inside = slice(width // 20, -width // 20)
    assert dark[:, inside].sum(axis=0) * mm_per_px == pytest.approx(3.0, abs=0.25)
    middle = np.array([np.flatnonzero(each).mean() for each in dark[:, inside].T])
    assert (middle - (height - 1) / 2) * mm_per_px == pytest.approx(0.0, abs=0.15)
    rows, columns = np.nonzero(straight[:, :, 0] > 240)
    assert columns.mean() * mm_per_px == pytest.approx(20.0, abs=0.3)
    assert ((height - 1) / 2 - rows.mean()) * mm_per_px == pytest.approx(3.0, abs=0.3)
