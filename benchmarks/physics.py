"""The fluid against textbooks and experiments: reference, measured, tolerance, pass, source.

    python benchmarks/physics.py [--only NAME]... [--list]

Each case prints what it took of the processor. A tolerance comes from a source or a reason that stands beside it in
the code, never from what was measured: what misses it is a limit of the solver, and is said to be one. Figures without
a tolerance are reported, and not counted. Particles count for what they count for when a run begins; where a level or
a current is judged against its volume, they are kept to it as in a run. About eight minutes of one core.
"""

import time
from typing import Annotated

from typer import Option

from benchmarks import physics_flow, physics_rest, physics_viscous, physics_yield
from benchmarks.physics_findings import Case, Finding
from benchmarks.table import leave, one_of, run_benchmark, say_why

MODULES = (physics_rest, physics_flow, physics_viscous, physics_yield)
CASES: dict[str, Case] = {name: getattr(module, name) for module in MODULES for name in module.CASES}


def main(
    only: Annotated[list[str] | None, one_of(CASES)] = None,
    names: Annotated[bool, Option("--list", help="the names of the cases")] = False,
) -> list[Finding]:
    if names:
        for name, case in CASES.items():
            print(f"{name:<16} {(case.__doc__ or '').splitlines()[0]}")
        return []
    print(f"{'figure':<56} {'reference':<14} {'measured':>9} {'unit':<6} {'tolerance':<16} {'':<6} source")
    findings: list[Finding] = []
    began = time.process_time()
    for name in only or CASES:
        before = time.process_time()
        for finding in CASES[name]():
            _print(finding)
            findings.append(finding)
        print(f"    {name}: {time.process_time() - before:.0f} CPU s", flush=True)
    print(f"{time.process_time() - began:.0f} CPU s")
    return findings


def _print(finding: Finding) -> None:
    passed = "MISSED" if finding.missed else "pass" if finding.judged else ""
    print(
        f"{finding.name:<56} {finding.goal:<14} {finding.value:>9.4g} {finding.unit:<6} "
        f"{finding.target:<16} {passed:<6} {finding.source}"
    )
    say_why(finding)


if __name__ == "__main__":
    run_benchmark(main, leave)
