"""An imported mesh gives its crack in any unit and with any axis up; damage is mended or refused."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from scipy.spatial import KDTree

from digitise.geometry.mesh_topology import examine_mesh
from digitise.geometry.polyline import resampled
from digitise.mesh_import.import_mesh import UPRIGHT_DEG, import_sample, upright, upright_mm
from digitise.settings import CrackShape, MeshInput
from digitise.solid.build_solid import build_solid
from digitise.solid.footprint import lay_out
from digitise.solid.sections import Slicer
from digitise.solid.wedges import wall_shifts_mm
from sealtwin.core.arc_length import arc_length
from sealtwin.core.errors import InputError, present
from sealtwin.core.mesh_file import Triangles
from sealtwin.core.record_files import read_solid, write_solid
from sealtwin.core.records import FaceLabel, Floats, Outline, Solid
from tests.support.meshes import Mesh, block, box, fine, labelled_mm2, mesh_of, slotted
from tests.support.shapes import OPEN, wandering_crack


def settings(units: str = "mm", up: str = "z") -> MeshInput:
    return MeshInput.model_validate({"file": Path("scan.stl"), "data": "synthetic", "units": units, "up": up})


@pytest.mark.parametrize("up", UPRIGHT_DEG)
def test_the_axis_that_is_set_as_up_is_rotated_to_z(up):
    """A mirror would exchange the crack's left and right walls."""
    axis = np.eye(3)["xyz".index(up[-1])] * (-1.0 if up.startswith("-") else 1.0)
    assert trimesh.transform_points(axis[None], upright(settings(up=up)))[0] == pytest.approx([0, 0, 1])
    assert np.linalg.det(upright(settings(up=up))[:3, :3]) == pytest.approx(1.0)


def corners_of(size: tuple[float, float, float]) -> Triangles:
    return Triangles(np.array([(0.0, 0.0, 0.0), size]), np.empty((0, 3), dtype=np.int64))


@pytest.mark.parametrize(("units", "mm"), [("mm", 1.0), ("cm", 10.0), ("m", 1000.0), ("inch", 25.4)])
def test_coordinates_in_any_unit_are_converted_to_millimetres(units, mm):
    size_mm = upright_mm(corners_of((100 / mm, 40 / mm, 20 / mm)), settings(units))
    assert np.ptp(size_mm, axis=0) == pytest.approx([100.0, 40.0, 20.0])


@pytest.mark.parametrize(
    ("longest", "units", "says"),
    [
        (80.0, "m", "probably mm or cm: set units"),
        (6.3, "mm", "probably cm or inch: set units"),
        (9000.0, "cm", "Crop the mesh to the sample"),
    ],
)
def test_the_error_for_a_mesh_of_implausible_size_suggests_a_remedy(longest, units, says):
    with pytest.raises(InputError, match=says):
        upright_mm(corners_of((longest, longest / 4, longest / 8)), settings(units))


SLOT = mesh_of(slotted())
"""A block with a slot of 60 x 4 x 10 mm."""
MINUS_X = np.array([(0, 0, -1), (0, 1, 0), (1, 0, 0)])
"""From upright to a file whose -x points out of the face."""


def brought(folder: Path, mesh: Mesh, name: str = "scan.stl", **settings: Any):
    trimesh.Trimesh(*mesh, process=False).export(folder / name)
    table = MeshInput.model_validate({"file": Path(name), "data": "synthetic", "units": "mm", **settings})
    return import_sample(table, folder)


def farthest_mm(points_mm: Floats, line_mm: Floats) -> float:
    return float(KDTree(resampled(line_mm, 0.005)).query(points_mm)[0].max())


@pytest.fixture(scope="module")
def paper() -> tuple[Outline, Solid]:
    """A wandering, leaning crack that is open at both ends: the hardest of our own solids."""
    outline = wandering_crack()
    return outline, build_solid(outline, CrackShape(depth_mm=16.0, tilt="lean"))


