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
        (
            slotted(box((5.0, 5.0, -0.04), (15.0, 15.0, 1.0))),
            {"TOP": 4000 - FLOOR_MM2 + 40 * 0.04, "WALL": WALL_MM2},
        ),
        (
            slotted(box((5.0, 5.0, -3.0), (15.0, 15.0, 1.0))),
            {"WALL": WALL_MM2 + 40 * 3, "FLOOR": FLOOR_MM2 + 100},
        ),
        (
            slotted(box((5.0, 5.0, -21.0), (15.0, 15.0, -19.0))),
            {"OUTSIDE": OUTSIDE_MM2 + 40 * 1, "WALL": WALL_MM2},
        ),
        (OPEN_SLOT + DAM, {"END": 4 * 10 + 12 * 5}),
    ],
    ids=["slot", "grain", "pit beside the crack", "rough underside", "inside of a dam"],
)
def test_each_part_has_its_area(body, expected_mm2):
    found_mm2 = areas_mm2(body)
    assert {name: found_mm2[name] for name in expected_mm2} == pytest.approx(expected_mm2)
