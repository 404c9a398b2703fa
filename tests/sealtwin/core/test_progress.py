"""Times left of a computation, from the pace of the later half of its steps."""

import pytest

from sealtwin.core import progress
from sealtwin.core.progress import Pace, PlainProgress, in_words


@pytest.fixture
def clock(monkeypatch):
    """The time that progress reads, to be set."""
    now = [0.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    return now


def test_set_up_time_is_excluded_from_the_pace_of_progress():
    """Kernels compile for three minutes before the first of 1,400 frames, which once gave 70 hours left."""
    pace = Pace(1400)
    assert pace.left_s(1, 180.0) is None
    assert pace.left_s(141, 180.0 + 14.0) == pytest.approx(125.9)


def test_the_time_left_follows_the_pace_of_the_later_half_of_steps():
    """The first hundred of a thousand steps take 1 s each, and the following steps 10 s each."""
    pace = Pace(1000)
    left_s = [pace.left_s(step, float(min(step, 100) + 10 * max(0, step - 100))) for step in range(301)]
    assert left_s[-1] == pytest.approx(7000.0)


def test_a_progress_log_prints_the_expected_or_measured_time_left(capsys, clock):
    shown = PlainProgress()
    shown.start("Simulating", 1400)
    for seconds, frames in ((180.0, 1), (200.0, 201)):
        clock[0] = seconds
        shown.advance(frames)
    lines = capsys.readouterr().err.splitlines()
    assert lines == ["Simulating", "Simulating: 0%.", "Simulating: 14%, about 120 s left."]


@pytest.mark.parametrize("expected", [True, False])
@pytest.mark.parametrize("before", [0, 50])
def test_no_time_left_is_printed_before_a_tenth_of_the_work_of_this_process(capsys, clock, before, expected):
    """A study expects a time from the start, and samples of the fast model gave 0 s left for minutes."""
    shown = PlainProgress()
    shown.start("Running", 100, before)
    if expected:
        shown.expect(600.0)
    for seconds, done in ((20.0, 1), (40.0, 4), (60.0, 11), (80.0, 40)):
        clock[0] = seconds
        shown.advance(before + done * (100 - before) // 100, "1 done")
    lines = capsys.readouterr().err.splitlines()[1:]
    assert ["left" in line for line in lines] == [False, False, True, True]


@pytest.mark.parametrize(("time_s", "words"), [(7.4, "7 s"), (119, "119 s"), (700, "12 min"), (9000, "2.5 h")])
def test_times_are_printed_in_seconds_minutes_or_hours(time_s, words):
    assert in_words(time_s) == words
