"""Check that digitise, simulate and validate are sealtwin's own: other distributions have packages of these names.

It runs whenever sealtwin is imported, so it executes none of the packages and reads only the first file of each.
"""

import sys
from importlib.util import find_spec
from pathlib import Path

PACKAGES = ("digitise", "simulate", "validate")
MARK = 'PART_OF = "sealtwin"'
"""A line of each package's __init__.py: a package that was overwritten in place lies where ours lay."""
HOME = Path(__file__).absolute().parents[1]
COMMANDS = ("-m", "sealtwin", "sealtwin.exe", "sealtwin-script.py")
"""First arguments of the command while its package is imported."""


def require_own_packages() -> None:
    """Raises InputError where a package is not sealtwin's own."""
    message = foreign_package()
    if message is not None:
        from sealtwin.core.errors import InputError

        raise InputError(message)


def require_at_import() -> None:
    """Do so for everything but the command, which answers by itself, with its exit code and without a traceback."""
    if Path(sys.argv[0] if sys.argv else "").name not in COMMANDS:
        require_own_packages()


def foreign_package() -> str | None:
    """Return the sentence about the first package that is not sealtwin's own, with the cure; None where all are."""
    cure = "give sealtwin an environment of its own ('uv tool install', 'pipx install' or a new venv)"
    for name in PACKAGES:
        # A folder without an __init__.py has no origin.
        found = spec.origin if (spec := find_spec(name)) is not None else None
        if found is None:
            return f"{HOME / name}: sealtwin's package '{name}' is missing; {cure}."
        if not _is_ours(name, Path(found)):
            if others := _distributions(name, Path(found)):
                return f"{found}: '{name}' is a package of {' and '.join(others)} and not sealtwin's own; {cure}."
            return f"{found}: '{name}' is not sealtwin's own package; rename it or start elsewhere, or {cure}."
    return None


def _is_ours(name: str, found: Path) -> bool:
    try:
        return found.samefile(HOME / name / "__init__.py") and MARK in found.read_text("utf-8", "replace")
    except OSError:
        return False


def _distributions(name: str, found: Path) -> list[str]:
    """Other distributions that installed a package of this name where it was found."""
    from importlib.metadata import distribution, packages_distributions

    names = sorted(set(packages_distributions().get(name, ())) - {"sealtwin"})
    homes = {other: Path(str(distribution(other).locate_file(""))).resolve() for other in names}
    return [other for other, home in homes.items() if found.resolve().is_relative_to(home)]
