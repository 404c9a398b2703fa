"""Rules for judging lines that were traced on real photos, tested on a drawn mask."""

import numpy as np
import pytest

from benchmarks.real_roads_rules import Branch, is_hit, verdict


@pytest.fixture(scope="module")
def mask():
    """A crack of 3 px along y = 100, from which a side crack rises at x = 200."""
    mask = np.zeros((200, 300), dtype=bool)
    mask[99:102, 20:281] = True
    mask[50:100, 199:202] = True
    return mask


def line(*points):
    return np.array(points, dtype=float)


@pytest.mark.parametrize(
    ("traced", "expected", "hit"),
    [
        (line((22, 100), (278, 100)), "right", True),
        (line((22, 104.9), (278, 104.9)), "right", True),
        (line((22, 105.9), (278, 105.9)), "other", True),  # 5.9 px from the branch, 4.9 from the mask
        (line((22, 107), (278, 107)), "wrong", False),
        (line((22, 100), (200, 100)), "other", True),  # 68 % of the branch
        (line((200, 52), (200, 95)), "other", False),  # 17 % of its length
        (line((22, 100), (200, 100), (200, 52)), "other", True),
        (line((22, 150), (278, 150)), "wrong", False),
        (line((22, 100), (150, 100), (150, 150), (278, 150), (278, 100)), "wrong", False),
    ],
)
def test_a_traced_line_is_judged_by_the_branch_and_mask_of_the_crack(mask, traced, expected, hit):
    branch = Branch.of(mask)
    assert branch.length_px == pytest.approx(260, abs=4)
    assert (verdict(traced, branch, mask), is_hit(traced, branch, mask)) == (expected, hit)