def test_a_written_solid_is_imported_as_the_same_crack(tmp_path, paper):
    """The mouth is measured 0.05 mm under the face, where walls that lean by 11 degrees have moved by 0.01 mm."""
    outline, solid = paper
    back = brought(tmp_path, (solid.vertices_mm @ MINUS_X.T / 1000, solid.faces), "a.ply", units="m", up="-x")
    assert back.solid.cavity_volume_mm3 == pytest.approx(solid.cavity_volume_mm3, rel=1e-6)
    assert back.solid.block_mm == pytest.approx(solid.block_mm, abs=1e-4)
    assert back.solid.depth_mm == pytest.approx(16.0, abs=1e-4)
    # A photo lacks one wall beside an oblique end and gives a warning; a mesh has both walls.
    assert back.outline.warnings == back.solid.figures.warnings == ()
    assert (back.outline.ends, back.outline.mean_width_mm) == (OPEN, pytest.approx(outline.mean_width_mm, rel=4e-3))
    ring_mm, back_ring_mm = (np.vstack([ring, ring[:1]]) for ring in (outline.outline_mm, back.outline.outline_mm))
    assert max(farthest_mm(back_ring_mm, ring_mm), farthest_mm(ring_mm, back_ring_mm)) < 0.03
    # Beside an oblique end only one wall is left, so that the midline is not defined.
    midline_mm, back_midline_mm = ((each.left_wall_mm + each.right_wall_mm) / 2 for each in (outline, back.outline))
    assert back.outline.length_mm == pytest.approx(arc_length(midline_mm)[-1], abs=0.3)
    assert farthest_mm(resampled(back_midline_mm, 0.5)[10:-10], midline_mm) < 0.1
    # A station between two corners of the ring cuts off as much as the ring bends there.
    assert farthest_mm(np.vstack([back.outline.left_wall_mm, back.outline.right_wall_mm]), back_ring_mm) < 0.01
    # Tolerance 0.2 %: a dam is 0.02 mm wider if its edge would meet the rest of an old dam.
    for label in FaceLabel:
        assert labelled_mm2(back.solid, label) == pytest.approx(labelled_mm2(solid, label), rel=2e-3), label.name
    assert examine_mesh(back.solid.vertices_mm, back.solid.faces, expected_euler=2)[0] == []


def test_the_sections_of_an_imported_solid_give_its_volume_below_each_level(tmp_path, paper):
    """Tolerance: 0.2 % of the cavity, from layers of 0.3 mm and cells of a twenty-fourth of the width."""
    outline, solid = paper
    shape = CrackShape(depth_mm=16.0, tilt="lean")
    write_solid(tmp_path, solid)
    settings = MeshInput.model_validate({"file": Path("crack.stl"), "data": "synthetic", "units": "mm"})
    sections = import_sample(settings, tmp_path).solid.sections
    levels_mm, areas_mm2 = present(sections.levels_mm, "levels"), present(sections.below_mm2, "areas")
    slicer = Slicer(lay_out(outline, shape, max(wall_shifts_mm(shape))), shape)
    for level_mm in (-12.0, -8.0, -3.0, -0.02):
        depths_mm = np.linspace(-level_mm, 16.0 - 1e-6, 60)
        expected_mm3 = np.trapezoid([slicer.cavity(depth_mm).area() for depth_mm in depths_mm], depths_mm)
        below_mm2 = [np.interp(level_mm, levels_mm, area_mm2) for area_mm2 in areas_mm2]
        below_mm3 = np.trapezoid(below_mm2, sections.s_mm)
        assert below_mm3 == pytest.approx(expected_mm3, abs=2e-3 * solid.cavity_volume_mm3), level_mm


def test_a_file_of_an_imported_solid_without_areas_by_level_is_refused(tmp_path):
    """Volumes without these areas would assume upright walls."""
    solid = brought(tmp_path, SLOT).solid
    write_solid(tmp_path, solid)
    assert read_solid(tmp_path).sections.below_mm2 == pytest.approx(solid.sections.below_mm2, abs=1e-5)
    write_solid(tmp_path, replace(solid, sections=replace(solid.sections, levels_mm=None, below_mm2=None)))
    with pytest.raises(InputError, match=r"solid\.json: .*sections\.below_mm2"):
        read_solid(tmp_path)


def test_an_inside_out_mesh_is_turned_with_a_warning(tmp_path):
    back = brought(tmp_path, (SLOT[0], SLOT[1][:, ::-1]))
    assert back.solid.cavity_volume_mm3 == pytest.approx(2400.0, rel=1e-9)
    assert [warning.key for warning in back.solid.figures.warnings] == ["mesh.inside-out"]


def test_the_error_for_a_mesh_that_crosses_itself_gives_the_position(tmp_path):
    """One corner of the face is pulled through a wall of the slot."""
    vertices, faces = fine(slotted())
    vertices[np.argmin(np.linalg.norm(vertices - [70.0, 26.0, 0.0], axis=1))] = 70.0, 21.0, -5.0
    with pytest.raises(InputError, match=r"scan\.stl: .* crosses itself .* \(\d+"):
        brought(tmp_path, (vertices, faces))


def test_a_block_on_its_side_gives_a_note_about_the_up_axis(tmp_path):
    """A crack that leaves through a side opens there too; only mesh.up decides which is the face."""
    across = mesh_of(block() - box((49.0, -1.0, -12.0), (51.0, 30.0, 1.0)))
    upright, upended = ([note.text for note in brought(tmp_path, across, up=up).notes] for up in ("z", "-y"))
    assert not any("mesh.up" in text for text in upright)
    assert any("100 x 40 mm" in text and "mesh.up" in text for text in upended)
