"""A reader of the report understands what a run says of itself."""

import pytest

from sealtwin.core.run_figures import RunHealth
from tests.evidence import make_evidence
from tests.fluids import path, pour, slot
from tests.tables import rows
from validate.wording.sample_and_run import HEALTH_LABELS, health_rows


@pytest.mark.parametrize(
    ("key", "value", "text"),
    [
        ("density_error_mean", 0.02318, "2.32 %"),
        ("density_error_max", 0.1503, "15.0 %"),
        ("viscosity_iterations_mean", 1.998, "2.0 a substep"),
        ("frames", 2076, "2,076"),
        ("frame_s", 0.0071729, "7.17 ms"),
        ("frames_s", 115.48, "115.5 s"),
        ("viscosity_m2_s", 3.248e-5, "32.5 mm²/s"),
        ("moving_mean", 2302.1, "2,302"),
        ("particles_across", 3.867, "3.9"),
    ],
)
def test_each_number_has_its_unit_and_its_meaning(key, value, text):
    ((label, shown),) = health_rows(RunHealth.model_validate({key: value}))
    assert shown == text
    assert label == HEALTH_LABELS[key][0]
    assert "_" not in label


def test_a_run_records_nothing_that_the_report_cannot_name():
    """A new number needs a line in HEALTH_LABELS, or the report shows its name in the code."""
    crack = slot(12.0)
    recorded = set(pour(crack, path(crack[1], 0.005, speed_mm_s=40.0), radius_mm=0.7).health.recorded())
    assert {"density_error_mean", "frame_s", "particles_across"} < recorded
    assert recorded < set(HEALTH_LABELS)


def test_two_times_of_a_frame_are_told_apart():
    rows = dict(health_rows(RunHealth(frames=2000, frame_s=0.007, frames_s=100.0)))
    assert rows["simulated time of a frame"] == "7.00 ms"
    assert rows["computing time of a frame"] == "50.0 ms"


@pytest.mark.parametrize(
    ("key", "value", "row"),
    [
        ("leak_mm_s", 0.25, ("leak (mm/s)", "0.25")),
        ("solver", "explicit", ("solver", "explicit")),
        ("frames", None, ("frames", "None")),
    ],
)
def test_what_is_not_known_keeps_its_name(key, value, row):
    assert health_rows(RunHealth.model_validate({key: value})) == [row]


def test_units_follow_from_the_names(tmp_path):
    health = rows(make_evidence(tmp_path), "Numerical health")
    assert health["simulated time of a frame"] == "7.14 ms"
    assert health["kinematic viscosity in effect"] == "32.6 mm²/s"
    assert health["compression above the rest density, mean"] == "2.00 %"
    assert rows(make_evidence(tmp_path), "Settings in effect")["fluid: density (kg/m³)"] == "1690"
