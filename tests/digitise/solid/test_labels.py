"""Labels by the planes that faces lie in, on a block that is easy to count."""

from collections import Counter

import numpy as np
import pytest

from digitise.settings import CrackShape
from digitise.solid.dams import label_faces
from digitise.solid.float_mesh import tidy
from digitise.solid.footprint import lay_out
from digitise.solid.wedges import carve
from sealtwin.core.records import FaceLabel
from tests.shapes import CLOSED, CUT, straight_slot

VERTICAL = CrackShape(depth_mm=16.0, tilt="vertical")


@pytest.mark.parametrize(("ends", "walls", "across"), [(CLOSED, 4, 0), (CUT, 2, 2)])
def test_a_box_in_a_box(ends, walls, across):
    """Normals and places of all faces, told apart without looking at how they were built."""
    footprint = lay_out(straight_slot(80.0, 3.1, ends), VERTICAL, 0.0)
    vertices, faces = tidy(carve(footprint, VERTICAL, ()))
    label = label_faces(vertices, faces, footprint, 16.0, -20.0)
    corners = vertices[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    for name in (FaceLabel.TOP, FaceLabel.FLOOR):
        assert normal[label == name] == pytest.approx(np.tile([0, 0, 1], (Counter(label)[name], 1)))
    planes = {tuple(row) for row in np.round(normal[label == FaceLabel.WALL], 6) + 0.0}
    assert len(planes) == walls
    planes = {tuple(row) for row in np.round(normal[label == FaceLabel.END], 6) + 0.0}
    assert len(planes) == across
    assert np.allclose(np.abs(corners[label == FaceLabel.END][:, :, 0] - 40.0), 40.0)


def test_the_bottom_is_outside_though_it_looks_like_no_side():
    footprint = lay_out(straight_slot(), VERTICAL, 0.0)
    vertices, faces = tidy(carve(footprint, VERTICAL, ()))
    label = label_faces(vertices, faces, footprint, 16.0, -20.0)
    bottom = (vertices[faces][:, :, 2] == -20.0).all(axis=1)
    assert set(label[bottom]) == {FaceLabel.OUTSIDE}
