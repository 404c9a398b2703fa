"""What is open in a mesh: small holes, a missing underside, and sheets that need sides."""

import numpy as np
import pytest

from digitise.geometry.mesh_topology import check_mesh
from digitise.mesh_import.repair import RepairedSurface, close_holes, find_openings, one_surface, with_base
from sealtwin.core.errors import InputError
from tests.meshes import SLOT_MM3, fine, mesh_of, sheet, slotted

VOLUME_MM3 = 100.0 * 40.0 * 20.0 - SLOT_MM3


def less(mesh, gone) -> RepairedSurface:
    return one_surface(mesh[0], mesh[1][~gone])


def closed(surface: RepairedSurface) -> RepairedSurface:
    return close_holes(surface, find_openings(surface))


def test_a_closed_mesh_has_no_openings():
    openings = find_openings(one_surface(*mesh_of(slotted())))
    assert (openings.holes, openings.rim, openings.underside) == ((), None, ())


@pytest.mark.parametrize("mesh", [mesh_of(slotted()), fine(slotted())], ids=["of 28 triangles", "of 9322"])
def test_a_missing_underside_is_closed_flat(mesh):
    """However many of its edges are open: nothing is guessed there."""
    surface = closed(less(mesh, (mesh[0][mesh[1], 2] < -20 + 1e-6).all(axis=1)))
    assert check_mesh(surface.vertices_mm, surface.faces, expected_euler=2) == []
    assert surface.volume_mm3 == pytest.approx(VOLUME_MM3)
    assert [str(repair) for repair in surface.repairs] == ["1 missing underside closed"]


def test_a_few_missing_faces_are_closed_and_told_with_their_volume():
    """In flat places nothing changes; five at most lie on an edge, of triangles of 2 mm."""
    mesh = fine(slotted())
    gone = np.zeros(len(mesh[1]), dtype=bool)
    gone[np.random.default_rng(0).choice(len(gone), 5, replace=False)] = True
    surface = closed(less(mesh, gone))
    assert check_mesh(surface.vertices_mm, surface.faces, expected_euler=2) == []
    assert surface.volume_mm3 == pytest.approx(VOLUME_MM3, rel=1e-4)
    assert str(surface.repairs[-1]).startswith("5 holes closed, of 15 open edges; volume changed by ")


def test_a_hole_whose_ring_has_no_area_is_refused_by_its_place():
    """Two corners of a square hole are exchanged, so that its ring runs like an 8."""
    vertices_mm, faces = sheet(step_mm=1.0, rough_mm=0.0, depth_mm=0.0)
    cell = 41 * 50 + 20
    gone = (faces[:, 0] == cell) & (faces[:, 1:] >= cell).all(axis=1)
    assert gone.sum() == 2
    vertices_mm[[cell + 1, cell + 42]] = vertices_mm[[cell + 42, cell + 1]]
    surface = RepairedSurface(vertices_mm, faces[~gone])
    with pytest.raises(InputError, match=r"hole of 4 edges near \(5\d\.00, 2\d\.00, -?0\.00\) mm"):
        closed(surface)


def test_holes_that_touch_in_a_corner_are_two():
    """Wherever the walk round them begins: at the corner that they share, or at another."""
    mesh = fine(slotted(), edge_mm=4.0)
    for vertex in range(100, 800, 100):
        one, *others = np.flatnonzero((mesh[1] == vertex).any(axis=1))
        opposite = next(other for other in others if len({*mesh[1][one].tolist(), *mesh[1][other].tolist()}) == 5)
        gone = np.isin(np.arange(len(mesh[1])), [one, opposite])
        openings = find_openings(less(mesh, gone))
        assert [len(hole) for hole in openings.holes] == [3, 3]


def test_many_holes_are_a_surface_that_was_not_seen():
    mesh = fine(slotted())
    with pytest.raises(
        InputError, match=r"\d+ of \d+ edges are open, first near .* up to 1% in whole rings are closed"
    ):
        closed(less(mesh, np.arange(len(mesh[1])) % 50 == 0))


@pytest.mark.parametrize("from_mm", [-1.0, 30.0])
def test_a_sheet_stands_on_its_base(from_mm):
    """The rim dips where the crack leaves the sheet; the volume is that of the columns under it."""
    surface = one_surface(*sheet(from_mm=from_mm))
    openings = find_openings(surface)
    assert openings.rim is not None
    assert len(openings.rim) == 2 * (125 + 50)
    solid = with_base(close_holes(surface, openings), openings.rim, 15.0)
    assert check_mesh(solid.vertices_mm, solid.faces, expected_euler=2) == []
    corners = surface.vertices_mm[surface.faces]
    seen_mm2 = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2] / 2
    assert solid.volume_mm3 == pytest.approx(((corners[:, :, 2].mean(axis=1) + 15) * seen_mm2).sum())
    assert str(solid.repairs[-1]) == "1 sheet given sides and an underside 15 mm below the face"


def test_holes_in_a_sheet_are_not_its_rim():
    mesh = sheet()
    surface = one_surface(mesh[0], np.delete(mesh[1], [3025, 6025, 9025], axis=0))
    openings = find_openings(surface)
    assert sorted(map(len, openings.holes)) == [3, 3, 3]
    assert openings.rim is not None


def test_a_sheet_that_looks_down_is_turned_over():
    vertices, faces = sheet()
    surface = one_surface(vertices, faces[:, ::-1])
    assert np.array_equal(np.sort(surface.faces[:, 0]), np.sort(one_surface(vertices, faces).faces[:, 0]))


def test_a_base_above_the_crack_s_floor_is_refused():
    surface = one_surface(*sheet(depth_mm=6.0, rough_mm=0.0))
    rim = find_openings(surface).rim
    assert rim is not None
    with pytest.raises(InputError, match=r"base_mm is 5, but the mesh reaches 6\.00 mm below its face"):
        with_base(surface, rim, 5.0)


def test_a_rim_that_overhangs_itself_is_refused():
    vertices, faces = sheet(rough_mm=0.0)
    folded = vertices.copy()
    # The strip at one side is folded back over the sheet.
    folded[vertices[:, 0] > 99, 0] -= 30.0
    surface = one_surface(folded, faces)
    rim = find_openings(surface).rim
    assert rim is not None
    with pytest.raises(InputError, match="overhangs itself"):
        with_base(surface, rim, 15.0)
