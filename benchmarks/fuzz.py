"""Damaged inputs: each command ends with an exit code and a sentence, and no file of the user's is lost.

    python -m benchmarks.fuzz [--cases 1000] [--seed 0] [--only KIND ...] [--keep DIR]

A case takes a sound input of its kind, mutates it, and calls one command on it in a copy of a small lab. It fails by a
traceback (or exit code 1, a bug), by taking over a minute, or where bytes that the user wrote are on no disk any more.
Cases follow from seed and number alone; --keep leaves the folders of those that failed. Every kind is first called with
its input as it is, which must be accepted: mutating what is refused anyway would find nothing.
"""

import argparse
import json
import random
import re
import shlex
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import chdir, contextmanager
from dataclasses import dataclass
from datetime import date
from hashlib import sha256
from pathlib import Path
from types import FrameType
from typing import Any

import cv2
import ezdxf.filemanagement
import numpy as np
from ezdxf import units
from typer.testing import CliRunner

from benchmarks.table import Row, finish
from sealtwin.cli.app import app
from sealtwin.material.by_rheometer import material_of_table
from sealtwin.material.material_text import material_text
from sealtwin.trial.starter_files import CELL
from tests.lab_folder import DEFAULTS
from tests.pictures import mortar, with_crack, write_png
from tests.spreads import BEAD_FACE_MM, BeadPhoto, Blob, write_sheet_table
from tests.studies import TRIAL, plannable_lab

