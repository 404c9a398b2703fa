"""Run independent tasks on worker processes of this machine, or on the workers of a Dask cluster."""

import ipaddress
import multiprocessing
import os
import pickle
import signal
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import (
    FIRST_COMPLETED,
    CancelledError,
    Executor,
    Future,
    ThreadPoolExecutor,
    wait,
)
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from importlib.metadata import version
from multiprocessing import resource_tracker
from multiprocessing.process import BaseProcess
from queue import Empty, SimpleQueue
from threading import Lock, Thread
from typing import Any, TypeVar
from urllib.parse import urlsplit

from sealtwin.core.errors import InputError

TRIES = 3  # Number of workers that a task may kill before it counts as lost
KILLED = f"{TRIES} worker processes were killed during this task, probably because memory ran out"
NOT_STARTED = "no worker process could start; in a script, call sealtwin only below the line: if __name__ == '__main__'"
WORKER_ENVIRONMENT = {
    **dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1"),
    # The C library then returns freed memory to the system.
    "MALLOC_TRIM_THRESHOLD_": "65536",
}
STARTING = Lock()  # Lock that is held while the environment of a worker is set in this process
CONNECT_S = 20.0  # Longest wait for a scheduler and its first worker, both of which usually connect within seconds

Item = TypeVar("Item")
Result = TypeVar("Result")
Workers = tuple[Executor, Callable[[], int]]  # Executor, and a function that returns how many tasks it accepts at once


@dataclass(frozen=True)
class Lost:
    """Result of a task that failed: it raised an exception, its workers were killed, or no worker could start."""

    reason: str


def cores() -> int:
    """Return the number of processor cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def run_tasks(
    function: Callable[..., Result],
    tasks: Iterable[tuple[Item, tuple[Any, ...]]],
    processes: int,
    scheduler: str | None = None,
    numbers: Callable[[], Any] = dict,
) -> Iterator[tuple[Item, Result | Lost]]:
    """Call ``function`` for every task, and yield each result as soon as it is available.

    Args:
        function: Function at the top level of a module, so that workers can import it. It should catch its exceptions.
        tasks: Pairs of an item, which is returned with the result, and the arguments of the call. The next pair is
            read only when a worker is free.
        processes: Number of worker processes on this machine, one core each. They end with this process, even if it is
            killed. 0 computes in this process.
        scheduler: Address of a Dask scheduler, whose workers are used instead of local processes.
        numbers: Function at the top level of a module that returns the stage numbers of the machine on which it runs.
            Workers must have the same numbers as this process.

    Raises:
        InputError: The scheduler does not respond, lacks workers, disappears, or is not encrypted; Dask is not
            installed; a worker has another version or other stage numbers.
    """
    if scheduler is None and processes == 0:
        yield from ((item, function(*arguments)) for item, arguments in tasks)
        return
    waiting, at_work = iter(tasks), dict[Future[Result], Item]()
    with _processes(processes) if scheduler is None else _cluster(scheduler, numbers) as (executor, wanted):

        def submit() -> None:
            while len(at_work) < wanted() and (task := next(waiting, None)) is not None:
                item, arguments = task
                at_work[executor.submit(function, *arguments)] = item

        submit()
        while at_work:
            for future in wait(at_work, return_when=FIRST_COMPLETED).done:
                item, outcome = at_work.pop(future), _outcome(future, scheduler)
                # Before the yield: a worker must not wait until the caller has written the result to disk.
                submit()
                yield item, outcome


def _outcome(future: Future[Result], scheduler: str | None) -> Result | Lost:
    try:
        return future.result()
    except CancelledError:
        raise InputError(
            f"{scheduler}: the connection to the scheduler was lost. Repeat the command to compute the rest."
        ) from None
    except Exception as fault:
        return _lost(fault)


def _lost(fault: Exception) -> Lost:
    return Lost(f"a worker could not compute it ({type(fault).__name__}: {fault})")


class LocalExecutor(ThreadPoolExecutor):
    """Executor with one worker process per thread. If a process is killed, only its current task is affected.

    ProcessPoolExecutor would wait forever for a process that was killed while sending its result.
    """

    def __init__(self, processes: int) -> None:
        super().__init__(processes, initializer=_block_interrupts)
        self._idle = SimpleQueue[tuple[BaseProcess, Any]]()
        self._context = multiprocessing.get_context("spawn")
        # The system closes this pipe when this process ends, even by kill -9.
        self._parent, self._open = self._context.Pipe(duplex=False)

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Call a function in a worker process. The result is ``Lost`` if ``fn`` raises or ``TRIES`` workers die."""
        return super().submit(self._call, partial(fn, *args, **kwargs))

    def kill(self) -> None:
        """End the worker processes at once, even during a task."""
        self._open.close()

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        super().shutdown(wait, cancel_futures=cancel_futures)
        while not self._idle.empty():
            process, connection = self._idle.get()
            connection.close()
            process.join()

    def _call(self, task: Callable[[], Any]) -> Any:
        message, reason = pickle.dumps(task), NOT_STARTED
        for _ in range(TRIES):
            if self._open.closed:
                break
            process, connection = self._worker()
            with ExitStack() as ending, suppress(EOFError, OSError):
                ending.callback(process.join)
                ending.callback(connection.close)
                connection.send_bytes(message)
                connection.recv()
                reason = KILLED
                answer = connection.recv()
                ending.pop_all()
                self._idle.put((process, connection))
                return answer
        return Lost(reason)

    def _worker(self) -> tuple[BaseProcess, Any]:
        with suppress(Empty):
            return self._idle.get_nowait()
        ours, theirs = self._context.Pipe()
        # At exit, the interpreter ends a daemon process; it would wait for any other process.
        process = self._context.Process(target=_work, args=(theirs, self._parent), daemon=True)
        with STARTING, _worker_environment():
            process.start()
        # While this end is open here, the end of the process is not noticed.
        theirs.close()
        return process, ours


