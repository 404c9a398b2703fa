"""Checks of ``make lint`` that no linter has: docstrings that are fragments, and type names that are defined twice."""

import ast
import re
import sys
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGES = ("sealtwin", "digitise", "simulate", "validate")
FRAGMENT_OPENER = re.compile(
    r"(Above|And|As|At|Because|Before|Behind|Below|Beside|Between|Beyond|But|By|Else|For|From|How|In|Into|Nor|Of|On|Or|Over"
    r"|Since|So|Than|That|Then|Till|To|Under|Until|Up|What|When|Where|Whether|Which|Who|Whom|Whose|Why|With|Without)\b"
)
"""First words of docstrings that neither are a sentence with a verb nor name the thing."""


def modules() -> Iterator[tuple[Path, ast.Module]]:
    """Yield every module of the four packages with its syntax tree."""
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*.py")):
            yield path.relative_to(ROOT), ast.parse(path.read_text(encoding="utf-8"))


def fragments(path: Path, tree: ast.Module) -> Iterator[str]:
    """Yield a line for each docstring, an attribute's included, whose first word opens a fragment."""
    for node in ast.walk(tree):
        match node:
            case ast.Expr(value=ast.Constant(value=str(text))) if FRAGMENT_OPENER.match(text.lstrip()):
                yield f"{path}:{node.lineno}: the docstring is a fragment: {' '.join(text.split()[:8])} ..."


def main() -> int:
    """Print every finding; return 1 if there is one."""
    found: list[str] = []
    places: defaultdict[str, list[str]] = defaultdict(list)
    for path, tree in modules():
        found.extend(fragments(path, tree))
        for node in ast.walk(tree):
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                places[node.name].append(f"{path}:{node.lineno}")
    found.extend(f"{', '.join(at)}: {name} is defined {len(at)} times" for name, at in places.items() if len(at) > 1)
    print("\n".join(found) or "No fragment, and no type name is defined twice.")  # noqa: T201
    return bool(found)


if __name__ == "__main__":
    sys.exit(main())
