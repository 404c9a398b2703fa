"""Kinds of a crack's ends in its mouth."""

import numpy as np
import pytest

from digitise.mesh_import.mouth_ends import end_before
from tests.slots import straight

RING = np.asarray(straight(60.0, 4.0).to_polygons()[0])
PATH = np.column_stack([np.arange(1.0, 50.0, 0.4), np.zeros(123)])


@pytest.mark.parametrize(
    ("path_mm", "face_mm", "kind"),
    [
        (PATH, (0.0, -20.0, 80.0, 20.0), "open"),
        (PATH, (-20.0, -20.0, 80.0, 20.0), "closed"),
        (PATH[30:], (-20.0, -20.0, 80.0, 20.0), "cut"),
    ],
)
def test_an_end_is_what_is_ahead_of_the_path(path_mm, face_mm, kind):
    """Two widths ahead: 8 mm, and the third path begins at 13 mm."""
    assert end_before(RING, path_mm, 4.0, face_mm, whole=False).kind == kind


def test_a_path_into_the_corner_of_a_blunt_end_ends_in_the_middle_of_its_front():
    corner = np.column_stack([np.linspace(0.1, 2.0, 10), np.linspace(1.9, 0.0, 10)])
    end = end_before(RING, np.vstack([corner, PATH[3:]]), 4.0, (-20.0, -20.0, 80.0, 20.0), whole=True)
    # The path's first width decides: in it the corner's bisector has come within 0.4 mm of the middle.
    edge, share = divmod(end.arrives, 1)
    place = RING[int(edge)] + share * (np.roll(RING, -1, axis=0) - RING)[int(edge)]
    assert end.blunt
    assert place == pytest.approx([0.0, 0.0], abs=0.4)
