"""The paper's trial as committed is what the package writes: one source for the repository and for 'sealtwin demo'."""

import cv2
import numpy as np
import pytest

from sealtwin.trials.reconstruction import DESCRIBED_MM, SCATTER_MM, paper_readings, write_paper_trial
from tests.places import FIXTURE


@pytest.fixture(scope="module")
def rewritten(tmp_path_factory):
    folder = tmp_path_factory.mktemp("paper-trial")
    write_paper_trial(folder)
    return folder


def test_texts_are_regenerated_to_the_letter(rewritten):
    for name in ("trial.toml", "trial-paper.toml", "caliper.csv"):
        assert (rewritten / name).read_text() == (FIXTURE / name).read_text(), name


def test_the_photo_is_regenerated_within_two_grey_levels(rewritten):
    """Not to the bit: JPEG encoders and the last digit of a sine differ between builds."""
    again, committed = (
        np.asarray(cv2.imread(str(folder / "photo.jpg"))).astype(int) for folder in (rewritten, FIXTURE)
    )
    assert again.shape == committed.shape
    assert np.abs(again - committed).max() <= 2


def test_readings_follow_the_described_line_with_the_declared_scatter():
    rows = np.vstack([paper_readings(seed) for seed in range(40)])
    described = np.array(DESCRIBED_MM)
    residual_mm = rows[:, 1:] - np.interp(rows[:, 0], described[:, 0], described[:, 1])[:, None]
    assert residual_mm.size == 40 * 17 * 3
    # 2,040 draws: the mean within 4 standard errors, the scatter within 4 of its own.
    assert abs(residual_mm.mean()) < 4 * SCATTER_MM / np.sqrt(residual_mm.size)
    assert residual_mm.std() == pytest.approx(SCATTER_MM, rel=4 / np.sqrt(2 * residual_mm.size))
