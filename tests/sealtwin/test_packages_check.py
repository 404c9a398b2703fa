"""A package digitise, simulate or validate of another distribution is refused before it is imported."""

import os
import subprocess
import sys

from tests.support.paths import ROOT


def test_a_foreign_package_of_the_same_name_is_refused_with_a_remedy(tmp_path):
    """For example configobj installs a package validate; here such a package is first on the path."""
    other = tmp_path / "validate" / "__init__.py"
    other.parent.mkdir()
    other.write_text("raise SystemExit('the foreign package was imported')")
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), str(ROOT)])}
    command = [sys.executable, "-m", "sealtwin", "--version"]
    answer = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert answer.returncode == 1
    assert str(other) in answer.stderr.splitlines()[-1]
    assert "uv tool install" in answer.stderr.splitlines()[-1]
