"""Labels for training other programs: masks that are read back, and annotations in COCO's format."""

from dataclasses import replace

import numpy as np
import pytest
from skimage.draw import disk, polygon2mask

from digitise.exports import coco_of, mask_of, mask_png
from digitise.image.decoding import read_mask
from sealtwin.core.errors import InputError
from tests.support.shapes import arc_slot, straight_slot

SIZE_PX = (1500, 1000)
SLOT = straight_slot(80.0, 3.1)
OUTLINE = replace(SLOT, photo_size_px=SIZE_PX, outline_px=SLOT.outline_mm * (10, -10) + (200, 500))


def test_an_exported_mask_is_the_inside_of_the_outline(tmp_path):
    """Pixels that the edge cuts may be inside or outside."""
    mask = mask_of(OUTLINE, "a.png")
    inside = polygon2mask(SIZE_PX[::-1], OUTLINE.outline_px[:, ::-1])
    assert (mask != inside).sum() < 2 * len(OUTLINE.outline_px) + 2 * 831
    assert mask.sum() == pytest.approx(800 * 31, rel=0.01)
    (tmp_path / "m.png").write_bytes(mask_png(OUTLINE, "a.png"))
    assert np.array_equal(read_mask(tmp_path / "m.png", SIZE_PX), mask)


def test_an_island_is_excluded_from_the_mask_and_its_run_length_code():
    turn = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    outline = replace(OUTLINE, islands_mm=(np.column_stack([40 + np.cos(turn), -np.sin(turn)]),))
    mask = mask_of(outline, "a.png")
    assert not mask[disk((500, 600), 9)].any()
    (annotation,) = coco_of([("a.png", outline)])["annotations"]
    counts = annotation["segmentation"]["counts"]
    assert annotation["area"] == mask.sum()
    flat = np.repeat(np.arange(len(counts)) % 2 == 1, counts)
    assert np.array_equal(flat.reshape(mask.shape, order="F"), mask)


@pytest.mark.parametrize(
    ("outline", "says"),
    [
        (replace(arc_slot(), path_source="mesh", photo_size_px=SIZE_PX), "a.x: .* in a photo"),
        # A mask without white pixels would teach a program that there is no crack.
        (replace(OUTLINE, width_source="none"), "--width-mm"),
    ],
)
def test_a_mask_of_a_crack_without_a_photo_or_without_walls_is_refused(outline, says):
    with pytest.raises(InputError, match=says):
        mask_of(outline, "a.x")