@contextmanager
def _processes(count: int) -> Iterator[Workers]:
    """Yield an executor with ``count`` processes, and a function that returns how many tasks it accepts at once."""
    with LocalExecutor(count) as executor:
        try:
            yield executor, lambda: count
        except BaseException:
            # Without this, shutdown would wait for the current runs after Ctrl-C.
            executor.kill()
            raise


def _block_interrupts() -> None:
    """Block Ctrl-C in this thread and in the processes that it starts.

    Ctrl-C reaches every process of a terminal. Only the parent process handles it, and ends its workers.
    """
    if hasattr(signal, "pthread_sigmask"):
        # multiprocessing would start this tracker with the first process, and would then unblock Ctrl-C.
        resource_tracker.ensure_running()
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})


@contextmanager
def _worker_environment() -> Iterator[None]:
    """Set the environment variables of a worker during the block. Variables that the user has set are not changed."""
    absent = {name: value for name, value in WORKER_ENVIRONMENT.items() if name not in os.environ}
    os.environ.update(absent)
    try:
        yield
    finally:
        for name in absent:
            del os.environ[name]


def _work(connection: Any, parent: Any) -> None:
    """Run tasks from ``connection`` until it is closed. End at once, even during a task, if ``parent`` is closed."""
    Thread(target=_end_with, args=(parent,), daemon=True).start()
    with suppress(EOFError, OSError):
        while True:
            message = connection.recv_bytes()
            connection.send("begun")
            try:
                connection.send(pickle.loads(message)())
            except Exception as fault:
                connection.send(_lost(fault))


def _end_with(parent: Any) -> None:
    with suppress(EOFError, OSError):
        parent.recv_bytes()
    os._exit(1)


