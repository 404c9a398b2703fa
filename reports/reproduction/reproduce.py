"""The paper reproduced by one command, which goes on where it was killed: README.md and figures/ beside this file.

python -m reports.reproduction.reproduce
"""

import sys
from pathlib import Path

from reports.reproduction.studies import parts, reproduce
from sealtwin.core.errors import SealtwinError
from sealtwin.core.progress import progress_for_stderr

HOME = Path(__file__).resolve().parent


def main() -> None:
    try:
        lines = reproduce(HOME, parts(HOME), HOME.parent, progress_for_stderr(quiet=False))
    except SealtwinError as fault:
        print(fault, file=sys.stderr)
        sys.exit(fault.exit_code)
    print("\n".join(lines))


if __name__ == "__main__":
    main()
