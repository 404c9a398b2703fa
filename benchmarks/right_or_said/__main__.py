"""Hold findings of an outside review against this code, or against another checkout: is each right, or said?

    python -m benchmarks.right_or_said [--code CHECKOUT] [--only NAME ...]

Each script beside this one makes one finding, with the packages of the checkout, and prints a line: "right: ...",
"said: ..." or "silent: ...". A crash counts as silent.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Annotated

from typer import Option

from benchmarks.table import Row, run_benchmark

HERE = Path(__file__).resolve().parent
FINDINGS = tuple(sorted(path.stem for path in HERE.glob("[!_]*.py")))


def answer(finding: str, code: Path) -> str:
    """Return the line of a finding's script, which ran with the packages in ``code``."""
    with tempfile.TemporaryDirectory() as folder:
        script = [sys.executable, HERE / f"{finding}.py"]
        environment = {**os.environ, "PYTHONPATH": str(code.resolve())}
        run = subprocess.run(script, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    lines = (run.stdout if run.returncode == 0 else run.stderr).strip().splitlines() or [""]
    return lines[-1] if run.returncode == 0 else f"silent: {lines[-1]}"


def main(
    code: Annotated[Path, Option(help="checkout whose packages are tried")] = HERE.parents[1],
    only: Annotated[list[str] | None, Option(help="name of a finding; may be given again; default: all")] = None,
) -> list[Row]:
    silent = 0
    for finding in only or FINDINGS:
        line = answer(finding, code)
        silent += not line.startswith(("right:", "said:"))
        print(f"{finding}: {line}", flush=True)
    return [Row("findings that are silent", silent, "", 0, 0)]


if __name__ == "__main__":
    run_benchmark(main)
