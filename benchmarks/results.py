"""Every benchmark in turn, and what each printed, in reports/results.json and on a page of the documentation.

    python -m benchmarks.results [--only NAME]...     (make results)

A benchmark is run again where a module that it imports, at any depth, or its data changed since, or where it failed; a
run that is stopped, or killed, goes on by the same command. The page shows each figure beside that of the results
before. Exits with 1 unless all targets are met.
"""

import ast
import hashlib
import json
import os
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from functools import cache
from pathlib import Path, PurePosixPath
from typing import Annotated, Any

import grimp

from benchmarks.against import HERE, processor
from benchmarks.table import ROWS_TO, one_of, run_benchmark
from sealtwin.core.files import write_json, write_text
from sealtwin.core.progress import in_words
from sealtwin.core.stage_keys import UNNUMBERED, number_words, other_numbers
from sealtwin.trial.stage_numbers import NUMBERS

COMMANDS = {
    "paper_trial": "benchmarks/paper_trial.py",
    "tracing": "benchmarks/tracing.py",
    "solids": "benchmarks/solids.py",
    "digitise_speed": "benchmarks/digitise_speed.py",
    "ingest": "benchmarks/ingest.py",
    "fuzz": "-m benchmarks.fuzz",
    "time_left": "-m benchmarks.time_left",
    "report_speed": "benchmarks/report_speed.py",
    "live_report": "-m benchmarks.live_report",
    "cold": "-m benchmarks.cold",
    "tilt": "benchmarks/tilt.py",
    "material": "benchmarks/material.py",
    "weighing": "-m benchmarks.weighing --fills 400 --first 5000",
    "slot": "-m benchmarks.slot",
    "input_uncertainty": "-m benchmarks.input_uncertainty --judge",
    "planning": "-m benchmarks.planning",
    "second_reality": "-m benchmarks.second_reality",
    "plan_outside": "-m benchmarks.plan_outside",
    "blind_own_band": "-m benchmarks.blind_own_band",
    "slumps": "-m benchmarks.slumps",
    "material_by_scale": "-m benchmarks.material_by_scale",
    "wall_and_volume": "-m benchmarks.wall_and_volume",
    "material_by_rheometer": "-m benchmarks.material_by_rheometer",
    "beads": "-m benchmarks.beads",
    "material_by_bead": "-m benchmarks.material_by_bead",
    "measured": "-m benchmarks.measured",
    "measured_boxes": "-m benchmarks.measured_boxes",
    "measured_numerics": "-m benchmarks.measured_numerics",
    "drafts": "-m benchmarks.drafts",
    "draft_physics": "-m benchmarks.draft_physics",
    "pbf_step": "benchmarks/pbf_step.py",
    "paper_run": "benchmarks/paper_run.py",
    "physics": "benchmarks/physics.py",
    "channels": "-m benchmarks.channels",
    "volume": "-m benchmarks.volume",
    "pressure": "-m benchmarks.pressure",
    "heaps": "-m benchmarks.heaps",
    "sleep": "-m benchmarks.sleep",
    "stated_intervals": "-m benchmarks.stated_intervals",
    "calibration": "-m benchmarks.calibration",
    "draft_calibration": "-m benchmarks.draft_calibration",
    "blind_prediction": "-m benchmarks.blind_prediction",
}
"""Arguments of Python by the name of a benchmark, the short ones first."""
INSTALLED = ("digitise", "sealtwin", "simulate", "validate")
PACKAGES = (*INSTALLED, "benchmarks", "tests")
CODE = (*PACKAGES, "fixtures", "pyproject.toml", "constraints.txt")
"""What a figure can follow from."""
RESULTS, PAGE = HERE / "reports" / "results.json", HERE / "docs" / "results.md"

_UNKNOWN = dict.fromkeys(NUMBERS, UNNUMBERED)

Content = dict[str, dict[str, Any]]  # By the name of a benchmark: its rows and where, when and of which code they are


