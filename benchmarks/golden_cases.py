"""The cases of ``benchmarks/golden.py``: what each writes, and the commands that it calls."""

import csv
import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit

from benchmarks import golden_inputs as inputs

ROOT = Path(__file__).parent.parent
FIXTURE = ROOT / "fixtures" / "paper-trial"
LONGEST_S = 600


@dataclass
class Bench:
    """Where one case works: ``given`` holds what it wrote itself, ``out`` what is recorded."""

    given: Path
    out: Path
    outs: Mapping[str, Path]
    """The folders ``out`` of the cases that this one needs."""
    failures: list[str] = field(default_factory=list)
    """Commands that ended otherwise than with 0."""

    def sealtwin(self, *arguments: object) -> dict[str, Any]:
        """Call the command with ``--json``; its answer, its exit code and what it says are recorded too."""
        words = [*(str(argument) for argument in arguments), "--json"]
        done = subprocess.run(
            [sys.executable, "-m", "sealtwin", *words],
            cwd=ROOT,
            env={**os.environ, "PYTHONPATH": str(ROOT), "SOURCE_DATE_EPOCH": "0", "COLUMNS": "100"},
            capture_output=True,
            text=True,
            check=False,
            timeout=LONGEST_S,
        )
        if done.returncode != 0:
            self.failures.append(f"sealtwin {' '.join(words)}: exit code {done.returncode}\n{done.stderr[-2000:]}")
        answer = json.loads(done.stdout) if done.stdout.lstrip().startswith("{") else {}
        number = len(list(self.out.glob("answer-*.json"))) + 1
        record = {"exit_code": done.returncode, "answer": answer}
        (self.out / f"answer-{number}.json").write_text(json.dumps(record, indent=1), encoding="utf-8")
        (self.out / f"answer-{number}.stderr").write_text(done.stderr, encoding="utf-8")
        return answer


@dataclass(frozen=True)
class Case:
    name: str
    run: Callable[[Bench], None]
    needs: tuple[str, ...] = ()
    """Cases that must have run before, in the same call."""


def _coarse(bench: Bench, name: str, changes: Mapping[str, Any]) -> Path:
    """Copy the shipped folder and set the trial's keys, ``table.key`` each; returns the trial file."""
    lab = bench.given / "lab"
    shutil.copytree(FIXTURE, lab)
    trial = tomlkit.parse((lab / name).read_text(encoding="utf-8"))
    for dotted, value in changes.items():
        table, key = dotted.split(".")
        if table not in trial:
            trial[table] = tomlkit.table()
        trial[table][key] = value  # pyright: ignore[reportIndexIssue]
    (lab / name).write_text(tomlkit.dumps(trial), encoding="utf-8")
    return lab / name


def _flare(bench: Bench) -> None:
    changes = {
        "crack.tilt": "flare",
        "crack.wall_angle_deg": 5.5,
        "solver.radius_mm": 0.78,
        "solver.settle_s": 0.2,
        "path.speed_mm_s": 10.0,
        "gate.mean_error_mm": 20.0,
        "output.snapshots_s": [],
    }
    trial = _coarse(bench, "trial.toml", changes)
    bench.sealtwin("run", trial, "--out", bench.out / "run", "--device", "cpu")


def _lean(bench: Bench) -> None:
    """The defaults of snapshots stay, so that their files are recorded too."""
    trial = _coarse(bench, "trial-paper.toml", {"solver.radius_mm": 0.75, "gate.mean_error_mm": 20.0})
    bench.sealtwin("run", trial, "--out", bench.out / "run", "--device", "cpu")


PLAIN = [(50.0, 118.0), (130.0, 108.0), (220.0, 120.0), (310.0, 102.0)]
ENDS = ("--ends", "50,118", "310,102")


def _set(*settings: str) -> list[str]:
    """Return the arguments that give settings, each as table.key=value."""
    return [word for setting in settings for word in ("--set", setting)]


def _trace(bench: Bench, *arguments: object, depth: object = 8) -> None:
    bench.sealtwin("digitise", bench.given / "photo.png", "--depth-mm", depth, *arguments, "--out", bench.out / "run")


