"""Units and axes of a file, never mirrored and never guessed; parts of a block by their planes."""

from pathlib import Path
from typing import get_args

import numpy as np
import pytest
import trimesh
from manifold3d import Manifold

from digitise.mesh_import.import_mesh import UPRIGHT_DEG, label_imported, upright, upright_mm
from digitise.settings import MeshInput, MeshUnit
from sealtwin.core.errors import InputError
from sealtwin.core.mesh_file import Triangles
from sealtwin.core.records import FaceLabel
from tests.support.meshes import BLOCK_MM, area_mm2, box, mesh_of, slotted


def settings(units: str = "mm", up: str = "z") -> MeshInput:
    return MeshInput.model_validate({"file": Path("scan.stl"), "data": "synthetic", "units": units, "up": up})


@pytest.mark.parametrize("up", UPRIGHT_DEG)
def test_the_axis_out_of_the_face_comes_to_point_upward(up):
    """By a rotation: a mirror would swap the crack's left wall for its right one."""
    axis = np.eye(3)["xyz".index(up[-1])] * (-1.0 if up.startswith("-") else 1.0)
    assert trimesh.transform_points(axis[None], upright(settings(up=up)))[0] == pytest.approx([0, 0, 1])
    assert np.linalg.det(upright(settings(up=up))[:3, :3]) == pytest.approx(1.0)


@pytest.mark.parametrize(("units", "mm"), [("mm", 1.0), ("cm", 10.0), ("m", 1000.0), ("inch", 25.4)])
def test_numbers_become_millimetres(units, mm):
    assert {"mm", "cm", "m", "inch"} == set(get_args(MeshUnit))
    block = Triangles(np.array([[0.0, 0, 0], [100 / mm, 40 / mm, 20 / mm]]), np.empty((0, 3), dtype=np.int64))
    assert np.ptp(upright_mm(block, settings(units)), axis=0) == pytest.approx([100.0, 40.0, 20.0])


@pytest.mark.parametrize(
    ("longest", "units", "says"),
    [
        (80.0, "m", "probably in mm or cm: set units"),
        (0.16, "mm", "probably in m: set units"),
        (6.3, "mm", "probably in cm or inch: set units"),
        (9000.0, "cm", "Crop the mesh to the sample"),
    ],
)
def test_a_size_that_no_sample_has_is_refused_with_the_units_that_would_fit(longest, units, says):
    block = Triangles(np.array([[0.0, 0, 0], [longest, longest / 4, longest / 8]]), np.empty((0, 3), dtype=np.int64))
    with pytest.raises(InputError, match=says):
        upright_mm(block, settings(units))


BELOW_MM = 0.05


def areas_mm2(body: Manifold) -> dict[str, float]:
    vertices, faces = mesh_of(body)
    label = label_imported(vertices, faces, (0.0, 0.0, *BLOCK_MM[:2]), BELOW_MM)
    return {each.name: area_mm2(vertices, faces[label == each]) for each in FaceLabel}


WALL_MM2, FLOOR_MM2 = 2 * (60 + 4) * 10.0, 60 * 4.0


OUTSIDE_MM2 = 4000 + 2 * (100 + 40) * 20
OPEN_SLOT, DAM = slotted(box((-1.0, 18.0, -10.0), (30.0, 22.0, 1.0))), box((-4.0, 14.0, -20.0), (0.0, 26.0, 5.0))


@pytest.mark.parametrize(
    ("body", "expected_mm2"),
    [
        (
            slotted(),
            {"TOP": 4000 - FLOOR_MM2, "WALL": WALL_MM2, "FLOOR": FLOOR_MM2, "END": 0.0, "OUTSIDE": OUTSIDE_MM2},
        ),
        # A dent of 0.04 mm with upright walls is part of the face, however steep: no room for sealant.
        (slotted(box((5.0, 5.0, -0.04), (15.0, 15.0, 1.0))), {"TOP": 4000 - FLOOR_MM2 + 40 * 0.04, "WALL": WALL_MM2}),
        (slotted(box((5.0, 5.0, -3.0), (15.0, 15.0, 1.0))), {"WALL": WALL_MM2 + 40 * 3, "FLOOR": FLOOR_MM2 + 100}),
        (slotted(box((5.0, 5.0, -21.0), (15.0, 15.0, -19.0))), {"OUTSIDE": OUTSIDE_MM2 + 40 * 1, "WALL": WALL_MM2}),
        (OPEN_SLOT + DAM, {"END": 4 * 10 + 12 * 5}),
    ],
    ids=["slot", "grain", "pit beside the crack", "rough underside", "inside of a dam"],
)
def test_each_part_has_its_area(body, expected_mm2):
    found_mm2 = areas_mm2(body)
    assert {name: found_mm2[name] for name in expected_mm2} == pytest.approx(expected_mm2)
