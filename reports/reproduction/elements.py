"""Every section, equation, figure and number of the paper: where it lives here, and how faithful it is."""

import ast
from collections import Counter
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from sealtwin.core.settings import Settings, read_settings

ROOT = Path(__file__).resolve().parents[2]

Faith = Literal["faithful", "deviates", "missing"]
FAITHS: tuple[Faith, ...] = ("faithful", "deviates", "missing")
INTRODUCTION = """\
# The paper, element by element

Every section, equation, figure and number of *Position-based fluid simulation for robotic injection sealing of pavement
cracks*, where it lives in this repository, and how faithful it is. Readings and photo of its trial are RECONSTRUCTED:
nothing of them was measured. *Faithful*: done as the paper says. *Deviates*: done otherwise, for the reason beside it.
*Missing*: not done. What the paper found with its runs is judged in `reports/reproduction/README.md`.

This page is made from `paper_elements.toml` by `python -m reports.reproduction.elements`.
"""


class Element(Settings):
    """An element of the paper."""

    place: Annotated[str, Field(min_length=1)]
    """Section, equation or figure."""
    says: Annotated[str, Field(min_length=1)]
    lives: tuple[str, ...] = ()
    """Files, of a Python file with what it defines there after a colon."""
    faith: Faith
    why: str = ""
    decisions: tuple[str, ...] = ()
    """Pages of ``docs/decisions``, by name."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.faith != "faithful" and not self.why:
            raise ValueError(f"{self.place}, {self.says}: {self.faith}, and why is not said")
        if (self.faith == "missing") == bool(self.lives):
            raise ValueError(f"{self.place}, {self.says}: what is missing lives nowhere, all else somewhere")
        return self

    def row(self) -> str:
        lives = "<br>".join(f"`{place}`" for place in self.lives)
        pages = ", ".join(f"[{name}](../../docs/decisions/{name}.md)" for name in self.decisions)
        why = f"{self.why} ({pages})" if self.why and pages else self.why or pages
        return f"| {self.place} | {self.says} | {self.faith} | {lives} | {why} |"


class Elements(Settings):
    """The table."""

    element: Annotated[tuple[Element, ...], Field(min_length=1)]

    def page(self) -> str:
        counts = Counter(each.faith for each in self.element)
        shares = ", ".join(f"{counts[faith]} {faith}" for faith in FAITHS)
        head = "| where | what | faithful? | here | why |\n| --- | --- | --- | --- | --- |"
        rows = "\n".join(each.row() for each in self.element)
        return f"{INTRODUCTION}\n{len(self.element)} elements: {shares}.\n\n{head}\n{rows}\n"

    def faults(self, root: Path) -> Iterator[str]:
        """Yield a sentence for each file, definition and page of decisions that is not in the checkout ``root``."""
        for each in self.element:
            for place in each.lives:
                name, _, symbol = place.partition(":")
                if not (root / name).is_file():
                    yield f"{each.place}: {name} is no file."
                elif symbol and symbol not in defined_in(root / name):
                    yield f"{each.place}: {name} defines no {symbol}."
            for name in each.decisions:
                if not (root / "docs" / "decisions" / f"{name}.md").is_file():
                    yield f"{each.place}: there is no page of decisions {name}."


def read_elements(path: Path) -> Elements:
    """Raises InputError for a table that cannot be used."""
    return read_settings(Elements, path, name="table of elements", starter="it is kept in the repository")


@cache
def defined_in(path: Path) -> frozenset[str]:
    """Return the names of functions, classes and variables that a Python file defines, inner ones among them."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        match node:
            case ast.FunctionDef(name=name) | ast.ClassDef(name=name) | ast.AnnAssign(target=ast.Name(id=name)):
                names.add(name)
            case ast.Assign(targets=targets):
                names.update(target.id for target in targets if isinstance(target, ast.Name))
    return frozenset(names)


def main() -> None:
    home = Path(__file__).parent
    (home / "elements.md").write_text(
        read_elements(home / "paper_elements.toml").page(), encoding="utf-8", newline="\n"
    )


if __name__ == "__main__":
    main()
