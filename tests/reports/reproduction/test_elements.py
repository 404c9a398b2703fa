"""The table of the paper's elements names existing definitions only, with a reason for each deviation."""

import ast
import re

from reports.reproduction.reproduce import HOME
from tests.support.paths import ROOT

ROWS = [line.split(" | ") for line in (HOME / "elements.md").read_text(encoding="utf-8").splitlines() if "|" in line][
    2:
]


def defined_in(name: str) -> set[str]:
    """Names of functions, classes and variables that a Python file defines, inner ones among them."""
    nodes = list(ast.walk(ast.parse((ROOT / name).read_text(encoding="utf-8"))))
    names = {node.name for node in nodes if isinstance(node, ast.FunctionDef | ast.ClassDef)}
    return names | {node.id for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}


def test_every_file_and_definition_in_the_table_of_elements_exists():
    places = [place for row in ROWS for place in re.findall(r"`([^`]+)`", row[3])]
    assert len(places) > 50
    for place in places:
        name, _, symbol = place.partition(":")
        assert (ROOT / name).is_file(), place
        assert not symbol or symbol in defined_in(name), place


def test_every_element_in_the_table_has_a_file_and_every_deviation_a_reason():
    for where, what, faith, lives, why in ROWS:
        assert faith in ("faithful", "deviates", "missing"), what
        assert bool(lives.strip()) == (faith != "missing"), (where, what)
        assert faith == "faithful" or why.strip(" |"), (where, what)
        for page in re.findall(r"\(\.\./\.\./(docs/decisions/\w[\w-]*\.md)\)", why):
            assert (ROOT / page).is_file(), page
