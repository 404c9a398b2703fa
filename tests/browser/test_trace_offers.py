"""Competing cracks, outlined and numbered on the trace page, of which a click chooses one."""

import numpy as np
import pytest

from tests.support.photos import mortar, with_crack, write_png

pytestmark = pytest.mark.browser

UPPER = [(30, 60), (120, 40), (200, 75), (300, 50), (390, 90), (470, 70)]
LOWER = [(30, 240), (110, 262), (210, 225), (290, 250), (380, 215), (470, 230)]


@pytest.fixture
def bench(open_page, tmp_path):
    """The page of a photo with two cracks of similar strength."""
    opened = open_page(write_png(tmp_path / "two.png", with_crack(with_crack(mortar(), UPPER), LOWER)))
    opened.await_state("refused")
    return opened


def taken(bench, line):
    """Assert that a line is chosen, with both its ends and its walls."""
    bench.await_state("walls")
    ends = np.array([bench.place(end) for end in ("end-0", "end-1")])
    assert bench.points() == ["end-0", "end-1"]
    assert np.abs(ends - np.array([line[0], line[-1]])).max() < 12
    assert bench.text("#refusal") == ""
    assert "Between your two ends" in bench.text("#how")
    assert not bench.page.is_visible("#offers")
    assert bench.page.locator("#lines .offer").count() == 0


def lines_offered(bench):
    """Return the cracks in the order of their numbers, by the position of the numbers."""
    middles = [bench.page.locator(".offered").nth(place).bounding_box()["y"] for place in (0, 1)]
    return (UPPER, LOWER) if middles[0] < middles[1] else (LOWER, UPPER)


def test_a_click_on_a_number_chooses_its_crack_and_undo_offers_both_cracks_again(bench):
    assert "2 lines may be the crack" in bench.text("#refusal")
    assert bench.page.locator(".offered").all_inner_texts() == ["1", "2"]
    assert bench.page.locator("#lines .offer").count() == 2
    first, second = lines_offered(bench)
    bench.page.locator(".offered").nth(1).click()
    taken(bench, second)
    bench.page.keyboard.press("Control+z")
    assert bench.points() == []
    assert bench.page.locator(".offered").all_inner_texts() == ["1", "2"]
    bench.page.locator(".offered").first.click()
    taken(bench, first)
    bench.page.keyboard.press("Control+z")
    bench.page.keyboard.press("Control+y")
    taken(bench, first)


def test_numbers_stand_beside_a_doubtful_path_and_a_click_takes_one(open_page, tmp_path):
    """The path between the clicks follows two joints. A path without a doubt has no numbers beside it."""
    picture = with_crack(mortar(), UPPER)
    for joint in ([(15, -10), (15, 310)], [(-10, 280), (510, 280)]):
        picture = with_crack(picture, joint, 4)
    bench = open_page(write_png(tmp_path / "tiles.png", picture))
    bench.await_state("refused", "walls")
    for end_px in ((15, 120), (430, 280)):
        bench.click(end_px)
    bench.until('document.body.innerText.includes("the path may not be the crack")')
    bench.await_state("walls")
    assert bench.page.locator(".offered").all_inner_texts() == ["1"]
    assert bench.page.is_visible(".offered")
    bench.page.locator(".offered").click()
    taken(bench, UPPER)
    assert "the path may not be the crack" not in bench.text("body")
