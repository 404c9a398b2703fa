"""From closed surfaces to one body: what counts once, what is filled, what is left out."""

import numpy as np
import pytest

from digitise.mesh_import.repair import RepairedSurface, bounded_body, one_surface
from sealtwin.core.errors import InputError
from tests.meshes import SLOT_MM3, Mesh, box, mesh_of, slotted

VOLUME_MM3 = 100.0 * 40.0 * 20.0 - SLOT_MM3


def joined(*meshes: Mesh) -> RepairedSurface:
    """Side by side in one file, as they are."""
    offsets = np.cumsum([0, *(len(mesh[0]) for mesh in meshes)])
    faces = [mesh[1] + at for mesh, at in zip(meshes, offsets[:-1], strict=True)]
    return one_surface(np.concatenate([mesh[0] for mesh in meshes]), np.concatenate(faces))


OTHER = {
    "overlap": box((90.0, 10.0, -15.0), (110.0, 20.0, -10.0)),
    "apart": box((120.0, 0.0, -15.0), (130.0, 10.0, -5.0)),
    "crumb": box((120.0, 0.0, -2.0), (121.0, 1.0, -1.0)),
}


@pytest.mark.parametrize(
    ("meshes", "volume_mm3", "repairs"),
    [
        ([mesh_of(slotted())], VOLUME_MM3, []),
        # A library takes bodies that overlap without a word, and counts 500 mm³ twice.
        (
            [mesh_of(slotted()), mesh_of(OTHER["overlap"])],
            VOLUME_MM3 + 500,
            [("overlapping bodies united", 2, -500 / (VOLUME_MM3 + 1000))],
        ),
        ([mesh_of(slotted()), mesh_of(OTHER["apart"])], VOLUME_MM3 + 1000, []),
        # No sealant gets into a hollow, and a body inside out would turn every later cut around.
        (
            [mesh_of(slotted(box((5.0, 5.0, -15.0), (10.0, 10.0, -12.0))))],
            VOLUME_MM3,
            [("hollows inside the sample filled", 1, 75 / (VOLUME_MM3 - 75))],
        ),
        (
            [mesh_of(slotted()), mesh_of(OTHER["crumb"])],
            VOLUME_MM3,
            [("loose crumbs left out", 1, -1 / (VOLUME_MM3 + 1))],
        ),
    ],
    ids=["one", "overlap", "apart", "hollow", "crumb"],
)
def test_bodies_count_once_hollows_are_filled_and_crumbs_left_out(meshes, volume_mm3, repairs):
    body, made = bounded_body(joined(*meshes))
    assert body.volume() == pytest.approx(volume_mm3)
    assert [(it.what, it.count, pytest.approx(it.volume_change)) for it in made] == repairs


def test_a_surface_that_is_not_closed_bounds_nothing():
    surface = joined(mesh_of(slotted()))
    with pytest.raises(InputError, match="not watertight: 3 open edges"):
        bounded_body(RepairedSurface(surface.vertices_mm, surface.faces[1:]))


def test_a_fold_bounds_nothing():
    corners = np.array([[0.0, 0, 0], [10, 0, 0], [10, 10, 0], [0, 10, 0]])
    with pytest.raises(InputError, match="encloses no volume"):
        bounded_body(RepairedSurface(corners, np.array([[0, 1, 2], [0, 2, 3], [2, 1, 0], [3, 2, 0]])))
