"""One trial through the stages, each redone only where its inputs, settings or this version changed."""

import json
import platform
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from digitise.settings import LARGEST_FILE_BYTES
from sealtwin.errors import InputError, NumericalError
from sealtwin.output import CHECKPOINT, FRAMES, PAST_THE_END, SNAPSHOTS, Output
from sealtwin.records import Profile, Run, Trajectory
from sealtwin.store import files
from sealtwin.store.folder import MANIFEST, stage_key
from sealtwin.store.vtk_files import read_collection, read_frame
from sealtwin.trials.job import (
    STAGES,
    Job,
    StageName,
    adopt_trial,
    begin_writing,
    check_sheet,
    sample_files,
    stage_settings,
)
from sealtwin.trials.result import read_result
from sealtwin.trials.sample import REFUSED, digitise_sample
from sealtwin.trials.trial import Trial

if TYPE_CHECKING:
    from validate.evidence import Sheet
    from validate.uncertainty.spread import Spread

NOT_RECORDED = "not recorded"
DIGITISED = ("outline.json", "crack.ply", "solid.json", "trajectory.csv")
"""What the later stages read of the first."""
SIMULATED = ("particles.csv", "simulation.json", "profile.csv")
REPORT_FORM = 2
"""Of comparison.json and report.json: those of another form are made again."""
UNCERTAINTY, SPREAD = "uncertainty", "uncertainty.json"
"""What the extra runs of 'sealtwin validate RUN --uncertainty' are in the manifest, and what they leave."""


@dataclass(frozen=True)
class Outcome:
    """What a command says at its end."""

    result: dict[str, Any]
    """The --json object, and run.json."""
    redone: tuple[StageName, ...]
    gate_passed: bool | None


def run_stages(job: Job, stages: Sequence[StageName]) -> Outcome:
    """Bring ``stages`` up to date, in their order.

    A stage that fails leaves the folder as it was, but for refused.png and the checkpoint of a fluid run.

    Raises:
        InputError, NumericalError: from a stage; or since a particle escaped, with all files written.
    """
    work: dict[StageName, Callable[[Job], bool]] = {"digitise": _digitise, "simulate": _simulate, "validate": _validate}
    redone: list[StageName] = []
    for stage in STAGES:
        if stage == "simulate" and "simulate" in stages and "validate" in stages:
            # Minutes of simulation must not pass before a typo in the sheet is found.
            _read_readings(job)
        if stage in stages and work[stage](job):
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
    return Outcome(result, tuple(redone), result.get("gate_passed"))


def _digitise(job: Job) -> bool:
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
    files.write_outline(job.path, outline)
    files.write_solid(job.path, replace(solid, report=report))
    files.write_trajectory(job.path, trajectory)
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


def _simulate(job: Job) -> bool:
    trial = job.trial
    if trial.fluid is None:
        raise InputError(
            f"{job.path / 'trial.toml'}: no [fluid] table; give U and D_cm, or viscosity_pa_s, and simulate again."
        )
    from simulate.device import choose_device, describe_device

    device = choose_device(job.device)
    if job.threads > 1 and device != "cpu":
        raise InputError(f"--threads {job.threads}: threads are a CPU's, and this run is on {device}. Leave it out.")
    job.progress.note(f"Device: {describe_device(device)}")
    inputs = made_by(job, "digitise", DIGITISED)
    settings = stage_settings(trial, "simulate")
    key = stage_key(inputs, {**settings, "device": device})
    if job.folder.is_current("simulate", key) and _shows(job, trial.output):
        # Killed just after it was finished, a run leaves its checkpoint.
        (job.path / CHECKPOINT).unlink(missing_ok=True)
        return False
    began = time.monotonic()

    from sealtwin.trials.watching import PROGRESS, ProgressFile, read_health, watch
    from simulate.fit import check_fit
    from simulate.profile import measure_profile, volume_ratio
    from simulate.run import inject
    from validate.drawing.snapshots import Scene
    from validate.gallery import write_gallery

    outline, solid = files.read_outline(job.path), files.read_solid(job.path)
    trajectory = files.read_trajectory(job.path)
    check_fit(outline, solid, trial.fluid, trial.solver, trial.nozzle)
    checkpoint, *others = watch(job.path, trial.output, key, job.progress.note)
    with ProgressFile(job.path / PROGRESS) as progress_file:
        run = inject(
            solid,
            outline,
            trajectory,
            trial.fluid,
            trial.solver,
            trial.nozzle,
            seed=trial.seed,
            device=device,
            progress=job.progress,
            watchers=(checkpoint, *others, progress_file),
            threads=job.threads,
        )
        run = replace(run, health={**run.health, "volume_ratio": volume_ratio(run, solid)})
        profile = measure_profile(run, outline, solid)
        begin_writing(job, "simulate")
        files.write_run(job.path, run)
        files.write_profile(job.path, profile)
        job.progress.start("Drawing", 1)
        scene = Scene(outline, solid, trajectory, run.radius_mm, trial.nozzle.diameter_mm)
        frames = {Path(name).stem: read_frame(job.path / name) for name in _snapshots(job)}
        pictures = write_gallery(job.path, frames, scene, read_health(job.path))
        _say_what_is_missing(job, run)
        facts = {"device": describe_device(device), "seed": trial.seed, "output": trial.output.model_dump(mode="json")}
        job.folder.record("simulate", key, settings, inputs, (*SIMULATED, *pictures), time.monotonic() - began, **facts)
        checkpoint.remove()
    return True