def _plain(bench: Bench) -> None:
    inputs.draw_photo(bench.given / "photo.png", [(PLAIN, 14.0)])
    _trace(bench, "--mm-per-px", 0.1, *ENDS)


def _steep(bench: Bench) -> None:
    """At 50 degrees, flared unequally, with a given volume."""
    line = [(80.0, 190.0), (130.0, 130.0), (170.0, 95.0), (240.0, 25.0)]
    inputs.draw_photo(bench.given / "photo.png", [(line, 18.0)], seed=2)
    tilt = _set("crack.tilt=flare", "crack.wall_angle_deg=[4,9]", "path.volume_ml=0.6")
    _trace(bench, "--mm-per-px", 0.12, "--ends", "80,190", "240,25", *tilt)


def _narrow(bench: Bench) -> None:
    inputs.draw_photo(bench.given / "photo.png", [(PLAIN, 10.0)], seed=3)
    _trace(bench, "--mm-per-px", 0.1, *ENDS, *_set("crack.tilt=vertical", "photo.edge_fraction=0.6"), depth=5)


def _wide(bench: Bench) -> None:
    inputs.draw_photo(bench.given / "photo.png", [(PLAIN, 32.0)], seed=4)
    _trace(bench, "--mm-per-px", 0.1, *ENDS, *_set("crack.tilt=funnel"))


def _lit(bench: Bench) -> None:
    """Two photos of walls that catch the light, from either side and uneven."""
    for name, glint, light in (("photo.png", 0.5, (1.3, 0.8)), ("second.png", -0.5, (0.8, 1.3))):
        inputs.draw_photo(bench.given / name, [(PLAIN, 22.0)], seed=5, glint=glint, light=light)
    _trace(bench, "--mm-per-px", 0.1, *ENDS, *_set(f"photo.second_photo={bench.given / 'second.png'}"))


def _branches(bench: Bench) -> None:
    side = [(180.0, 114.0), (210.0, 160.0), (225.0, 190.0)]
    inputs.draw_photo(bench.given / "photo.png", [(PLAIN, 16.0), (side, 10.0)], seed=6)
    _trace(bench, "--mm-per-px", 0.1, *ENDS, *_set("photo.branches=keep", "crack.tilt=vertical"))


def _mask(bench: Bench) -> None:
    """Without ends: between given ends the way hangs on distances whose last bits OpenCV changes from call to call."""
    inputs.draw_photo(bench.given / "photo.png", [(PLAIN, 14.0)], seed=7)
    inputs.draw_mask(bench.given / "mask.png", PLAIN, 15.0)
    _trace(bench, "--mm-per-px", 0.1, "--mask", bench.given / "mask.png")


def _via(bench: Bench) -> None:
    """A crack that parts and joins again; the way round below is asked for."""
    below = [(110.0, 110.0), (150.0, 160.0), (220.0, 165.0), (260.0, 112.0)]
    inputs.draw_photo(bench.given / "photo.png", [(PLAIN, 12.0), (below, 12.0)], seed=8)
    _trace(bench, "--mm-per-px", 0.1, *ENDS, "--via", "150,160 220,165", *_set("crack.tilt=vertical"))


def _automatic(bench: Bench) -> None:
    inputs.draw_photo(bench.given / "photo.png", [(PLAIN, 16.0)], seed=9)
    _trace(bench, "--mm-per-px", 0.1, *_set("photo.scale_is=assumed"), "--roi", "20,60 340,170")


def _reversed(bench: Bench) -> None:
    """From right to left, scaled by a ruler, with a measured profile of depths."""
    inputs.draw_photo(bench.given / "photo.png", [(PLAIN, 14.0)], seed=10)
    depths = bench.given / "depths.csv"
    depths.write_text("s_mm,depth_mm\n0,6.0\n8,7.5\n16,9.0\n26,8.0\n", encoding="utf-8")
    ruler = _set("photo.ruler_px=[[20,200],[340,200]]", "photo.ruler_mm=32")
    tilt = _set("crack.tilt=flare", "crack.wall_angle_deg=5")
    _trace(bench, *ruler, "--ends", "310,102", "50,118", *tilt, depth=depths)


