"""Stages of one trial in their order; each is redone only if its inputs, its settings or its number changed."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from sealtwin.core import files, record_files
from sealtwin.core.earlier_trials import EarlierTrials
from sealtwin.core.errors import InputError, NumericalError
from sealtwin.core.progress import Progress
from sealtwin.core.run_folder import RunFolder, look_into, open_folder
from sealtwin.core.vtk_files import read_collection, read_frame
from sealtwin.trial import digitise_stage, simulate_stage, validate_stage
from sealtwin.trial.job import (
    NOTHING_ABOVE,
    STAGES,
    Above,
    Job,
    StageName,
    adopt_trial,
    other_versions,
    require_sample,
    require_solid,
    shown,
    start_job,
)
from sealtwin.trial.simulate_stage import FRAMES
from sealtwin.trial.trial_file import Trial
from sealtwin.trial.validate_stage import EARLIER, PREDICTION
from validate.uncertainty.validation import with_time


def make_film(folder: Path, path: Path, progress: Progress) -> tuple[int, float]:
    """Write a film of a run folder's frames; return their number and the film's length in seconds.

    Raises InputError if there are no frames.
    """
    look_into(folder)
    if not (folder / FRAMES).is_file():
        raise InputError(
            f"{folder / FRAMES}: not found. 'sealtwin simulate {folder} --set output.frames_every_s=0.1' writes "
            "frames, by another fluid run."
        )
    from validate.figures.film import write_film
    from validate.figures.snapshots import FillScene

    outline, solid = record_files.read_outline(folder), record_files.read_solid(folder)
    run = record_files.read_simulation(folder)
    with files.understood(folder / "simulation.json"):
        nozzle_mm = float(files.read_json(folder / "simulation.json")["settings"]["nozzle"]["diameter_mm"])
    scene = FillScene(outline, solid, record_files.read_trajectory(folder), run.radius_mm, nozzle_mm)
    frames = read_collection(folder / FRAMES)
    progress.start("Filming", len(frames))
    write_film(path, [t_s for t_s, _ in frames], lambda number: read_frame(frames[number][1]), scene, progress.advance)
    return len(frames), frames[-1][0] - frames[0][0]


@dataclass(frozen=True)
class FinishedStages:
    result: dict[str, Any]  # Content of run.json
    redone: tuple[StageName, ...]


def run_trial(
    trial: Trial,
    source: Path,
    out: Path | None,
    stages: Sequence[StageName],
    device: str,
    progress: Progress,
    threads: int = 1,
    above: Above = NOTHING_ABOVE,
) -> FinishedStages:
    """Bring stages of a trial up to date in ``out``, by default reports/ and its name; its files lie in ``source``."""
    require_sample(trial, source)
    with open_folder(out or Path("reports", trial.folder_name), create=True) as folder:
        job = start_job(trial, source, folder, device, progress)
        return run_stages(replace(job, threads=threads, above=above), stages)


def run_stages(job: Job, stages: Sequence[StageName]) -> FinishedStages:
    """Bring ``stages`` up to date, in their order.

    A stage that fails leaves the folder as it was, but for refused.png and the checkpoint of a fluid run. Raises
    InputError or NumericalError from a stage, and NumericalError if a particle escaped, with all files written.
    """
    work = {"digitise": digitise_stage, "simulate": simulate_stage, "validate": validate_stage}
    redone: list[StageName] = []
    for caution in job.above.cautions:
        job.progress.warn(caution)
    for stage in STAGES:
        if stage in stages and stage != "digitise":
            require_solid(job)
        both = stage == "simulate" and {"simulate", "validate"} <= set(stages)
        # Minutes of simulation must not pass before a typo in the sheet is found.
        if both and (readings := validate_stage.readings_of(job)) is not None:
            validate_stage.note_doubts(job, readings)
        if stage in stages and work[stage].bring_up_to_date(job):
            redone.append(stage)
    adopt_trial(job)
    result = read_result(job)
    if (escaped := result.get("escaped_particles")) and stages[-1] != "digitise":
        raise NumericalError(
            f"{job.path}: {escaped} particles went through a wall, which must never happen; the files are complete, "
            "but do not use them. Please report this with the trial file."
        )
    if not redone:
        job.progress.note(f"{job.path}: complete and up to date; nothing to redo.")
    return FinishedStages(result, tuple(redone))


def check_run(job: Job) -> tuple[str, ...]:
    """Make all checks that a run of a trial makes before its first frame; return what its readings may not have meant.

    The trial is digitised where it is not; its level counts where it is simulated. Raises InputError as the run would.
    """
    digitise_stage.bring_up_to_date(job)
    require_solid(job)
    simulated = record_files.read_profile(job.path) if "simulate" in job.folder.finished() else None
    readings = validate_stage.readings_of(job, simulated)
    simulate_stage.check(job)
    return () if readings is None else readings.doubts


def read_result(job: Job) -> dict[str, Any]:
    """Return what the folder holds now, and write it to run.json if that differs."""
    folder, trial = job.folder, job.trial
    stages = folder.finished()
    result: dict[str, Any] = {
        "version": 1,
        "name": trial.name,
        "folder": shown(folder.path),
        "wall_time_s": round(sum(folder.manifest["stages"][stage]["wall_time_s"] for stage in stages), 1),
        "stages": stages,
        "computed_by": {stage: _computed_by(folder, stage) for stage in stages},
        "other_versions": other_versions(folder),
        "edited": [name for stage in stages for name in folder.edited(stage)],
    }
    with files.understood(folder.path):
        result |= _findings(folder, trial, stages)
        if "findings" in result:
            result["findings"] = list(with_time(result["findings"], job.extra_runs))
    target = folder.path / "run.json"
    if not target.is_file() or files.read_json(target) != result:
        files.write_json(target, result)
    return result


def _computed_by(folder: RunFolder, stage: str) -> dict[str, Any]:
    """Return the version and the stage numbers by which a finished stage was computed."""
    sealtwin = folder.manifest["stages"][stage]["versions"].get("sealtwin")
    return {"sealtwin": sealtwin, "stage_numbers": folder.numbers_of(stage)}


def _findings(folder: RunFolder, trial: Trial, stages: Sequence[str]) -> dict[str, Any]:
    result: dict[str, Any] = {}
    if "digitise" in stages:
        outline = record_files.read_outline(folder.path)
        path_alone = outline.width_source == "none"
        if path_alone:
            solid: dict[str, Any] = {
                "warnings": [],
                "sealant_mm3": record_files.read_trajectory(folder.path).dispensed_mm3,
            }
        else:
            solid = files.read_json(folder.path / "solid.json")
        result |= {
            "data": trial.shown_by.data,
            "length_mm": round(outline.length_mm, 3),
            "mean_width_mm": None if path_alone else round(outline.mean_width_mm, 3),
            "width_source": outline.width_source,
            "width_95_mm": _rounded(outline.width_95_mm, 4),
            "cavity_volume_mm3": None if path_alone else round(solid["cavity_volume_mm3"], 1),
            "cavity_volume_95_mm3": _rounded(solid.get("cavity_volume_95_mm3"), 1),
            "weighed": solid.get("weighed"),
            "sealant_mm3": round(solid["sealant_mm3"], 1),
            "path_source": outline.path_source,
            "scale_source": outline.scale_source,
            "mm_per_px": None if outline.seen_in == "mesh" else round(outline.mm_per_px, 6),
            "scale_uncertainty": outline.scale_uncertainty,
            "scale_residual_mm": outline.scale_residual_mm,
            "camera_tilt_deg": outline.camera_tilt_deg,
            "warnings": [*outline.warnings, *solid["warnings"]],
        }
    if "simulate" in stages:
        from validate.wording.headline import run_warnings

        simulation = record_files.read_simulation(folder.path)
        result |= {
            **_counted(simulation),
            "volume_ratio": round(simulation.volume_ratio, 4),
            "device": simulation.device,
            "fluid_warnings": list(run_warnings(simulation, simulation.volume_ratio)),
        }
    if "validate" in stages:
        result["report"] = shown(folder.path / "report.html")
        readings = {} if trial.readings is None else trial.readings.model_dump(mode="json")
        result |= {f"readings_{key}": readings.get(key) for key in ("role", "fitted")}
        if trial.readings is not None:
            result |= _compared(record_files.read_comparison(folder.path))
        elif (predicted := folder.path / PREDICTION).is_file():
            with files.understood(predicted):
                found = files.read_json(predicted)
                result["predicted"] = {name: found[name] for name in ("mean_level_mm", "mean_level_95_mm")}
        if (earlier := folder.path / EARLIER).is_file():
            with files.understood(earlier):
                result["expected"] = _expected(EarlierTrials.model_validate(files.read_json(earlier)))
    return result


def _expected(found: EarlierTrials) -> dict[str, Any]:
    from validate.uncertainty.earlier_trials import expected_sentences

    content: dict[str, Any] = {"earlier_trials": len(found.trials), "told": list(expected_sentences(found))}
    for one in found.expectations:
        ends = [round(end, 4) for end in one.expected_95]
        content[one.quantity] = {"expected": round(one.expected, 4), "expected_95": ends}
    return content


def _counted(simulation: record_files.Simulation) -> dict[str, Any]:
    """Return the numbers of particles; of the fast model, which has none, why it is unfit for the case."""
    if not simulation.has_particles:
        return {"model": simulation.method, "unfit": list(simulation.unfit)}
    names = ("particles", "escaped_particles", "spilled_particles")
    return {name: getattr(simulation, name) for name in names}


def _rounded(interval: Sequence[float] | None, digits: int) -> list[float] | None:
    return None if interval is None else [round(end, digits) for end in interval]


def _compared(comparison: dict[str, Any]) -> dict[str, Any]:
    found = comparison["uncertainty"]
    mean, numerics = found["mean_level"], found["numerics"]
    kept = ("error_mm", "volume_level_mm", "data_mm", "numerics_mm", "inputs_mm", "validation_mm", "resolved")
    return {
        "mean_error_mm": round(comparison["mean_error_mm"], 4),
        "mean_error_95_mm": [round(end, 4) for end in found["mean_error_mm"]],
        "worst_error_mm": round(comparison["worst_error_mm"], 4),
        "worst_at_mm": round(comparison["worst_at_mm"], 2),
        "worst_at_a_station": _worst_at_a_station(found["stations"], comparison["worst_at_mm"]),
        "flat_level_error_mm": round(comparison["flat_level_error_mm"], 4),
        "beats_flat_level": comparison["beats_flat_level"],
        "baselines": comparison["baselines"],
        "beats_baseline": comparison["beats_baseline"],
        "gate_passed": comparison["passed"],
        "outcome": comparison["outcome"],
        "verdict": comparison["verdict"],
        "headline": comparison["headline"],
        "mean_level": {
            key: round(value, 4) if isinstance(value, float) else value
            for key, value in mean.items()
            if key in kept
        },
        "particle_sizes": None if numerics is None else _sizes(numerics["radii_mm"], numerics["mean_error_mm"]),
        "inputs_mm": {one["name"]: round(one["mean_level_mm"], 4) for one in found["inputs"]},
        "inputs_model": found["inputs"][0]["model"] if found["inputs"] else None,
        "findings": comparison["findings"],
    }  # fmt: skip


def _worst_at_a_station(stations: dict[str, Any], worst_at_mm: float) -> dict[str, float] | None:
    """Return the worst error at a station and its place; None if the worst of all is at one."""
    import numpy as np

    from validate.wording.where_off import worst_at_a_station

    worst = worst_at_a_station(np.array(stations["s_mm"]), np.array(stations["error_mm"]), worst_at_mm)
    return None if worst is None else {"error_mm": round(worst[0], 4), "s_mm": round(worst[1], 2)}


def _sizes(radii_mm: list[float], error: dict[str, Any]) -> dict[str, Any]:
    band_mm = error["band"]
    return {
        "radii_mm": [round(radius_mm, 4) for radius_mm in radii_mm],
        "runs": error["runs"],
        "mean_error_mm": [round(error_mm, 4) for error_mm in error["values"]],
        "band_95_mm": None if band_mm is None else round(band_mm, 4),
    }
