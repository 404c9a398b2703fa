"""Every benchmark in turn, and what each printed, in reports/results.json.

    python -m benchmarks.results [--only NAME]...     (make results)

A benchmark is run again if a module that it imports, at any depth, or its data changed since, or if it failed; a run
that is stopped, or killed, goes on by the same command. Particle runs that are missing, or of other code, are computed
first. All of it takes two and a half to three and a half hours on two cores. At the end a line for each section says
how many of its targets are met, and whether its code has changed since. Exits with 1 unless all targets are met.
"""

import ast
import hashlib
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from functools import cache
from itertools import chain
from pathlib import Path, PurePosixPath
from typing import Annotated, Any

import grimp

from benchmarks.machine import processor
from benchmarks.table import ROWS_TO, one_of, run_benchmark
from sealtwin.core.files import write_json
from sealtwin.core.progress import in_words
from sealtwin.trial.job import NUMBERS
from tests.support.paths import ROOT

COMMANDS = {
    "paper_trial": "-m benchmarks.paper_trial",
    "tracing": "-m benchmarks.tracing",
    "solids": "-m benchmarks.solids",
    "line_verdict": "-m benchmarks.line_verdict",
    "ingest": "-m benchmarks.ingest",
    "sound_trials": "-m benchmarks.sound_trials",
    "first_fills": "-m benchmarks.first_fills",
    "fuzz": "-m benchmarks.fuzz",
    "speed_bars": "-m benchmarks.speed_bars",
    "slot": "-m benchmarks.slot_cases && -m benchmarks.slot",
    "plan_outside": "-m benchmarks.plan_outside",
    "blind_own_band": "-m benchmarks.blind_labs && -m benchmarks.blind_own_band",
    "blind_roads": "-m benchmarks.blind_roads --pour",
    "measured_boxes": "-m benchmarks.measured_boxes --record",
    "measured": "-m benchmarks.measured",
    "scans": "-m benchmarks.scans",
    "measured_numerics": "-m benchmarks.measured_numerics",
    "drafts": "-m benchmarks.drafts",
    "pbf_step": "-m benchmarks.pbf_step",
    "physics": "-m benchmarks.physics",
    "stated_intervals": "-m benchmarks.stated_intervals",
    "calibration": "-m benchmarks.calibration --anew",
}
"""Arguments of Python by the name of a benchmark, the short ones first."""
KEEPING = {
    "slot": "slot",
    "blind_own_band": "blind",
    "blind_roads": "blind_roads",
    "measured_boxes": "measured_boxes",
    "calibration": "calibration",
}
"""Name of the kept runs, a folder or a table, of each benchmark that first computes those that are missing."""
INSTALLED = ("digitise", "sealtwin", "simulate", "validate")
PACKAGES = (*INSTALLED, "benchmarks", "tests")
CODE = (*PACKAGES, "fixtures", "pyproject.toml", "constraints.txt")
"""What a figure can follow from."""
RESULTS = ROOT / "reports" / "results.json"
KEPT_BY = "reports/kept_runs.json"
"""Hash of the code that computes kept runs, by the name of a benchmark."""

Content = dict[str, dict[str, Any]]  # By the name of a benchmark: its rows and where, when and of which code they are