def _say_what_is_missing(job: Job, run: Run) -> None:
    end_s = run.health["frames"] * run.health["frame_s"]
    if late := [t_s for t_s in sorted(set(job.trial.output.snapshots_s)) if t_s > PAST_THE_END * end_s]:
        moments = ", ".join(f"{t_s:g}" for t_s in late)
        job.progress.note(f"note: no snapshot at {moments} s: the run ended after {end_s:.2f} s.")


def _shows(job: Job, wanted: Output) -> bool:
    """Whether the finished run left all frames and pictures that are wanted now."""
    with files.understood(job.path / MANIFEST):
        made = Output.model_validate_json(json.dumps(job.folder.manifest["stages"]["simulate"].get("output", {})))
    if wanted.frames_every_s is not None and not (job.path / FRAMES).is_file():
        return False
    return wanted.frames_every_s in (None, made.frames_every_s) and set(wanted.snapshots_s) <= set(made.snapshots_s)


def _validate(job: Job) -> bool:
    trial = job.trial
    inputs = {
        **made_by(job, "digitise", (*DIGITISED, "overlay.png")),
        **made_by(job, "simulate", SIMULATED),
        **{name: files.sha256(job.path / name) for name in _snapshots(job)},
    }
    given = {}
    if trial.readings is not None and job.sheet is not None:
        check_sheet(job.sheet)
        given = {trial.readings.file.as_posix(): files.sha256(job.sheet)}
    inputs |= given
    spread = read_spread(job)
    if spread is not None:
        inputs |= {SPREAD: files.sha256(job.path / SPREAD)}
    settings = stage_settings(trial, "validate")
    from sealtwin.trials.origin import keep_origin, sheet_of

    sheet = sheet_of(job)
    key = stage_key(inputs, {**settings, "form": REPORT_FORM, "sheet": sheet and vars(sheet)})
    if job.folder.is_current("validate", key):
        return False
    job.progress.start("Validating", 2)
    began = time.monotonic()

    from validate.assess import assess
    from validate.compare import compare
    from validate.evidence import Evidence
    from validate.report import REPORT, write_report
    from validate.statements.cautions import run_warnings

    outline, solid = files.read_outline(job.path), files.read_solid(job.path)
    run, profile = files.read_run(job.path), files.read_profile(job.path)
    with files.understood(job.path / "simulation.json"):
        ratio = files.read_simulation(job.path).volume_ratio
    readings, comparison = _read_readings(job), None
    if readings is not None:
        job.progress.note(f"Readings: {readings.dialect}.")
    if trial.readings is not None and readings is not None:
        comparison = compare(
            profile,
            readings,
            outline,
            solid,
            gate=trial.gate,
            role=trial.readings.role,
            photo_data=trial.sample.data,
            escaped_particles=run.escaped_particles,
        )
    job.progress.advance(1, "writing the report")
    evidence = Evidence(
        name=trial.name,
        note=trial.note,
        outline=outline,
        solid=solid,
        trajectory=files.read_trajectory(job.path),
        run=run,
        profile=profile,
        readings=readings,
        comparison=comparison,
        volume_ratio=ratio,
        overlay_path=job.path / "overlay.png",
        photo_data=trial.sample.data,
        provenance=_provenance(job, sheet, spread is not None),
        commands=_commands(job, spread is not None),
        sheet=sheet,
        edited=_edited(job),
        frames=tuple(read_frame(job.path / name) for name in _snapshots(job)),
    )
    if comparison is not None and trial.readings is not None:
        comparison = assess(evidence, trial.readings, trial.uncertainty, spread)
        evidence = replace(evidence, comparison=comparison)
    for warning in run_warnings(run, ratio):
        job.progress.note(f"note: {warning}")
    begin_writing(job, "validate")
    keep_origin(job)
    outputs: list[str] = list(REPORT)
    if comparison is not None:
        files.write_comparison(job.path, comparison)
        outputs.append("comparison.json")
    write_report(job.path, evidence)
    job.progress.advance(2)
    job.folder.record("validate", key, settings, inputs, outputs, time.monotonic() - began, given=list(given))
    return True