def _open(bench: Bench) -> None:
    """Across the whole face, whose corners give the scale: both ends are open."""
    line = [(-20.0, 90.0), (90.0, 116.0), (200.0, 98.0), (380.0, 125.0)]
    inputs.draw_photo(bench.given / "photo.png", [(line, 15.0)], seed=11)
    corners = "[[20,200],[340,200],[340,20],[20,20]]"
    _trace(bench, "--face-mm", "32x18", *_set(f"photo.face_corners_px={corners}"), "--ends", "20,99", "340,119")


def _markers(bench: Bench) -> None:
    """The shipped photo, its scale by the markers of the shipped trial."""
    photo = tomlkit.parse((FIXTURE / "trial.toml").read_text(encoding="utf-8")).unwrap()["photo"]
    table = tomlkit.dumps({"photo": {"markers": photo["markers"]}})
    (bench.given / "markers.toml").write_text(table, encoding="utf-8")
    shutil.copy(FIXTURE / "photo.jpg", bench.given / "photo.png")
    ends = (f"{x},{y}" for x, y in photo["ends_px"])
    scale = ("--markers", bench.given / "markers.toml", "--face-mm", "160x40")
    _trace(bench, *scale, "--ends", *ends, *_set("crack.tilt=vertical"), depth=16)


def _sheet(bench: Bench, name: str, **declared: object) -> None:
    """Validate a copy of the flared trial's run against another sheet, declared as given.

    Only files that the run did not have before, or not so, are recorded.
    """
    base, run = bench.outs["trial-flare"] / "run", bench.out / "run"
    shutil.copytree(base, run)
    shutil.copy(bench.given / name, run / "inputs" / name)
    trial = tomlkit.parse((run / "trial.toml").read_text(encoding="utf-8"))
    readings: Any = trial["readings"]
    readings["file"] = f"inputs/{name}"
    for key, value in declared.items():
        readings[key] = value
    (run / "trial.toml").write_text(tomlkit.dumps(trial), encoding="utf-8")
    bench.sealtwin("validate", run, "--device", "cpu")
    for path in run.rglob("*"):
        before = base / path.relative_to(run)
        if path.is_file() and before.is_file() and path.read_bytes() == before.read_bytes():
            path.unlink()


REPEATS = (1, 2, 3)
S_MM, LEVEL_MM = inputs.read_caliper(FIXTURE / "caliper.csv")
CANONICAL = ["s_mm", *(f"level_{number}_mm" for number in REPEATS)]


def _sheet_commas(bench: Bench) -> None:
    """A canonical sheet, every second station only."""
    inputs.write_text_sheet(bench.given / "a.csv", CANONICAL, inputs.wide(S_MM[::2], LEVEL_MM[::2]), digits=2)
    _sheet(bench, "a.csv")


def _sheet_german(bench: Bench) -> None:
    header = ["Abstand vom Rissanfang [mm]", *(f"Tiefe {number} [mm]" for number in REPEATS)]
    rows = inputs.wide(S_MM, -LEVEL_MM)
    inputs.write_text_sheet(
        bench.given / "b.csv", header, rows, separator=";", decimal=",", encoding="latin-1", digits=2
    )
    _sheet(bench, "b.csv")


def _sheet_utf16(bench: Bench) -> None:
    header = ["Position along crack/mm", *(f"Depth below surface {number}/mm" for number in REPEATS)]
    rows = inputs.wide(S_MM, -LEVEL_MM)
    inputs.write_text_sheet(
        bench.given / "c.txt", header, rows, separator="\t", decimal=",", encoding="utf-16", digits=2
    )
    _sheet(bench, "c.txt")


def _sheet_long(bench: Bench) -> None:
    """A row for each reading, out of order."""
    rows = inputs.long(S_MM, LEVEL_MM)
    rows = [rows[index] for index in np.random.default_rng(3).permutation(len(rows))]
    inputs.write_text_sheet(bench.given / "d.csv", ["s_mm", "repeat", "level_mm"], rows, digits=2)
    _sheet(bench, "d.csv", state="cured", shrinkage_percent=2.5)


