"""Reproduce the paper by one command, which continues where it was killed.

    python -m reports.reproduction.reproduce           all runs, kept.json, figures/ and README.md
    python -m reports.reproduction.reproduce --page    README.md alone, from kept.json

The runs are in reports/paper-*, which git ignores.
"""

import argparse
from dataclasses import asdict
from pathlib import Path

import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined

from reports.reproduction.claims import SAME_MM, claims_of
from reports.reproduction.runs import Results, compute
from sealtwin.core import files

HOME = Path(__file__).resolve().parent
KEPT = HOME / "kept.json"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--page", action="store_true", help="write the page alone, from kept.json")
    if not parser.parse_args().page:
        files.write_json(KEPT, asdict(compute(HOME.parent, HOME / "figures")))
    files.write_text(HOME / "README.md", page(Results(**files.read_json(KEPT))))
    print(HOME / "README.md")


def page(results: Results) -> str:
    environment = Environment(
        loader=FileSystemLoader(HOME), undefined=StrictUndefined, trim_blocks=True, keep_trailing_newline=True
    )
    claims = claims_of(results)
    return environment.get_template("page.md.j2").render(
        asdict(results),
        claims=claims,
        agreeing=sum(claim.agrees for claim in claims),
        same_mm=SAME_MM,
        least_mm=np.min(results.error_mm),
        most_mm=np.max(results.error_mm),
    )


if __name__ == "__main__":
    main()
