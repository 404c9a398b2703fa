"""Lines that the trace page offers or takes by itself: the one that is probably the crack, and walls beside a band."""

import numpy as np
import pytest

from sealtwin.trial.trial_file import load_trial
from tests.support.photos import mortar, with_crack, write_png

pytestmark = pytest.mark.browser

LINE = [(30, 160), (120, 140), (200, 175), (300, 150), (390, 190), (470, 170)]


@pytest.fixture
def shaded(open_page, tmp_path):
    """The page of a photo with one clear crack of 20 px, and a shade of 9 px below it."""
    line = [(x, round(150 + 12 * np.sin(x / 70))) for x in range(30, 471, 10)]
    light = with_crack(mortar(), [(x, y + 10) for x, y in line], 18) ** 0.45 * mortar() ** 0.55
    return open_page(write_png(tmp_path / "shaded.png", np.minimum(light, with_crack(mortar(), line, 20))))


def test_a_line_that_is_probably_the_crack_is_traced_at_once_and_saved_with_its_ends(open_page, tmp_path):
    photo = write_png(tmp_path / "single.png", with_crack(mortar(), LINE))
    bench = open_page(photo)
    bench.await_state("walls")
    assert "probably the crack" in bench.text("#how")
    assert bench.text("#refusal") == ""
    bench.give_scale_and_depth()
    bench.page.keyboard.press("Control+s")
    bench.page.wait_for_selector("#farewell[open]")
    settings = load_trial(photo.with_suffix(".toml")).photo
    assert settings is not None
    assert np.abs(np.array(settings.ends_px) - np.array([LINE[0], LINE[-1]])).max() < 12


def test_a_key_chooses_the_wall_beside_a_band_and_the_panel_forgets_the_choice(shaded):
    shaded.await_state("walls")
    assert shaded.page.locator(".offered").all_inner_texts() == ["1", "2"]
    areas = {}
    for number in (1, 2):
        shaded.page.locator("#stage").focus()
        shaded.page.keyboard.press(str(number))
        shaded.until("document.querySelector('#drawn').innerText.includes(`Wall ${given[0]} of the band`)", number)
        shaded.until("document.querySelectorAll('#lines .band').length === 0")
        areas[number] = shaded.number("area")
        shaded.page.click("#drawn button")
        shaded.until("document.querySelectorAll('.offered').length === 2")
        shaded.until("document.querySelectorAll('#lines .band').length > 0")
    assert areas[2] > 1.3 * areas[1]