def main(only: Annotated[list[str] | None, one_of(COMMANDS)] = None) -> None:
    names = only or list(COMMANDS)
    results = read(RESULTS)
    code = {name: code_sha256(ROOT, COMMANDS[name]) for name in {*names, *results} & COMMANDS.keys()}
    stands = {name for name in code.keys() & results if _ended(results[name]) and results[name]["code"] == code[name]}
    waiting = [name for name in names if name not in stands]
    for number, name in enumerate(waiting):
        ran_before = all(other in results for other in waiting[number:])
        left_s = sum(results[other]["wall_s"] for other in waiting[number:] if other in results)
        time_left = f"about {in_words(left_s)}" if ran_before else "unknown, since not all ran before"
        print(f"{number + 1} of {len(waiting)}: {name}; time left: {time_left}", file=sys.stderr, flush=True)
        command = COMMANDS[name].replace("-m", "python -m")
        facts: dict[str, Any] = {"command": command, "code": code[name], "commit": commit()}
        facts |= {"stage_numbers": stage_numbers(COMMANDS[name]), "older": False}
        if name in KEEPING:
            remove_older_runs(ROOT, name)
        results[name] = facts | measure(COMMANDS[name])
        if name in KEEPING:
            results[name]["code"] = code[name] = code_sha256(ROOT, COMMANDS[name])
        write_json(RESULTS, {key: results[key] for key in COMMANDS if key in results})
    print(table(results, code))
    rows = [row for name in names for row in results[name]["rows"]]
    failed = [name for name in names if not _ended(results[name])]
    print(f"{counts(rows)} targets met" + (f"; no result: {', '.join(failed)}" if failed else ""))
    sys.exit(1 if failed or any(row["missed"] for row in rows) else 0)


def _ended(section: dict[str, Any]) -> bool:
    """Return True for a benchmark that ended with a table: with 0 where all its targets are met, else with 1."""
    return section["exit_code"] in (0, 1)


def counts(rows: Sequence[dict[str, Any]]) -> str:
    """Return how many targets are met, of how many."""
    judged, missed = (sum(row[kind] for row in rows) for kind in ("judged", "missed"))
    return f"{judged - missed} of {judged}"


def seen(row: dict[str, Any]) -> str:
    return f"{row['value']:.4g} {row['unit']}".strip() if "value" in row else "no number"


def measure(command: str) -> dict[str, Any]:
    """Run a benchmark and return its rows; what it prints goes to the terminal."""
    began_s, now = time.monotonic(), datetime.now(UTC)
    with tempfile.TemporaryDirectory() as place:
        path = Path(place) / "rows.json"
        environment, exit_code = os.environ | {ROWS_TO: str(path)}, 0
        for arguments in command.split(" && "):
            started = [sys.executable, *arguments.split()]
            exit_code = exit_code or subprocess.run(started, cwd=ROOT, env=environment, check=False).returncode
        rows = json.loads(path.read_text()) if path.is_file() else []
    # An exit code of 0 or 1 without a table is a fault of the benchmark.
    exit_code = exit_code if rows or exit_code > 1 else 2
    facts = {"exit_code": exit_code, "processor": processor(), "load": round(os.getloadavg()[0], 1)}
    return facts | {"date": f"{now:%Y-%m-%d}", "wall_s": round(time.monotonic() - began_s), "rows": rows}


def commit() -> str:
    """Return the last commit that changed a module or a version, with a "+" if the work tree has others.

    Results and kept runs can be committed while the benchmarks run.
    """
    modules = (*INSTALLED, "*.py", "pyproject.toml", "constraints.txt")
    last = ["git", "log", "-1", "--format=%h", "--abbrev=8", "--", *modules]
    head = subprocess.run(last, cwd=ROOT, stdout=subprocess.PIPE, check=True).stdout.decode().strip()
    changed = subprocess.run(["git", "diff", "--quiet", "HEAD", "--", *modules], cwd=ROOT, check=False).returncode
    return head + "+" * bool(changed)


def table(results: Content, code: Mapping[str, str]) -> str:
    """Return a line for each benchmark, in their order, and one for each target that is missed."""
    lines = []
    for name in COMMANDS:
        if (section := results.get(name)) is None:
            lines.append(f"{name:<18} not run yet")
            continue
        met = counts(section["rows"]) if _ended(section) else f"no result, exit code {section['exit_code']}"
        older = "" if section["code"] == code.get(name) else "; the code has changed since"
        run = f"{in_words(section['wall_s']):>8}  {section['date']}, {section['processor']}{older}"
        lines.append(f"{name:<18} {met:<12} {run}")
        lines += [f"    {row['name']}: {seen(row)} for {row['target']}" for row in section["rows"] if row["missed"]]
    return "\n".join(lines)


