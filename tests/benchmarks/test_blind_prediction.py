"""The judge of blind predictions: what it holds, and the emulated measurements that a prediction begins with."""

import numpy as np
import pytest

from benchmarks.blind_cases import STATIONS_MM
from benchmarks.blind_measured import LENGTH_MM, measured
from benchmarks.blind_prediction import judge, over_trials, read, rows

pytestmark = pytest.mark.usefixtures("kept_of_any_number")


def levels(off_mm: float) -> dict[str, np.ndarray]:
    """A bed, predicted too high by ``off_mm``, of inputs that are unsure by 0.2 mm."""
    level_mm = -5 + 0.1 * STATIONS_MM
    return {"predicted_mm": level_mm + off_mm, "real_mm": level_mm, "inputs_mm": np.full(len(STATIONS_MM), 0.2)}


def test_a_prediction_is_held_within_its_band_and_lost_beyond_it():
    near, far = judge(0, levels(0.0), 0.25), judge(1, levels(2.0), 0.25)
    assert near.held() > 0.9
    assert far.held() == 0
    assert near.ahead_mm == pytest.approx(1.96 * np.hypot(0.2, 0.25), rel=0.03)
    assert (near.band_mm > near.ahead_mm).all()
    figures = {row.name: row for row in rows([near, far], 0.25)}
    assert figures["the same in the trial that has fewest"].missed
    assert figures["EMULATED trials judged"].missed, "two of twenty"


def test_the_interval_of_a_share_is_over_trials_and_not_over_their_stations():
    """Ten of twenty trials hold all, ten half: 6 to 14 of twenty drawn again hold all, by the binomial law.

    Over 320 stations the interval would be 70 to 80 %.
    """
    assert over_trials(np.repeat([100.0, 50.0], 10)) == pytest.approx([65.0, 85.0])
    assert over_trials(np.full(20, 95.0)) == pytest.approx([95.0, 95.0])


def test_a_caliper_errs_by_what_is_declared():
    level_mm = 0 * STATIONS_MM
    off_mm = np.array([read(number, level_mm).level_mm for number in range(200)])
    # A mean of three passes and three readings.
    assert off_mm.std() == pytest.approx(np.hypot(0.1, 0.1) / np.sqrt(3), rel=0.15)


def test_what_a_lab_finds_lies_about_the_truth(tmp_path):
    """The one quick test of a viscosity by early photos of a spread."""
    one = measured(7, 0, tmp_path)
    sample, real = one.base.sample, one.real
    assert sample.outline.length_mm == pytest.approx(LENGTH_MM, rel=0.05)
    assert sample.trajectory.dispensed_mm3 != real.trajectory.dispensed_mm3
    assert sample.trajectory.dispensed_mm3 == pytest.approx(real.trajectory.dispensed_mm3, rel=0.1)
    assert sample.outline.mean_width_mm == pytest.approx(real.outline.mean_width_mm, abs=0.5)
    assert {"width_mm", "depth_mm", "wall_angle_deg", "volume_ml", "yield_stress_pa"} < set(one.base.inputs)
