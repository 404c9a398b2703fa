"""Independent tasks on worker processes of this machine, or on the workers of a Dask cluster."""

import asyncio
import ipaddress
import logging
import os
import signal
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from importlib.metadata import version
from multiprocessing import resource_tracker
from typing import Any, TypeVar
from urllib.parse import urlsplit

import psutil

from sealtwin.core.errors import InputError

CONNECT_S = 20.0  # A scheduler answers at once, and workers that were started along with it connect within seconds
ALLOWED_FAILURES = 2  # Killed workers after which a task is tried once more; the next one makes it fail
KILLED = f"{ALLOWED_FAILURES + 1} worker processes were killed while they computed it, most likely as memory ran out"
LOCAL_CONFIG = {
    "distributed.scheduler.allowed-failures": ALLOWED_FAILURES,
    # A killed worker counts against the one task that it computed, and against none that waited for it.
    "distributed.scheduler.worker-saturation": 1.0,
    "distributed.scheduler.http.routes": [],
    "distributed.worker.http.routes": [],
    # Sampling stacks a hundred times a second costs a tenth of short runs.
    "distributed.worker.profile.enabled": False,
}
CONFIG = {"distributed.admin.large-graph-warning-threshold": "1GB"}

Item = TypeVar("Item")
Result = TypeVar("Result")


@dataclass(frozen=True)
class Lost:
    """The outcome of a task whose workers were killed, or could not start it."""

    reason: str


def cores() -> int:
    """The number of processor cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def run_tasks(
    function: Callable[..., Result],
    tasks: Iterable[tuple[Item, tuple[Any, ...]]],
    processes: int,
    scheduler: str | None = None,
    numbers: Callable[[], Any] = dict,
) -> Iterator[tuple[Item, Result | Lost]]:
    """Call ``function`` for every task and yield results as they finish.

    Args:
        function: A function of a module, which a worker imports. It should catch its own exceptions.
        tasks: An item, which comes back beside its result, and the arguments of its call. Tasks are read only as fast
            as workers take them.
        processes: Worker processes on this machine, one core each, which end with this process, however that ends; 0
            computes in the calling process.
        scheduler: Address of a Dask scheduler whose workers are used instead.
        numbers: A function of a module that returns the stage numbers of the machine it is called on: those of each
            worker must be those of this process.

    Raises:
        InputError: The scheduler does not answer, has no worker, or disappears; it is refused as unencrypted; or a
            worker has another version or other stage numbers.
    """
    if scheduler is None and processes == 0:
        yield from ((item, function(*arguments)) for item, arguments in tasks)
        return
    import dask.config
    from distributed import as_completed

    reached = _local_client(processes) if scheduler is None else _connected(scheduler, numbers)
    with dask.config.set(CONFIG if scheduler else CONFIG | LOCAL_CONFIG), reached as client:
        waiting = iter(tasks)
        at_work: dict[Any, Item] = {}
        finished: Any = as_completed()

        def submit() -> None:
            # One task per worker here, so that only what a killed worker computed is blamed. A network's delay is
            # bridged by a second one.
            wanted = processes if scheduler is None else 2 * max(1, sum(client.nthreads().values()))
            while len(at_work) < wanted and (task := next(waiting, None)) is not None:
                item, arguments = task
                future = client.submit(function, *arguments, pure=False)
                at_work[future] = item
                finished.add(future)

        submit()
        while at_work:
            future = next(finished)
            if future.status in {"pending", "lost"}:
                # Its worker was killed while it still held the result: it is computed again.
                finished.add(future)
                continue
            item = at_work.pop(future)
            outcome = _outcome(future, scheduler)
            # Before the caller writes the result to disk: the worker must not wait for that.
            submit()
            yield item, outcome


def _outcome(future: Any, scheduler: str | None) -> Any:
    if future.status == "finished":
        return future.result()
    if future.status == "error":
        kind = type(fault := future.exception()).__name__
        return Lost(KILLED if kind == "KilledWorker" else f"a worker could not compute it ({kind}: {fault})")
    raise InputError(
        f"{scheduler or 'local cluster'}: the connection to the scheduler was lost; the same command computes "
        "what is left."
    )


@contextmanager
def _local_client(processes: int) -> Iterator[Any]:
    """Workers on the loopback interface with credentials of their own: whoever reaches a scheduler can run code."""
    from distributed import Client, LocalCluster
    from distributed.security import Security

    with _children_ignore_interrupts():
        cluster: Any = LocalCluster(
            n_workers=processes,
            threads_per_worker=1,
            host="tls://127.0.0.1",
            dashboard_address=None,  # pyright: ignore[reportArgumentType]
            # Without a port of its own two sweeps would ask for the same one.
            scheduler_kwargs={"dashboard": False, "dashboard_address": "127.0.0.1:0"},
            security=Security.temporary(),
            # The operating system lends memory; a share of it per process is no bound of a run.
            memory_limit=0,
            silence_logs=logging.CRITICAL,
        )
    # The cluster resets its loggers as it closes, and they would then report connections that an interrupt cut.
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    with cluster, Client(cluster) as client:
        try:
            yield client
        except BaseException:
            # Ctrl-C too: a worker in the middle of a run would be waited for.
            for nanny in cluster.workers.values():
                # None while a killed worker is not yet started again; psutil would take that for this process.
                if (pid := nanny.pid) is not None:
                    with suppress(psutil.NoSuchProcess):
                        psutil.Process(pid).terminate()
            raise


@contextmanager
def _children_ignore_interrupts() -> Iterator[None]:
    """Block Ctrl-C in threads and processes that are started within, and in those that they start.

    It reaches every process of a terminal; here it is the parent's alone, which then ends its workers.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    # The first process that multiprocessing starts also starts this one, and unblocks Ctrl-C for it.
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def _connected(address: str, numbers: Callable[[], Any]) -> Iterator[Any]:
    from distributed import Client

    _refuse_unencrypted(address)
    try:
        # Dask itself waits without end for the first word of a server that accepts and says nothing.
        asyncio.run(asyncio.wait_for(_greet(address), CONNECT_S))
        client: Any = Client(address, timeout=CONNECT_S)
    except (OSError, ValueError, TypeError, MemoryError, TimeoutError) as fault:
        # A server of another kind, as a dashboard, answers what reads as the length of a huge message.
        reason = str(fault) or f"silent for {CONNECT_S:g} s"
        raise InputError(
            f"--scheduler {address}: no scheduler answers there ({reason}). 'dask scheduler' starts one; for tls:// "
            "Dask's configuration (distributed.comm.tls) names the credentials."
        ) from None
    with client:
        _require_workers(client, address, numbers)
        yield client


