"""Plain package names are easy to shadow: each must be the one in this checkout, and cheap to start."""

import importlib
import subprocess
import sys
import tomllib
from itertools import chain
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent


@pytest.mark.parametrize("name", ["sealtwin", "digitise", "simulate", "validate"])
def test_package_is_the_one_in_this_checkout(name):
    found = importlib.import_module(name).__file__
    assert found is not None
    assert Path(found).parent == ROOT / name


def test_help_loads_no_heavy_library():
    """What makes --help instant: counted in modules, since a timed test fails on a busy machine."""
    script = (
        "import sys, sealtwin.cli.app;"
        "heavy = ('warp', 'cv2', 'trimesh', 'scipy', 'matplotlib', 'numpy', 'pydantic');"
        "print([name for name in heavy if name in sys.modules])"
    )
    loaded = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout
    assert loaded.strip() == "[]"


def test_constraints_pin_every_dependency_and_no_address():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    wanted = [*project["dependencies"], *chain.from_iterable(project["optional-dependencies"].values())]
    lines = (ROOT / "constraints.txt").read_text().splitlines()
    pinned = {line.split("==")[0].lower().replace("_", "-") for line in lines}
    assert {name.split(">=")[0].lower() for name in wanted} <= pinned
    assert all("==" in line and "/" not in line for line in lines)