def varied_settings(trial: Trial) -> dict[str, Any]:
    """What of a trial its extra runs depend on."""
    declared = trial.uncertainty.model_dump(mode="json", exclude_none=True)
    return {**stage_settings(trial, "simulate"), "uncertainty": declared}


def read_spread(job: Job) -> "Spread | None":
    """What extra runs of these very results and settings left; None where there were none."""
    if UNCERTAINTY not in job.folder.finished() or job.folder.settings_of(UNCERTAINTY) != varied_settings(job.trial):
        return None
    from validate.uncertainty.spread import Spread

    with files.understood(job.path / SPREAD):
        return Spread.of(files.read_json(job.path / SPREAD))


def _snapshots(job: Job) -> list[str]:
    """Files of the run's snapshots, in the order of time; none where the run made none."""
    if not (job.path / SNAPSHOTS).is_file():
        return []
    return [f"{SNAPSHOTS.parent}/{path.name}" for _, path in read_collection(job.path / SNAPSHOTS)]


def _read_readings(job: Job) -> Profile | None:
    if job.trial.readings is None or job.sheet is None:
        return None
    from validate.caliper import read_readings

    length_mm = files.read_outline(job.path).length_mm
    with files.understood(job.path / "solid.json"):
        depth_mm = float(files.read_json(job.path / "solid.json")["depth_mm"])
    return read_readings(job.sheet, job.trial.readings, length_mm, depth_mm)


def dispensed_mm3(trajectory: Trajectory) -> float:
    """What flows out along a trajectory: each row's flow holds until the next."""
    return float((trajectory.flow_mm3_s[:-1] * (trajectory.t_s[1:] - trajectory.t_s[:-1])).sum())


def made_by(job: Job, stage: StageName, names: Sequence[str]) -> dict[str, str]:
    """Hashes of files that ``stage`` left, edited since or not.

    Raises InputError where it is not finished, or was with other settings than the trial's.
    """
    again = f"'sealtwin {stage} {job.path}'" if stage != "digitise" else f"'sealtwin run TRIAL --out {job.path}'"
    made_with = job.folder.settings_of(stage)
    missing = [name for name in names if not (job.path / name).is_file()]
    if made_with is None or missing:
        what = f" ({missing[0]} is not there)" if missing else ""
        raise InputError(f"{job.path}: {stage} is not finished{what}. Run {again} first.")
    wanted = stage_settings(job.trial, stage)
    if differing := [table for table, setting in wanted.items() if made_with.get(table) != setting]:
        raise InputError(
            f"{job.path / 'trial.toml'}: [{'], ['.join(differing)}] is not what {stage} ran with here. "
            f"Run {again} for these settings first."
        )
    for name in job.folder.edited(stage):
        job.progress.note(f"{name}: not as {stage} wrote it; it is used as it is now.")
    return {name: files.sha256(job.path / name) for name in names}


def _edited(job: Job) -> tuple[str, ...]:
    """Files that the report rests on, and that are not as their stage wrote them."""
    used = {*DIGITISED, "overlay.png", *SIMULATED, SPREAD}
    stages = ("digitise", "simulate", UNCERTAINTY)
    return tuple(name for stage in stages for name in job.folder.edited(stage) if name in used)


def _commands(job: Job, varied: bool) -> tuple[str, ...]:
    run = f"reports/{job.trial.folder_name}"
    again = (f"sealtwin validate {run} --uncertainty",) if varied else ()
    return "sealtwin run trial.toml", *again


def _provenance(job: Job, sheet: "Sheet | None", varied: bool) -> dict[str, str]:
    done = ("digitise", "simulate", *([UNCERTAINTY] if varied else []))
    stages = {stage: job.folder.manifest["stages"][stage] for stage in done}
    facts = {"sealtwin": version("sealtwin"), "system": f"{platform.system()} {platform.machine()}"}
    told: set[tuple[str, str]] = set()
    for stage, entry in stages.items():
        facts[f"{stage}: finished"] = str(entry.get("finished_utc", NOT_RECORDED))
        facts[f"{stage}: wall time"] = f"{entry['wall_time_s']:.1f} s"
        new = [one for one in entry["inputs"].items() if one not in told]
        facts |= {f"{stage}: {name}": f"sha256 {digest}" for name, digest in new}
        told.update(new)
    facts["validate: begun"] = datetime.now(UTC).isoformat(timespec="seconds")
    if sheet is not None:
        facts[f"validate: {sheet.name}"] = f"sha256 {sheet.sha256}"
    if edited := [name for stage in stages for name in job.folder.edited(stage)]:
        facts["edited by hand since"] = ", ".join(edited)
    facts["device"] = stages["simulate"]["device"]
    facts["seed"] = str(stages["simulate"]["seed"])
    return facts | {name: text for name, text in stages["simulate"]["versions"].items() if name != "sealtwin"}
