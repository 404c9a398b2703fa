"""The nozzle's path against lines and arcs, and its flow against the volume it must give."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from digitise.settings import NozzlePath
from digitise.trajectory import plan_trajectory, smooth_centreline, volume_warnings
from sealtwin.errors import InputError
from sealtwin.files import read_trajectory, write_trajectory
from sealtwin.records import Trajectory, arc_length
from tests.shapes import arc_slot, cut_crack, mirrored, reversed_path, straight_slot, wandering_crack

PAPER = NozzlePath(volume_ml=4.8)


def dispensed_mm3(trajectory: Trajectory) -> float:
    return float((trajectory.flow_mm3_s[:-1] * np.diff(trajectory.t_s)).sum())


def test_a_straight_crack_gets_the_paper_s_path():
    """80 mm, 10 mm in from each end, 4 mm/s: 61 waypoints over 60 mm in 15 s, 4.8 ml at 320 mm³/s."""
    path = plan_trajectory(straight_slot(80.0), PAPER, cavity_volume_mm3=1.0)
    expected = np.column_stack([np.linspace(10, 70, 61), np.zeros(61), np.full(61, 3.0)])
    assert np.abs(path.position_mm - expected).max() < 1e-9
    assert np.abs(path.s_mm - expected[:, 0]).max() < 1e-9
    assert path.duration_s == pytest.approx(15.0, rel=1e-12)
    assert path.length_mm == pytest.approx(60.0, rel=1e-12)
    assert path.flow_mm3_s[:-1] == pytest.approx(np.full(60, 320.0))
    assert path.speed_mm_s[:-1] == pytest.approx(np.full(60, 4.0))


def test_a_controller_that_holds_the_last_row_stands_still_and_gives_no_more():
    path = plan_trajectory(wandering_crack(1), PAPER, cavity_volume_mm3=1.0)
    assert (path.flow_mm3_s[-1], path.speed_mm_s[-1]) == (0.0, 0.0)
    assert path.flow_mm3_s[:-1].min() > 0


def test_an_arc_is_followed_within_the_smoothing_bound():
    """Radius 60 mm. The bound is an RMS over the whole line; the ends are where a spline leaves it most."""
    path = plan_trajectory(arc_slot(60.0), PAPER, cavity_volume_mm3=1.0)
    radius_mm = np.linalg.norm(path.position_mm[:, :2], axis=1)
    assert np.sqrt(np.mean((radius_mm - 60.0) ** 2)) < PAPER.smoothing_mm
    angle = np.arctan2(path.position_mm[:, 1], path.position_mm[:, 0])
    assert angle * 60.0 == pytest.approx(path.s_mm, abs=0.05)
    exact = plan_trajectory(arc_slot(60.0), NozzlePath(volume_ml=4.8, smoothing_mm=0.0), cavity_volume_mm3=1.0)
    # Sagitta of the centreline's own 0.25 mm chords: 0.13 micrometres.
    assert np.abs(np.linalg.norm(exact.position_mm[:, :2], axis=1) - 60.0).max() < 1e-3


@pytest.mark.parametrize("seed", range(4))
def test_smoothing_keeps_its_bound_and_straightens_noise(seed):
    """On a rough centreline the bound is used up, and turns between waypoints are calmer than without."""
    rough = wandering_crack(seed, rough_mm=0.2)
    rng = np.random.default_rng(seed)
    line = rough.centreline_mm + 0.08 * rng.standard_normal(rough.centreline_mm.shape)
    s_mm, smooth = smooth_centreline(line, 0.1)
    raw_s = arc_length(line)
    raw = np.column_stack([np.interp(s_mm, raw_s, line[:, axis]) for axis in (0, 1)])
    rms_mm = np.sqrt(np.mean(((smooth - raw) ** 2).sum(axis=1)))
    assert 0.05 < rms_mm <= 0.1 * 1.001
    noisy = dataclasses.replace(rough, centreline_mm=line)
    calm, wild = (
        turns_deg(plan_trajectory(noisy, NozzlePath(volume_ml=4.8, smoothing_mm=bound), 1.0)).max()
        for bound in (0.1, 0.0)
    )
    assert calm < 8 < wild


def turns_deg(path: Trajectory) -> np.ndarray:
    step = np.diff(path.position_mm[:, :2], axis=0)
    return np.degrees(np.abs(np.diff(np.unwrap(np.arctan2(step[:, 1], step[:, 0])))))


@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 50),
    volume_ml=st.floats(0.01, 900),
    speed=st.floats(0.1, 100),
    spacing=st.floats(0.1, 7),
    trim=st.floats(0, 15),
)
def test_the_volume_is_out_exactly_when_the_path_ends(seed, volume_ml, speed, spacing, trim):
    """Each row holds until the next: speed times time is the way, flow times time the volume, whatever the crack."""
    outline = cut_crack(seed)
    plan = NozzlePath(volume_ml=volume_ml, speed_mm_s=speed, spacing_mm=spacing, trim_mm=trim)
    path = plan_trajectory(outline, plan, cavity_volume_mm3=1.0)
    assert dispensed_mm3(path) == pytest.approx(volume_ml * 1000, rel=1e-12)
    way_mm = np.linalg.norm(np.diff(path.position_mm, axis=0), axis=1)
    assert way_mm / np.diff(path.t_s) == pytest.approx(np.full(len(way_mm), speed), rel=1e-9)
    assert way_mm.max() <= spacing + 1e-9
    # Chords of even arcs: no waypoint is skipped, none doubled.
    assert way_mm.min() > 0.9 * way_mm.max()
    assert path.s_mm[0] == pytest.approx(trim, abs=1e-9)
    assert path.s_mm[-1] == pytest.approx(outline.length_mm - trim, abs=1e-9)


def test_the_cavity_s_volume_is_given_where_asked_for():
    path = plan_trajectory(straight_slot(), NozzlePath(), cavity_volume_mm3=3968.0)
    assert dispensed_mm3(path) == pytest.approx(3968.0, rel=1e-12)


def test_a_mirrored_crack_gives_the_mirrored_path():
    outline = wandering_crack(3)
    path = plan_trajectory(outline, PAPER, 1.0)
    twin = plan_trajectory(mirrored(outline), PAPER, 1.0)
    assert np.abs(twin.position_mm - path.position_mm * [-1, 1, 1]).max() < 1e-9
    assert np.abs(twin.position_mm - path.position_mm - [-160, 0, 0]).max() > 1.0


def test_the_nozzle_starts_at_the_first_end():
    outline = wandering_crack(3)
    there, back = (plan_trajectory(o, PAPER, 1.0) for o in (outline, reversed_path(outline)))
    assert np.linalg.norm(there.position_mm[0, :2] - outline.centreline_mm[0]) < 10.1
    assert np.linalg.norm(back.position_mm[0, :2] - outline.centreline_mm[-1]) < 10.1


def test_the_file_gives_the_volume_too(tmp_path):
    """Six decimals of time and flow lose less than a millionth of it."""
    write_trajectory(tmp_path, plan_trajectory(wandering_crack(1), PAPER, 1.0))
    assert dispensed_mm3(read_trajectory(tmp_path)) == pytest.approx(4800.0, rel=1e-6)


@pytest.mark.parametrize(
    ("length_mm", "changes", "says"),
    [
        (20.5, {}, r"Centreline 20.5 mm: too short to trim 2 x 10 mm"),
        (1100.0, {"spacing_mm": 0.0105}, "more than 100000 waypoints"),
        (80.0, {"volume_ml": "cavity"}, "the cavity holds 0 mm³"),
    ],
)
def test_impossible_paths_are_refused_in_a_sentence(length_mm, changes, says):
    plan = NozzlePath.model_validate({"volume_ml": 4.8} | changes)
    with pytest.raises(InputError, match=says):
        plan_trajectory(straight_slot(length_mm), plan, cavity_volume_mm3=0.0)


def test_a_cavity_larger_than_a_path_may_fill_is_refused_with_its_volume():
    """volume_ml has a limit of 1000; "cavity" must not be a way round it."""
    with pytest.raises(InputError, match=r"the cavity holds 31000 ml, more than the 1000 ml"):
        plan_trajectory(straight_slot(), NozzlePath(), cavity_volume_mm3=3.1e7)


def test_a_volume_far_from_the_cavity_s_is_remarked_on():
    """The paper's trial gives 0.81 cavities (4.8 of 5.95 ml); 1000 ml for 3.17 is a slip, and so is a thousandth."""
    assert volume_warnings(4800.0, 5950.0) == ()
    (flood,) = volume_warnings(1e6, 3170.0)
    assert "1000 ml of sealant to a cavity of 3.17 ml, 315 times" in flood
    (drop,) = volume_warnings(1.0, 3170.0)
    assert "0.000315 times" in drop
