"""Run a piece of a benchmark in a process of its own, in any work tree of the project; name the processor."""

import json
import os
import platform
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).parent.parent
ONE_CORE = {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL")}

CHILD = """
import json, sys, time
from pathlib import Path
scratch = Path(sys.argv[1])
{body}
print(json.dumps([took_s, result]))
"""


def turn(body: str, tree: Path, scratch: Path) -> tuple[float, float]:
    """Seconds of the processor, and the result that is compared."""
    child = subprocess.run(
        [sys.executable, "-c", CHILD.format(body=body), str(scratch)],
        cwd=tree,
        env={**os.environ, **ONE_CORE, "PYTHONPATH": str(tree)},
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    took_s, result = json.loads(child.stdout.splitlines()[-1])
    return took_s, result


def processor() -> str:
    info = Path("/proc/cpuinfo")
    models = (
        [line.split(":")[1].strip() for line in info.read_text().splitlines() if line.startswith("model name")]
        if info.exists()
        else []
    )
    return models[0] if models else platform.processor()


def flags() -> list[str]:
    """What the processor can do, as Linux lists it; none on other systems."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8").splitlines() if info.exists() else []
    return next((line.split() for line in lines if line.startswith("flags")), [])