def _sheet_workbook(bench: Bench) -> None:
    inputs.write_workbook(bench.given / "e.xlsx", [CANONICAL, *inputs.wide(S_MM, LEVEL_MM)])
    _sheet(bench, "e.xlsx")


def _sheet_workbook_long(bench: Bench) -> None:
    header = ["Distancia desde el inicio [mm]", "Medición Nº", "Profundidad [cm]"]
    rows = [[s, number, -float(level) / 10] for s, number, level in inputs.long(S_MM, LEVEL_MM)]
    inputs.write_workbook(bench.given / "f.xlsx", [["Labor 3"], [], header, *rows])
    _sheet(bench, "f.xlsx")


def _sheet_inches(bench: Bench) -> None:
    header = ["Position along crack [inch]", *(f"Height {number} [inch]" for number in REPEATS)]
    rows = inputs.wide(S_MM, LEVEL_MM, 1 / 25.4)
    inputs.write_text_sheet(bench.given / "g.csv", header, rows, digits=8, newline="\r\n")
    _sheet(bench, "g.csv", probe_mm=0.5)


def _sheet_centimetres(bench: Bench) -> None:
    header = ["Abstand vom Rissanfang (cm)", *(f"Höhe über Oberfläche {number} (cm)" for number in REPEATS)]
    rows = inputs.wide(S_MM, LEVEL_MM, 0.1)
    inputs.write_text_sheet(
        bench.given / "h.csv",
        header,
        rows,
        separator=";",
        decimal=",",
        encoding="cp1252",
        digits=8,
        newline="\r\n",
        above=["sep=;"],
    )
    _sheet(bench, "h.csv")


def _sheet_gaps(bench: Bench) -> None:
    """Missing readings, a column of remarks, and units in a row of their own."""
    rows = [[*row, "good; photo 1"] for row in inputs.wide(S_MM, LEVEL_MM)]
    rows[3][2] = rows[8][1] = "n/a"
    header = ["Position along crack", *(f"Height {number}" for number in REPEATS), "Remark"]
    units = ["mm", "mm", "mm", "mm", ""]
    inputs.write_text_sheet(bench.given / "i.tsv", header, [units, *rows], separator="\t", digits=2)
    _sheet(bench, "i.tsv")


def _sheet_datum(bench: Bench) -> None:
    """Depths below the caliper's base, which stood 12.5 mm above the face."""
    header = ["s_mm", *(f"depth_{number}_mm" for number in REPEATS)]
    inputs.write_text_sheet(bench.given / "j.csv", header, inputs.wide(S_MM, 12.5 - LEVEL_MM), digits=2)
    _sheet(bench, "j.csv", datum="caliper_base", datum_level_mm=12.5, datum_error_mm=0.1)


def _mesh(bench: Bench, name: str, scale: float, *arguments: object, text: bool = False, **shape: float) -> None:
    """``scale`` is a millimetre in the file's unit; ``mesh.up=y`` among the arguments turns the block to match."""
    vertices, faces = inputs.slotted_block(**shape)
    if "mesh.up=y" in arguments:
        vertices = vertices[:, [0, 2, 1]] * (1.0, 1.0, -1.0)
    inputs.write_mesh(bench.given / name, vertices * scale, faces, text=text)
    bench.sealtwin(
        "import-mesh", bench.given / name, *arguments, *_set("mesh.data=synthetic"), "--out", bench.out / "run"
    )


def _mesh_path(bench: Bench) -> None:
    """With a centreline and a volume that are given."""
    path = bench.given / "path.csv"
    path.write_text("".join(f"{x} {20 + 0.2 * (i % 3)}\n" for i, x in enumerate(range(22, 79, 4))), encoding="utf-8")
    _mesh(bench, "block.off", 1.0, "--units", "mm", *_set(f"mesh.path={path}", "path.volume_ml=1.5"))


def _robot(bench: Bench, formats: str) -> None:
    run = bench.given / "run"
    shutil.copytree(bench.outs["trial-flare"] / "run", run)
    (bench.given / "cell.toml").write_text(inputs.CELL, encoding="utf-8")
    bench.sealtwin("robot", run, "--cell", bench.given / "cell.toml", "--format", formats, "--out", bench.out / "robot")


