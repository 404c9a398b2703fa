"""Kinds of cases: what is damaged, and the command that reads it."""

import random
import shlex
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from benchmarks.fuzz_lab import MESHES, PLAN
from benchmarks.fuzz_mutations import ODD, flipped, reboxed, rekeyed, repainted, reworded

OPTIONS = (
    *("--mm-per-px", "--depth-mm", "--ends", "--via", "--roi", "--face-mm", "--width-mm", "--set"),
    *("--mask", "--preset", "--seed"),
    *("--jobs", "--out", "--markers", "--json", "--quiet", "--threads"),
    *("--device", "--units", "--data"),
    *("--format", "--cell", "--batch", "--line", "--width-mm", "--walls", "--outline", "--caliper"),
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
    "simulate run --threads 1 --device cpu --set output.frames_every_s=0.1",
    "validate run --device cpu --json",
    "import-mesh block.stl --units mm --set mesh.up=z --out new",
    "robot run --cell cell.toml --format all --out robot",
    "sweep study.toml --dry-run --jobs 1 --batch 1 --out sweep",
    "compare run twin --out compared",
    "markers --face-mm 160x40 --out frame.pdf --size-mm 16 --count 8 --paper a4 --toml frame.toml",
    "film run --out fill.gif",
    "ingest photos --out ingested --dry-run",
    "lab show ingested P01",
    "map study --any-volume --out new",
    "init new",
    "quick quick.png --depth-mm 3 --mm-per-px 0.1 --ends 20,61 270,58 --out new --device cpu",
    "export run --format mask,coco,dxf --out new",
    "import-dxf crack.dxf --depth-mm 8 --line MIDDLE --width-mm 3 --units mm --out new",
)
"""Lines whose words are replaced, taken out, doubled and joined by others."""


@dataclass(frozen=True)
class Case:
    """One mutated input, in a folder of its own."""

    chance: random.Random
    lab: Path
    sound: bool = False  # True for an input as it is

    def damage(self, name: str, mutate: Callable[[bytes, random.Random], bytes]) -> None:
        path = self.lab / name
        if not self.sound:
            path.write_bytes(mutate(path.read_bytes(), self.chance))


def of_photo(case: Case) -> list[str]:
    case.damage("crack.png", repainted)
    return ["digitise", "trial.toml", "--out", "new"]


def of_heic(case: Case) -> list[str]:
    case.damage("phone.heic", reboxed)
    return shlex.split("digitise phone.heic --depth-mm 10 --mm-per-px 0.1 --ends 22,60 398,110 --out new")


def of_mesh(case: Case) -> list[str]:
    own = f"block.{case.chance.choice(MESHES)}"
    case.damage(own, reworded if own.endswith("obj") else flipped)
    return ["import-mesh", own, "--units", "mm", "--out", "new"]


def of_drawing(case: Case) -> list[str]:
    case.damage("crack.dxf", reworded)
    how = case.chance.choice(([], ["--line", "MIDDLE", "--width-mm", "3"]))
    return ["import-dxf", "crack.dxf", "--depth-mm", "8", *how, "--out", "new"]


def of_command_line(case: Case) -> list[str]:
    chance, line = case.chance, shlex.split(LINES[0] if case.sound else case.chance.choice(LINES))
    for _ in range(0 if case.sound else chance.choice((1, 1, 2, 4))):
        at = chance.randrange(1, len(line) + 1)
        match chance.randrange(4):
            case 0 | 1:
                line[at : at + 1] = [chance.choice((*WORDS, *ODD))]
            case 2:
                line[at : at + 1] = []
            case _:
                line[at:at] = [chance.choice(OPTIONS), *([chance.choice(WORDS)] if chance.random() < 0.7 else [])]
    return line


def of_trial(case: Case) -> list[str]:
    case.damage("trial.toml", reworded)
    return ["digitise", "trial.toml", "--out", case.chance.choice(("new", "run"))]


def of_cell(case: Case) -> list[str]:
    case.damage("cell.toml", reworded)
    return ["robot", "run", "--cell", "cell.toml", "--format", "all"]


def of_study(case: Case) -> list[str]:
    case.damage("study.toml", reworded)
    return ["sweep", "study.toml", "--dry-run", "--out", "sweep", "--jobs", "1"]


def of_sheet(case: Case) -> list[str]:
    case.damage("readings.csv", reworded)
    return ["run", "trial.toml", "--out", "run"]


def of_lab(case: Case) -> list[str]:
    case.damage(f"photos/{case.chance.choice(('P01.png', 'P01.csv', 'lab.toml'))}", reworded)
    return ["ingest", "photos", "--out", "new"]


def of_pump(case: Case) -> list[str]:
    case.damage(case.chance.choice(("pump.csv", "pump.csv", "pumped.toml")), reworded)
    return ["robot", "run", "--cell", "pumped.toml", "--format", "all"]


def of_material(case: Case) -> list[str]:
    if case.sound or case.chance.random() < 0.7:
        case.damage(case.chance.choice(("material.toml", "material.toml", "pasted.toml")), reworded)
        return ["digitise", "pasted.toml", "--out", "new"]
    case.damage("curve.csv", reworded)
    return ["material", "rheometer", "curve.csv", "--density-kg-m3", "1690", "--data", "synthetic", "--out", "new.toml"]


def of_fill(case: Case) -> list[str]:
    case.damage(case.chance.choice(("fill.csv", "fill.csv", "filled.toml")), reworded)
    return ["run", "filled.toml", "--out", "new", "--device", "cpu", "--quiet"]


