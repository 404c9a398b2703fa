"""A change that must not change results, as a renamed module, is compared with the revision before the change.

    SEALTWIN_BEFORE=main pytest -m slow tests/slow/test_golden.py

Each command below is run by the code of that revision and by this checkout's, in folders with the same files. Every
value, word, vertex and picture that they write must be equal, except for what NOT_COMPARED lists.
"""

import csv
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from fnmatch import fnmatchcase
from hashlib import sha256
from itertools import zip_longest
from pathlib import Path

import numpy as np
import pytest
import trimesh

from tests.shown_output import FACTS, NOTE
from tests.support.lab_folder import make_lab_folder
from tests.support.meshes import mesh_of, modelled, slotted
from tests.support.paths import FIXTURE, ROOT
from tests.support.photos import mortar, with_crack, write_png
from tests.support.robot_cells import TAUGHT_CELL
from tests.support.shapes import wandering_crack
from tests.support.tiny_study import tiny_lab

BEFORE = os.environ.get("SEALTWIN_BEFORE", "")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not BEFORE, reason="SEALTWIN_BEFORE names no revision to compare with"),
]
NOT_COMPARED = (
    "*#*wall_time_s",
    "*#*wall_s",
    "*#*setup_s*",
    "*#*frames_s*",
    "*#*eta_s",
    "*manifest.json#*/versions/*",
    "*record.json#sealtwin",
    "*catalogue.json#checked/*",
    "*#*made_by",
    "*.lock#*",
    "*.sqlite#*",
    "*report.pdf#*",  # Compressed, with its date; report.html says the same
)
"""Patterns of FILE#KEY: durations, versions, and results that a change changes on purpose, until it is merged.

A key is its path, as stages/digitise/key, or a row and a column. FACTS, as dates and hashes, are compared in no text.
"""
BINARY = {".glb", ".gz", ".jpg", ".npy", ".npz", ".ply", ".png", ".stl", ".vtp", ".xlsx"}

LINE = [(50, 118), (130, 108), (220, 120), (310, 102)]
PHOTOS = {
    "steep": ([(80, 190), (130, 130), (170, 95), (240, 25)], 18),
    "narrow": (LINE, 10),
    "wide": (LINE, 32),
    "plain": (LINE, 14),
    "open": ([(-20, 90), (90, 116), (200, 98), (380, 125)], 15),
}
"""Points and width in pixels of the crack of each photo."""
SCALED = "--depth-mm 8 --mm-per-px 0.1"
ENDS = "--ends 50,118 310,102"
COARSE = "--set solver.radius_mm=0.78 --set gate.mean_error_mm=20"
COMMANDS = {
    "trial-flare": f"run paper/trial.toml {COARSE} --set crack.tilt=flare --set crack.wall_angle_deg=5.5"
    " --set solver.settle_s=0.2 --set path.speed_mm_s=10 --set output.snapshots_s=[] --device cpu --out {out}",
    "trial-lean": f"run paper/trial-paper.toml {COARSE} --device cpu --out {{out}}",
    "trace-steep": "digitise steep.png --depth-mm 8 --mm-per-px 0.12 --ends 80,190 240,25 --set crack.tilt=flare"
    " --set crack.wall_angle_deg=[4,9] --set path.volume_ml=0.6 --out {out}",
    "trace-narrow": f"digitise narrow.png {SCALED} {ENDS} --set crack.tilt=vertical --set photo.edge_fraction=0.6"
    " --out {out}",
    "trace-wide": f"digitise wide.png {SCALED} {ENDS} --set crack.tilt=funnel --out {{out}}",
    "trace-lit": f"digitise lit.png {SCALED} {ENDS} --out {{out}}",
    "trace-branches": f"digitise branches.png {SCALED} {ENDS} --set photo.branches=keep --set crack.tilt=vertical"
    " --out {out}",
    # Without ends: a path between given ends depends on distances whose last bits OpenCV changes between calls.
    "trace-mask": f"digitise plain.png {SCALED} --mask mask.png --out {{out}}",
    "trace-via": f"digitise loop.png {SCALED} {ENDS} --via '150,160 220,165' --set crack.tilt=vertical --out {{out}}",
    "trace-choice": f"digitise plain.png {SCALED} --set photo.scale_is=assumed --set photo.crack=1"
    " --roi '20,60 340,170' --out {out}",
    "trace-reversed": "digitise plain.png --depth-mm depths.csv --ends 310,102 50,118 --set photo.ruler_mm=32"
    " --set photo.ruler_px=[[20,200],[340,200]] --set crack.tilt=flare --set crack.wall_angle_deg=5 --out {out}",
    "trace-open": "digitise open.png --depth-mm 8 --face-mm 32x18 --ends 20,99 340,119"
    " --set photo.face_corners_px=[[20,200],[340,200],[340,20],[20,20]] --out {out}",
    "mesh-stl": "import-mesh block.stl --units cm --set mesh.data=synthetic --out {out}",
    "mesh-ply": "import-mesh block.ply --units mm --set mesh.data=synthetic --set mesh.up=y --out {out}",
    "mesh-glb": "import-mesh block.glb --units m --set mesh.data=synthetic --set path.volume_ml=1.5 --out {out}",
    "sweep": "sweep tiny/study.toml --device cpu --jobs 1 --out {out}",
    "ingest": "ingest measurements --out {out}",
    # Sheets in centimetres, in inches, with gaps, and in a workbook; the others are read by ingest.
    **{
        f"sheet-{sample}": f"run ingest/{sample}/trial.toml --device cpu --out {{out}}"
        for sample in ("P03", "P08", "P09", "P10")
    },
    "robot": "robot trial-flare --cell cell.toml --out {out}",
}
"""Words behind ``sealtwin`` by the folder for what they write, {out}; later ones use the folders of earlier ones."""