def main(only: Annotated[list[str] | None, one_of(COMMANDS)] = None) -> None:
    names = only or list(COMMANDS)
    results = read(RESULTS)
    code = {name: code_sha256(HERE, COMMANDS[name]) for name in {*names, *results} & COMMANDS.keys()}
    waiting = [name for name in names if not (name in results and _stands(results[name], code[name]))]
    for number, name in enumerate(waiting):
        ran_before = all(other in results for other in waiting[number:])
        left_s = sum(results[other]["wall_s"] for other in waiting[number:] if other in results)
        time_left = f"about {in_words(left_s)}" if ran_before else "unknown, since not all ran before"
        print(f"{number + 1} of {len(waiting)}: {name}; time left: {time_left}", file=sys.stderr, flush=True)
        before = values_of(results.get(name, {}).get("rows", []))
        facts = {"command": f"python {COMMANDS[name]}", "code": code[name], "before": before}
        facts["stage_numbers"] = stage_numbers(COMMANDS[name])
        results[name] = facts | measure(COMMANDS[name].split())
        write_json(RESULTS, {key: results[key] for key in COMMANDS if key in results})
    write_text(PAGE, page(results, code))
    rows = [row for name in names for row in results[name]["rows"]]
    failed = [name for name in names if not _ended(results[name])]
    judged, missed = sum(row["judged"] for row in rows), sum(row["missed"] for row in rows)
    print(f"{judged - missed} of {judged} targets met" + (f"; no result: {', '.join(failed)}" if failed else ""))
    sys.exit(1 if missed or failed else 0)


def values_of(rows: list[dict[str, Any]]) -> dict[str, float]:
    """Return the value of each row that has one, by the row's key."""
    return {key: row["value"] for key, row in _by_key(rows) if "value" in row}


