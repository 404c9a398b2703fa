"""The parts of a modelled block by their planes, and by what hangs together between them."""

import numpy as np
import pytest
from manifold3d import Manifold

from digitise.mesh_import.import_mesh import label_imported
from sealtwin.core.records import FaceLabel
from tests.meshes import BLOCK_MM, box, mesh_of, slotted

BELOW_MM = 0.05


def areas_mm2(body: Manifold) -> dict[str, float]:
    vertices, faces = mesh_of(body)
    label = label_imported(vertices, faces, (0.0, 0.0, *BLOCK_MM[:2]), BELOW_MM)
    corners = vertices[faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    return {each.name: float(area[label == each].sum()) for each in FaceLabel}


WALL_MM2, FLOOR_MM2 = 2 * (60 + 4) * 10.0, 60 * 4.0


def test_each_part_has_its_area():
    assert areas_mm2(slotted()) == pytest.approx(
        {
            "TOP": 4000 - FLOOR_MM2,
            "WALL": WALL_MM2,
            "FLOOR": FLOOR_MM2,
            "END": 0.0,
            "OUTSIDE": 4000 + 2 * (100 + 40) * 20,
        }
    )


def test_grain_is_part_of_the_face_however_steep():
    """A dent of 0.04 mm with upright walls; it is no room for sealant."""
    dented = areas_mm2(slotted(box((5.0, 5.0, -0.04), (15.0, 15.0, 1.0))))
    assert dented["TOP"] == pytest.approx(4000 - FLOOR_MM2 + 40 * 0.04)
    assert dented["WALL"] == pytest.approx(WALL_MM2)


def test_a_pit_beside_the_crack_has_walls_and_a_floor():
    pitted = areas_mm2(slotted(box((5.0, 5.0, -3.0), (15.0, 15.0, 1.0))))
    assert pitted["WALL"] == pytest.approx(WALL_MM2 + 40 * 3)
    assert pitted["FLOOR"] == pytest.approx(FLOOR_MM2 + 100)


def test_a_rough_underside_is_outside():
    hollow_below = areas_mm2(slotted(box((5.0, 5.0, -21.0), (15.0, 15.0, -19.0))))
    assert hollow_below["OUTSIDE"] == pytest.approx(4000 + 2 * (100 + 40) * 20 + 40 * 1)
    assert hollow_below["WALL"] == pytest.approx(WALL_MM2)


def test_a_dam_has_an_inside_and_an_outside():
    open_slot = slotted(box((-1.0, 18.0, -10.0), (30.0, 22.0, 1.0)))
    dam = box((-4.0, 14.0, -20.0), (0.0, 26.0, 5.0))
    assert areas_mm2(open_slot + dam)["END"] == pytest.approx(4 * 10 + 12 * 5)
