"""The block of a sample: its four sides, past what stands out of them."""

import numpy as np
import pytest
from manifold3d import Manifold, OpType

from digitise.mesh_import.block import cut_block, parted
from sealtwin.core.errors import InputError
from tests.meshes import BLOCK_MM, box, slotted

BELOW_MM = 0.05


def oblique_slot(width_mm: float, angle_deg: float) -> Manifold:
    half = width_mm / 2
    slot = box((-100.0, -half, -10.0), (100.0, half, 1.0)).rotate((0.0, 0.0, angle_deg)).translate((50.0, 20.0, 0.0))
    return slotted() - slot


@pytest.mark.parametrize(
    "body",
    [
        slotted(),
        # A crack may leave through a fifth of a side.
        slotted(box((-1.0, 16.0, -10.0), (30.0, 24.0, 1.0))),
        # Its walls recede from the side slowly: lines beside its opening are less than 1 mm behind it.
        *(oblique_slot(4.0, angle_deg) for angle_deg in (20.0, 45.0, 70.0)),
        # In a slot of 0.6 mm at 52 degrees no line is 1 mm behind the side, and the side is plane.
        oblique_slot(0.6, 52.0),
    ],
    ids=["slot", "side crack", "20 degrees", "45 degrees", "70 degrees", "thin"],
)
def test_a_block_is_cut_exactly_at_its_sides_whatever_crack_leaves_by_them(body):
    block = cut_block(body.translate((12.5, -4.5, 0.0)), BELOW_MM)
    assert block.size_mm == BLOCK_MM[:2]
    assert block.trimmed_mm == 0.0
    assert block.placed[:2, 3] == pytest.approx([-12.5, 4.5])
    assert block.body.volume() == pytest.approx(body.volume(), rel=1e-9)


@pytest.mark.parametrize("top_mm", [0.0, 10.0])
def test_dams_at_its_sides_are_no_part_of_it(top_mm):
    dams = box((-4.0, 10.0, -20.0), (0.0, 30.0, top_mm)) + box((60.0, 40.0, -20.0), (72.0, 44.0, top_mm))
    block = cut_block(slotted() + dams, BELOW_MM)
    assert block.size_mm == BLOCK_MM[:2]
    assert block.trimmed_mm == 4.0
    assert block.body.volume() == pytest.approx(slotted().volume(), rel=1e-12)


def test_a_turned_block_is_turned_back():
    """0.01 mm goes from each side that rounding has taken off its plane."""
    block = cut_block(slotted().rotate((0.0, 0.0, 17.0)), BELOW_MM)
    assert block.yaw_deg == pytest.approx(17.0, abs=1e-4)
    assert block.size_mm == pytest.approx(BLOCK_MM[:2], abs=0.021)
    assert (block.placed @ [0, 0, 0, 1])[:2] == pytest.approx([0.0, 0.0], abs=0.011)


def test_rough_sides_are_cut_to_where_material_stands_all_along():
    rng = np.random.default_rng(0)
    teeth = [box((x, 39.0, -30.0), (x + 1.0, 41.0, 1.0)) for x in range(100)]
    rough = slotted() - Manifold.batch_boolean(
        [tooth.translate((0.0, depth, 0.0)) for tooth, depth in zip(teeth, rng.uniform(0.5, 1.0, 100), strict=True)],
        OpType.Add,
    )
    block = cut_block(rough, BELOW_MM)
    assert block.size_mm[0] == 100.0
    assert block.size_mm[1] == pytest.approx(39.5 - 0.01, abs=0.02)


@pytest.mark.parametrize(
    "body",
    [Manifold.cylinder(30.0, 50.0, 50.0, 128), Manifold.cylinder(30.0, 10.0, 60.0, 4)],
    ids=["core", "pyramid on its tip"],
)
def test_what_has_no_four_upright_sides_is_no_block(body):
    with pytest.raises(InputError, match="no block with four upright sides"):
        cut_block(body.translate((0.0, 0.0, -30.0)), BELOW_MM)


def test_a_pyramid_is_the_block_under_its_upper_edge():
    pyramid = Manifold.cylinder(30.0, 60.0, 30.0, 4).rotate((0, 0, 45)).translate((0.0, 0.0, -30.0))
    assert cut_block(pyramid, BELOW_MM).size_mm[0] < 43


def test_a_cut_that_loses_volume_is_refused():
    """As a library does where a triangle's corners lie on a line: see the needle in test_digitise_repair."""

    class Lossy:
        def volume(self) -> float:
            return 100.0

        def split(self, _cutter: object) -> tuple[Manifold, Manifold]:
            return box((0, 0, 0), (4, 4, 4)), box((0, 0, 0), (1, 1, 35.99))

    with pytest.raises(InputError, match="cannot be cut without loss"):
        parted(Lossy(), slotted())  # pyright: ignore[reportArgumentType]