def remove_older_runs(root: Path, name: str) -> None:
    """Remove the kept runs of a benchmark, unless its code of today began them: stage numbers do not tell all code."""
    by_code, kept = read(root / KEPT_BY), root / "benchmarks" / KEEPING[name]
    code = code_sha256(root, COMMANDS[name], without=KEEPING[name])
    if by_code.get(name) != code:
        if kept.is_dir():
            shutil.rmtree(kept)
        kept.with_suffix(".csv").unlink(missing_ok=True)
        write_json(root / KEPT_BY, by_code | {name: code})


def code_sha256(root: Path, command: str, without: str = "") -> str:
    """Return the hash of the files that the figures of a benchmark follow from, of those that git tracks or would.

    These are the modules that it imports, at any depth; data of their packages; and versions. The data of a benchmark
    lie in a file or a folder of its name. If one of the modules starts programs, all packages that are installed count.
    Docstrings, comments and layout of modules do not count, nor do the kept runs of the name ``without``.
    """
    listed = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard", *CODE]
    names = subprocess.run(listed, cwd=root, stdout=subprocess.PIPE, check=True).stdout.decode().split("\0")
    needed = _needed(command)
    total = hashlib.sha256()
    for name in sorted(filter(None, names)):
        path = PurePosixPath(name)
        if (root / name).is_file() and _counts(path, needed) and not _is_of(without, path):
            content = (root / name).read_bytes()
            digest = _module_digest(content) if name.endswith(".py") else hashlib.sha256(content).digest()
            total.update(f"{name}\0".encode() + digest)
    return total.hexdigest()


@cache  # Most modules are of several benchmarks.
def _module_digest(content: bytes) -> bytes:
    return hashlib.sha256(ast.dump(_WithoutDocstrings().visit(ast.parse(content))).encode()).digest()


class _WithoutDocstrings(ast.NodeTransformer):
    def visit_Expr(self, node: ast.Expr) -> ast.Expr | None:
        return None if isinstance(node.value, ast.Constant) and isinstance(node.value.value, str) else node


def stage_numbers(command: str) -> dict[str, int]:
    """Return the numbers of the stages whose modules a benchmark imports, at any depth."""
    packages = {module.partition(".")[0] for module in _needed(command)}
    return {stage: number for stage, number in NUMBERS.items() if stage in packages}


@cache
def _imports() -> grimp.ImportGraph:
    return grimp.build_graph(*PACKAGES, include_external_packages=True, cache_dir=None)


def _needed(command: str) -> frozenset[str]:
    """Return the modules that a benchmark needs, itself among them: imports at any depth, and programs it starts."""
    modules, graph = [part for part in command.split() if part.startswith("benchmarks.")], _imports()
    needed = {*modules, *chain.from_iterable(map(graph.find_upstream_modules, modules))}
    beside = [name for name in needed if name.partition(".")[0] in ("benchmarks", "tests")]
    if any("subprocess" in graph.find_modules_directly_imported_by(name) for name in beside):
        needed |= {name for name in graph.modules if name.partition(".")[0] in INSTALLED}
    return frozenset(needed)


def _is_of(kept: str, path: PurePosixPath) -> bool:
    return path.suffix != ".py" and path.parts[0] == "benchmarks" and PurePosixPath(path.parts[1]).stem == kept


def _counts(path: PurePosixPath, needed: frozenset[str]) -> bool:
    package = path.parts[0]
    if path.suffix == ".py":
        name = ".".join(path.with_suffix("").parts)
        # A package is run before its modules.
        package_of = name.removesuffix("__init__")
        return name in needed or (package_of != name and any(f"{other}.".startswith(package_of) for other in needed))
    if package == "benchmarks":
        return any(other.startswith(f"benchmarks.{PurePosixPath(path.parts[1]).stem}") for other in needed)
    return package not in PACKAGES or any(other.partition(".")[0] == package for other in needed)


def read(path: Path) -> Content:
    return json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}


if __name__ == "__main__":
    run_benchmark(main)
