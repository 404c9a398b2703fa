"""Kinds of cases: what is damaged, and the command that reads it."""

import random
import shlex
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import NamedTuple

from benchmarks.fuzz_lab import MESHES, PLAN
from benchmarks.fuzz_mutations import ODD, flipped, reboxed, rekeyed, repainted, reworded

OPTIONS = (
    *("--mm-per-px", "--depth-mm", "--ends", "--via", "--roi", "--face-mm", "--width-mm", "--set"),
    *("--mask", "--preset", "--seed"),
    *("--jobs", "--out", "--markers", "--json", "--quiet", "--threads"),
    *("--device", "--units", "--data"),
    *("--format", "--cell", "--batch", "--line", "--width-mm", "--walls", "--caliper"),
)
WORDS = (
    *("", "-", "--", "0", "-1", "1,2", "1,2 3,4", "40,101", "160,98", "0,1", "1_0", "nan", "1e400", "crack.png", "."),
    *("trial.toml", "run", "..", "notes.txt", "/dev/null", "/nowhere", "\u202e", "x" * 5000, "160x40"),
    *("lean", "all", "z", "mm", "cpu", "cuda:9", "readings.csv", "run/solid.json", "1/2", "2/1", "*"),
    *("crack.tilt=steep", "photo.via_px=[[1,2]]", "photo.edge_fraktion=0.7", "seed=-1", "a.b.c.d.e=1", "fluid=", "=1"),
)
LINES = (
    "digitise crack.png --depth-mm 8 --mm-per-px 0.4 --ends 40,101 160,98 --set path.volume_ml=3 --out new",
    "digitise crack.png --depth-mm 8 --face-mm 80x80 --set photo.face_corners_px=[[0,199],[199,199],[199,0],[0,0]] "
    "--out new",
    "digitise crack.png --depth-mm 8 --set photo.ruler_px=[[0,0],[100,0]] --set photo.ruler_mm=40 --ends 40,101 160,98 "
    "--via 100,100 --out new",
    "digitise trial.toml --out new --json",
    "simulate run --threads 1 --device cpu --set output.snapshots_s=[0.1]",
    "validate run --device cpu --json",
    "import-mesh block.stl --units mm --set mesh.up=z --out new",
    "robot run --cell cell.toml --format spel,csv --out robot",
    "sweep study.toml --dry-run --jobs 1 --batch 1 --out sweep",
    "compare run twin --out compared",
    "markers --face-mm 160x40 --out frame.pdf --size-mm 16 --count 8 --paper a4 --toml frame.toml",
    "ingest photos --out ingested --dry-run",
    "map study --any-volume --out new",
    "init new",
    "quick quick.png --depth-mm 3 --mm-per-px 0.1 --ends 20,61 270,58 --out new --device cpu",
    "export run --format mask,dxf --out new",
    "import-dxf crack.dxf --depth-mm 8 --line MIDDLE --width-mm 3 --units mm --out new",
)
"""Lines whose words are replaced, taken out, doubled and joined by others."""


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

    def odd(self) -> str:
        return self.chance.choice((*WORDS, *ODD))


MUTATIONS = {".png": repainted, ".heic": reboxed, ".json": rekeyed} | dict.fromkeys((".stl", ".ply", ".glb"), flipped)


class Kind(NamedTuple):
    """Files of which one is damaged, and commands of which one reads it."""

    files: tuple[str, ...]  # Named twice: damaged twice as often
    commands: tuple[str, ...]
    options: str = ""  # A value of these is odd in ``ODD_OPTION`` of the cases