@pytest.fixture(scope="module")
def sides(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Path, Path]]:
    """Yield the folders with what the commands wrote by the revision's code and by this checkout's."""
    top = tmp_path_factory.mktemp("golden")
    make_inputs(top / "inputs")
    tree = top / "tree"
    subprocess.run(["git", "worktree", "add", "--quiet", "--detach", str(tree), BEFORE], cwd=ROOT, check=True)
    try:
        yield run_commands(top, tree, "before"), run_commands(top, ROOT, "here")
    finally:
        subprocess.run(["git", "worktree", "remove", "--force", str(tree)], cwd=ROOT, check=True)


@pytest.mark.parametrize("name", COMMANDS)
def test_each_command_writes_the_same_files_as_the_previous_revision(sides: tuple[Path, Path], name: str):
    before, here = (files_of(side / name) for side in sides)
    assert "answer.json" in before
    differences = [file for file in before.keys() ^ here.keys() if is_compared(file, "")]
    for file in sorted(before.keys() & here.keys()):
        values, new_values = (dict(values_of(path)) for path in (before[file], here[file]))
        differences += [
            f"{file}#{key}: {values.get(key)!r} -> {new_values.get(key)!r}"
            for key in sorted(values.keys() | new_values.keys())
            if is_compared(file, key) and (key not in values or key not in new_values or values[key] != new_values[key])
        ]
    assert not differences, "\n".join(differences[:30])


def make_inputs(folder: Path) -> None:
    shutil.copytree(FIXTURE, folder / "paper")
    make_lab_folder(folder / "measurements")
    tiny_lab(folder / "tiny")
    (folder / "cell.toml").write_text(TAUGHT_CELL, encoding="utf-8")
    (folder / "depths.csv").write_text("s_mm,depth_mm\n0,6.0\n8,7.5\n16,9.0\n26,8.0\n", encoding="utf-8")
    grounds = [mortar((360, 220), seed=seed) for seed in range(1, 6)]
    for ground, (name, (points_px, width_px)) in zip(grounds, PHOTOS.items(), strict=True):
        write_png(folder / f"{name}.png", with_crack(ground, points_px, width_px))
    write_png(folder / "mask.png", np.where(with_crack(np.ones((220, 360)), LINE, 15) < 0.5, 1.0, 0.0))
    # A lamp from the side lights the wall opposite to it.
    photo = with_crack(grounds[0] * np.linspace(1.3, 0.8, 360), LINE, 22)
    strip = 1 - with_crack(np.ones((220, 360)), [(x, y + 5) for x, y in LINE], 4)
    write_png(folder / "lit.png", photo + 0.15 * strip)
    side, loop = [(180, 114), (210, 160), (225, 190)], [(110, 110), (150, 160), (220, 165), (260, 112)]
    for name, other, width_px in (("branches", side, 10), ("loop", loop, 12)):
        write_png(folder / f"{name}.png", with_crack(with_crack(grounds[1], LINE, 14), other, width_px))
    vertices, faces = mesh_of(slotted())
    outlined, its_faces = modelled(wandering_crack(1), depth_mm=8.0, tilt="vertical")
    for name, points, triangles in (
        ("block.stl", vertices / 10, faces),
        ("block.ply", outlined[:, [0, 2, 1]] * (1.0, 1.0, -1.0), its_faces),
        ("block.glb", vertices / 1000, faces),
    ):
        trimesh.Trimesh(points, triangles, process=False).export(folder / name)


