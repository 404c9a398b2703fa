"""Kinds of cases: what is damaged, and the command that reads it."""

import random
import shlex
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import NamedTuple

from benchmarks.fuzz_lab import MESHES, PLAN
from benchmarks.fuzz_mutations import flipped, reboxed, rekeyed, repainted, reworded


@dataclass(frozen=True)
class Case:
    """One mutated input, in a folder of its own."""

    chance: random.Random
    lab: Path
    sound: bool = False  # True for an input as it is

    def damage(self, name: str) -> None:
        """Mutate a file as its suffix says; text if it says nothing else."""
        path = self.lab / name
        if not self.sound:
            path.write_bytes(MUTATIONS.get(path.suffix, reworded)(path.read_bytes(), self.chance))


MUTATIONS = {".png": repainted, ".heic": reboxed, ".json": rekeyed} | dict.fromkeys((".stl", ".ply", ".glb"), flipped)


class Kind(NamedTuple):
    """Files of which one is damaged, and commands of which one reads it."""

    files: tuple[str, ...]  # Named twice: damaged twice as often
    commands: tuple[str, ...]


BY_FILES: Mapping[str, Kind] = {
    "photo": Kind(("crack.png",), ("digitise trial.toml --out new",)),
    "HEIC": Kind(
        ("phone.heic",), ("digitise phone.heic --depth-mm 10 --mm-per-px 0.1 --ends 22,60 398,110 --out new",)
    ),
    "mesh": Kind(
        tuple(f"block.{suffix}" for suffix in MESHES),
        ("digitise {file} --units mm --set mesh.data=synthetic --out new",),
    ),
    "drawing": Kind(
        ("crack.dxf",),
        (
            "digitise crack.dxf --depth-mm 8 --walls UPPER LOWER --out new",
            "digitise crack.dxf --depth-mm 8 --line MIDDLE --width-mm 3 --out new",
        ),
    ),
    "trial.toml": Kind(("trial.toml",), ("digitise trial.toml --out new", "digitise trial.toml --out run")),
    "cell.toml": Kind(("cell.toml",), ("robot run --cell cell.toml",)),
    "study.toml": Kind(("study.toml",), ("sweep study.toml --dry-run --out sweep --jobs 1",)),
    "sheet": Kind(("readings.csv",), ("run trial.toml --out run",)),
    "lab's folder": Kind(("photos/P01.png", "photos/P01.csv", "photos/lab.toml"), ("ingest photos --out new",)),
    "fill": Kind(("fill.csv", "fill.csv", "filled.toml"), ("run filled.toml --out new --device cpu --quiet",)),
    # One that is accepted is searched and poured, which takes a quarter minute.
    "plan": Kind(
        ("planned.toml", "planned.toml", "cell.toml"),
        (f"{PLAN} --cell cell.toml --margin-mm 0.5 --flow-max-mm3-s 400 --out new",),
    ),
}


def of_files(case: Case, kind: Kind) -> list[str]:
    file = case.chance.choice(kind.files)
    case.damage(file)
    return shlex.split(case.chance.choice(kind.commands).format(file=file))


def of_folder(case: Case, folder: str) -> list[str]:
    """Damage a file of a folder that commands wrote, most often a JSON, and let a command read it back."""
    suffixes = (".json",) if case.chance.random() < 0.7 else (".csv", ".toml")
    listed = sorted(path for path in (case.lab / folder).rglob("[!.]*") if path.suffix in suffixes)
    # Particle runs of a finished plan are not read again.
    path = case.chance.choice([path for path in listed if "verification" not in path.parts])
    case.damage(str(path.relative_to(case.lab)))
    return shlex.split(case.chance.choice(READ_BY[folder]))


READ_BY = {
    "run": (
        "validate run --device cpu --quiet",
        "compare run twin",
        "robot run --cell cell.toml --quiet",
        "export run --format mask,dxf --out drawn",
        "run trial.toml --out run --device cpu --quiet",
    ),
    "study": (
        "map study --any-volume",
        "sweep study.toml --out study --device cpu --jobs 1 --quiet",
    ),
    "ingested": (
        "lab ingested --device cpu --jobs 1 --quiet",
        "ingest photos --out ingested",
    ),
    "plan": (
        "digitise planned.toml --out plan/sample",
        "robot plan/sample --cell cell.toml --quiet",
    ),
}
"""Commands that read a folder back."""
KINDS: dict[str, Callable[[Case], list[str]]] = {
    **{name: partial(of_files, kind=kind) for name, kind in BY_FILES.items()},
    **{f"{folder} folder": partial(of_folder, folder=folder) for folder in READ_BY},
}
