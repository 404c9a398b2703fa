"""Runs of a lab show their progress while they are computed, not only when they end."""

import time
from dataclasses import replace
from typing import Any

from sealtwin.core.progress import Progress
from sealtwin.study import runner
from sealtwin.study.study_folder import StudyRun


def test_progress_goes_on_during_a_run_and_is_of_all_runs(monkeypatch):
    """Once a lab's first run of eleven minutes showed "Running" and nothing else."""
    monkeypatch.setattr(runner, "SHOWN_EVERY_S", 0.02)
    steps, began_s = list[tuple[float, int]](), time.monotonic()

    class Steps(Progress):
        def advance(self, done, note=""):
            steps.append((time.monotonic() - began_s, done))

    runs = [StudyRun(number, f"{number}", {}, {}, "", f"{number}", 10.0) for number in (1, 2)]
    work: Any = (time.sleep, lambda _: (0.3,), lambda run, _: replace(run, state="done", wall_s=0.3))
    monkeypatch.setattr(
        runner, "run_tasks", lambda function, tasks, *_: ((run, [function(*more)]) for run, more in tasks)
    )
    runner.launch(runs, runner.StudyOptions("cpu", 0), "Running", Steps(), work, left_s=lambda _: 0.1)
    within = [done for at_s, done in steps if at_s < 0.28]
    assert len(within) > 3
    assert 0 < within[-1] < 1000, "of 2,000 hundredths of a second"
    assert [done for _, done in steps] == sorted(done for _, done in steps)
    assert steps[-1][1] == 2000
