"""A sweep on the machines of a cluster, through Dask.distributed. They get what they need by value and hold nothing."""

from collections.abc import Callable
from contextlib import suppress
from typing import Any

from sealtwin.errors import InputError
from sealtwin.progress import Progress
from sealtwin.study.bench import Failure, Sealing, seal
from sealtwin.study.ledger import Claim, Ledger
from sealtwin.study.workers import LOOK_EVERY_S, Task, bench_of, keep, trial_of

CONNECT_S = 20.0
"""A scheduler that is there answers at once, and workers that were started along with it come in some seconds."""
AHEAD = 2
"""Claims for each thread of the cluster: one that runs, and one that is there when it ends."""


def run_there(task: Task, address: str, look: Callable[[Ledger], None]) -> None:
    """Compute all that waits on the workers of the scheduler at ``address``, and calls ``look`` now and then.

    Only this process touches the folder. Raises InputError where the scheduler cannot be reached, has no worker, or a
    worker has another version of sealtwin.
    """
    try:
        from distributed import Client, wait  # pyright: ignore[reportMissingImports]
    except ImportError:
        raise InputError("--dask needs Dask: pip install 'sealtwin[cluster]', here and on every worker.") from None
    try:
        client: Any = Client(address, timeout=CONNECT_S)
    except (OSError, ValueError) as fault:
        raise InputError(
            f"--dask {address}: no scheduler answers there ({fault}). 'dask scheduler' starts one."
        ) from None
    with client, Ledger(task.folder) as ledger:
        _require_workers(client, address)
        at_work: dict[Any, Claim] = {}
        while True:
            # Workers come and go.
            wanted = AHEAD * max(1, sum(client.nthreads().values()))
            while len(at_work) < wanted and (claim := ledger.claim(task.batch)) is not None:
                at_work[_submit(client, task, claim)] = claim
            if not at_work:
                break
            with suppress(TimeoutError):
                wait(list(at_work), timeout=LOOK_EVERY_S, return_when="FIRST_COMPLETED")
            for future in [future for future in at_work if future.done()]:
                claim = at_work.pop(future)
                keep(task.folder, ledger, claim, _outcomes(future, claim))
            look(ledger)
        look(ledger)


def _submit(client: Any, task: Task, claim: Claim) -> Any:
    return client.submit(
        seal,
        bench_of(task.folder, claim.entries[0]),
        [trial_of(entry) for entry in claim.entries],
        device=task.device,
        keep_runs=task.keep_runs,
        progress=Progress(),
        key=f"sealtwin-{claim.token}",
        pure=False,
    )


def _outcomes(future: Any, claim: Claim) -> list[Sealing | Failure]:
    """What ``seal`` gave; it raises nothing itself, so that any error here is of the cluster."""
    if future.status == "finished":
        return future.result()
    reason = f"the cluster lost it: {future.exception()}. --retry gives it another try."
    return [Failure(reason, 0.0, None) for _ in claim.entries]


def _require_workers(client: Any, address: str) -> None:
    from importlib.metadata import version

    try:
        client.wait_for_workers(1, timeout=CONNECT_S)
    except TimeoutError:
        raise InputError(
            f"--dask {address}: the scheduler has no worker. 'dask worker {address}' starts one."
        ) from None
    try:
        found = client.run(version, "sealtwin")
    except Exception as fault:
        # What a worker raised comes over the wire as whatever it was there.
        raise InputError(f"--dask {address}: a worker has no sealtwin ({fault}). Install it on each.") from None
    own = version("sealtwin")
    if other := {worker: theirs for worker, theirs in found.items() if theirs != own}:
        worker, theirs = next(iter(other.items()))
        raise InputError(f"--dask {address}: {worker} has sealtwin {theirs}, here is {own}. Install the same on each.")