def run_commands(top: Path, code: Path, side: str) -> Path:
    """Run the commands by a checkout's code, always in the same folder, since paths are in files; then rename it."""
    work = top / "work"
    shutil.copytree(top / "inputs", work)
    environment = os.environ | {"PYTHONPATH": str(code), "SOURCE_DATE_EPOCH": "0", "COLUMNS": "100"}
    for name, command in COMMANDS.items():
        (work / name).mkdir()
        words = [*shlex.split(command.format(out=name)), "--json"]
        ended = subprocess.run(
            [sys.executable, "-m", "sealtwin", *words], cwd=work, env=environment, capture_output=True, encoding="utf-8"
        )
        assert ended.returncode == 0, f"{side}: {name}: exit code {ended.returncode}\n{ended.stderr[-2000:]}"
        (work / name / "answer.json").write_text(ended.stdout, encoding="utf-8")
        notes = [line for line in ended.stderr.splitlines() if NOTE.match(line)]
        (work / name / "answer.txt").write_text("\n".join(notes), encoding="utf-8")
    # Folders are named by a hash of the settings' names.
    with (work / "sweep" / "runs.csv").open(encoding="utf-8") as runs:
        for run in csv.DictReader(runs):
            (work / "sweep" / run["folder"]).rename(work / "sweep" / "runs" / run["number"])
    (sample,) = (work / "sweep" / "samples").iterdir()
    sample.rename(sample.with_name("sample"))
    return work.rename(top / side)


def files_of(folder: Path) -> dict[str, Path]:
    return {path.relative_to(folder).as_posix(): path for path in folder.rglob("*") if path.is_file()}


def is_compared(file: str, key: str) -> bool:
    return not any(fnmatchcase(f"{file}#{key}", pattern) for pattern in NOT_COMPARED)


def values_of(path: Path) -> Iterator[tuple[str, object]]:
    """Yield each value of a JSON or CSV file, each line of another text, and the hash of other files, by a key."""
    if path.suffix in BINARY:
        yield "sha256", sha256(path.read_bytes()).hexdigest()
        return
    text = path.read_bytes().decode("utf-8", errors="surrogateescape")
    if path.suffix == ".json":
        yield from leaves_of(json.loads(text))
    elif path.suffix == ".csv":
        header, *rows = [*csv.reader(text.splitlines())] or [[]]
        for number, row in enumerate(rows, 1):
            for column, value in zip_longest(header, row, fillvalue=""):
                yield f"{number}/{column}", settled(value)
    else:
        for number, line in enumerate(text.splitlines(), 1):
            yield f"line {number}", settled(line)


def leaves_of(value: object, key: str = "") -> Iterator[tuple[str, object]]:
    parts = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else None
    if parts is None:
        # As text, so that 1 is not 1.0 and NaN is itself.
        yield key, settled(value) if isinstance(value, str) else repr(value)
    elif not value:
        yield key, repr(value)
    else:
        for name, part in parts:
            yield from leaves_of(part, f"{key}/{name}".lstrip("/"))


def settled(text: str) -> str:
    """Return a text that is no number without dates, times, versions and places of this machine."""
    try:
        return repr(float(text))
    except ValueError:
        pass
    for fact in FACTS:
        text = fact.sub("<fact>", text)
    return re.sub(re.escape(str(ROOT)), "<root>", text)
