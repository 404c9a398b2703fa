"""Another distribution's digitise, simulate or validate is named, with its cure, before it is imported."""

import json
import os
import shutil
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

from sealtwin.packages_check import MARK, PACKAGES, foreign_package
from tests.places import ROOT

NOT_TO_BE_RUN = "raise SystemExit('the foreign package was imported')\n"


@pytest.fixture
def other(tmp_path):
    """A folder first on the path, into which configobj installed a package validate, and with our installed script."""
    (tmp_path / "validate").mkdir()
    (tmp_path / "validate" / "__init__.py").write_text(NOT_TO_BE_RUN)
    (tmp_path / "sealtwin").write_text("from sealtwin.cli.app import main\nmain()\n")
    information = tmp_path / "configobj-5.0.9.dist-info"
    information.mkdir()
    (information / "METADATA").write_text("Metadata-Version: 2.1\nName: configobj\nVersion: 5.0.9\n")
    (information / "RECORD").write_text("validate/__init__.py,,\nconfigobj-5.0.9.dist-info/METADATA,,\n")
    return tmp_path


def _python(first, *arguments):
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(first), str(ROOT)])}
    return subprocess.run(
        [sys.executable, *arguments], cwd=first, env=environment, capture_output=True, text=True, check=False
    )


@pytest.mark.parametrize(
    ("code", "command"),
    [
        pytest.param(3, ("-m", "sealtwin", "--version"), marks=pytest.mark.broad),
        pytest.param(3, ("sealtwin", "doctor", "--json"), marks=pytest.mark.broad),
        (1, ("-c", "import sealtwin")),
    ],
)
def test_package_distribution_and_cure_are_named(other, code, command):
    answer = _python(other, *command)
    assert answer.returncode == code
    *above, line = answer.stderr.splitlines()
    assert str(other / "validate" / "__init__.py") in line
    assert "configobj" in line
    assert "uv tool install" in line
    assert not above or line.startswith("sealtwin.core.errors.InputError: ")
    if "--json" in command:
        content = json.loads(answer.stdout)
        assert content["exit_code"] == 3
        assert "configobj" in content["error"]
    else:
        assert answer.stdout == ""


@pytest.mark.broad
def test_a_script_of_the_users_own_of_that_name_blames_no_distribution(tmp_path):
    (tmp_path / "simulate.py").write_text(NOT_TO_BE_RUN)
    answer = _python(tmp_path, "-m", "sealtwin", "doctor")
    assert answer.returncode == 3
    assert str(tmp_path / "simulate.py") in answer.stderr
    assert "rename" in answer.stderr


@pytest.mark.broad
def test_a_package_overwritten_in_place_is_found_out(tmp_path):
    """As pip does it: the file lies where ours lay."""
    for name in ("sealtwin", *PACKAGES):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_bytes((ROOT / name / "__init__.py").read_bytes())
    shutil.copytree(ROOT / "sealtwin", tmp_path / "sealtwin", dirs_exist_ok=True)
    assert _python(tmp_path, "-c", "import sealtwin").returncode == 0
    (tmp_path / "validate" / "__init__.py").write_text(NOT_TO_BE_RUN)
    answer = _python(tmp_path, "-c", "import sealtwin")
    assert "validate" in answer.stderr.splitlines()[-1]


@pytest.mark.parametrize("name", PACKAGES)
def test_each_package_bears_the_mark(name):
    assert MARK in Path(str(import_module(name).__file__)).read_text(encoding="utf-8").splitlines()
    assert foreign_package() is None
