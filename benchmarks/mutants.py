"""Mutants of the packages, run against the tests of two revisions: a leaner suite must kill what the older one kills.

    python -m benchmarks.mutants OLD FOLDER [--count 200] [--seed REVISION]

Both suites run against the packages of HEAD, each in a worktree below FOLDER, which stays as it was made. A mutant is
a place of an operator in a module, the same in both. It meets the quickest ``MAX_TESTS`` whose coverage contexts
include its line, until one fails. The same command goes on where it was stopped.
"""

import json
import os
import random
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache, cached_property
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any
from xml.etree import ElementTree

from coverage import CoverageData
from typer import Option

from benchmarks.table import Row, run_benchmark
from tests.support.paths import ROOT

STAGES = ("digitise", "simulate", "validate", "sealtwin")
OPERATORS = (
    *(f"ReplaceComparisonOperator_{pair}" for pair in ("Lt_LtE", "LtE_Lt", "Gt_GtE", "GtE_Gt", "Lt_Gt", "Gt_Lt")),
    *(f"ReplaceComparisonOperator_{pair}" for pair in ("Eq_NotEq", "NotEq_Eq", "Is_IsNot", "IsNot_Is")),
    *(f"ReplaceBinaryOperator_{pair}" for pair in ("Add_Sub", "Sub_Add", "Mul_Div", "Div_Mul")),
    *("AddNot", "ReplaceAndWithOr", "ReplaceOrWithAnd", "ReplaceTrueWithFalse", "ReplaceFalseWithTrue"),
    *("NumberReplacer", "ReplaceUnaryOperator_USub_UAdd", "ZeroIterationForLoop"),
)
"""Operators of cosmic-ray that leave a module importable."""
RUN_BY_CI = "not slow and not gpu and not browser"
MAX_TESTS = 40  # Of a mutant: a line that everything runs has thousands, and each survivor would take minutes
MAX_S = 100.0  # Time of one mutant's tests; a mutant that loops for ever counts as killed
FAILED = (1, 2, 4)  # Exit codes of pytest: a test failed, or its module could not be imported and has no tests
LOST_AT_MOST = 0.01  # Share of the old suite's kills


@dataclass(frozen=True, order=True)
class Mutant:
    """One change of one module: the ``occurrence``-th place of an operator."""

    module: str
    operator: str
    occurrence: int

    @property
    def key(self) -> str:
        return f"{self.module} {self.operator} {self.occurrence}"


@dataclass(frozen=True)
class Suite:
    """Tests of one revision in a worktree that has the packages of HEAD."""

    name: str
    revision: str
    folder: Path

    def check_out(self) -> None:
        if self.folder.exists():
            return
        git("worktree", "add", "--detach", "--force", str(self.folder), self.revision)
        git("checkout", git("rev-parse", "HEAD"), "--", *STAGES, at=self.folder)

    def measure(self) -> None:
        """Run every test once, for its contexts, its time and whether it passes at all."""
        if (self.folder / ".coverage").exists():
            return
        sources = [f"--cov={stage}" for stage in STAGES]
        options = ["-n", "2", "--dist", "worksteal", "-q", "--cov-branch", "--cov-context=test", "--cov-report="]
        self.pytest(*options, *sources, "--junitxml=times.xml")

    def pytest(self, *arguments: str, most_s: float | None = None) -> int:
        """Return pytest's exit code; 1 if it takes longer than ``most_s``."""
        command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-m", RUN_BY_CI, *arguments]
        environment = os.environ | {"PYTHONPATH": str(self.folder)}
        try:
            ended = subprocess.run(
                command, cwd=self.folder, env=environment, capture_output=True, timeout=most_s, check=False
            )
        except subprocess.TimeoutExpired:
            return 1
        return ended.returncode

    @cached_property
    def contexts(self) -> CoverageData:
        data = CoverageData(str(self.folder / ".coverage"))
        data.read()
        return data

    @cached_property
    def seconds(self) -> dict[str, float]:
        """Time of each test that passes on unchanged packages, by the name that contexts have."""
        cases = ElementTree.parse(self.folder / "times.xml").iter("testcase")
        return {
            f"{case.get('classname', '').replace('.', '/')}.py::{case.get('name')}": float(case.get("time", 0))
            for case in cases
            if case.find("failure") is None and case.find("error") is None and case.find("skipped") is None
        }

    def tests_of(self, mutant: Mutant) -> list[str]:
        """Names of the tests that run the mutant's line, quickest first; none if the module lacks the place."""
        line = dict(mutants_of(self.folder, mutant.module)).get(mutant, 0)
        lines = self.contexts.contexts_by_lineno(str(self.folder / mutant.module))
        names = {context.split("|")[0] for context in lines.get(line, ())}
        return sorted(names & self.seconds.keys(), key=self.seconds.__getitem__)[:MAX_TESTS]

    def kills(self, mutant: Mutant) -> bool:
        tests = self.tests_of(mutant)
        if not tests:
            return False
        path = self.folder / mutant.module
        source = path.read_text(encoding="utf-8")
        path.write_text(mutated(source, mutant), encoding="utf-8")
        try:
            (self.folder / "tests.txt").write_text("\n".join(tests), encoding="utf-8")
            return self.pytest("-x", "-q", "-n", "0", "@tests.txt", most_s=MAX_S) in FAILED
        finally:
            path.write_text(source, encoding="utf-8")


