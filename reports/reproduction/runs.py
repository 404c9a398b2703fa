"""Compute the runs of the reproduction, or take them from an earlier call, and draw its figures."""

import shutil
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import sealtwin as st
from sealtwin.core import files, record_files
from sealtwin.core.errors import present
from sealtwin.core.progress import progress_for_stderr
from sealtwin.core.records import Sample
from sealtwin.core.run_folder import number_words, stage_key
from sealtwin.study.study_file import load_study
from sealtwin.study.study_folder import FILL, read_plan, run_path
from sealtwin.study.study_map import map_study, read_fill
from sealtwin.trial.job import NUMBERS, numbers_up_to
from sealtwin.trial.trial_file import load_trial
from simulate.pour import Pour
from simulate.run import fill
from validate.compare import compare
from validate.figures.chart import pace_of
from validate.figures.levels import draw_histogram
from validate.figures.map_page import Fill, draw_cost, draw_fills
from validate.figures.snapshots import FillScene
from validate.figures.theme import as_svg

FIXTURE = Path(__file__).parents[2] / "fixtures" / "paper-trial"
TRIAL, LEANING = FIXTURE / "trial.toml", FIXTURE / "trial-paper.toml"
CHOSEN = (30.0, 0.3)  # U, and D in cm, that the paper chose
NAMED = ((0.03, 1e-4), CHOSEN, (30.0, 3.0), (1e4, 3.0))  # Its farthest, chosen and nearest pair, and the stiffest
ETA_PER_S = (0.02, 0.2, 2.0)  # The paper's 0.2, a tenth and ten times of it
FREEZE_AFTER_S = (2.58, 5.16, "never")  # The age at which 2,500 particles move, twice that, and no freezing
TIMED_D_CM = (0.3, 1.0, 3.0)
SUBSTEPS = (1, 2)  # The paper's single step a frame, and two
NARROWER = (1, 3)
MAPPED = ("levels", "heat", "thumbnails", "influence-D", "influence-U")  # Figures of the study's map


@dataclass(frozen=True)
class Results:
    """Figures of all runs, as kept.json has them. Errors are those of a level against the readings."""

    computed_by: str  # Stage numbers
    u: list[float]
    d_cm: list[float]
    error_mm: list[list[float]]  # Mean error of each pair, a list for each U
    run_s: float  # Median time of a run by the clock
    volume_ratio: list[float]  # Least and largest share of the dispensed volume in a bed
    chosen: dict[str, Any]  # Errors and levels along the crack of the pair that the paper chose
    baselines_mm: dict[str, float]  # Mean errors of curves through the readings
    frame_r2: float  # R² of a line through the times of a run's frames over the moving particles, median of the runs
    eta_error_mm: list[float]  # Mean errors by ETA_PER_S
    freezing_error_mm: list[float]  # Mean errors by FREEZE_AFTER_S
    freezing_sd_mm: list[float]  # Standard deviations of the level along the crack by FREEZE_AFTER_S
    unfrozen_mm: float  # Mean error of the shipped trial without freezing, 2 s after the nozzle stopped
    leaning: dict[str, Any]  # The trial between leaning walls
    printed: list[dict[str, Any]]  # The same by SUBSTEPS, with five iterations in each and Eq. 5 in passes
    times: dict[str, list[dict[str, Any]]]  # Times of runs by TIMED_D_CM for each way to solve Eq. 5, and by NARROWER


def compute(work: Path, figures: Path) -> Results:
    """Compute in ``work`` what is not there yet, and draw into ``figures``."""
    study = load_study(FIXTURE / "study-paper.toml")
    grid = present(study.grid, "grid")
    pairs = _sweep(work / study.folder_name, grid, study.fixed)
    sample = record_files.read_sample(next((pairs.folder / "samples").iterdir()))
    as_it_stops = {"solver.settle_s": 0}
    eta = _sweep(work / "paper-eta", {"solver.damping_per_s": ETA_PER_S}, as_it_stops)
    freezing = _sweep(work / "paper-freezing", {"fluid.freeze_after_s": FREEZE_AFTER_S}, as_it_stops)
    unfrozen = _sweep(work / "paper-unfrozen", {"fluid.freeze_after_s": ["never"]}, {})
    leaning = _sweep(work / "paper-leaning", {"solver.substeps": [4]}, {}, LEANING)
    as_printed = {"solver.iterations": 5, "solver.viscosity_solve": "explicit"}
    printed = _sweep(work / "paper-printed", {"solver.substeps": SUBSTEPS}, as_printed, LEANING)
    chosen, frame_r2 = _draw(pairs.folder, sample, figures)
    volume_ratio = pairs.column("volume_ratio")
    return Results(
        computed_by=number_words(NUMBERS),
        u=[*grid["fluid.U"]],
        d_cm=[*grid["fluid.D_cm"]],
        error_mm=pairs.column("mean_error_mm").round(4).reshape([len(values) for values in grid.values()]).tolist(),
        run_s=float(np.median(pairs.column("wall_s"))),
        volume_ratio=[volume_ratio.min(), volume_ratio.max()],
        chosen=chosen,
        baselines_mm={one["name"]: one["mean_error_mm"] for one in _summary(pairs, 0)["baselines"]},
        frame_r2=frame_r2,
        eta_error_mm=eta.column("mean_error_mm").tolist(),
        freezing_error_mm=freezing.column("mean_error_mm").tolist(),
        freezing_sd_mm=[
            record_files.read_profile(freezing.folder / row["folder"]).level_mm.std() for row in freezing.rows
        ],
        unfrozen_mm=unfrozen.rows[0]["mean_error_mm"],
        leaning=_figures(leaning, 0),
        printed=[_figures(printed, number) for number in range(len(SUBSTEPS))],
        times=_times(work / "paper-times", sample),
    )


