"""The first stage: a photo or a mesh becomes walls, a solid and a nozzle path."""

import time
from dataclasses import replace

from digitise.settings import LARGEST_FILE_BYTES
from sealtwin.records import Trajectory
from sealtwin.store import files, stage_files
from sealtwin.store.folder import stage_key
from sealtwin.trials.job import Job, begin_writing, sample_files, stage_settings
from sealtwin.trials.made import DIGITISED
from sealtwin.trials.sample import REFUSED, digitise_sample


def bring_up_to_date(job: Job) -> bool:
    """Whether anything had to be redone. Raises InputError where the sample shows no crack that can be measured."""
    (job.path / REFUSED).unlink(missing_ok=True)
    inputs = _hashes_of_sample(job)
    settings = stage_settings(job.trial, "digitise")
    key = stage_key(inputs, settings)
    # A file that is not there, or larger than any that is read, has no hash; what reads it says so.
    if len(inputs) == len(sample_files(job.trial)) and job.folder.is_current("digitise", key):
        return False
    job.progress.start("Digitising", 5)
    began = time.monotonic()

    from digitise.path_report import path_report
    from digitise.trajectory import plan_trajectory, volume_warnings
    from digitise.walls.overlay import draw_overlay

    sample = digitise_sample(job)
    outline, solid = sample.outline, sample.solid
    job.progress.advance(4, "planning the path")
    trajectory = plan_trajectory(outline, job.trial.path, solid.cavity_volume_mm3, solid.sections)
    path, doubts = path_report(trajectory, outline, job.trial.path)
    sealant_mm3 = dispensed_mm3(trajectory)
    report = {
        **solid.report,
        "sealant_mm3": sealant_mm3,
        "cavity_to_sealant": solid.cavity_volume_mm3 / sealant_mm3,
        "path": path,
        "warnings": [*solid.report["warnings"], *doubts, *volume_warnings(sealant_mm3, solid.cavity_volume_mm3)],
    }
    begin_writing(job, "digitise")
    files.write_png(job.path / "overlay.png", draw_overlay(sample.photo, outline, trajectory))
    stage_files.write_outline(job.path, outline)
    stage_files.write_solid(job.path, replace(solid, report=report))
    stage_files.write_trajectory(job.path, trajectory)
    job.progress.advance(5)
    for warning in (*outline.warnings, *report["warnings"]):
        job.progress.note(f"note: {warning}")
    outputs = ("overlay.png", "crack.stl", "crack.glb", "trajectory.txt", *DIGITISED)
    wall_time_s = time.monotonic() - began
    job.folder.record(
        "digitise", key, settings, inputs, outputs, wall_time_s, given=list(inputs), path_source=outline.path_source
    )
    return True


def _hashes_of_sample(job: Job) -> dict[str, str]:
    """Of each file that shows the crack and is of a size that is read, by its role and name."""
    named = sample_files(job.trial).items()
    return {
        file.name if role == "file" else f"{role} {file.name}": files.sha256(job.source / file)
        for role, file in named
        if (job.source / file).is_file() and (job.source / file).stat().st_size <= LARGEST_FILE_BYTES
    }


def dispensed_mm3(trajectory: Trajectory) -> float:
    """What flows out along a trajectory: each row's flow holds until the next."""
    return float((trajectory.flow_mm3_s[:-1] * (trajectory.t_s[1:] - trajectory.t_s[:-1])).sum())
