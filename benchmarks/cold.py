"""How much of the processor's time each part of a run of the shipped trial takes, in seconds, as JSON.

    python -m benchmarks.cold RUN

The time of a part is that of the thread that runs it, without the parts inside it; frames are computed on one thread.
The rest is imports, other threads and child processes. It is the first run of a newcomer if the caches of Warp and
matplotlib are empty, as ``benchmarks.speed_bars`` makes them.
"""

import json
import resource
import sys
import time
from typing import Any

from sealtwin.cli.app import main as sealtwin
from tests.support.paths import FIXTURE

TRIAL = FIXTURE / "trial.toml"
FRAMES, COMPILE, REST = "frames", "compile", "imports and the rest"


def main(run: str) -> None:
    spent = _clocked_parts()
    options = ["--device", "cpu", "--threads", "1", "--quiet", "--out", run]
    sys.argv = ["sealtwin", "run", str(TRIAL), *options]
    try:
        sealtwin()
    except SystemExit as end:
        if end.code:
            raise
    spent[REST] = _processor_s() - sum(spent.values())
    print(json.dumps(spent))


def _clocked_parts() -> dict[str, float]:
    """Clock the parts of runs in this process: seconds by part, each without the parts inside it, which grow later."""
    import warp as wp

    import simulate.run
    from sealtwin.trial import digitise_stage, simulate_stage, validate_stage
    from simulate.injection import Injection

    spent: dict[str, float] = {}
    inside_s: list[float] = []

    def clock(owner: Any, name: str, part: str) -> None:
        work = getattr(owner, name)
        spent.setdefault(part, 0.0)

        def by_the_clock(*given: Any, **options: Any) -> Any:
            began_s = time.thread_time()
            inside_s.append(0.0)
            try:
                return work(*given, **options)
            finally:
                took_s = time.thread_time() - began_s
                spent[part] += took_s - inside_s.pop()
                if inside_s:
                    inside_s[-1] += took_s

        setattr(owner, name, by_the_clock)

    clock(simulate.run, "prepare", "walls and particles")
    # A module compiles as its first kernel is launched, wherever that is.
    clock(wp.Module, "load", COMPILE)
    clock(Injection, "advance", FRAMES)
    for stage in (digitise_stage, simulate_stage, validate_stage):
        clock(stage, "bring_up_to_date", stage.__name__.rpartition(".")[2])
    return spent


def _processor_s() -> float:
    used = [resource.getrusage(of) for of in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in used)


if __name__ == "__main__":
    main(sys.argv[1])
