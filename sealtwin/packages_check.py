"""Check that digitise, simulate and validate are sealtwin's packages: other distributions use the same names.

It runs at each import of sealtwin, so it executes none of the packages and reads only the first file of each.
"""

import sys
from importlib.util import find_spec
from pathlib import Path

PACKAGES = ("digitise", "simulate", "validate")
MARK = 'PART_OF = "sealtwin"'
"""A line in the __init__.py of each package. It is missing if another package has overwritten the file."""
HOME = Path(__file__).absolute().parents[1]
COMMANDS = ("-m", "sealtwin", "sealtwin.exe", "sealtwin-script.py")
"""Names in sys.argv[0] if the command imports the package."""


def require_own_packages() -> None:
    """Raise InputError if a package is not sealtwin's."""
    message = foreign_package()
    if message is not None:
        from sealtwin.core.errors import InputError

        raise InputError(message)


def require_at_import() -> None:
    """Call ``require_own_packages``, except in the command, which makes the same check but prints no traceback."""
    if Path(sys.argv[0] if sys.argv else "").name not in COMMANDS:
        require_own_packages()


def foreign_package() -> str | None:
    """Return a sentence about the first package that is not sealtwin's, with the remedy, or None if all are ours."""
    remedy = "give sealtwin an environment of its own ('uv tool install', 'pipx install' or a new venv)"
    for name in PACKAGES:
        # A folder without an __init__.py has no origin.
        origin = spec.origin if (spec := find_spec(name)) is not None else None
        if origin is None:
            return f"{HOME / name}: sealtwin's package '{name}' is missing; {remedy}."
        if not _is_ours(name, Path(origin)):
            if others := _distributions(name, Path(origin)):
                return f"{origin}: '{name}' is a package of {' and '.join(others)}, not sealtwin's own; {remedy}."
            return f"{origin}: '{name}' is not sealtwin's own package; rename it or start elsewhere, or {remedy}."
    return None


def _is_ours(name: str, origin: Path) -> bool:
    try:
        return origin.samefile(HOME / name / "__init__.py") and MARK in origin.read_text("utf-8", "replace")
    except OSError:
        return False


def _distributions(name: str, origin: Path) -> list[str]:
    """Return the other distributions that installed a package of this name at its place."""
    from importlib.metadata import distribution, packages_distributions

    names = sorted(set(packages_distributions().get(name, ())) - {"sealtwin"})
    homes = {other: Path(str(distribution(other).locate_file(""))).resolve() for other in names}
    return [other for other, home in homes.items() if origin.resolve().is_relative_to(home)]
