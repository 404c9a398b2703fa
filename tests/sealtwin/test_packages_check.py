"""A package digitise, simulate or validate of another distribution is refused before it is imported."""

import os
import subprocess
import sys

from tests.support.paths import ROOT

FILES = "import builtins, io; builtins.open = io.open = None; import sealtwin, sys; sys.exit('validate' in sys.modules)"


def answer_beside_a_foreign_package(tmp_path, *arguments: str) -> "subprocess.CompletedProcess[str]":
    """For example configobj installs a package validate; here such a package is first on the path."""
    other = tmp_path / "validate" / "__init__.py"
    other.parent.mkdir()
    other.write_text("raise SystemExit('the foreign package was imported')")
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), str(ROOT)])}
    command = [sys.executable, *arguments]
    return subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)


def test_a_command_beside_a_foreign_package_is_refused_with_a_remedy(tmp_path):
    answer = answer_beside_a_foreign_package(tmp_path, "-m", "sealtwin", "run", "trial.toml")
    (line,) = answer.stderr.splitlines()
    assert answer.returncode == 3
    assert str(tmp_path / "validate" / "__init__.py") in line
    assert "uv tool install" in line


def test_importing_sealtwin_opens_no_file_and_imports_no_package_of_that_name(tmp_path):
    assert answer_beside_a_foreign_package(tmp_path, "-c", FILES).returncode == 0
