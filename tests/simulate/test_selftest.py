"""The doctor's question to the device, where the answer is known."""

import warp as wp

from simulate.device import SIDE, touching_pairs, turns_of_a_recording


def test_this_machine_compiles_runs_and_records():
    assert touching_pairs("cpu") == 3 * 7 * 8 * 8
    assert turns_of_a_recording("cpu") == SIDE


def test_a_device_that_does_not_run_its_recordings_is_found_out(monkeypatch):
    monkeypatch.setattr(wp, "capture_launch", lambda _: None)
    assert turns_of_a_recording("cpu") == 0
