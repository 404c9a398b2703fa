"""The scale of a photo, set on the trace page by a ruler or by the corners of the face."""

import pytest

pytestmark = pytest.mark.browser


def test_a_ruler_drawn_on_the_photo_sets_the_scale(bench, shot):
    """The mouse may be off by five pixels in 500, which is 1 %."""
    bench.give_ends(shot)
    assert bench.text("#length").endswith("px")
    bench.page.keyboard.press("r")
    lower_left, lower_right = shot.corners_px[:2]
    bench.drag(lower_left, lower_right)
    bench.page.fill("#ruler-mm", "160")
    bench.page.keyboard.press("Enter")
    bench.until("document.getElementById('length').innerText.endsWith('mm')")
    assert bench.number("length") == pytest.approx(0.9 * shot.length_mm, rel=0.02)
    assert bench.number("width") == pytest.approx(shot.width_mm, rel=0.03)
    assert "mm/px" in bench.text("#scale-found")


def test_the_clicked_corners_of_the_face_set_the_scale(bench, shot):
    """Corners are clicked in any order. A crack that meets the face's edge has open ends."""
    bench.page.keyboard.press("f")
    for corner in (2, 0, 3, 1):
        bench.click(shot.corners_px[corner])
    assert bench.page.eval_on_selector_all("#coordinates span", "all => all.map(one => one.innerText)") == [
        "Lower left", "Lower right", "Upper right", "Upper left",
    ]  # fmt: skip
    bench.page.fill("#face-width-mm", "160")
    bench.page.fill("#face-height-mm", "40,0")
    bench.page.keyboard.press("Enter")
    bench.until("document.getElementById('scale-found').innerText.includes('corners given')")
    bench.page.click("#tools [data-tool=ends]")
    bench.give_ends(shot, shares=(0.01, 0.99))
    assert "both ends open" in bench.text("#how")
    assert bench.number("length") == pytest.approx(shot.length_mm, rel=0.015)