def of_calibrate(case: Case) -> list[str]:
    """Damage trial, sheet or options of a calibration that is refused before any run: it holds its own trial out."""
    chance, free = case.chance, ["fluid.U=3:300", "fluid.D_cm=0.03:0.3"]
    if case.sound:
        return ["calibrate", "--help"]
    if chance.random() < 0.6:
        case.damage(chance.choice(("trial.toml", "trial.toml", "readings.csv", "crack.png")), reworded)
    else:
        at, word = chance.randrange(2), chance.choice((*WORDS, *ODD))
        free[at] = chance.choice((word, f"fluid.U={word}:3", f"{word}=1:3", f"fluid.U=1:{word}", f"{word}:3"))
    options = [word for text in free for word in ("--free", text)]
    return ["calibrate", "trial.toml", *options, "--hold-out", "twin.toml", "--out", "new", "--device", "cpu"]


def of_plan(case: Case) -> list[str]:
    """Damage what a plan is made from. One that is accepted is searched and poured, which takes a quarter minute."""
    case.damage(case.chance.choice(("planned.toml", "planned.toml", "cell.toml", "draws.csv")), reworded)
    limits = "--cell cell.toml --posterior draws.csv --margin-mm 0.5 --flow-max-mm3-s 400"
    return [*shlex.split(PLAN), *_reworded_line(case, limits), "--out", "new"]


def of_quick(case: Case) -> list[str]:
    """Damage a photo, a sheet or an option; one that is accepted is digitised, poured and drawn in seconds."""
    damaged = (("quick.png", repainted), ("quick.png", repainted), ("levels.csv", reworded), ("depths.csv", reworded))
    name, mutate = case.chance.choice(damaged)
    case.damage(name, mutate)
    options = (
        f"--depth-mm {name if name == 'depths.csv' else 3} --mm-per-px 0.1 --ends 20,61 270,58 --caliper levels.csv"
    )
    return ["quick", "quick.png", *_reworded_line(case, options, 0.25), "--out", "new", "--device", "cpu"]


def of_folder(case: Case, folder: str) -> list[str]:
    """Damage a file of a folder that commands wrote, most often a JSON, and let a command read it back."""
    kinds = (".json",) if case.chance.random() < 0.7 else (".csv", ".toml")
    listed = sorted(path for path in (case.lab / folder).rglob("[!.]*") if path.suffix in kinds)
    # Particle runs of a finished plan are not read again.
    path = case.chance.choice([path for path in listed if "verification" not in path.parts])
    case.damage(str(path.relative_to(case.lab)), rekeyed if path.suffix == ".json" else reworded)
    return shlex.split(case.chance.choice(READ_BY[folder]))


def of_path_table(case: Case) -> list[str]:
    case.damage(case.chance.choice(("path_table.csv", "path_table.csv", "path_table.toml")), reworded)
    return ["digitise", "path_table.toml", "--out", "new"]


def of_spread(case: Case) -> list[str]:
    return _photographed(case, "spread", "spread.png", "frame.toml", SPREAD)


def of_bead(case: Case) -> list[str]:
    return _photographed(case, "bead", "bead.png", "narrow.toml", BEAD)


def _photographed(case: Case, method: str, photo: str, frame: str, options: str) -> list[str]:
    case.damage(*case.chance.choice(((photo, repainted), (photo, repainted), (frame, reworded))))
    sheet = ["--markers", frame, "--data", "synthetic", "--density-kg-m3", "1690", "--date", "2026-11-21"]
    return ["material", method, photo, *sheet, *_reworded_line(case, options), "--out", "new.toml"]


def _reworded_line(case: Case, options: str, share: float = 0.4) -> list[str]:
    """Return the words of a line of options, in this share of cases with an odd value in place of one."""
    words = shlex.split(options)
    values = [number for number, word in enumerate(words) if not word.startswith("--")]
    if not case.sound and case.chance.random() < share:
        words[case.chance.choice(values)] = case.chance.choice((*WORDS, *ODD))
    return words


SPREAD = "--face-mm 150x150 --mass-g 30"
BEAD = "--face-mm 90x60 --mass-g 4.36 --asked-mm3-s 320 --speed-mm-s 5 --start-mm 22,30"
READ_BY = {
    "run": (
        "validate run --device cpu --quiet",
        "compare run twin",
        "robot run --cell cell.toml --format all --quiet",
        "export run --format mask,coco,dxf --out drawn",
        "run trial.toml --out run --device cpu --quiet",
    ),
    "study": (
        "sweep status study",
        "map study --any-volume",
        "sweep study.toml --out study --device cpu --jobs 1 --quiet",
    ),
    "ingested": (
        "lab list ingested",
        "lab show ingested P01",
        "lab export ingested --out lab.csv",
        "ingest photos --out ingested",
    ),
    "plan": (
        "digitise planned.toml --out plan/sample",
        "robot plan/sample --cell cell.toml --quiet",
    ),
}
"""Commands that read a folder back."""
KINDS: dict[str, Callable[[Case], list[str]]] = {
    "photo": of_photo,
    "HEIC": of_heic,
    "command line": of_command_line,
    "mesh": of_mesh,
    "drawing": of_drawing,
    "trial.toml": of_trial,
    "cell.toml": of_cell,
    "study.toml": of_study,
    "sheet": of_sheet,
    "lab's folder": of_lab,
    **{f"{folder} folder": partial(of_folder, folder=folder) for folder in READ_BY},
    "quick": of_quick,
    "pump": of_pump,
    "material": of_material,
    "spread": of_spread,
    "bead": of_bead,
    "fill": of_fill,
    "calibrate": of_calibrate,
    "plan": of_plan,
    "path from a table": of_path_table,
}
NEWER = {
    *("quick", "import-mesh", "import-dxf", "ingest", "lab", "map", "export", "robot", "markers", "film", "material"),
    *("plan", "calibrate"),
}
"""Commands that were added last: at least half of the cases call one."""