def git(*arguments: str, at: Path = ROOT) -> str:
    return subprocess.run(["git", *arguments], cwd=at, check=True, capture_output=True, text=True).stdout.strip()


def cosmic_ray(module: str) -> Any:
    # Installed by the extra 'mutants' alone, so that a type checker must not ask for it.
    return import_module(f"cosmic_ray.{module}")


@cache
def mutants_of(root: Path, module: str) -> tuple[tuple[Mutant, int], ...]:
    """Return every mutant of a module below ``root``, with its line."""
    trees = cosmic_ray("ast")
    nodes = list(trees.ast_nodes(trees.get_ast((root / module).read_text(encoding="utf-8"))))
    mutants = []
    for operator in OPERATORS:
        find = cosmic_ray("plugins").get_operator(f"core/{operator}")().mutation_positions
        places = (position for node in nodes for position in find(node))
        for occurrence, ((line, _), *_) in enumerate(places):
            mutants.append((Mutant(module, operator, occurrence), line))
    return tuple(mutants)


def mutated(source: str, mutant: Mutant) -> str:
    operator = cosmic_ray("plugins").get_operator(f"core/{mutant.operator}")()
    text = cosmic_ray("mutating").mutate_code(source, operator, mutant.occurrence)
    if text is None:
        raise ValueError(f"{mutant.key}: there is no such place.")
    return text


def drawn(old: Suite, new: Suite, count: int, seed: str) -> list[Mutant]:
    """Draw mutants whose line a test of the old suite runs, a fourth of them from each package."""
    chance = random.Random(seed)
    chosen: list[Mutant] = []
    for stage in STAGES:
        modules = git("ls-files", f"{stage}/*.py", at=new.folder).splitlines()
        candidates = sorted(mutant for module in modules for mutant, _ in mutants_of(new.folder, module))
        chance.shuffle(candidates)
        touched = (mutant for mutant in candidates if old.tests_of(mutant))
        chosen += [mutant for mutant, _ in zip(touched, range(count // len(STAGES)), strict=False)]
    return chosen


def main(
    old: str,
    folder: Path,
    count: int = 200,
    seed: Annotated[str | None, Option(help="default: the hash of HEAD")] = None,
) -> list[Row]:
    folder = folder.resolve()
    suites = [Suite("old", old, folder / "old"), Suite("new", "HEAD", folder / "new")]
    for suite in suites:
        suite.check_out()
        suite.measure()
    results, names = folder / "mutants.json", [suite.name for suite in suites]
    killed: dict[str, dict[str, bool]] = json.loads(results.read_text()) if results.exists() else {}
    mutants = drawn(suites[0], suites[1], count, seed or git("rev-parse", "HEAD"))
    for number, mutant in enumerate(mutants, 1):
        if mutant.key not in killed:
            with ThreadPoolExecutor() as pool:
                killed[mutant.key] = dict(
                    zip(names, pool.map(Suite.kills, suites, [mutant] * len(suites)), strict=True)
                )
            results.write_text(json.dumps(killed, indent=1))
        print(f"{number} of {len(mutants)}: {mutant.key}: {killed[mutant.key]}", flush=True)
    outcomes = [killed[mutant.key] for mutant in mutants]
    lost = sum(each["old"] and not each["new"] for each in outcomes)
    by_old = sum(each["old"] for each in outcomes)
    return [
        Row("killed by the old suite", by_old, f"of {len(mutants)}"),
        Row("lost by the new one", lost, "", 0, int(LOST_AT_MOST * by_old)),
        Row("killed by the new one alone", sum(each["new"] and not each["old"] for each in outcomes), ""),
    ]


if __name__ == "__main__":
    run_benchmark(main)
