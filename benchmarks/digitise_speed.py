"""A 12-megapixel photo through the whole digitise stage: time on one core, peak memory, and whether it is right.

    python benchmarks/digitise_speed.py

The photo is synthetic and its truth exact. Each case runs in a fresh process; importing libraries is not counted.
"""

import json
import os
import platform
import statistics
import tempfile
from pathlib import Path
from typing import Annotated

from typer import Option

from benchmarks.against import ONE_CORE, run_program
from benchmarks.table import Row, run_benchmark
from fixtures.generate.recipe import Recipe
from fixtures.generate.specimen import make_specimen, mean_width_mm
from sealtwin.core.arc_length import arc_length

RECIPE = Recipe(face_mm=(148.0, 98.0), length_mm=130.0, mm_per_px=0.05)
"""With its frame, 4000 x 3000 px."""
SEED = 1
CHILD = """
import json, sys, time
from pathlib import Path
import cv2
cv2.setNumThreads(1)
from sealtwin.core.run_folder import open_folder
from sealtwin.trial.job import start_job
from sealtwin.study.pipeline import run_stages
from sealtwin.core.progress import Progress
from sealtwin.trial.trial_file import load_trial
import sealtwin.trial.digitise_stage, digitise.outline, digitise.walls.overlay, digitise.crack_path.find_path
import digitise.photo, digitise.solid.build_solid, digitise.trajectory, trimesh.exchange.load
trial = Path(sys.argv[1])
with open_folder(Path(sys.argv[2]), create=True) as folder:
    wall, cpu = time.perf_counter(), time.process_time()
    result = run_stages(start_job(load_trial(trial), trial.parent, folder, "cpu", Progress()), ("digitise",)).result
    result = result.sample.model_dump(mode="json")
    result["wall_s"], result["cpu_s"] = time.perf_counter() - wall, time.process_time() - cpu
status = Path("/proc/self/status")
result["peak_mb"] = int(status.read_text().split("VmHWM:")[1].split()[0]) / 1024 if status.exists() else float("nan")
print(json.dumps(result))
"""
TRIAL = """
name = "twelve megapixels"
[photo]
file = "photo.jpg"
data = "synthetic"
face_mm = [{width}, {height}]
{ends}
[photo.markers]
size_mm = {size}
markers = [{markers}]
[crack]
depth_mm = 16.0
"""


def main(repeats: Annotated[int, Option(help="runs of each case; the median counts")] = 3) -> list[Row]:
    specimen = make_specimen(SEED, RECIPE)
    length_mm = float(arc_length(specimen.centreline_mm)[-1])
    width_mm = mean_width_mm(specimen.centreline_mm, specimen.width_mm)
    rows = []
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        (folder / "photo.jpg").write_bytes(specimen.jpeg)
        for name, ends, limit_s in (("two ends", specimen.ends_px, 3), ("automatic", None, 10)):
            trial = folder / f"{name}.toml"
            trial.write_text(_trial_text(specimen.board, ends), encoding="utf-8")
            seen = [_run(trial, folder / f"{name} {number}") for number in range(repeats)]
            rows += [
                Row(f"{name}: processor time", statistics.median(run["cpu_s"] for run in seen), "s", 0, limit_s),
                Row(f"{name}: wall time", statistics.median(run["wall_s"] for run in seen), "s", 0, limit_s),
                Row(f"{name}: peak memory", max(run["peak_mb"] for run in seen), "MB", 0, 1000),
                Row(f"{name}: mean width off by", 100 * abs(seen[0]["mean_width_mm"] / width_mm - 1), "%", 0, 2),
                Row(f"{name}: length off by", abs(seen[0]["length_mm"] - length_mm), "mm", 0, 2),
            ]
    print(f"{platform.platform()}, {os.cpu_count()} cores, one used; 4000 x 3000 px, synthetic")
    return rows


def _run(trial: Path, out: Path) -> dict:
    return json.loads(run_program(["-c", CHILD, str(trial), str(out)], env=ONE_CORE).stdout.splitlines()[-1])


def _trial_text(board, ends) -> str:
    width, height = RECIPE.face_mm
    markers = ", ".join(f"{{id = {one.id}, x_mm = {one.x_mm}, y_mm = {one.y_mm}}}" for one in board.markers)
    given = "" if ends is None else f"ends_px = [[{ends[0][0]}, {ends[0][1]}], [{ends[1][0]}, {ends[1][1]}]]"
    return TRIAL.format(width=width, height=height, ends=given, size=board.size_mm, markers=markers)


if __name__ == "__main__":
    run_benchmark(main)
