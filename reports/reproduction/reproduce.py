"""The paper reproduced by one command, which goes on where it was killed; README.md, elements.md, figures/ beside it.

    python -m reports.reproduction.reproduce                    all stages
    python -m reports.reproduction.reproduce flare flare-seeds  these
    python -m reports.reproduction.reproduce page               none: the page alone

What a stage finds is kept in kept.json, of which the page is made. Times are judged only where nothing else runs beside
them, so their stages are best run alone.
"""

import argparse
import sys
from pathlib import Path

from reports.reproduction.stages import parts, stages
from reports.reproduction.studies import reproduce
from sealtwin.core.errors import SealtwinError
from sealtwin.core.progress import progress_for_stderr

HOME = Path(__file__).resolve().parent
PAGE = "page"


def main() -> None:
    wanted = parts(HOME)
    names = [stage.name for stage in stages(wanted)]
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("stages", nargs="*", metavar="STAGE", help=f"{', '.join(names)}, or {PAGE}; none: all")
    asked: list[str] = parser.parse_args().stages
    if unknown := [name for name in asked if name not in (*names, PAGE)]:
        parser.error(f"{unknown[0]}: no such stage; there are {', '.join(names)} and {PAGE}")
    try:
        lines = reproduce(HOME, wanted, asked or names, HOME.parent, progress_for_stderr(quiet=False))
    except SealtwinError as fault:
        print(fault, file=sys.stderr)
        sys.exit(fault.exit_code)
    print("\n".join(lines))


if __name__ == "__main__":
    main()
