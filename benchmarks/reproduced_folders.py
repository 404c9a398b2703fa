"""Folders and caches that a reproduction needs beside its files, made by the commands themselves."""

import os
import subprocess
import sys
from pathlib import Path

from tests.studies import tiny_lab
from tests.wrong_inputs.processes import OUTCOME, study_of

CACHE = "cache"
"""Folder of the kernels of a reproduction: the user's own must stay as it is."""


def _sealtwin(folder: Path, *words: str) -> None:
    line = [sys.executable, "-m", "sealtwin", *words, "--quiet"]
    subprocess.run(line, cwd=folder, env=os.environ, capture_output=True, check=True)


def digitised(folder: Path) -> None:
    """Make RUN: a tiny trial, digitised."""
    tiny_lab(folder)
    _sealtwin(folder, "digitise", "trial.toml", "--out", "RUN")


def damaged_kernels(folder: Path) -> None:
    """Make a cache with the self-test's kernels, and cut each object short, as a power cut does."""
    environment = {**os.environ, "WARP_CACHE_PATH": str(folder / CACHE)}
    subprocess.run([sys.executable, "-m", "sealtwin", "doctor"], env=environment, capture_output=True, check=True)
    for kernel in (folder / CACHE).rglob("*.o"):
        os.truncate(kernel, 0)


def filmed(folder: Path) -> None:
    """Make RUN with frames, the first of which is a link to a device without end."""
    digitised(folder)
    _sealtwin(folder, "simulate", "RUN", "--device", "cpu", "--set", "output.frames_every_s=0.3")
    frame = min((folder / "RUN" / "frames").glob("*.vtp"))
    frame.unlink()
    frame.symlink_to("/dev/zero")


def filmed_by_a_pipe(folder: Path) -> None:
    """Make RUN with frames, the first of which is a pipe that nobody writes to."""
    filmed(folder)
    frame = min((folder / "RUN" / "frames").glob("*.vtp"))
    frame.unlink()
    os.mkfifo(frame)


def looped(folder: Path) -> None:
    """Make PLAN, whose tables are a link to a device without end."""
    (folder / "PLAN").mkdir()
    (folder / "PLAN" / "loop.json").symlink_to("/dev/zero")
    (folder / "PLAN" / "loop-1.jsonl").write_text("{}\n", encoding="utf-8")


def outcome_of_a_list(folder: Path) -> None:
    """Make STUDY, whose run took a list of seconds."""
    (folder / "STUDY").mkdir()
    study_of({**OUTCOME, "wall_s": [1, 2]})(folder / "STUDY")
