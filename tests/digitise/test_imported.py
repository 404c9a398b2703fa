"""A mesh from others comes in as the crack that it is, whatever its units, axes and damage."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from scipy.spatial import KDTree

from digitise.geometry.mesh_topology import check_mesh
from digitise.geometry.polyline import resampled
from digitise.mesh_import.import_mesh import ImportedSample, import_sample
from digitise.settings import CrackShape, MeshInput
from digitise.solid.build_solid import build_solid
from digitise.solid.footprint import lay_out
from digitise.solid.sections import Slicer
from digitise.solid.wedges import wall_shifts_mm
from sealtwin.core.arc_length import arc_length
from sealtwin.core.errors import InputError
from sealtwin.core.record_files import read_solid, write_solid
from sealtwin.core.records import FaceLabel, Floats, Outline, Solid
from tests.support.meshes import Mesh, block, box, fine, labelled_mm2, mesh_of, sheet, slotted, turned
from tests.support.shapes import OPEN, wandering_crack

MINUS_X = np.array([(0, 0, -1), (0, 1, 0), (1, 0, 0)])
"""From upright to a file whose -x points out of the face."""


def brought(folder: Path, mesh: Mesh, name: str = "scan.stl", **settings: Any) -> ImportedSample:
    trimesh.Trimesh(*mesh, process=False).export(folder / name)
    table = MeshInput.model_validate({"file": Path(name), "data": "synthetic", "units": "mm", **settings})
    return import_sample(table, folder)


def midline(outline: Outline) -> Floats:
    """Between the walls, which the centreline of a made-up crack is not."""
    return (outline.left_wall_mm + outline.right_wall_mm) / 2


def farthest_mm(points_mm: Floats, line_mm: Floats) -> float:
    return float(KDTree(resampled(line_mm, 0.005)).query(points_mm)[0].max())


def ring(points_mm: Floats) -> Floats:
    return np.vstack([points_mm, points_mm[:1]])


@pytest.fixture(scope="module")
def paper() -> tuple[Outline, Solid]:
    """Wandering, leaning, open at both ends: the hardest of our own solids."""
    outline = wandering_crack()
    return outline, build_solid(outline, CrackShape(depth_mm=16.0, tilt="lean"))


@pytest.fixture(scope="module")
def slot(tmp_path_factory) -> ImportedSample:
    """A block with a slot of 60 x 4 x 10 mm."""
    return brought(tmp_path_factory.mktemp("slot"), mesh_of(slotted()))


def test_our_own_solid_comes_back_as_the_same_crack(tmp_path, paper):
    """Walls that lean by 11 degrees have moved by 0.01 mm where the mouth is seen, 0.05 mm under the face."""
    outline, solid = paper
    back = brought(tmp_path, (solid.vertices_mm @ MINUS_X.T / 1000, solid.faces), "a.ply", units="m", up="-x")
    assert back.solid.cavity_volume_mm3 == pytest.approx(solid.cavity_volume_mm3, rel=1e-6)
    assert back.solid.block_mm == pytest.approx(solid.block_mm, abs=1e-4)
    assert back.solid.depth_mm == pytest.approx(16.0, abs=1e-4)
    assert back.outline.ends == OPEN
    assert back.outline.length_mm == pytest.approx(arc_length(midline(outline))[-1], abs=0.3)
    # Beside an oblique end one wall is lost to a photo, and that is told; a mesh knows its walls.
    assert back.outline.warnings == back.solid.figures.warnings == ()
    assert farthest_mm(back.outline.outline_mm, ring(outline.outline_mm)) < 0.03
    assert farthest_mm(ring(outline.outline_mm), ring(back.outline.outline_mm)) < 0.03
    # Where one wall alone is left beside an oblique end, the middle is a matter of taste.
    inside = resampled(midline(back.outline), 0.5)[10:-10]
    assert farthest_mm(inside, midline(outline)) < 0.1
    assert back.outline.mean_width_mm == pytest.approx(outline.mean_width_mm, rel=4e-3)
    for wall in (back.outline.left_wall_mm, back.outline.right_wall_mm):
        # A station between two corners of the ring cuts off as much as the ring bends there.
        assert farthest_mm(wall, ring(back.outline.outline_mm)) < 0.01
    # To 0.2 percent: where a dam's edge would meet what is left of an old dam's, it is 0.02 mm wider.
    for label in FaceLabel:
        assert labelled_mm2(back.solid, label) == pytest.approx(labelled_mm2(solid, label), rel=2e-3), label.name
    assert check_mesh(back.solid.vertices_mm, back.solid.faces, expected_euler=2) == []


def test_sections_hold_below_each_level_what_our_own_solid_holds(tmp_path, paper):
    """To 0.2 % of the cavity, at oblique ends too: layers of 0.3 mm and cells of a twenty-fourth of the width."""
    outline, solid = paper
    shape = CrackShape(depth_mm=16.0, tilt="lean")
    write_solid(tmp_path, solid)
    settings = MeshInput.model_validate({"file": Path("crack.stl"), "data": "synthetic", "units": "mm"})
    sections = import_sample(settings, tmp_path).solid.sections
    slicer = Slicer(lay_out(outline, shape, max(wall_shifts_mm(shape))), shape)
    for level_mm in (-12.0, -8.0, -3.0, -0.02):
        depths_mm = np.linspace(-level_mm, 16.0 - 1e-6, 60)
        expected_mm3 = np.trapezoid([slicer.cavity(depth_mm).area() for depth_mm in depths_mm], depths_mm)
        below_mm2 = sections.below_at_mm2(sections.s_mm, np.full(len(sections.s_mm), level_mm))
        assert np.trapezoid(below_mm2, sections.s_mm) == pytest.approx(
            expected_mm3, abs=2e-3 * solid.cavity_volume_mm3
        ), level_mm


def test_a_solid_without_areas_by_level_is_of_an_earlier_state(tmp_path, slot):
    """Its volumes would take the walls of the mesh as upright."""
    write_solid(tmp_path, slot.solid)
    assert read_solid(tmp_path).sections.below_mm2 == pytest.approx(slot.solid.sections.below_mm2, abs=1e-5)
    write_solid(tmp_path, replace(slot.solid, sections=replace(slot.solid.sections, levels_mm=None, below_mm2=None)))
    with pytest.raises(InputError, match=r"solid\.json: .*sections\.below_mm2 is missing"):
        read_solid(tmp_path)


def test_a_mesh_that_is_inside_out_is_turned_and_told(tmp_path):
    vertices, faces = mesh_of(slotted())
    back = brought(tmp_path, (vertices, faces[:, ::-1]))
    assert back.solid.cavity_volume_mm3 == pytest.approx(2400.0, rel=1e-9)
    assert [warning.key for warning in back.solid.figures.warnings] == ["mesh.inside-out"]


def test_a_mesh_that_crosses_itself_is_refused_by_its_place(tmp_path):
    """One corner of the face is pulled through a wall of the slot."""
    vertices, faces = fine(slotted())
    vertices[np.argmin(np.linalg.norm(vertices - [70.0, 26.0, 0.0], axis=1))] = 70.0, 21.0, -5.0
    with pytest.raises(InputError, match=r"scan\.stl: Mesh crosses itself in \d+ pairs of faces, first near \(\d+"):
        brought(tmp_path, (vertices, faces))


def test_a_given_path_is_the_centreline(tmp_path):
    """In the file's own frame turned upright, whatever is levelled and moved afterwards."""
    mesh = turned(turned(mesh_of(slotted()), 0, 3.0), 2, 14.0)
    line_mm = np.column_stack([np.linspace(75, 15, 100), np.full(100, 20.4), np.zeros(100)])
    file_mm = turned(turned((line_mm, mesh[1]), 0, 3.0), 2, 14.0)[0]
    np.savetxt(tmp_path / "path.csv", file_mm, "%.6f", ",", header="x_mm,y_mm,z_mm", comments="")
    back = brought(tmp_path, mesh, path=Path("path.csv"))
    centre = back.outline.centreline_mm
    assert np.abs(centre[:, 1] - 20.4).max() < 0.02
    assert (back.outline.path_source, back.outline.seen_in) == ("line", "mesh")
    assert centre[0, 0] == pytest.approx(75, abs=0.1)
    # The slot ends at x = 20, and so does its centreline.
    assert centre[-1, 0] == pytest.approx(20, abs=0.3)
    assert back.outline.width_mm[20:-40] == pytest.approx(4.0, abs=0.02)


