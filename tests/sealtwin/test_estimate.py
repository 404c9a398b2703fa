"""What a study will take, before it starts."""

from dataclasses import replace

import pytest

from sealtwin.errors import InputError
from sealtwin.estimate import Estimate, estimate, in_words, require_disk
from sealtwin.ledger import StudyRun


def _run(state, work_s, wall_s=None):
    empty = dict.fromkeys(StudyRun.__dataclass_fields__)
    return replace(StudyRun(**empty), state=state, work_s=work_s, wall_s=wall_s)  # pyright: ignore[reportArgumentType]


def test_runs_that_are_done_correct_the_model():
    """It expected 10 s for them and they took 30: what is left, 8 s by the model, takes 24, on two processes 12."""
    runs = [
        _run("done", 4.0, 12.0),
        _run("done", 6.0, 18.0),
        _run("failed", 5.0, 1.0),
        _run("waiting", 3.0),
        _run("waiting", 5.0),
    ]
    found = estimate(runs, particles=1000, jobs=2, batch=1, keep_runs=False)
    assert (found.runs, found.measured) == (2, True)
    assert found.time_s == pytest.approx(12.0)
    assert "by the runs that are done" in found.sentence
    unknown = estimate(runs[2:], particles=1000, jobs=2, batch=1, keep_runs=False)
    assert unknown.time_s == pytest.approx(4.0)
    assert "by a model" in unknown.sentence


def test_memory_counts_processes_and_disk_what_is_kept():
    runs = [_run("waiting", 1.0) for _ in range(10)]
    one, four = (estimate(runs, 10_000, jobs, 1, keep_runs=False) for jobs in (1, 4))
    assert four.memory_bytes == pytest.approx(4 * one.memory_bytes)
    # More processes than runs are not started.
    assert estimate(runs, 10_000, 40, 1, keep_runs=False).memory_bytes == pytest.approx(10 * one.memory_bytes)
    kept = estimate(runs, 10_000, 1, 1, keep_runs=True)
    # particles.csv of the paper's run: 14,527 lines in 1.1 MB.
    assert kept.disk_bytes - one.disk_bytes == pytest.approx(10 * 10_000 * 75)


def test_a_disk_that_is_too_small_is_told_before_the_first_run():
    wanted = Estimate(runs=1, time_s=1.0, measured=False, memory_bytes=1.0, disk_bytes=5e6)
    require_disk(wanted, 6e6, "out")
    with pytest.raises(InputError, match="out: 4 MB are free there, the results need 5 MB"):
        require_disk(wanted, 4e6, "out")


@pytest.mark.parametrize(("time_s", "words"), [(7.4, "7 s"), (119, "119 s"), (700, "12 min"), (9000, "2.5 h")])
def test_times_are_said_as_people_say_them(time_s, words):
    assert in_words(time_s) == words
