"""What the README tells a newcomer to type works when typed."""

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.coarse import make_coarse

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")


def _commands() -> list[str]:
    """Lines of the README's shell blocks, without their comments."""
    blocks = re.findall(r"^```sh\n(.*?)^```", README, flags=re.MULTILINE | re.DOTALL)
    lines = [re.sub(r"\s+#.*", "", line).strip() for block in blocks for line in block.splitlines()]
    return [line for line in lines if line]


def test_every_make_target_named_exists():
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), flags=re.MULTILINE))
    named = set(re.findall(r"(?:^|`)make ([a-z-]+)", README, flags=re.MULTILINE))
    assert {"demo", "test"} <= named <= targets


def test_every_file_and_folder_named_exists():
    named = set(re.findall(r"\]\(([^)#:]+)\)", README)) | set(re.findall(r"`((?:fixtures|reports)/[\w./-]+)`", README))
    made_by_commands = {"reports/paper-trial/"}
    missing = [name for name in named - made_by_commands if not (ROOT / name).exists()]
    assert not missing


def test_sealtwin_commands_run_in_the_order_given(tmp_path):
    """With the fixture's trial made coarse: the same commands, in seconds."""
    make_coarse(tmp_path / "fixtures" / "paper-trial")
    commands = [line for line in _commands() if line.split()[0] in {"sealtwin", ".venv/bin/sealtwin"}]
    assert len(commands) >= 6
    for line in commands:
        arguments = shlex.split(line)[1:]
        answer = subprocess.run(
            [sys.executable, "-m", "sealtwin", *arguments],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=False,
        )
        assert answer.returncode == 0, f"{line}\n{answer.stderr}"
    assert (tmp_path / "reports" / "paper-trial" / "report.html").is_file()
    assert (tmp_path / "reports" / "crack" / "crack.stl").is_file()


@pytest.mark.slow
def test_make_demo_and_plain_pip_in_a_copy_without_an_environment(tmp_path):
    """The newcomer's way: nothing installed, the demo by make, then the pip lines up to the tests."""
    keep = shutil.ignore_patterns(".venv", ".git", "__pycache__", "reports", ".*_cache")
    shutil.copytree(ROOT, tmp_path / "clone", ignore=keep)
    environment = {name: value for name, value in os.environ.items() if name not in {"VIRTUAL_ENV", "PYTHONPATH"}}
    demo = subprocess.run(
        ["make", "demo"], cwd=tmp_path / "clone", env=environment, capture_output=True, text=True, check=False
    )
    assert demo.returncode == 0, demo.stderr
    assert "Report: reports/paper-trial/report.html" in demo.stdout
