"""The built wheel and source archive are complete, and the wheel works without this checkout."""

import json
import os
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path

import pytest

from sealtwin.trial.starter_files import DEMO
from tests.support.paths import FIXTURE, ROOT

pytestmark = pytest.mark.slow
PACKAGES = ("sealtwin", "digitise", "simulate", "validate")
BIN = "Scripts" if sys.platform == "win32" else "bin"


def _run(*command, code=0):
    """Run a program without the variables of this environment and return its standard output and errors."""
    names = {name: value for name, value in os.environ.items() if name not in {"VIRTUAL_ENV", "PYTHONPATH"}}
    line, at = [str(part) for part in command], Path(command[0]).parent
    answer = subprocess.run(line, cwd=at, env=names, capture_output=True, text=True, check=False)
    assert answer.returncode == code, answer.stdout + answer.stderr
    return answer.stdout, answer.stderr


def _environment(folder):
    subprocess.run([sys.executable, "-m", "venv", str(folder)], check=True)
    return folder / BIN / "python"


def _pip(python, *arguments):
    _run(python, "-m", "pip", "--quiet", "--disable-pip-version-check", *arguments)


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """The source archive, and the wheel that is built from the archive and not from the checkout."""
    folder = tmp_path_factory.mktemp("built")
    python = _environment(folder / "tools")
    _pip(python, "install", "hatchling")
    keep = shutil.ignore_patterns(".venv", ".git", "__pycache__", ".*_cache")
    shutil.copytree(ROOT, folder / "source", ignore=keep)
    script = "import os, sys; os.chdir(sys.argv[1]); from hatchling.build import build_sdist; build_sdist(sys.argv[2])"
    _run(python, "-c", script, folder / "source", folder)
    (source,) = folder.glob("*.tar.gz")
    _pip(python, "wheel", "--no-deps", "--wheel-dir", folder, source)
    (wheel,) = folder.glob("*.whl")
    return source, wheel


@pytest.fixture(scope="module")
def installed(built, tmp_path_factory):
    """Python of an environment with the wheel and what it depends on."""
    python = _environment(tmp_path_factory.mktemp("installed") / "environment")
    _pip(python, "install", built[1], "--constraint", ROOT / "constraints.txt")
    return python


def test_the_wheel_contains_all_files_of_the_packages_and_no_other_files(built):
    with zipfile.ZipFile(built[1]) as wheel:
        names = set(wheel.namelist())
    ours = {
        path.relative_to(ROOT).as_posix()
        for package in PACKAGES
        for path in (ROOT / package).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    demo = {name for name in names if name.startswith("sealtwin/demo/")}
    information = {name for name in names if name.split("/")[0].endswith(".dist-info")}
    assert names - demo - information == ours
    assert demo == {f"sealtwin/demo/{folder}/{file}" for folder, files in DEMO.items() for file in files}


def test_the_source_archive_contains_the_files_for_tests_and_reproduction(built):
    with tarfile.open(built[0]) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    wanted = {
        "constraints.txt", "Makefile", "tests/support/paths.py",
        "benchmarks/paper_trial.py", "fixtures/paper-trial/photo.jpg",
        "fixtures/generate/specimen.py", "reports/reproduction/reproduce.py", "docs/decisions/layout.md",
    }  # fmt: skip
    assert wanted <= names
    assert not [name for name in names if name.startswith((".venv", "reports/paper-trial"))]


def test_the_installed_command_digitises_a_photo_and_runs_the_demo(installed, tmp_path):
    command = installed.parent / "sealtwin"
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    assert _run(command, "--version")[0].strip() == project["version"]
    assert json.loads(_run(command, "doctor", "--json")[0])["healthy"] is True
    options = ["--depth-mm", "16", "--mm-per-px", "0.1", "--ends", "780,600", "1340,300", "--out", tmp_path / "crack"]
    _run(command, "digitise", FIXTURE / "photo.jpg", *options)
    assert (tmp_path / "crack" / "crack.stl").stat().st_size > 10_000
    place = "from sealtwin.trial.starter_files import shipped_trial, DEMO; print(*map(shipped_trial, DEMO), sep='\\n')"
    shipped, real = (Path(line) for line in _run(installed, "-c", place)[0].splitlines())
    assert shipped.is_relative_to(installed.parents[1])
    assert (shipped / "photo.jpg").read_bytes() == (FIXTURE / "photo.jpg").read_bytes()
    assert "CC BY 4.0" in (real / "LICENCE.txt").read_text("utf-8")