ODD_OPTION = 0.4
MADE = "--data synthetic --density-kg-m3 1690"
FRAMED = f"{MADE} --date 2026-11-21 --out new.toml"
BY_FILES: Mapping[str, Kind] = {
    "photo": Kind(("crack.png",), ("digitise trial.toml --out new",)),
    "HEIC": Kind(
        ("phone.heic",), ("digitise phone.heic --depth-mm 10 --mm-per-px 0.1 --ends 22,60 398,110 --out new",)
    ),
    "mesh": Kind(tuple(f"block.{suffix}" for suffix in MESHES), ("import-mesh {file} --units mm --out new",)),
    "drawing": Kind(
        ("crack.dxf",),
        (
            "import-dxf crack.dxf --depth-mm 8 --walls UPPER LOWER --out new",
            "import-dxf crack.dxf --depth-mm 8 --line MIDDLE --width-mm 3 --out new",
        ),
    ),
    "trial.toml": Kind(("trial.toml",), ("digitise trial.toml --out new", "digitise trial.toml --out run")),
    "cell.toml": Kind(("cell.toml",), ("robot run --cell cell.toml",)),
    "study.toml": Kind(("study.toml",), ("sweep study.toml --dry-run --out sweep --jobs 1",)),
    "sheet": Kind(("readings.csv",), ("run trial.toml --out run",)),
    "lab's folder": Kind(("photos/P01.png", "photos/P01.csv", "photos/lab.toml"), ("ingest photos --out new",)),
    # One that is accepted is digitised, poured and drawn in seconds.
    "quick": Kind(
        ("quick.png", "quick.png", "levels.csv", "depths.csv"),
        ("quick quick.png --out new --device cpu",),
        "--depth-mm depths.csv --mm-per-px 0.1 --ends 20,61 270,58 --caliper levels.csv",
    ),
    "pump": Kind(("pump.csv", "pump.csv", "pumped.toml"), ("robot run --cell pumped.toml",)),
    "material": Kind(("material.toml", "material.toml", "pasted.toml"), ("digitise pasted.toml --out new",)),
    "rheometer": Kind(("curve.csv",), (f"material rheometer curve.csv {MADE} --out new.toml",)),
    "spread": Kind(
        ("spread.png", "spread.png", "frame.toml"),
        (f"material spread spread.png --markers frame.toml {FRAMED}",),
        "--face-mm 150x150 --mass-g 30",
    ),
    "fill": Kind(("fill.csv", "fill.csv", "filled.toml"), ("run filled.toml --out new --device cpu --quiet",)),
    # One that is accepted is searched and poured, which takes a quarter minute.
    "plan": Kind(
        ("planned.toml", "planned.toml", "cell.toml"),
        (f"{PLAN} --out new",),
        "--cell cell.toml --margin-mm 0.5 --flow-max-mm3-s 400",
    ),
    "path from a table": Kind(
        ("path_table.csv", "path_table.csv", "path_table.toml"), ("digitise path_table.toml --out new",)
    ),
}


def of_files(case: Case, kind: Kind) -> list[str]:
    file = case.chance.choice(kind.files)
    case.damage(file)
    options = shlex.split(kind.options)
    values = [number for number, word in enumerate(options) if not word.startswith("--")]
    if values and not case.sound and case.chance.random() < ODD_OPTION:
        options[case.chance.choice(values)] = case.odd()
    return [*shlex.split(case.chance.choice(kind.commands).format(file=file)), *options]


def of_command_line(case: Case) -> list[str]:
    chance, line = case.chance, shlex.split(LINES[0] if case.sound else case.chance.choice(LINES))
    for _ in range(0 if case.sound else chance.choice((1, 1, 2, 4))):
        number = chance.randrange(1, len(line) + 1)
        match chance.randrange(4):
            case 0 | 1:
                line[number : number + 1] = [case.odd()]
            case 2:
                line[number : number + 1] = []
            case _:
                line[number:number] = [
                    chance.choice(OPTIONS),
                    *([chance.choice(WORDS)] if chance.random() < 0.7 else []),
                ]
    return line


def of_calibrate(case: Case) -> list[str]:
    """Damage trial, sheet or options of a calibration that is refused before any run: it holds its own trial out."""
    chance, free = case.chance, ["fluid.U=3:300", "fluid.D_cm=0.03:0.3"]
    if case.sound:
        return ["calibrate", "--help"]
    if chance.random() < 0.6:
        case.damage(chance.choice(("trial.toml", "trial.toml", "readings.csv", "crack.png")))
    else:
        number, word = chance.randrange(2), case.odd()
        free[number] = chance.choice((word, f"fluid.U={word}:3", f"{word}=1:3", f"fluid.U=1:{word}", f"{word}:3"))
    options = [word for text in free for word in ("--free", text)]
    return ["calibrate", "trial.toml", *options, "--hold-out", "twin.toml", "--out", "new", "--device", "cpu"]


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
    "command line": of_command_line,
    "calibrate": of_calibrate,
    **{name: partial(of_files, kind=kind) for name, kind in BY_FILES.items()},
    **{f"{folder} folder": partial(of_folder, folder=folder) for folder in READ_BY},
}