STUDY = """\
name = "golden"
trial = "trial.toml"

[fixed]
"solver.radius_mm" = 0.78
"path.speed_mm_s" = 20.0
"solver.settle_s" = 0.0
"fluid.freeze_after_s" = 0.5

[grid]
"fluid.U" = [10.0, 30.0]
"fluid.D_cm" = [0.1, 0.3]
"""


def _sweep(bench: Bench) -> None:
    """Folders that are named by a hash of settings are recorded under their runs' numbers."""
    trial = _coarse(bench, "trial.toml", {})
    study = trial.with_name("study.toml")
    study.write_text(STUDY, encoding="utf-8")
    out = bench.out / "sweep"
    bench.sealtwin("sweep", study, "--out", out, "--device", "cpu", "--jobs", 1, "--keep-runs")
    for row in csv.DictReader((out / "runs.csv").read_text(encoding="utf-8").splitlines()):
        (out / row["folder"]).rename(out / "runs" / row["number"])
    hashed = sorted(path for path in out.rglob("*") if path.is_dir() and re.fullmatch(r"[0-9a-f]{8,}", path.name))
    for number, path in enumerate(hashed, 1):
        path.rename(path.with_name(f"hashed-{number}"))


def _ingest(bench: Bench) -> None:
    folder, lab = inputs.write_lab_folder(bench.given / "measurements"), bench.out / "lab"
    bench.sealtwin("ingest", folder, "--out", lab)
    bench.sealtwin("lab", "list", lab)
    bench.sealtwin("lab", "export", lab, "--out", bench.out / "export.csv")


CASES = (
    Case("trial-flare", _flare),
    Case("trial-lean", _lean),
    Case("trace-plain", _plain),
    Case("trace-steep", _steep),
    Case("trace-narrow", _narrow),
    Case("trace-wide", _wide),
    Case("trace-lit", _lit),
    Case("trace-branches", _branches),
    Case("trace-mask", _mask),
    Case("trace-via", _via),
    Case("trace-automatic", _automatic),
    Case("trace-reversed", _reversed),
    Case("trace-open", _open),
    Case("trace-markers", _markers),
    Case("mesh-stl-binary", lambda bench: _mesh(bench, "block.stl", 1.0, "--units", "mm")),
    Case("mesh-stl-text", lambda bench: _mesh(bench, "block.stl", 0.1, "--units", "cm", text=True, wander_mm=3.0)),
    Case("mesh-ply", lambda bench: _mesh(bench, "block.ply", 1.0, "--units", "mm", floor_half_mm=0.8)),
    Case("mesh-obj", lambda bench: _mesh(bench, "block.obj", 1.0, "--units", "mm", *_set("mesh.up=y"), wander_mm=1.5)),
    Case("mesh-off-path", _mesh_path),
    Case("mesh-glb", lambda bench: _mesh(bench, "block.glb", 1e-3, "--units", "m", depth_mm=7.0)),
    Case("sweep", _sweep),
    Case("ingest", _ingest),
    Case("sheet-commas", _sheet_commas, ("trial-flare",)),
    Case("sheet-german", _sheet_german, ("trial-flare",)),
    Case("sheet-utf16", _sheet_utf16, ("trial-flare",)),
    Case("sheet-long", _sheet_long, ("trial-flare",)),
    Case("sheet-workbook", _sheet_workbook, ("trial-flare",)),
    Case("sheet-workbook-long", _sheet_workbook_long, ("trial-flare",)),
    Case("sheet-inches", _sheet_inches, ("trial-flare",)),
    Case("sheet-centimetres", _sheet_centimetres, ("trial-flare",)),
    Case("sheet-gaps", _sheet_gaps, ("trial-flare",)),
    Case("sheet-datum", _sheet_datum, ("trial-flare",)),
    Case("robot-spel", lambda bench: _robot(bench, "spel,csv"), ("trial-flare",)),
    Case("robot-gcode", lambda bench: _robot(bench, "gcode,txt"), ("trial-flare",)),
    Case("robot-urscript", lambda bench: _robot(bench, "urscript"), ("trial-flare",)),
)
"""A case that others need stands before them."""
