import numpy as np
import pytest

from benchmarks.tracing_cases import clean_case
from digitise.crack_path.find_path import find_path
from digitise.crack_path.hints import CrackPath
from digitise.outline import trace_outline
from digitise.photo import Photo, load_photo
from fixtures.generate.lighting import Look
from fixtures.generate.specimen import Recipe, Specimen, make_specimen, mean_width_mm
from sealtwin.core.errors import InputError
from sealtwin.core.record_files import read_outline, write_outline
from sealtwin.core.records import Outline
from tests.support.paths import FIXTURE
from tests.support.photos import (
    SMALL_FACE,
    distance_to,
    evenly_scaled,
    how_traced,
    mortar,
    photo_of,
    photo_of_light,
    rms,
    with_crack,
    write_png,
)


@pytest.fixture(scope="module")
def paper() -> Specimen:
    return make_specimen(1)


@pytest.fixture(scope="module")
def paper_photo(paper) -> Photo:
    return load_photo(paper.photo_input(), FIXTURE)


@pytest.fixture(scope="module")
def paper_outline(paper, paper_photo) -> Outline:
    return trace_outline(paper_photo, find_path(paper_photo, paper.ends_px))


@pytest.fixture(scope="module")
def bent_photo(tmp_path_factory) -> Photo:
    """A crack with two bends that runs past both of ``BENT_ENDS``."""
    picture = with_crack(mortar(), [(10, 80), (170, 180), (300, 120), (490, 230)])
    return evenly_scaled(write_png(tmp_path_factory.mktemp("bent") / "photo.png", picture))


BENT_ENDS = ((60.0, 111.0), (440.0, 201.0))
POOR = Look(light=0.5, grain=0.15, blur_px=2.0, noise=0.04, jpeg_quality=50)


@pytest.fixture(scope="module")
def bent_outline(bent_photo) -> Outline:
    return trace_outline(bent_photo, find_path(bent_photo, BENT_ENDS))


def check(outline: Outline, truth: Specimen, width_error: float, length_error_mm: float) -> None:
    """Centreline within 0.1 mm and walls within 0.15 mm of the truth, RMS."""
    assert rms(distance_to(outline.centreline_mm, truth.centreline_mm)) <= 0.10
    for wall_mm, exact_mm in ((outline.left_wall_mm, truth.left_wall_mm), (outline.right_wall_mm, truth.right_wall_mm)):
        on_face = np.all((wall_mm >= 0) & (wall_mm <= truth.recipe.face_mm), axis=1)
        assert rms(distance_to(wall_mm[on_face], exact_mm)) <= 0.15
    assert outline.mean_width_mm == pytest.approx(mean_width_mm(truth.centreline_mm, truth.width_mm), rel=width_error)
    assert outline.length_mm == pytest.approx(truth.recipe.length_mm, abs=length_error_mm)
    assert outline.ends == (truth.recipe.ends, truth.recipe.ends)


def test_the_fixture_photo_is_traced_within_the_required_limits(paper, paper_outline):
    """The limits are those of issue 2. Measured: centreline 0.04, walls 0.03 mm, width 0.8 %, length 0.5 mm."""
    check(paper_outline, paper, width_error=0.02, length_error_mm=2)
    assert paper_outline.path_source == "ends"


@pytest.mark.parametrize(
    ("seed", "recipe"),
    [
        (4, Recipe(**SMALL_FACE, mm_per_px=0.15, look=POOR, wall_pores=20)),
        (6, Recipe(face_mm=(50, 30), length_mm=30, ends="closed", width_mm=1.2)),
    ],
    ids=["coarse, blur, noise, pores, JPEG 50", "closed, 12 px"],
)
def test_a_poor_photo_and_a_narrow_closed_crack_are_traced_within_the_limits(tmp_path, seed, recipe):
    """An open end hides a part of a wall, so that the width's tolerance is 3 % there and 2 % otherwise."""
    truth = make_specimen(seed, recipe)
    photo = photo_of(truth, tmp_path)
    outline = trace_outline(photo, find_path(photo, truth.ends_px))
    check(outline, truth, *((0.03, 2) if recipe.ends == "open" else (0.02, 0.5)))
    assert (outline.islands_mm, outline.branches_mm) == ((), ())


def test_clicked_ends_inside_a_longer_crack_cut_the_outline_at_right_angles(bent_photo, bent_outline):
    outline = bent_outline
    assert outline.ends == ("cut", "cut")
    for station, inner in ((0, 3), (-1, -4)):
        along = outline.centreline_mm[inner] - outline.centreline_mm[station]
        across = outline.left_wall_mm[station] - outline.right_wall_mm[station]
        assert abs(along @ across) < 0.1 * np.linalg.norm(along) * np.linalg.norm(across)
    off_mm = outline.centreline_mm[[0, -1]] - bent_photo.to_mm(np.array(BENT_ENDS))
    assert np.linalg.norm(off_mm, axis=1).max() < 0.4
    assert outline.width_mm == pytest.approx(1.4, abs=0.25)
    assert outline.warnings == ()


