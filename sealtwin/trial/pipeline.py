"""Stages of one trial in their order; each is redone only if its inputs, its settings or this version changed."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from sealtwin.core import files, record_files
from sealtwin.core.errors import InputError, NumericalError
from sealtwin.core.progress import Progress
from sealtwin.core.run_folder import look_into, open_folder
from sealtwin.core.vtk_files import read_collection, read_frame
from sealtwin.trial import digitise_stage, simulate_stage, validate_stage
from sealtwin.trial.job import STAGES, Job, StageName, adopt_trial, require_sample, start_job
from sealtwin.trial.result import read_result
from sealtwin.trial.simulate_stage import FRAMES
from sealtwin.trial.trial_file import Trial


def make_film(folder: Path, path: Path, progress: Progress) -> tuple[int, float]:
    """Write a film of a run folder's frames; return their number and the film's length in seconds.

    Raises InputError if there are no frames.
    """
    look_into(folder)
    if not (folder / FRAMES).is_file():
        raise InputError(
            f"{folder / FRAMES}: not found. 'sealtwin simulate {folder} --frames-every-s 0.1' runs the fluid again and "
            "writes frames."
        )
    from sealtwin.core.drawing.snapshots import FillScene
    from validate.figures.film import write_film

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
) -> FinishedStages:
    """Bring stages of a trial up to date in ``out``, by default reports/ and its name; its files lie in ``source``."""
    require_sample(trial, source)
    with open_folder(out or Path("reports", trial.folder_name), create=True) as folder:
        return run_stages(replace(start_job(trial, source, folder, device, progress), threads=threads), stages)


def run_stages(job: Job, stages: Sequence[StageName]) -> FinishedStages:
    """Bring ``stages`` up to date, in their order.

    A stage that fails leaves the folder as it was, but for refused.png and the checkpoint of a fluid run. Raises
    InputError or NumericalError from a stage, and NumericalError if a particle escaped, with all files written.
    """
    work = {"digitise": digitise_stage, "simulate": simulate_stage, "validate": validate_stage}
    redone: list[StageName] = []
    for stage in STAGES:
        if stage == "simulate" and "simulate" in stages and "validate" in stages:
            # Minutes of simulation must not pass before a typo in the sheet is found.
            validate_stage.readings_of(job)
        if stage in stages and work[stage].bring_up_to_date(job):
            redone.append(stage)
    adopt_trial(job)
    result = read_result(job.folder, job.trial)
    if (escaped := result.get("escaped_particles")) and stages[-1] != "digitise":
        raise NumericalError(
            f"{job.path}: {escaped} particles went through a wall, which must never happen; the files are complete, "
            "but do not use them. Please report this with the trial file."
        )
    if not redone:
        job.progress.note(f"{job.path}: complete and up to date; nothing to redo.")
    return FinishedStages(result, tuple(redone))