def _by_key(rows: list[dict[str, Any]]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Return rows with their keys: the name, and from a name's second row on the row's number among them."""
    rows_so_far = Counter[str]()
    for row in rows:
        rows_so_far[row["name"]] += 1
        number = rows_so_far[row["name"]]
        yield row["name"] if number == 1 else f"{row['name']} #{number}", row


def _ended(one: dict[str, Any]) -> bool:
    """Return True for a benchmark that ended with a table: with 0 where all its targets are met, else with 1."""
    return one["exit_code"] in (0, 1)


def _stands(one: dict[str, Any], code: str) -> bool:
    return _ended(one) and one["code"] == code


def measure(arguments: list[str]) -> dict[str, Any]:
    """Run a benchmark and return its rows; what it prints goes to the terminal."""
    began_s, now = time.monotonic(), datetime.now(UTC)
    with tempfile.TemporaryDirectory() as place:
        path = Path(place) / "rows.json"
        ended = subprocess.run(
            [sys.executable, *arguments], cwd=HERE, env=os.environ | {ROWS_TO: str(path)}, check=False
        )
        rows = json.loads(path.read_text()) if path.is_file() else []
    # An exit code of 0 or 1 without a table is a fault of the benchmark.
    exit_code = ended.returncode if rows or ended.returncode > 1 else 2
    facts = {"exit_code": exit_code, "processor": processor(), "load": round(os.getloadavg()[0], 1)}
    return facts | {"date": f"{now:%Y-%m-%d}", "wall_s": round(time.monotonic() - began_s), "rows": rows}


def code_sha256(root: Path, command: str) -> str:
    """Return the hash of the files that the figures of a benchmark follow from, of those that git tracks or would.

    These are the modules that it imports, at any depth; data of their packages; and versions. The data of a benchmark
    lie in a file or a folder of its name. If one of the modules starts programs, all packages that are installed count.
    Docstrings, comments and layout of modules do not count.
    """
    listed = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard", *CODE]
    names = subprocess.run(listed, cwd=root, stdout=subprocess.PIPE, check=True).stdout.decode().split("\0")
    needed = _needed(command)
    total = hashlib.sha256()
    for name in sorted(filter(None, names)):
        if (root / name).is_file() and _counts(PurePosixPath(name), needed):
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
    needed = _needed(command)
    packages = set(NUMBERS) if needed is None else {module.partition(".")[0] for module in needed}
    return {stage: number for stage, number in NUMBERS.items() if stage in packages}


@cache
def _imports() -> grimp.ImportGraph:
    return grimp.build_graph(*PACKAGES, include_external_packages=True, cache_dir=None)


def _needed(command: str) -> frozenset[str] | None:
    """Return the modules that a benchmark needs, itself among them: imports at any depth, and programs that it starts.

    None if the benchmark is not among the packages.
    """
    named = next(part for part in command.split() if part != "-m")
    module, graph = named.removesuffix(".py").replace("/", "."), _imports()
    if module not in graph.modules:
        return None
    needed = {module, *graph.find_upstream_modules(module)}
    own = (one for one in needed if one.partition(".")[0] in ("benchmarks", "tests"))
    if any("subprocess" in graph.find_modules_directly_imported_by(one) for one in own):
        needed |= {one for one in graph.modules if one.partition(".")[0] in INSTALLED}
    return frozenset(needed)


def _counts(path: PurePosixPath, needed: frozenset[str] | None) -> bool:
    if needed is None:
        return not path.name.startswith("test_")
    package = path.parts[0]
    if path.suffix == ".py":
        name = ".".join(path.with_suffix("").parts)
        # A package is run before its modules.
        package_of = name.removesuffix("__init__")
        return name in needed or (package_of != name and any(f"{one}.".startswith(package_of) for one in needed))
    if package == "benchmarks":
        return any(one.startswith(f"benchmarks.{PurePosixPath(path.parts[1]).stem}") for one in needed)
    return package not in PACKAGES or any(one.partition(".")[0] == package for one in needed)


def read(path: Path) -> Content:
    return json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}


def page(results: Content, code: Mapping[str, str]) -> str:
    """Return the page of the documentation: a table for each benchmark, in their order; ``code`` has hashes of now."""
    judged = [row for one in results.values() for row in one["rows"] if row["judged"]]
    met = sum(not row["missed"] for row in judged)
    lines = [
        "# Results",
        "",
        f"`make results` writes this page: **{met} of {len(judged)} targets met**. *Before* is the figure of the run "
        "before this one. A figure that is reported has no target.",
        "",
        _of_one_solver(results),
    ]
    for name in COMMANDS:
        if name in results:
            lines += ["", *_section(name, results[name], code[name])]
    if absent := [f"`{name}`" for name in COMMANDS if name not in results]:
        lines += ["", f"Not run yet: {', '.join(absent)}."]
    return "\n".join(lines) + "\n"


def _of_one_solver(results: Content) -> str:
    """Return the sentence on whether all sections were computed by the same stage numbers, and by this version's."""
    by = {name: one.get("stage_numbers", _UNKNOWN) for name, one in results.items()}
    own = {name: {stage: NUMBERS[stage] for stage in numbers} for name, numbers in by.items()}
    if older := [f"`{name}`" for name, numbers in by.items() if other_numbers(numbers, own[name])]:
        return (
            f"**Not all by one solver.** This version is {number_words(NUMBERS)}; computed by other stage numbers: "
            f"{', '.join(older)}."
        )
    return f"All sections were computed by {number_words(NUMBERS)}, the stage numbers of this version."


def _section(name: str, one: dict[str, Any], code: str) -> list[str]:
    older = "" if one["code"] == code else " **The code has changed since.**"
    took = f"{in_words(one['wall_s'])} on {one['processor']}, load {one['load']}, {one['date']}"
    if numbers := one.get("stage_numbers", _UNKNOWN):
        took += f", by {number_words(numbers)}"
    lines = [f"## {name}", "", f"`{one['command']}`, {took}.{older}"]
    if not _ended(one):
        return [*lines, "", f"It ended with exit code {one['exit_code']} and without a result."]
    lines += ["", "| figure | target | seen | before | |", "|---|---|---|---|---|"]
    for key, row in _by_key(one["rows"]):
        was = f"{one['before'][key]:.4g}" if key in one["before"] else ""
        verdict = "**missed**" if row["missed"] else "met" if row["judged"] else ""
        why = f": {row['because']}" if row["missed"] and row["because"] else ""
        value = f"{row['value']:.4g} {row['unit']}".strip() if "value" in row else "no number"
        cells = (row["name"], row["target"], value, was, verdict + why)
        lines.append(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |")
    return lines


if __name__ == "__main__":
    run_benchmark(main)
