"""Sizes of this repository beside their caps in pyproject.toml; 'make lint' fails above one.

    python -m tests.house_sizes

Counted are the files that git lists, an untracked file that it does not ignore included. Tokens are those of modules
without comments and docstrings, and a string counts 1 and another for each 40 characters: neither dense code nor text
in strings gains anything. Data are all files of the packages that are no module, picture or generated schema.
"""

import ast
import io
import subprocess
import sys
import tokenize
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path

from tests.support.paths import ROOT

PACKAGES = ("digitise", "simulate", "validate", "sealtwin")
PICTURES = (".png", ".jpg", ".svg", ".gif", ".ico")
COUNTED = (tokenize.NAME, tokenize.OP, tokenize.NUMBER)


def docstrings_of(tree: ast.Module) -> Iterator[tuple[int, int]]:
    """Yield line and column of each string that stands alone."""
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        for statement in body if isinstance(body, list) else ():
            match statement:
                case ast.Expr(value=ast.Constant(value=str())):
                    yield statement.lineno, statement.col_offset


def tokens_of(source: str) -> int:
    """Return the tokens of a module."""
    docstrings, count = set(docstrings_of(ast.parse(source))), 0
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.STRING and token.start not in docstrings:
            count += 1 + len(token.string) // 40
        count += token.type in COUNTED
    return count


def listed(root: Path) -> list[Path]:
    """Return the files of a work tree, from its root."""
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    names = subprocess.run(command, cwd=root, stdout=subprocess.PIPE, check=True).stdout.decode().split("\0")
    return [Path(name) for name in names if name and (root / name).is_file()]


def sizes_of(root: Path, files: Sequence[Path]) -> dict[str, int]:
    """Return each size by the name of its cap."""
    texts = {path: (root / path).read_text(encoding="utf-8") for path in files if path.suffix in (".py", ".md")}
    lines = {path: text.count("\n") for path, text in texts.items() if path.suffix == ".py"}
    packages = [path for path in files if path.parts[0] in PACKAGES]
    modules = [path for path in packages if path.suffix == ".py"]
    data = [path for path in packages if path.suffix not in (".py", *PICTURES) and "schema" not in path.as_posix()]
    return {
        "package_tokens": sum(tokens_of(texts[path]) for path in modules),
        "package_data_bytes": sum((root / path).stat().st_size for path in data),
        "package_files": len(modules),
        "test_lines": sum(count for path, count in lines.items() if path.parts[0] == "tests"),
        "benchmark_lines": sum(count for path, count in lines.items() if path.parts[0] == "benchmarks"),
        "markdown_words": sum(len(text.split()) for path, text in texts.items() if path.suffix == ".md"),
    }


def main(root: Path = ROOT) -> int:
    """Print each size beside its cap; return 1 if one is above."""
    caps: dict[str, int] = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["house"]
    sizes = sizes_of(root, listed(root))
    for name, cap in caps.items():
        print(f"{name:<18} {sizes[name]:>8,} of {cap:>8,}{'  ABOVE' if sizes[name] > cap else ''}")  # noqa: T201
    return int(any(sizes[name] > cap for name, cap in caps.items()))


if __name__ == "__main__":
    sys.exit(main())