LONGEST_S = 60
MESHES = ("stl", "ply", "glb", "obj", "off")
AS_IT_IS = -1  # Number of the case of a kind whose input is left as it is
MINE = {
    "notes.txt": "mine",
    ".notes.2024.txt": "mine too",
    "run/.crack.12345.stl": "mine as well",
    "run/remark.md": "m",
}
"""Files of the user's that no command is told of."""
ODD = (
    *("0", "-1", "1e300", "1e-300", "nan", "inf", "1_0", "0,1", "999999999999999999999", "0x10", '""', '"x"', "[]"),
    *("[[]]", "{}", "true", "[1, 2, 3]", '"../../notes.txt"', '"\\u202e"', "1979-05-27", '"cavity"', "[nan, 1]"),
)
"""Values in place of a sound one."""
OPTIONS = (
    *("--mm-per-px", "--depth-mm", "--ends", "--via", "--roi", "--face-mm", "--face-corners", "--ruler", "--ruler-mm"),
    *("--mask", "--second-photo", "--edge-fraction", "--tilt", "--wall-angle-deg", "--volume-ml", "--jobs", "--out"),
    *("--markers", "--assumed", "--keep-branches", "--json", "--quiet", "--threads", "--device", "--frames-every-s"),
    *(
        "--units",
        "--up",
        "--base-mm",
        "--dam-height-mm",
        "--path",
        "--data",
        "--format",
        "--cell",
        "--shard",
        "--batch",
        "--line",
        "--width-mm",
        "--walls",
        "--outline",
        "--caliper",
    ),
)
WORDS = (
    *("", "-", "--", "0", "-1", "1,2", "1,2 3,4", "40,101", "160,98", "0,1", "1_0", "nan", "1e400", "crack.png", "."),
    *("trial.toml", "run", "..", "notes.txt", "/dev/null", "/nowhere", "\u202e", "x" * 5000, "160x40"),
    *("lean", "all", "z", "mm", "cpu", "cuda:9", "readings.csv", "run/solid.json", "1/2", "2/1", "*"),
)
LINES = (
    "digitise crack.png --depth-mm 8 --mm-per-px 0.4 --ends 40,101 160,98 --volume-ml 3 --out new",
    "digitise crack.png --depth-mm 8 --face-mm 80x80 --face-corners '0,199 199,199 199,0 0,0' --out new",
    "digitise crack.png --depth-mm 8 --ruler '0,0 100,0' --ruler-mm 40 --ends 40,101 160,98 --via 100,100 --out new",
    "digitise trial.toml --out new --json",
    "simulate run --threads 1 --device cpu --frames-every-s 0.1",
    "validate run --device cpu --json",
    "import-mesh block.stl --units mm --up z --out new",
    "robot run --cell cell.toml --format all --out robot",
    "sweep study.toml --dry-run --jobs 1 --batch 1 --shard 1/2 --out sweep",
    "compare run twin --out compared",
    "markers --face-mm 160x40 --out frame.pdf --size-mm 16 --count 8 --paper a4 --toml frame.toml",
    "film run --out fill.gif",
    "ingest photos --out ingested --dry-run",
    "lab list ingested",
    "init new",
    "quick crack.png --depth-mm 8 --mm-per-px 0.4 --ends 40,101 160,98 --out new --device cpu",
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


def flipped(content: bytes, chance: random.Random) -> bytes:
    """Change, cut, double or take out some bytes."""
    changed = bytearray(content)
    for _ in range(chance.choice((1, 1, 2, 5, 20))):
        at = chance.randrange(len(changed) or 1)
        match chance.randrange(5):
            case 0 | 1:
                changed[at : at + 1] = bytes([chance.randrange(256)])
            case 2:
                del changed[at : at + chance.choice((1, 4, 100))]
            case 3:
                changed[at:at] = changed[at : at + chance.choice((1, 4, 100))]
            case _:
                changed = changed[: chance.randrange(len(changed) + 1)] if chance.random() < 0.3 else changed
    return bytes(changed)


def reworded(content: bytes, chance: random.Random) -> bytes:
    """Change lines, values and words of a text; a quarter of the time bytes alone."""
    if chance.random() < 0.25:
        return flipped(content, chance)
    lines = content.decode("utf-8", "replace").splitlines()
    for _ in range(chance.choice((1, 1, 1, 2, 4))):
        at = chance.randrange(len(lines) or 1)
        line = lines[at] if lines else ""
        values = [*re.finditer(r"(?<==)\s*[^#\n]+|[-\d.]+|\"[^\"]*\"", line)]
        match chance.randrange(6):
            case 0 | 1 | 2 if values:
                value = chance.choice(values)
                lines[at] = f"{line[: value.start()]} {chance.choice(ODD)}{line[value.end() :]}"
            case 3:
                lines[at : at + 1] = []
            case 4:
                lines.insert(chance.randrange(len(lines) + 1), line)
            case _:
                letter = chance.randrange(len(line) + 1)
                lines[at : at + 1] = [
                    line[:letter] + chance.choice((*'x_ "]=;', "\t", "\ufeff", "\x00")) + line[letter:]
                ]
    return "\n".join(lines).encode()


def rekeyed(content: bytes, chance: random.Random) -> bytes:
    """Replace, remove or add something in a JSON; a fifth of the time bytes alone."""
    if chance.random() < 0.2:
        return flipped(content, chance)
    tree = json.loads(content)
    for _ in range(chance.choice((1, 1, 2))):
        here: Any = tree
        above, key = here, None
        while isinstance(here, dict | list) and here and (key is None or chance.random() < 0.75):
            above, key = here, chance.choice([*here] if isinstance(here, dict) else range(len(here)))
            here = above[key]
        if key is None:
            continue
        odd = (None, -1, 0, 1e308, "x", [], {}, [[]], True, [1], {"a": 1}, "../../notes.txt", -0.0, 10**30)
        if chance.random() < 0.2:
            del above[key]
        else:
            above[key] = chance.choice(odd)
    return json.dumps(tree).encode()


def repainted(content: bytes, chance: random.Random) -> bytes:
    """Change a picture: its size, depth, channels and places in it; a third of the time bytes alone."""
    if chance.random() < 0.33:
        return flipped(content, chance)
    decoded = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_COLOR)
    assert decoded is not None
    picture = decoded.astype(float)
    height, width = picture.shape[:2]
    match chance.randrange(5):
        case 0:
            size = (chance.choice((1, 7, 100, 333, 1500)), chance.choice((1, 9, 100, 333, 1500)))
            picture = cv2.resize(picture, size)
        case 1:
            picture = picture * chance.choice((-1, 0, 0.1, 3)) + chance.choice((0, 40, 255))
        case 2:
            for _ in range(chance.choice((1, 5, 40))):
                corner, other = ((chance.randrange(width), chance.randrange(height)) for _ in range(2))
                picture = cv2.line(picture, corner, other, [chance.randrange(256)] * 3, chance.choice((1, 8, 30)))
        case 3:
            picture = np.roll(picture, chance.randrange(width), axis=chance.randrange(2))
        case _:
            picture += np.random.default_rng(chance.randrange(100)).normal(0, chance.choice((5, 50)), picture.shape)
    kind, channels = chance.choice((np.uint8, np.uint8, np.uint16)), chance.choice((1, 3, 4))
    picture = np.clip(picture, 0, 255).astype(kind) * (257 if kind is np.uint16 else 1)
    shown = picture[..., 0] if channels == 1 else np.dstack([picture, picture[..., :1]])[..., :channels]
    return cv2.imencode(chance.choice((".png", ".png", ".tif", ".webp" if kind is np.uint8 else ".png")), shown)[
        1
    ].tobytes()


def of_photo(case: Case) -> list[str]:
    case.damage("crack.png", repainted)
    return ["digitise", "trial.toml", "--out", "new"]