async def _greet(address: str) -> None:
    """Connect, exchange the first messages and disconnect."""
    from distributed.comm.core import connect
    from distributed.security import Security

    comm: Any = await connect(address, timeout=CONNECT_S, **Security().get_connection_args("client"))
    await comm.close()


def _refuse_unencrypted(address: str) -> None:
    """Raises InputError for an unencrypted connection to another machine that Dask's configuration does not allow."""
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
        f"--scheduler {address}: the connection is not encrypted, and whoever can reach such a scheduler can run code. "
        "Give it TLS (tls://, distributed.comm.tls in Dask's configuration), or on a network that you trust set "
        "DASK_DISTRIBUTED__COMM__REQUIRE_ENCRYPTION=False."
    )


def _require_workers(client: Any, address: str, numbers: Callable[[], Any]) -> None:
    try:
        client.wait_for_workers(1, timeout=CONNECT_S)
    except TimeoutError:
        raise InputError(
            f"--scheduler {address}: the scheduler has no worker. 'dask worker {address}' starts one."
        ) from None
    # The second is asked for once the first is known to be the same. What a worker raised comes over the wire as
    # whatever it was there.
    for what, ask in (("sealtwin", partial(version, "sealtwin")), ("stage numbers", numbers)):
        own, answers = ask(), client.run(ask, on_error="return")
        if other := {worker: theirs for worker, theirs in answers.items() if theirs != own}:
            worker, theirs = next(iter(other.items()))
            raise InputError(
                f"--scheduler {address}: {worker} has {what} {theirs}, here is {own}. Install one version everywhere."
            )
