"""Each case in an earlier work tree of the project and in this one, a line each.

    git worktree add ../before ec1d030
    python -m benchmarks.before_after ../before [--only seeds_of_coarse_particles ...]

A case is a script of this folder. It runs in the root of a tree with that tree's packages, uses only what both trees
have, and ends by printing ``{"line": what it saw, "sound": true or false}`` as JSON. The earlier tree is judged by
nothing: a case that was sound before is printed as such, and guards what was right.
"""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Annotated

from benchmarks.against import HERE
from benchmarks.table import Row, leave, one_of, run_benchmark

CASES = {path.stem: path for path in sorted(Path(__file__).parent.glob("[!_]*.py"))}


def main(before: Path, only: Annotated[list[str] | None, one_of(CASES)] = None) -> list[Row]:
    rows = []
    for name in only or CASES:
        print(name)
        then, now = (run_case(CASES[name], tree) for tree in (before.resolve(), HERE))
        for tree, (line, sound) in (("before", then), ("now", now)):
            print(f"  {tree:<7} {'sound' if sound else 'WRONG':<6} {line}", flush=True)
        rows.append(Row(name, float(now[1]), "", 1, 1))
    return rows


def run_case(case: Path, tree: Path) -> tuple[str, bool]:
    """Return what a case saw in a tree, and whether that is sound; a case that fails to run is not."""
    ended = subprocess.run(
        # -P: the case's folder must not stand before the tree's packages.
        [sys.executable, "-P", str(case)],
        cwd=tree,
        env=os.environ | {"PYTHONPATH": str(tree)},
        capture_output=True,
        text=True,
        check=False,
    )
    last = (ended.stdout.splitlines() or [""])[-1]
    if ended.returncode or not last.startswith("{"):
        reason = (ended.stderr.strip().splitlines() or ["no output"])[-1]
        return f"exit code {ended.returncode}: {reason}", False
    answer = json.loads(last)
    return answer["line"], answer["sound"]


if __name__ == "__main__":
    run_benchmark(main, leave)