def of_mesh(case: Case) -> list[str]:
    own = f"block.{case.chance.choice(MESHES)}"
    case.damage(own, reworded if own.endswith(("obj", "off")) else flipped)
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
    return ["ingest", "photos", "--out", "ingested"]


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
    given = {"--cell": "cell.toml", "--posterior": "draws.csv", "--margin-mm": "0.5", "--flow-max-mm3-s": "400"}
    if not case.sound and case.chance.random() < 0.4:
        given[case.chance.choice([*given])] = case.chance.choice((*WORDS, *ODD))
    options = [word for option, value in given.items() for word in (option, value)]
    coarse = ["--knots", "3", "--verify", "1", "--seeds", "1", "--device", "cpu", "--quiet"]
    return ["plan", "planned.toml", *options, *coarse, "--out", "new"]


def of_loop(case: Case) -> list[str]:
    """Damage a finished plan, its tables or a log, which is answered again: no particle is poured."""
    names = ("loop.json", "plan.json", "sample/solid.json", "sample/outline.json")
    name = case.chance.choice((*names, "loop-1.jsonl", "loop-1.jsonl", "plan.csv", "level.csv", "trial.toml"))
    case.damage(f"plan/{name}", rekeyed if name.endswith(".json") else reworded)
    return ["loop", "plan", "--replay", "plan/loop-1.jsonl"]


def of_faults(case: Case) -> list[str]:
    """Damage the faults of an emulated pour; one that is accepted takes a quarter minute."""
    case.damage("faults.toml", reworded)
    return ["loop", "plan", "--emulate", "faults.toml", "--quiet"]


def of_steered(case: Case) -> list[str]:
    case.damage(case.chance.choice(("steered.csv", "steered.csv", "steered.toml")), reworded)
    return ["digitise", "steered.toml", "--out", "new"]


def of_spread(case: Case) -> list[str]:
    return _photographed(case, "spread", "spread.png", "frame.toml", SPREAD)


def of_bead(case: Case) -> list[str]:
    return _photographed(case, "bead", "bead.png", "narrow.toml", BEAD)


def _photographed(case: Case, method: str, photo: str, frame: str, sound: dict[str, str]) -> list[str]:
    case.damage(*case.chance.choice(((photo, repainted), (photo, repainted), (frame, reworded))))
    given = dict(sound)
    if not case.sound and case.chance.random() < 0.4:
        given[case.chance.choice([*given])] = case.chance.choice((*WORDS, *ODD))
    options = [word for option, value in given.items() for word in (option, value)]
    return ["material", method, photo, "--markers", frame, *options, "--data", "synthetic", "--out", "new.toml"]


def of_run_folder(case: Case) -> list[str]:
    chance = case.chance
    names = ("outline.json", "solid.json", "simulation.json", "comparison.json", "manifest.json", "trajectory.csv")
    name = chance.choice((*names, "profile.csv", "particles.csv", "trial.toml"))
    case.damage(f"run/{name}", rekeyed if name.endswith("json") else reworded)
    verb = chance.choice((["validate", "run"], ["compare", "run", "twin"], ["robot", "run", "--cell", "cell.toml"]))
    return [*verb, "--quiet"] if verb[0] != "compare" else verb


SPREAD = {"--face-mm": "150x150", "--mass-g": "30", "--density-kg-m3": "1690", "--date": "2026-11-21"}
"""Options of a flat heap, which no slump is replayed for."""
BEAD = {
    **{"--face-mm": "90x60", "--mass-g": "4.36", "--density-kg-m3": "1690", "--date": "2026-11-21"},
    **{"--asked-mm3-s": "320", "--speed-mm-s": "5", "--start-mm": "22,30"},
}
KINDS: dict[str, Callable[[Case], list[str]]] = {
    "photo": of_photo,
    "command line": of_command_line,
    "mesh": of_mesh,
    "drawing": of_drawing,
    "trial.toml": of_trial,
    "cell.toml": of_cell,
    "study.toml": of_study,
    "sheet": of_sheet,
    "lab's folder": of_lab,
    "run folder": of_run_folder,
    "pump": of_pump,
    "material": of_material,
    "spread": of_spread,
    "bead": of_bead,
    "fill": of_fill,
    "calibrate": of_calibrate,
    "plan": of_plan,
    "loop": of_loop,
    "faults": of_faults,
    "steered path": of_steered,
}


