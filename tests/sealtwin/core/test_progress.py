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
    assert pace.left_s(100, 180.0 + 9.9) is None, "less than a tenth"
    assert pace.left_s(141, 180.0 + 14.0) == pytest.approx(125.9)
    # Steps of an earlier process do not count either.
    again = Pace(100, done=50)
    assert again.left_s(51, 10.0) is None
    assert again.left_s(61, 20.0) == pytest.approx(39.0)


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
    clock[0] = 0.0
    shown = PlainProgress()
    shown.start("Extra runs", 100)
    shown.expect(600.0)
    clock[0] = 20.0
    shown.advance(1, "1 done")
    clock[0] = 25.0
    shown.advance(2, "too soon for a line")
    assert capsys.readouterr().err.splitlines() == ["Extra runs", "Extra runs: 1%, about 10 min left. 1 done"]


@pytest.mark.parametrize(("time_s", "words"), [(7.4, "7 s"), (119, "119 s"), (700, "12 min"), (9000, "2.5 h")])
def test_times_are_printed_in_seconds_minutes_or_hours(time_s, words):
    assert in_words(time_s) == words
