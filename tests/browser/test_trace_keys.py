"""The trace page by keyboard alone, and with reduced motion."""

import numpy as np
import pytest

pytestmark = pytest.mark.browser


def test_a_crack_can_be_traced_by_keyboard_alone(bench, shot):
    """Tab selects the photo or a point, arrows move, and Enter sets an end."""
    bench.await_state("refused")
    for _ in range(3):  # tools, views, photo
        bench.page.keyboard.press("Tab")
    assert bench.page.evaluate("document.activeElement.id") == "stage"
    for share in (0.1, 0.9):
        _walk_to(bench, shot.along(share))
        bench.page.keyboard.press("Enter")
    bench.await_state("walls")
    bench.page.keyboard.press("Tab")
    assert bench.page.evaluate("document.activeElement.id") == "end-0"
    place = bench.place("end-0")
    bench.page.keyboard.press("ArrowRight")
    bench.page.keyboard.press("Shift+ArrowUp")
    assert bench.place("end-0") == pytest.approx([place[0] + 1, place[1] - 10], abs=0.051)
    bench.page.keyboard.press("Control+z")
    assert bench.place("end-0") == pytest.approx(place), "steps of one point are taken back together"
    bench.page.keyboard.press("Tab")
    bench.page.keyboard.press("Delete")
    assert bench.points() == ["end-0"]
    assert bench.page.evaluate("document.activeElement.id") == "end-0", "the focus does not fall off the page"
    bench.page.keyboard.press("Control+z")
    assert bench.points() == ["end-0", "end-1"]
    for key, tool in (("e", "ends"), ("r", "ruler"), ("f", "face"), ("b", "box"), ("v", "via")):
        bench.page.keyboard.press(key)
        assert bench.page.get_attribute(f"#tools [data-tool={tool}]", "aria-pressed") == "true"


def _walk_to(bench, point_px):
    """Move the crosshair by the arrow keys, in steps of 64 and 8 screen pixels."""
    for _ in range(200):
        target, here = np.array(bench.at(point_px)), _crosshair(bench)
        off = target - here
        axis = int(np.argmax(np.abs(off)))
        if abs(off[axis]) <= 4.01:
            return
        arrow = (("ArrowLeft", "ArrowRight"), ("ArrowUp", "ArrowDown"))[axis][int(off[axis] > 0)]
        bench.page.keyboard.press(f"Shift+{arrow}" if abs(off[axis]) > 40 else arrow)
    pytest.fail("the crosshair does not get there")


def _crosshair(bench):
    shown = bench.page.locator("#crosshair").bounding_box()
    assert bench.page.is_visible("#crosshair")
    return np.array([shown["x"] + shown["width"] / 2, shown["y"] + shown["height"] / 2])


def test_nothing_on_the_page_moves_with_reduced_motion(open_page, shot):
    bench = open_page(shot.file, reduced_motion="reduce")
    assert bench.probe("moving") == 0