def sound_lab(folder: Path) -> None:
    """Write a small lab with a finished run and a plan, which no case changes: each takes a copy."""
    import trimesh

    plannable_lab(folder)
    drawing = ezdxf.filemanagement.new(units=units.MM)
    edge = [(0, 0), (20, 1), (40, 0), (40, 3), (20, 4), (0, 3)]
    drawing.modelspace().add_lwpolyline(edge, close=True, dxfattribs={"layer": "OUTLINE"})
    drawing.modelspace().add_spline([(0, 1.5, 0), (20, 2.5, 0), (40, 1.5, 0)], dxfattribs={"layer": "MIDDLE"})
    drawing.saveas(folder / "crack.dxf")
    (folder / "trial.toml").write_text(TRIAL + "\n[output]\nsnapshots_s = []\n")
    # Beside trial.toml it is refused for its name, when both are read.
    (folder / "twin.toml").write_text(TRIAL.replace("calibrated-on", "held-out"))
    _sound_paste_and_pump(folder)
    (folder / "fill.csv").write_text("mass_g,level_mm\n0.10,-4\n0.17,-2\n0.25,0\n")
    filled = TRIAL.replace('tilt = "vertical"', 'tilt = "flare"\nfill = "fill.csv"')
    (folder / "filled.toml").write_text(filled + "\n[output]\nsnapshots_s = []\n")
    photos = folder / "photos"
    photos.mkdir()
    # Longer than that of trial.toml: nobody gives its ends.
    longer = with_crack(mortar((200, 400)), [(10, 101), (150, 97), (250, 103), (390, 98)], 20)
    write_png(photos / "P01.png", longer)
    shutil.copy(folder / "readings.csv", photos / "P01.csv")
    (photos / "lab.toml").write_text(DEFAULTS.replace("[crack]", "[crack]\ndepth_mm = 8.0"))
    made = ["--device", "cpu", "--quiet", "--out"]
    with chdir(folder):
        for command in (
            ["run", "trial.toml", *made, "run"],
            ["plan", "planned.toml", "--knots", "3", "--verify", "1", "--seeds", "1", *made, "plan"],
            ["loop", "plan", "--emulate", "faults.toml", "--quiet"],
        ):
            answer = CliRunner().invoke(app, command)
            if answer.exit_code not in (0, 5):
                raise RuntimeError(answer.output)
    shutil.copy(folder / "plan" / "plan.csv", folder / "steered.csv")
    steered = re.sub(r"(?s)\[path\].*?\n\n", '[path]\nplan = "steered.csv"\n\n', (folder / "planned.toml").read_text())
    (folder / "steered.toml").write_text(steered)
    shutil.copytree(folder / "run", folder / "twin")
    mesh = trimesh.load_mesh(folder / "run" / "crack.stl")
    # As it is, the crack is shorter than the trims of a path.
    mesh.apply_scale(10.0)
    for kind in MESHES:
        mesh.export(folder / f"block.{kind}")
    for name, text in MINE.items():
        (folder / name).write_text(text)


def _sound_paste_and_pump(folder: Path) -> None:
    """Write a spread with its frame, a flow curve, a material with its trial, and weighings with their cell."""
    Blob(55.0, mm_per_px=0.5).write(folder / "spread.png")
    write_sheet_table(folder / "frame.toml")
    BeadPhoto(8.0).write(folder / "bead.png")
    write_sheet_table(folder / "narrow.toml", BEAD_FACE_MM)
    (folder / "curve.csv").write_text("shear_rate_per_s,stress_pa\n1,12.5\n3,13.4\n10,17.2\n30,27.1\n100,62\n")
    pump = '[pump]\nfile = "pump.csv"\ndensity_kg_m3 = 1690.0\n\n[spel] '
    (folder / "pumped.toml").write_text(CELL.replace("{file}", "pumped.toml").replace("[spel] ", pump, 1))
    rows = [f"{asked},{asked * 0.0017 * 20:.4f},20,0.3" for asked in (1, 1, 1, 10, 10, 10, 3000, 3000, 3000)]
    (folder / "pump.csv").write_text("\n".join(["asked_mm3_s,weighed_g,time_s,delay_s", *rows]) + "\n")
    day = date(2026, 11, 21)
    paste = material_of_table(folder / "curve.csv", 1690.0, None, "synthetic", day)
    (folder / "material.toml").write_text(material_text(paste))
    head, rest = TRIAL.split("[fluid]\n")
    fluid = 'material = "material.toml"\nfreeze_after_s = 0.5\n\n'
    content = f"{head}[fluid]\n{fluid}{rest[rest.index('[solver]') :]}\n[output]\nsnapshots_s = []\n"
    (folder / "pasted.toml").write_text(content)


