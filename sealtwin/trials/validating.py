"""The third stage: the simulated level is held against the readings, and the report written."""

import platform
import time
from dataclasses import replace
from datetime import UTC, datetime
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

from sealtwin.records import Profile
from sealtwin.store import files, stage_files
from sealtwin.store.folder import stage_key
from sealtwin.store.vtk_files import read_frame
from sealtwin.trials.job import Job, begin_writing, check_sheet, stage_settings
from sealtwin.trials.made import DIGITISED, SIMULATED, made_by
from sealtwin.trials.simulating import snapshots_of
from sealtwin.trials.trial import Trial

if TYPE_CHECKING:
    from validate.evidence import Sheet
    from validate.uncertainty.spread import Spread

NOT_RECORDED = "not recorded"
REPORT_FORM = 2
"""Of comparison.json and report.json: those of another form are made again."""
UNCERTAINTY, SPREAD = "uncertainty", "uncertainty.json"
"""What the extra runs of 'sealtwin validate RUN --uncertainty' are in the manifest, and what they leave."""


def bring_up_to_date(job: Job) -> bool:
    """Whether anything had to be redone. Raises InputError where the sheet of readings cannot be read."""
    trial = job.trial
    inputs = {
        **made_by(job, "digitise", (*DIGITISED, "overlay.png")),
        **made_by(job, "simulate", SIMULATED),
        **{name: files.sha256(job.path / name) for name in snapshots_of(job)},
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

    outline, solid = stage_files.read_outline(job.path), stage_files.read_solid(job.path)
    run, profile = stage_files.read_run(job.path), stage_files.read_profile(job.path)
    with files.understood(job.path / "simulation.json"):
        ratio = stage_files.read_simulation(job.path).volume_ratio
    readings, comparison = readings_of(job), None
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
        trajectory=stage_files.read_trajectory(job.path),
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
        frames=tuple(read_frame(job.path / name) for name in snapshots_of(job)),
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
        stage_files.write_comparison(job.path, comparison)
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


def readings_of(job: Job) -> Profile | None:
    if job.trial.readings is None or job.sheet is None:
        return None
    from validate.caliper import read_readings

    length_mm = stage_files.read_outline(job.path).length_mm
    with files.understood(job.path / "solid.json"):
        depth_mm = float(files.read_json(job.path / "solid.json")["depth_mm"])
    return read_readings(job.sheet, job.trial.readings, length_mm, depth_mm)


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