def _sweep(folder: Path, grid: Mapping[str, Any], fixed: Mapping[str, Any], trial: Path = TRIAL) -> st.SweepResult:
    return st.sweep(trial, grid, fixed=fixed, out=folder, name=folder.name, accurate=True)


def _figures(swept: st.SweepResult, number: int) -> dict[str, Any]:
    """Return figures of a run, or the reason if it failed."""
    if swept.rows[number]["state"] == "failed":
        return {"reason": swept.rows[number]["reason"]}
    figures = _summary(swept, number)
    figures |= figures["health"]
    return {name: figures[name] for name in ("mean_error_mm", "volume_ratio", "density_error_p95")}


def _summary(swept: st.SweepResult, number: int) -> dict[str, Any]:
    return files.read_json(swept.folder / swept.rows[number]["folder"] / "summary.json")["figures"]


def _draw(folder: Path, sample: Sample, figures: Path) -> tuple[dict[str, Any], float]:
    """Draw the figures of the study. Return figures of the chosen pair, and the median R² of frame times."""
    progress = progress_for_stderr()
    mapped = map_study(folder, None, None, None, progress)
    figures.mkdir(exist_ok=True)
    for name in MAPPED:
        shutil.copyfile(mapped.folder / "figures" / f"{name}.svg", figures / f"{name}.svg")
    chosen = next(run for run in mapped.chart.runs if run.values == CHOSEN)
    levels = chosen.profile, mapped.chart.readings
    comparison = compare(*levels, sample.outline, sample.solid, role="undeclared", photo_data="undeclared")
    trial = load_trial(TRIAL)
    size_mm, nozzle_mm = trial.solver.size_mm, trial.nozzle.size_mm
    scene = FillScene(sample.outline, sample.solid, sample.trajectory, size_mm, nozzle_mm)
    courses = [read_fill(run_path(folder, run) / FILL) for run in read_plan(folder).runs]
    fills = {
        run.values: Fill(run, mapped.chart.text_of(run), scene, course)
        for run, course in zip(mapped.chart.runs, courses, strict=True)
    }
    drawn = {
        "histogram": draw_histogram(comparison),
        "fills": draw_fills([fills[pair] for pair in NAMED]),
        "cost": draw_cost(mapped.chart, [fills[CHOSEN]]),
    }
    for name, figure in drawn.items():
        files.write_text(figures / f"{name}.svg", as_svg(figure, name))
    s_mm, level_mm = chosen.profile.s_mm, chosen.profile.level_mm
    lines = [present(pace_of(course.particles, course.frame_ms), "a line of frame times") for course in courses]
    return {
        "mean_error_mm": comparison.mean_error_mm,
        "worst_error_mm": comparison.worst_error_mm,
        "worst_at_mm": comparison.worst_at_mm,
        "share_under_1_mm": comparison.errors.share_under_1_mm,
        "bins_mm": [part.mean_error_mm for part in comparison.distances.by_bin],
        "level_20_to_30_mm": level_mm[(s_mm >= 20) & (s_mm <= 30)].mean(),
        "level_from_40_mm": level_mm[s_mm >= 40].mean(),
    }, float(np.median([r2 for _, _, r2 in lines]))


def _times(folder: Path, sample: Sample) -> dict[str, list[dict[str, Any]]]:
    """Time the trial with each way to solve Eq. 5, and straight cracks without readings, one after another."""
    trial = load_trial(TRIAL)
    fluid, solver, nozzle = trial.given_fluid, trial.solver, trial.nozzle
    ways = {}
    for way in ("explicit", "implicit"):
        as_it_stops = solver.model_copy(update={"settle_s": 0.0, "viscosity_solve": way})
        ways[way] = [
            _timed(folder / f"{way}-{d_cm:g}", sample, fluid.model_copy(update={"D_cm": d_cm}), as_it_stops, nozzle)
            for d_cm in TIMED_D_CM
        ]
    return ways | {"straight": [_straight(folder / f"straight-{narrower}", fluid, narrower) for narrower in NARROWER]}


def _straight(path: Path, fluid: st.Fluid, narrower: int) -> dict[str, Any]:
    """Time a straight crack of half the paper's length, with four particles from wall to wall at any width."""
    width_mm = 3.1 / narrower
    crack = st.crack_from_polyline([(0.0, 0.0), (40.0, 0.0)], width_mm)
    solid = st.build_solid(crack, 16.0, tilt="vertical")
    trajectory = st.plan_path(solid, volume_ml=2.4 / narrower, speed_mm_s=4.0, trim_mm=5.0)
    solver, nozzle = st.Solver(radius_mm=width_mm / 8, settle_s=0.0), st.Nozzle(diameter_mm=2.4 / narrower)
    return _timed(path, Sample(crack, solid, trajectory), fluid, solver, nozzle)


def _timed(path: Path, sample: Sample, fluid: st.Fluid, solver: st.Solver, nozzle: st.Nozzle) -> dict[str, Any]:
    """Return processor time and size of a run; compute it unless an earlier call did."""
    settings: dict[str, Any] = {type(each).__name__: each.model_dump(mode="json") for each in (fluid, solver, nozzle)}
    settings["cavity_mm3"] = sample.solid.cavity_volume_mm3
    path = path.with_name(f"{path.name}-{stage_key({}, settings, numbers_up_to('simulate'))}.json")
    if not path.is_file():
        began_s = time.process_time()
        run, _ = fill(Pour(sample, (fluid,), solver, nozzle))
        took_s = time.process_time() - began_s
        path.parent.mkdir(parents=True, exist_ok=True)
        size = {"particles": len(run.position_mm), "frames": run.health.frames}
        files.write_json(path, {"processor_s": took_s, **size})
    return files.read_json(path)