def written_by_user(lab: Path) -> dict[str, str]:
    """Return hashes of what must be on the disk afterwards under any name: all but what a command may renew."""
    renewed = {"manifest.json", "run.json", "progress.json", "health.csv", "health.png", "trial.toml"}
    kept = {path for path in lab.rglob("*") if path.is_file() and not (path.parent != lab and path.name in renewed)}
    stages = {lab / "run" / name for name in ("report.html", "report.pdf", "report.json", ".lock", ".holder.json")}
    return {str(path.relative_to(lab)): sha256(path.read_bytes()).hexdigest() for path in kept - stages}


@contextmanager
def no_longer_than(limit_s: int) -> Iterator[None]:
    def ring(_: int, __: FrameType | None) -> None:
        raise TimeoutError(f"over {limit_s} s")

    signal.signal(signal.SIGALRM, ring)
    signal.alarm(limit_s)
    try:
        yield
    finally:
        signal.alarm(0)


def judged(kind: str, number: int, seed: int, sound: Path, lab: Path) -> tuple[str, str]:
    """Return the outcome of a case in the folder ``lab``, and what is to be told of a failure."""
    shutil.copytree(sound, lab)
    case = Case(random.Random(f"{kind} {number} {seed}"), lab, sound=number == AS_IT_IS)
    arguments = KINDS[kind](case)
    before = written_by_user(lab)
    told = f"{kind} {number}: sealtwin {' '.join(repr(word)[:80] for word in arguments)}"
    with chdir(lab):
        try:
            with no_longer_than(LONGEST_S):
                answer = CliRunner().invoke(app, arguments)
        except TimeoutError as late:
            return "too long", f"{told}: {late}"
    fault = answer.exception
    if answer.exit_code == 1 or (fault is not None and not isinstance(fault, SystemExit)):
        trace = "".join(traceback.format_exception(fault)) if fault is not None else answer.output
        return "too long" if isinstance(fault, TimeoutError) else "traceback", f"{told}\n{trace}"
    after = {sha256(path.read_bytes()).hexdigest() for path in lab.rglob("*") if path.is_file()}
    # A stage that was redone renews its own files; those of the sound lab are no user's.
    made = [sound / name for name in before if "/" in name and (sound / name).is_file()]
    ours = {sha256(path.read_bytes()).hexdigest() for path in made}
    ours -= {sha256(text.encode()).hexdigest() for text in MINE.values()}
    if lost := [name for name, digest in before.items() if digest not in after and digest not in ours]:
        return "file lost", f"{told}: lost {', '.join(lost)}"
    return {0: "accepted", 2: "usage", 5: "accepted", 130: "traceback"}.get(
        answer.exit_code, "one sentence"
    ), f"{told}\n{answer.output}"


def fuzz(cases: int, seed: int, kinds: list[str], keep: Path | None) -> dict[str, Counter[str]]:
    """Run cases of each kind in turn; return the outcomes by kind, and print failures as they come."""
    outcomes = {kind: Counter[str]() for kind in kinds}
    with tempfile.TemporaryDirectory(prefix="sealtwin-fuzz-") as home:
        sound = Path(home) / "sound"
        sound_lab(sound)
        for kind in kinds:
            outcome, told = judged(kind, AS_IT_IS, seed, sound, Path(home) / kind)
            if outcome != "accepted":
                raise RuntimeError(f"{kind}: a sound input ended with: {outcome}; {told}")
        for number in range(cases):
            kind = kinds[number % len(kinds)]
            lab = Path(home) / f"case-{number}"
            outcome, told = judged(kind, number, seed, sound, lab)
            outcomes[kind][outcome] += 1
            if outcome in FAILURES:
                print(f"{outcome}: {told}", file=sys.stderr, flush=True)
                if keep is not None:
                    shutil.copytree(lab, keep / f"{number}", dirs_exist_ok=True)
            shutil.rmtree(lab)
    return outcomes


FAILURES = ("traceback", "too long", "file lost")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", nargs="+", choices=KINDS, default=list(KINDS), metavar="KIND")
    parser.add_argument("--keep", type=Path)
    asked = parser.parse_args()
    began = time.monotonic()
    outcomes = fuzz(asked.cases, asked.seed, asked.only, asked.keep)
    for kind, found in outcomes.items():
        told = ", ".join(f"{count} {name}" for name, count in found.most_common())
        print(f"{kind:<13} {found.total():4d}: {told}")
    total = sum(outcomes.values(), Counter[str]())
    print(f"{total.total()} cases in {time.monotonic() - began:.0f} s")
    # A file lost is one case, however many it lost.
    finish([Row(f"mutated inputs that end with: {name}", total[name], "", high=0) for name in FAILURES])


if __name__ == "__main__":
    main()
