"""Another distribution's digitise, simulate or validate is named, with its cure, before it is imported."""

import os
import subprocess
import sys

from tests.support.paths import ROOT

NOT_TO_BE_RUN = "raise SystemExit('the foreign package was imported')\n"


def _python(first, *arguments):
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(first), str(ROOT)])}
    return subprocess.run(
        [sys.executable, *arguments], cwd=first, env=environment, capture_output=True, text=True, check=False
    )


def test_the_package_of_another_and_the_cure_are_named(tmp_path):
    """As configobj installs a package validate, first on the path."""
    (tmp_path / "validate").mkdir()
    (tmp_path / "validate" / "__init__.py").write_text(NOT_TO_BE_RUN)
    answer = _python(tmp_path, "-m", "sealtwin", "--version")
    assert answer.returncode == 1
    line = answer.stderr.splitlines()[-1]
    assert str(tmp_path / "validate" / "__init__.py") in line
    assert "uv tool install" in line


def test_a_script_of_the_users_own_of_that_name_blames_no_distribution(tmp_path):
    (tmp_path / "simulate.py").write_text(NOT_TO_BE_RUN)
    answer = _python(tmp_path, "-m", "sealtwin", "doctor")
    assert answer.returncode == 1
    assert str(tmp_path / "simulate.py") in answer.stderr
    assert "rename" in answer.stderr
