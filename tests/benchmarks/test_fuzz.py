"""The benchmark of mutated inputs classifies how commands end."""

import os
import time
from pathlib import Path

import psutil
import pytest
import typer

from benchmarks import fuzz_endings, fuzz_process
from benchmarks.fuzz_lab import MINE

app = typer.Typer()


@app.command()
def pretend(what: str) -> None:
    """A command with the faults that are looked for."""
    match what:
        case "loses":
            Path(".notes.2024.txt").unlink()
        case "moves":
            Path(".notes.2024.txt").rename("kept.txt")
        case "raises":
            raise KeyError(what)
        case "hangs":
            time.sleep(3)
        case "breaks":
            os.abort()
        case "refuses":
            raise typer.Exit(3)


@pytest.mark.parametrize(
    ("what", "outcome"),
    [
        ("loses", "file lost"),
        ("moves", "accepted"),
        ("raises", "traceback"),
        ("hangs", "too long"),
        ("breaks", "traceback"),
        ("refuses", "one sentence"),
        ("ends", "accepted"),
    ],
)
def test_the_fuzz_benchmark_classifies_each_ending_of_a_command(tmp_path, monkeypatch, what, outcome):
    sound = tmp_path / "sound"
    (sound / "run").mkdir(parents=True)
    for name, text in MINE.items():
        (sound / name).write_text(text)
    monkeypatch.setattr(fuzz_process, "app", app)
    if what == "hangs":  # Any other ends by itself, however busy the machine
        monkeypatch.setattr(fuzz_process, "HANGS_S", 1)
    # This process has grown by other tests.
    monkeypatch.setattr(fuzz_endings, "LARGEST_GB", psutil.Process().memory_info().rss / 1e9 + 0.2)
    monkeypatch.setitem(fuzz_endings.KINDS, "pretended", lambda _: [what])
    assert fuzz_endings.judged("pretended", 0, 0, sound, tmp_path / "case").outcome == outcome
