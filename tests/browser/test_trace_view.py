"""The photo on the trace page: zoom, position, and width of the window."""

import cv2
import numpy as np
import pytest

pytestmark = pytest.mark.browser


def test_the_wheel_zooms_about_the_pointer(open_page, big):
    bench = open_page(big.file)
    bench.await_state("refused")
    screen = [500, 400]  # whole pixels, as a mouse has them
    place = bench.probe("onPhoto", screen)
    bench.page.mouse.move(*screen)
    for _ in range(12):
        bench.page.mouse.wheel(0, -200)
    bench.until("window.probe.zoom() > 10")
    # Twelve steps of rounding in a browser's floats.
    assert bench.at(place) == pytest.approx(screen, abs=0.01)
    bench.page.wait_for_load_state("networkidle")
    assert any("/photo/0/" in visited for visited in bench.visited), "the photo's own pixels are shown"
    bench.page.mouse.down()
    bench.page.mouse.move(550, 420, steps=3)
    bench.page.mouse.up()
    bench.until("Math.abs(window.probe.onScreen(given[0])[0] - 550) < 0.01", place)
    assert bench.points() == [], "a drag is no click"
    bench.page.keyboard.press("0")
    bench.until("window.probe.zoom() < 0.5")


@pytest.mark.parametrize("width", [320, 1280])
def test_no_part_of_the_trace_page_is_wider_than_the_window(open_page, shot, width):
    bench = open_page(shot.file, width=width, height=844)
    bench.give_ends(shot)
    bench.page.check("input[value=face]")
    assert bench.page.evaluate("document.documentElement.scrollWidth <= document.documentElement.clientWidth")
    assert bench.probe("stickingOut") == []
    assert bench.probe("smallButtons", 24) == [], "WCAG 2.2 asks for 24 px at least"


def test_a_pixel_of_the_photo_is_drawn_at_its_coordinates(open_page, tmp_path):
    """Lines and photo share one frame, in which a pixel reaches half a pixel to each side of its centre."""
    grey = np.full((400, 600), 60, np.uint8)
    grey[200:208, 296:304] = 250  # a block of JPEG's own grid, which it keeps sharp
    cv2.imwrite(str(tmp_path / "block.png"), grey)
    bench = open_page(tmp_path / "block.png")
    bench.page.mouse.move(*bench.at((300, 204)))
    for _ in range(30):
        bench.page.mouse.wheel(0, -300)
    bench.until("window.probe.zoom() >= 39.9")
    bench.page.wait_for_load_state("networkidle")
    for place, bright in (((295.7, 204), True), ((295.3, 204), False), ((303.3, 204), True), ((303.7, 204), False)):
        assert (bench.probe("shade", place) > 155) == bright
    for place, bright in (((300, 199.7), True), ((300, 199.3), False), ((300, 207.3), True), ((300, 207.7), False)):
        assert (bench.probe("shade", place) > 155) == bright