def test_a_stretch_of_crack_shorter_than_three_widths_is_refused(tmp_path):
    picture = with_crack(mortar(), [(20, 150), (480, 140)], width_px=30)
    photo = photo_of_light(tmp_path, picture)
    path = find_path(photo, ((230.0, 145.0), (290.0, 144.0)))
    with pytest.raises(InputError, match="at least 3 times as long as wide"):
        trace_outline(photo, path)


def test_walls_are_complete_up_to_the_oblique_ends_of_a_crack(tmp_path):
    """Tolerance: 0.15 mm. Measured: 0.02 to 0.06; with rays square to the centreline alone 0.12 to 0.19.

    The opening of an oblique end is twice as wide as the crack; it is no width, also not after reading a file.
    """
    truth = make_specimen(2, Recipe(**SMALL_FACE, mirrored=True))
    photo = photo_of(truth, tmp_path)
    outline = trace_outline(photo, find_path(photo, truth.ends_px))
    for wall, exact in ((outline.left_wall_mm, truth.left_wall_mm), (outline.right_wall_mm, truth.right_wall_mm)):
        assert rms(distance_to(wall, exact)) <= 0.15
        # The traced walls cover all of the true walls and do not end inside the face.
        assert rms(distance_to(exact, wall)) <= 0.15
        assert wall.min() >= 0
        assert np.all(wall <= truth.recipe.face_mm)
        assert wall[[0, -1], 1] == pytest.approx(sorted([0, 40], reverse=bool(wall[0, 1] > 20)), abs=1e-6)
    assert np.linalg.norm(outline.left_wall_mm[0] - outline.right_wall_mm[0]) > 1.1 * outline.width_mm[0]
    assert truth.width_mm.min() - 0.2 < outline.width_mm.min()
    assert outline.width_mm.max() < truth.width_mm.max() + 0.2
    assert outline.mean_width_mm == pytest.approx(mean_width_mm(truth.centreline_mm, truth.width_mm), rel=0.02)
    write_outline(tmp_path, outline)
    assert read_outline(tmp_path).mean_width_mm == pytest.approx(outline.mean_width_mm, abs=1e-4)


def test_the_centreline_is_accurate_up_to_an_oblique_edge_of_the_face(tmp_path):
    """A crack 5.6 mm wide, at 40 degrees to the edge, has only one wall along its last 8 mm.

    At half the expected width from that wall, the line is off by 0.04 mm; in the opening's middle by 0.23 mm.
    """
    case = clean_case(5)
    truth = make_specimen(case.seed, case.recipe)
    photo = photo_of(truth, tmp_path)
    outline = trace_outline(photo, find_path(photo, case.ends_px(truth)))
    assert rms(distance_to(outline.centreline_mm, truth.centreline_mm)) <= 0.08
    check(outline, truth, width_error=0.02, length_error_mm=2)


def test_no_wall_is_drawn_outside_the_photo(tmp_path):
    """A crack turns up along the right border, which cuts off its right wall; the part before the turn is complete."""
    picture = with_crack(mortar(), [(20, 150), (494, 160), (494, 10)])
    photo = photo_of_light(tmp_path, picture)
    via_px = ((250.0, 155.0),)
    outline = trace_outline(photo, find_path(photo, ((30.0, 150.0), (494.0, 100.0)), via_px))
    assert outline.outline_px.min() >= 0
    assert np.all(outline.outline_px <= (499, 299))
    assert outline.ends[1] == "cut"
    assert any("left out at the edge of the photo" in warning.text for warning in outline.warnings)
    assert outline.outline_px[:, 0].max() > 480
    with pytest.raises(InputError, match=r"outside the photo on \d\d% of the path \(at most 20% is allowed\)"):
        trace_outline(photo, find_path(photo, ((30.0, 150.0), (494.0, 20.0)), via_px))


def test_walls_that_cross_are_refused_with_the_place(tmp_path):
    """The legs of a hairpin are 5 mm apart, and the given width is 8 mm."""
    legs = [(60, 100), (400, 100), (400, 150), (60, 150)]
    photo = photo_of_light(tmp_path, with_crack(mortar(), legs, 8))
    path = CrackPath(np.array(legs, float), 8.0, "via")
    assert trace_outline(photo, path, how_traced(width_mm=3.0)).mean_width_mm == pytest.approx(3, abs=0.01)
    with pytest.raises(InputError, match=r"cross each other, first at \(5\d, 100\) px"):
        trace_outline(photo, path, how_traced(width_mm=8.0))
