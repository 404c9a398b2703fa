"""Packages, constraints, guides and version of this checkout."""

import importlib
import json
import re
import tomllib
from itertools import chain
from pathlib import Path

import pytest

import sealtwin as package
from tests.support.processes import sealtwin

ROOT = Path(__file__).parent.parent
PACKAGES = ("sealtwin", "digitise", "simulate", "validate")


@pytest.mark.parametrize("name", PACKAGES)
def test_each_package_is_imported_from_this_checkout_and_is_typed(name):
    assert Path(str(importlib.import_module(name).__file__)).parent == ROOT / name
    assert (ROOT / name / "py.typed").is_file()


def test_constraints_pin_every_dependency_by_version_and_not_by_address():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    wanted = {*project["dependencies"], *chain.from_iterable(project["optional-dependencies"].values())}
    lines = (ROOT / "constraints.txt").read_text().splitlines()
    pinned = {line.split("==")[0].lower().replace("_", "-") for line in lines}
    assert {name.split(">=")[0].lower() for name in wanted - {"sealtwin[docs]"}} <= pinned
    assert all("==" in line and "/" not in line for line in lines)


def test_files_and_names_mentioned_in_the_guides_exist():
    """The guides are CONTRIBUTING, the page of the method, and the recipes of the packages."""
    recipes = "digitise/robots/__init__.py", "validate/readings/__init__.py"
    guides = ["CONTRIBUTING.md", "docs/explanation/method.md", *recipes]
    for guide in guides:
        named = re.findall(r"`+([^`\n]+)`+", (ROOT / guide).read_text(encoding="utf-8"))
        files = [name for name in named if re.fullmatch(r"[\w./-]*(/|\.(py|toml|md))", name)]
        assert files, guide
        places = ROOT, (ROOT / guide).parent, ROOT / "simulate" / "kernels"
        for name in files:
            assert any((place / name).exists() for place in places) or name == "__init__.py", f"{guide}: {name}"
    # A recipe names tables of tests too.
    folders = (*PACKAGES, "tests/validate/readings")
    files = [path for name in folders for path in (ROOT / name).rglob("*.py") if path.name != "__init__.py"]
    sources = "\n".join(path.read_text(encoding="utf-8") for path in files)
    table = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8").split("| what | where |")[1]
    table += "".join((ROOT / recipe).read_text(encoding="utf-8") for recipe in recipes)
    for name in re.findall(r"`+([A-Za-z_]+(?:\.[a-z_]+)?)`+", table):
        assert re.search(rf"\b{re.escape(name.rpartition('.')[2])}\b", sources), name


def test_all_files_state_the_same_version():
    version = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
    assert sealtwin("--version").stdout == f"{version}\n"
    assert package.__version__ == version
    assert f"\nversion: {version}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert json.loads((ROOT / "codemeta.json").read_text(encoding="utf-8"))["version"] == version