def test_a_given_path_along_a_part_of_the_crack_is_told(tmp_path):
    """The slot runs from 20 to 80 mm: half of it would get the sealant of all."""
    line_mm = np.linspace((50.0, 20.0), (85.0, 20.0), 50)
    np.savetxt(tmp_path / "path.csv", line_mm, delimiter=",", header="x_mm,y_mm", comments="")
    (warning,) = brought(tmp_path, mesh_of(slotted()), path=Path("path.csv")).outline.warnings
    assert re.search(r"follows 5[01] % of the crack's mouth", warning.text)


def test_a_block_that_stands_on_its_side_is_told(tmp_path):
    """A crack that runs out at a side opens there as well: which of the two is the face, up alone says."""
    across = mesh_of(block() - box((49.0, -1.0, -12.0), (51.0, 30.0, 1.0)))
    assert not any("check mesh.up" in note.text for note in brought(tmp_path, across).notes)
    upended = brought(tmp_path, across, up="-y").notes
    assert any("100 x 40 mm" in note.text and "check mesh.up" in note.text for note in upended)


SLOT = mesh_of(slotted())


@pytest.mark.parametrize(
    ("mesh", "settings", "says"),
    [
        (SLOT, {"units": "m"}, r"box 1e\+05 x 4e\+04 x 2e\+04 mm, with units = m, is implausible .* in mm or cm"),
        (SLOT, {"up": "-z"}, "No crack opens in the face"),
        (SLOT, {"path": Path("none.csv")}, "none.csv: no such file"),
        (sheet(), {}, r"scan\.stl: Mesh is not watertight; open edges: 350, the first near"),
    ],
)
def test_what_cannot_be_a_sample_is_refused_in_a_sentence(tmp_path, mesh, settings, says):
    with pytest.raises(InputError, match=says):
        brought(tmp_path, mesh, **settings)
