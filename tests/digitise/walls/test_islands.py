import numpy as np
import pytest

from digitise.crack_path.find_path import find_path
from digitise.geometry.polyline import signed_area
from digitise.outline import trace_outline
from fixtures.generate.recipe import Recipe
from fixtures.generate.specimen import make_specimen
from tests.support.photos import SMALL_FACE, distance_to, evenly_scaled, mortar, photo_of, rms, with_crack, write_png


@pytest.fixture(scope="module")
def stony(tmp_path_factory):
    truth = make_specimen(1, Recipe(**SMALL_FACE, stones=3))
    photo = photo_of(truth, tmp_path_factory.mktemp("stones"))
    return truth, trace_outline(photo, find_path(photo, truth.ends_px))


def test_stones_in_the_crack_are_islands(stony):
    """Half a pixel on their rim; walls pass them as on a plain specimen."""
    truth, outline = stony
    assert signed_area(outline.outline_mm) == pytest.approx(signed_area(truth.outline_mm), rel=0.02)
    assert len(outline.islands_mm) == 3
    for ring in outline.islands_mm:
        assert signed_area(ring) < 0
        exact = min(truth.islands_mm, key=lambda stone: np.linalg.norm(stone.mean(axis=0) - ring.mean(axis=0)))
        assert rms(distance_to(ring, np.vstack([exact, exact[:1]]))) < 0.05
    assert any(warning.text.startswith("3 islands are in the crack, 13.") for warning in outline.warnings)


def test_glints_on_the_floor_are_no_stones(tmp_path):
    """0.12 mm² is less than a stone; the walls stay where they are without it, to a fifth of a pixel."""
    plain = with_crack(mortar(), [(-20, 150), (520, 150)], width_px=30)
    spoilt = plain.copy()
    spoilt[144:151, 250:257] = 0.4
    outlines = []
    for name, picture in (("plain.png", plain), ("spoilt.png", spoilt)):
        photo = evenly_scaled(write_png(tmp_path / name, picture), mm_per_px=0.05)
        outlines.append(trace_outline(photo, find_path(photo, ((70.0, 150.0), (430.0, 150.0)))))
    assert [outline.islands_mm for outline in outlines] == [(), ()]
    assert outlines[1].mean_width_mm == pytest.approx(outlines[0].mean_width_mm, abs=0.01)


def test_ground_between_two_strands_is_no_stone(tmp_path):
    """Wider than the crack: one strand is measured, as the path goes."""
    picture = with_crack(mortar(), [(20, 150), (150, 150), (200, 110), (300, 110), (350, 150), (480, 150)])
    picture = with_crack(picture, [(150, 150), (200, 190), (300, 190), (350, 150)])
    photo = evenly_scaled(write_png(tmp_path / "photo.png", picture))
    path = find_path(photo, ((40.0, 150.0), (460.0, 150.0)), via_px=((250.0, 110.0),))
    outline = trace_outline(photo, path)
    assert outline.islands_mm == ()
    assert outline.centreline_px[:, 1].max() < 160
