from dataclasses import replace

import cv2
import numpy as np
import pytest

from digitise.specimens.lighting import DIFFUSE, STRONG_LAMP, Look, SideLamp, exposed, illuminated, shadowed

GREY = np.full((120, 200), 0.4, dtype=np.float32)


def lit_from(degrees: float) -> Look:
    return replace(DIFFUSE, lamp=SideLamp(degrees, 0.2, 0.1))


def test_the_side_of_the_lamp_is_the_brighter_one():
    """0 degrees is right, 90 the top of the photo."""
    right, top = (illuminated(GREY, lit_from(degrees), np.random.default_rng(1)) for degrees in (0, 90))
    assert right[:, -20:].mean() > 1.2 * right[:, :20].mean()
    assert top[:20].mean() > 1.2 * top[-20:].mean()


def test_from_the_other_side_the_lamp_shines_the_opposite_way():
    here, there = lit_from(30), lit_from(30).from_the_other_side
    rng = np.random.default_rng(1)
    assert illuminated(GREY, here, rng) == pytest.approx(illuminated(GREY, there, rng)[::-1, ::-1], abs=1e-6)


def test_without_a_lamp_there_is_no_other_side():
    with pytest.raises(ValueError, match="no other side"):
        _ = DIFFUSE.from_the_other_side


def test_a_shadow_takes_its_share_inside_and_nothing_far_away():
    chord_px = np.array([[20.0, 60.0], [180.0, 60.0]])
    dark = shadowed(GREY.astype(float), 0.4, chord_px, 2.0, np.random.default_rng(3)) / GREY
    assert dark.min() == pytest.approx(0.6, abs=0.01)
    assert dark.max() == pytest.approx(1, abs=0.01)
    # 14 mm of shadow at 2 px per mm, of 120 px.
    assert np.mean(dark < 0.8) == pytest.approx(14 * 2 / 120, rel=0.2)


def test_the_photo_keeps_linear_light_in_its_gamma():
    look = Look(light=0, grain=0, blur_px=0.5, noise=0, jpeg_quality=100, lamp=STRONG_LAMP)
    jpeg = exposed(GREY.astype(float), look, np.random.default_rng(1))
    green = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR)[..., 1]  # pyright: ignore[reportOptionalSubscript]
    assert (green / 255.0) ** 2.2 == pytest.approx(0.4, abs=0.005)


def test_noise_shrinks_with_the_light_as_shot_noise_does():
    look = Look(light=0, grain=0, blur_px=0.5, noise=0.02, jpeg_quality=100)

    def noise(level: float) -> float:
        flat = np.full((200, 200), level)
        jpeg = exposed(flat, look, np.random.default_rng(1))
        decoded = np.asarray(cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR), dtype=float)
        return float(np.std((decoded[..., 1] / 255) ** 2.2))

    assert noise(0.8) == pytest.approx(0.02 * np.sqrt(0.8), rel=0.1)
    assert noise(0.8) / noise(0.2) == pytest.approx(2, rel=0.1)