class ClusterExecutor(Executor):
    """Executor for the workers of a Dask client.

    Dask's own executor would wait forever for a result that is lost in transit.
    """

    def __init__(self, client: Any) -> None:
        self._client = client

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Call a function in a Dask worker. The future is cancelled if the connection to the scheduler is lost."""
        future = Future[Any]()

        def settle(task: Any) -> None:
            try:
                future.set_result(task.result())
            except Exception as fault:
                future.set_exception(fault if task.status == "error" else CancelledError())

        self._client.submit(fn, *args, **kwargs, pure=False).add_done_callback(settle)
        return future


@contextmanager
def _cluster(address: str, numbers: Callable[[], Any]) -> Iterator[Workers]:
    """Yield an executor for a Dask scheduler, and a function that returns how many tasks it accepts at once."""
    try:
        import asyncio

        import dask.config
        from distributed import Client
    except ModuleNotFoundError as missing:
        raise InputError(
            f"--scheduler {address}: Dask is not installed ({missing}); 'pip install sealtwin[cluster]' installs it."
        ) from None
    _refuse_unencrypted(address)
    try:
        # Dask itself would wait forever for a server that accepts the connection and sends nothing.
        asyncio.run(asyncio.wait_for(_greet(address), CONNECT_S))
        client: Any = Client(address, timeout=CONNECT_S)
    except (OSError, ValueError, TypeError, MemoryError, TimeoutError) as fault:
        # Dask reads the response of another kind of server, such as a dashboard, as the length of a huge message.
        reason = str(fault) or f"it sent nothing for {CONNECT_S:g} s"
        raise InputError(
            f"--scheduler {address}: no scheduler responds at this address ({reason}). 'dask scheduler' starts one. "
            "For tls://, set the credentials in Dask's configuration (distributed.comm.tls)."
        ) from None
    # Tasks contain the records of a sample; Dask would warn above 10 MB.
    with dask.config.set({"distributed.admin.large-graph-warning-threshold": "1GB"}), client:
        _require_workers(client, address, numbers)
        # A second task per core hides the delay of the network.
        yield ClusterExecutor(client), lambda: 2 * max(1, sum(client.nthreads().values()))


async def _greet(address: str) -> None:
    """Connect to a scheduler, exchange the first messages, and disconnect."""
    from distributed.comm.core import connect
    from distributed.security import Security

    comm: Any = await connect(address, timeout=CONNECT_S, **Security().get_connection_args("client"))
    await comm.close()


def _refuse_unencrypted(address: str) -> None:
    """Raise InputError for an unencrypted connection to another machine, unless Dask's configuration allows it."""
    import dask.config

    parts = urlsplit(address if "://" in address else f"tcp://{address}")
    host = parts.hostname or ""
    try:
        local = host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:
        local = False
    if local or parts.scheme in {"tls", "wss"} or dask.config.get("distributed.comm.require-encryption") is False:
        return
    raise InputError(
        f"--scheduler {address}: the connection is not encrypted, and anyone who can reach the scheduler can run code. "
        "Use TLS (tls://, with distributed.comm.tls in Dask's configuration). On a network that you trust, you can "
        "allow it with DASK_DISTRIBUTED__COMM__REQUIRE_ENCRYPTION=False."
    )


def _require_workers(client: Any, address: str, numbers: Callable[[], Any]) -> None:
    try:
        client.wait_for_workers(1, timeout=CONNECT_S)
    except TimeoutError:
        raise InputError(
            f"--scheduler {address}: the scheduler has no worker. 'dask worker {address}' starts one."
        ) from None
    # Stage numbers are compared only if the versions are equal. on_error="return" returns a worker's exception.
    for name, function in (("sealtwin", partial(version, "sealtwin")), ("stage numbers", numbers)):
        value, answers = function(), client.run(function, on_error="return")
        if other := {worker: theirs for worker, theirs in answers.items() if theirs != value}:
            worker, theirs = next(iter(other.items()))
            raise InputError(
                f"--scheduler {address}: {worker} has {name} {theirs}, but this machine has {value}. Install the same "
                "version everywhere."
            )
