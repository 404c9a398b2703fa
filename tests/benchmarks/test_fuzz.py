"""The benchmark of mutated inputs: it finds what it is there to find, and today's command passes it."""

import random
import time
from pathlib import Path

import pytest
import typer

from benchmarks import fuzz
from tests.studies import tiny_lab

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
        case "refuses":
            raise typer.Exit(3)


@pytest.mark.parametrize(
    ("what", "outcome"),
    [
        ("loses", "file lost"),
        ("moves", "accepted"),
        ("raises", "traceback"),
        ("hangs", "too long"),
        ("refuses", "one sentence"),
        ("ends", "accepted"),
    ],
)
def test_each_failure_is_told_from_an_answer(tmp_path, monkeypatch, what, outcome):
    sound = tmp_path / "sound"
    (sound / "run").mkdir(parents=True)
    for name, text in fuzz.MINE.items():
        (sound / name).write_text(text)
    monkeypatch.setattr(fuzz, "app", app)
    monkeypatch.setattr(fuzz, "LONGEST_S", 1)
    monkeypatch.setitem(fuzz.KINDS, "pretended", lambda _: [what])
    assert fuzz.judged("pretended", 0, 0, sound, tmp_path / "case")[0] == outcome


@pytest.mark.parametrize("mutate", [fuzz.flipped, fuzz.reworded, fuzz.rekeyed, fuzz.repainted])
def test_a_mutation_follows_from_its_seed_and_changes_something(mutate, tmp_path):
    tiny_lab(tmp_path)
    content = (
        b'{"a": [1, 2], "b": {"c": "x"}}' if mutate is not fuzz.repainted else (tmp_path / "crack.png").read_bytes()
    )
    made = [mutate(content, random.Random(number)) for number in range(30)]
    assert made == [mutate(content, random.Random(number)) for number in range(30)]
    assert sum(one != content for one in made) > 20


@pytest.mark.slow
def test_a_hundred_mutated_inputs_end_with_an_answer():
    outcomes = fuzz.fuzz(100, 1, list(fuzz.KINDS), None)
    assert sum(outcomes[kind][failure] for kind in outcomes for failure in fuzz.FAILURES) == 0
