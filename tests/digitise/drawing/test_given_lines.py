"""Cracks that are given by lines in mm: their lengths, widths and volumes, and refusals."""

import numpy as np
import pytest

from digitise.drawing.given_lines import outline_between, outline_of_line
from digitise.geometry.polyline import extended, left_normals, signed_area
from digitise.settings import CrackShape
from digitise.solid.build_solid import build_solid
from sealtwin.core.errors import InputError

X_MM = np.linspace(0.0, 80.0, 161)
LINE_MM = np.column_stack([X_MM, 20 + 4 * np.sin(X_MM / 12)])
LENGTH_MM = float(np.linalg.norm(np.diff(LINE_MM, axis=0), axis=1).sum())
WIDTH_MM = np.array([[0.0, 3.0]])
UPRIGHT = CrackShape(depth_mm=16.0, tilt="vertical", wall_angle_deg=0.0)


def _walls_mm(beyond_mm: float) -> tuple[np.ndarray, np.ndarray]:
    line_mm = extended(LINE_MM, beyond_mm, beyond_mm, 1.0, 0.5)
    across_mm = 1.5 * left_normals(line_mm)
    return line_mm + across_mm, line_mm - across_mm


@pytest.mark.parametrize(
    ("face_mm", "ends"),
    [(None, ("cut", "cut")), ((0.0, 0.0, 100.0, 40.0), ("open", "cut")), ((-20.0, 0.0, 80.0, 40.0), ("cut", "open"))],
)
def test_a_crack_drawn_as_a_line_has_the_length_and_width_of_the_line(face_mm, ends):
    """An oblique open end loses as much volume on one side as it gains on the other."""
    outline, photo = outline_of_line(LINE_MM, WIDTH_MM, face_mm, "line")
    assert (outline.ends, outline.seen_in, outline.warnings) == (ends, "drawing", ())
    assert outline.length_mm == pytest.approx(LENGTH_MM, abs=0.01)
    assert outline.mean_width_mm == pytest.approx(3.0, rel=1e-3)
    assert build_solid(outline, UPRIGHT).cavity_volume_mm3 == pytest.approx(48 * LENGTH_MM, rel=5e-4)
    assert photo.to_mm(outline.outline_px) == pytest.approx(outline.outline_mm)
    dark_mm2 = float((1 - photo.brightness).sum()) * photo.mm_per_px**2
    assert dark_mm2 == pytest.approx(signed_area(outline.outline_mm), rel=1e-3)


@pytest.mark.parametrize(("face_mm", "turned"), [(None, True), ((0.0, 0.0, 80.0, 40.0), False)])
def test_the_direction_of_the_second_wall_line_does_not_change_the_crack(face_mm, turned):
    # Walls that go on beyond the face end at its edge.
    left_mm, right_mm = _walls_mm(0.0 if face_mm is None else 3.0)
    outline, _ = outline_between(left_mm, right_mm[::-1] if turned else right_mm, face_mm, "walls")
    # Ends that are joined square to the crack lie beyond its walls' middle by up to a tenth of a width.
    assert outline.length_mm == pytest.approx(LENGTH_MM, abs=0.3)
    assert outline.mean_width_mm == pytest.approx(3.0, rel=0.01)
    assert np.linalg.norm(outline.centreline_mm[0] - LINE_MM[0]) < 0.6
    area_mm2 = build_solid(outline, UPRIGHT).cavity_volume_mm3 / 16
    assert area_mm2 == pytest.approx(3 * LENGTH_MM, rel=5e-3)


@pytest.mark.parametrize(
    ("points_mm", "face_mm", "words"),
    [
        ([(0, 0), (5, 0)], None, "5 mm long .* 3 mm wide"),
        ([(0, 0), (40, 0), (40, 1), (0, 1)], None, "within 1 mm of itself, at s = "),
        ([(0, 0), (40, 0)], (0.0, 10.0, 100.0, 40.0), "outside the face of 100 x 30 mm"),
    ],
)
def test_a_line_that_is_short_folded_or_off_the_face_is_refused(points_mm, face_mm, words):
    with pytest.raises(InputError, match=words):
        outline_of_line(np.array(points_mm, dtype=float), WIDTH_MM, face_mm, "line")


def test_exchanged_walls_and_walls_off_the_face_are_refused():
    left_mm, right_mm = _walls_mm(0.0)
    with pytest.raises(InputError, match="walls: the crack has 0 pieces on the face"):
        outline_between(left_mm, right_mm, (0.0, 60.0, 80.0, 90.0), "walls")
    with pytest.raises(InputError, match="Exchange"):
        outline_between(right_mm, left_mm, None, "walls")
