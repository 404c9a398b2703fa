"""Tasks on worker processes: their results, lost tasks, and refused schedulers."""

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import Future
from multiprocessing.connection import Connection
from typing import Any

import psutil
import pytest

from sealtwin.core.errors import InputError, present
from sealtwin.core.workers import ClusterExecutor, Lost, _outcome, run_tasks


def _square(number) -> Any:
    if number == 3:
        return _Unreadable()
    if number == 4:
        raise ValueError("on purpose")
    if number == 5:
        Connection._send = _half_of_it
    time.sleep(0.05)
    return number**2, os.getpid(), os.environ["OMP_NUM_THREADS"]


class _Unreadable:
    def __reduce__(self):
        return _raised_here, ()


def _raised_here():
    raise OSError("on purpose")


def _half_of_it(self, message, *_):
    os.write(self.fileno(), bytes(message)[:2])
    os.kill(os.getpid(), signal.SIGKILL)


def test_only_tasks_that_raise_or_kill_their_worker_are_lost():
    """One task raises, one is killed in the middle of its answer, and one returns a result that cannot be read."""
    outcomes = dict(run_tasks(_square, ((number, (number,)) for number in range(2, 7)), 2))
    lost = {number: outcome.reason for number, outcome in outcomes.items() if isinstance(outcome, Lost)}
    assert sorted(lost) == [3, 4, 5]
    assert "3 worker processes were killed" in lost[3] == lost[5]
    assert "ValueError: on purpose" in lost[4]
    squares = {number: outcome for number, outcome in outcomes.items() if not isinstance(outcome, Lost)}
    assert {number: square for number, (square, *_) in squares.items()} == {number: number**2 for number in squares}
    _, workers, threads = (set(column) for column in zip(*squares.values(), strict=True))
    assert os.getpid() not in workers
    assert threads == {"1"}, "one core each"
    assert multiprocessing.active_children() == [], "none waits for a next task, which would never come"


def _noted(folder, number):
    (folder / f"half.{number}").write_text(str(os.getpid()))
    (folder / f"half.{number}").rename(folder / str(number))
    return number


def _killed(folder):
    """Kill every process that left its number, this one last; once."""
    notes = sorted(folder.glob("[12]"), key=lambda note: note.read_text() == str(os.getpid()))
    if not (folder / "killed").exists():
        (folder / "killed").touch()
        for note in notes:
            os.kill(int(note.read_text()), signal.SIGKILL)


def test_a_result_lost_with_its_worker_is_computed_again(tmp_path):
    """A later task kills the worker after it finished and before its result is fetched."""

    def tasks():
        yield "first", (_noted, tmp_path, 1)
        yield "second", (_noted, tmp_path, 2)
        while not all((tmp_path / number).exists() for number in "12"):
            time.sleep(0.01)
        yield "killer", (_killed, tmp_path)

    results = {}
    for item, outcome in run_tasks(_called, tasks(), 2):
        results[item] = outcome
        if item != "killer":
            time.sleep(0.5)  # As if the result took long to write; meanwhile both workers are killed.
    assert results == {"first": 1, "second": 2, "killer": None}


def _called(function, *arguments):
    return function(*arguments)


def test_local_workers_open_no_port_and_can_be_stopped_during_a_task():
    """A process that reaches such a port could run code."""

    def tasks():
        yield 0, (0.0,)
        yield 1, (600.0,)

    results = run_tasks(_slept, tasks(), 2)
    _, listening = next(results)
    assert listening == set()
    began = time.monotonic()
    results.close()
    assert time.monotonic() - began < 30


def _slept(seconds):
    time.sleep(seconds)
    parent = present(psutil.Process().parent(), "parent")
    sockets = (socket for process in (parent, *parent.children()) for socket in process.net_connections())
    return {one.laddr for one in sockets if one.status == "LISTEN"}


def test_unread_results_do_not_prevent_the_interpreter_from_exiting():
    """A printed traceback keeps the results alive, and the interpreter once waited for idle workers without end."""
    script = "from sealtwin.core.workers import run_tasks\n"
    script += "results = run_tasks(pow, [(0, (1, 1)), (1, (1, 1)), (2, (1, 1))], 2)\nnext(results)"
    subprocess.run([sys.executable, "-c", script], timeout=60, check=True)


class _LostTask:
    """A task of Dask's, and the client that was given it."""

    status = "finished"

    def submit(self, *_, **__):
        return self

    def result(self):
        raise OSError("Stream is closed")

    def add_done_callback(self, called):
        called(self)


def test_a_lost_or_cancelled_result_is_reported_as_a_lost_connection():
    """Dask never ends a task whose result is lost in transfer, and cancels tasks that it has taken.

    Both were observed by killing a scheduler, once while it sent a result of 700 MB.
    """
    cancelled = Future()
    cancelled.cancel()
    for task in (ClusterExecutor(_LostTask()).submit(pow, 1, 1), cancelled):
        with pytest.raises(InputError, match=r"tcp://127\.0\.0\.1:9: the connection to the scheduler was lost"):
            _outcome(task, "tcp://127.0.0.1:9")


def test_the_error_for_a_scheduler_without_dask_names_the_extra_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match=r"pip install sealtwin\[cluster\]"):
        next(run_tasks(pow, [(0, (1, 1))], 0, "tls://node7:8786"))


@pytest.mark.parametrize(
    ("fault", "address"),
    [
        *(("the connection is not encrypted", address) for address in ("tcp://10.1.2.3:8786", "node7:8786")),
        ("no scheduler responds", "localhost:9"),
    ],
)
def test_an_unencrypted_or_unreachable_scheduler_is_refused(fault, address, monkeypatch):
    monkeypatch.setattr("sealtwin.core.workers.CONNECT_S", 0.2)
    with pytest.raises(InputError, match=f"--scheduler {address}: {fault}"):
        next(run_tasks(pow, [(0, (1, 1))], 0, address))
