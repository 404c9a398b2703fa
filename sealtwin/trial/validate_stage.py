"""Third stage: compare the simulated level with the readings, and write the report."""

import time
from dataclasses import replace
from datetime import UTC, datetime
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sealtwin.core import files, record_files
from sealtwin.core.errors import InputError
from sealtwin.core.facts import doubt
from sealtwin.core.record_files import LEVEL
from sealtwin.core.records import Outline, Profile, Solid
from sealtwin.core.run_folder import other_numbers, stage_key
from sealtwin.core.vtk_files import read_frame
from sealtwin.trial.job import (
    DIGITISED,
    OVERLAY,
    SEEDS,
    SIMULATED,
    STRAIGHT,
    Job,
    begin_writing,
    check_sheet,
    made_by,
    stage_settings,
)
from sealtwin.trial.simulate_stage import snapshots_of
from sealtwin.trial.trial_file import Trial
from validate.result import COMPARISON, PREDICTION, SHOWN_REMARKS, Evidence, ReadingsSheet, SeedRuns, provenance
from validate.units import counted

if TYPE_CHECKING:
    from validate.uncertainty.computed import Spread

REPORT_FORM = 19  # Version of the report's content and layout. A report of another version is written again
UNCERTAINTY, SPREAD = "uncertainty", "uncertainty.json"
"""Name in the manifest for the runs of 'sealtwin validate RUN --uncertainty', and the file with their results."""
SEED_RUNS = "seeds.json"
OF_SEEDS = (LEVEL, SEED_RUNS)  # Files from the runs with other seeds that the report uses
OF_EXTRA_RUNS = ("uncertainty", "weighed")  # Settings of this stage that the extra runs depend on
RECORD = "record.json"  # Record of a trial that was made from a lab's folder, in the trial's folder
ORIGIN = Path("inputs", "origin.json")
"""File in a run folder with the origin of the readings. It is copied from ``RECORD`` without the lab's other data."""


def bring_up_to_date(job: Job) -> bool:
    """Run the stage unless its files are up to date. Returns True if it ran.

    Raises InputError if the readings cannot be read.
    """
    trial = job.trial
    inputs = {
        **made_by(job, "digitise", (*DIGITISED, OVERLAY, STRAIGHT)),
        **made_by(job, "simulate", SIMULATED),
        **files.hashes(job.path, snapshots_of(job)),
    }
    sheets = {}
    if trial.readings is not None and job.sheet is not None:
        check_sheet(job.sheet, trial.readings)
        sheets = {trial.readings.path.as_posix(): files.sha256(job.sheet)}
    inputs |= sheets
    spread = read_spread(job)
    if spread is not None:
        inputs |= files.hashes(job.path, [SPREAD])
    if trial.seeds is not None:
        read_level(job)
        inputs |= files.hashes(job.path, OF_SEEDS)
    settings = stage_settings(trial, "validate")

    sheet, numbers = sheet_of(job), job.numbers("validate")
    key = stage_key(inputs, {**settings, "form": REPORT_FORM, "sheet": sheet and dict(sheet)}, numbers)
    if job.folder.is_current("validate", key):
        return False
    began = time.monotonic()

    from validate.compare import assess
    from validate.metrics.volumes import balance_profile, gained_level_mm
    from validate.report.write_report import write_report
    from validate.uncertainty.meniscus import Mouth
    from validate.uncertainty.validation import BedEnds, predict

    outline, solid = _crack(job)
    run, (profile, seeds) = record_files.read_run(job.path), read_level(job)
    with files.reading_stage_file(job.path / "simulation.json"):
        ratio = record_files.read_simulation(job.path).volume_ratio
    readings = readings_of(job)
    job.progress.start("Validating", 2)
    if readings is not None:
        job.progress.note(f"Readings: {readings.dialect}.")
        note_doubts(job, readings)
    job.progress.advance(1, "writing the report")
    stages = ("digitise", "simulate", SEEDS, UNCERTAINTY)
    used = {*DIGITISED, OVERLAY, STRAIGHT, *SIMULATED, *OF_SEEDS, SPREAD}
    trajectory = record_files.read_trajectory(job.path)
    evidence = Evidence(
        name=trial.name,
        note=trial.note,
        assumed=trial.assumed_words,
        outline=outline,
        solid=solid,
        trajectory=trajectory,
        run=run,
        profile=profile,
        seeds=seeds,
        readings=readings,
        volume_ratio=ratio,
        overlay_path=job.path / OVERLAY,
        straight_path=job.path / STRAIGHT,
        photo_data=trial.shown_by.data,
        provenance=_provenance(job, sheet, varied=spread is not None, seeds=seeds),
        commands=("sealtwin run trial.toml", *(["sealtwin validate trial.toml --uncertainty"] if spread else [])),
        sheet=sheet,
        edited=tuple(name for stage in stages for name in job.folder.edited(stage) if name in used),
        can_be_varied=trial.can_be_varied,
        frames=tuple(read_frame(job.path / name) for name in snapshots_of(job)),
        can_be_planned=trial.given_fluid.suits_fast_model,
    )
    if trial.readings is not None and readings is not None:
        comparison = assess(evidence, trial.readings, trial.known_inputs(outline, solid), spread, trial.gate)
        evidence = replace(evidence, comparison=comparison)
    elif spread is not None:
        gained_mm = gained_level_mm(run, profile, outline, solid, ratio)
        ends, mouth = BedEnds.of(trajectory, run), Mouth.of(outline, solid, run.density_kg_m3)
        flat = balance_profile(run.dispensed_volume_mm3, outline, solid)
        prediction = predict(profile, spread, trial.known_inputs(outline, solid), gained_mm, ends, mouth, flat)
        evidence = replace(evidence, prediction=prediction)
    begin_writing(job, "validate")
    keep_origin(job)
    outputs = write_report(job.path, evidence, pdf=trial.output.pictures)
    if trial.output.pictures and run.has_particles:
        outputs += _draw_run(job, evidence)
    for name, record in ((COMPARISON, evidence.comparison), (PREDICTION, evidence.prediction)):
        if record is not None:
            files.write_json(job.path / name, record.model_dump())
            outputs.append(name)
    job.progress.advance(2)
    facts = {"numbers": numbers, "from_user": list(sheets)}
    job.folder.record("validate", key, settings, inputs, outputs, time.monotonic() - began, **facts)
    return True


def _draw_run(job: Job, evidence: Evidence) -> list[str]:
    """Draw the snapshots of a particle run, and return the names of the files."""
    from validate.figures.snapshots import write_gallery
    from validate.report.chapters import scene_of

    names = [Path(name).stem for name in snapshots_of(job)]
    frames = dict(zip(names, evidence.frames, strict=True))
    return write_gallery(job.path, frames, scene_of(evidence))


def read_seeds(job: Job) -> SeedRuns | None:
    """Read the record of the runs with several seeds. Returns None for one seed, or if the runs are not finished."""
    if job.trial.seeds is None or SEEDS not in job.folder.finished():
        return None
    return record_files.read_record(SeedRuns, job.path / SEED_RUNS)


def read_level(job: Job) -> tuple[Profile, SeedRuns | None]:
    """Read the level. If it is the mean of several seeds, also read the record of their runs.

    Raises InputError if the runs are not finished.
    """
    seeds = read_seeds(job)
    if job.trial.seeds is not None and (seeds is None or len(seeds.seeds) != job.trial.seeds):
        raise InputError(
            f"{job.path}: the runs with {job.trial.seeds} seeds are not finished. First run 'sealtwin validate "
            f"{job.path}'."
        )
    return (record_files.read_profile if seeds is None else record_files.read_level)(job.path), seeds


def varied_settings(trial: Trial) -> dict[str, Any]:
    """Return the settings that the extra runs depend on."""
    compared = stage_settings(trial, "validate")
    return {**stage_settings(trial, "simulate"), **{name: compared[name] for name in OF_EXTRA_RUNS if name in compared}}


def read_spread(job: Job) -> "Spread | None":
    """Read the results of the extra runs. Returns None if they were not computed for these files and settings."""
    if UNCERTAINTY not in job.folder.finished() or job.folder.settings_of(UNCERTAINTY) != varied_settings(job.trial):
        return None
    if other := other_numbers(job.folder.numbers_of(UNCERTAINTY), job.numbers("validate")):
        text = (
            f"{job.path / SPREAD}: is not used, since the extra runs were computed by {other}. 'sealtwin validate "
            f"{job.path} --uncertainty' computes them again."
        )
        job.progress.warn(doubt("file.other-version", text, UNCERTAINTY))
        return None
    from validate.uncertainty.computed import Spread

    with files.reading_stage_file(job.path / SPREAD):
        return replace(Spread.of(files.read_json(job.path / SPREAD)), mean_of=job.trial.seeds or 1)


def readings_of(job: Job) -> Profile | None:
    """Return the trial's readings, or None if it has no readings. Raises InputError if they cannot be read."""
    if job.trial.readings is None or job.sheet is None:
        return None
    from validate.readings.read_readings import read_readings

    return read_readings(job.sheet, job.trial.readings, crack=_crack(job), progress=job.progress)


def _crack(job: Job) -> tuple[Outline, Solid]:
    hashes = tuple(files.sha256(job.path / name) for name in DIGITISED if (job.path / name).is_file())
    return _read_crack(job.path, hashes)


@lru_cache(maxsize=1)
def _read_crack(folder: Path, _: tuple[str, ...]) -> tuple[Outline, Solid]:
    """Read a crack. It is cached by the hashes of its files, so that areas of its cavity are computed only once."""
    return record_files.read_outline(folder), record_files.read_solid(folder)


def note_doubts(job: Job, readings: Profile) -> None:
    """Show each doubt about the readings as a warning, and all remarks on them as one."""
    remarks = [f"{question}" for question in readings.questions if question.is_remark]
    for question in readings.questions:
        if not question.is_remark:
            job.progress.warn(doubt("readings.doubt", f"{question}", question.kind), "warning")
    if remarks:
        more = f" {COMPARISON} has them all." if len(remarks) > SHOWN_REMARKS else ""
        text = f"{counted(len(remarks), 'remark')} on the readings: {' '.join(remarks[:SHOWN_REMARKS])}{more}"
        job.progress.warn(doubt("readings.remarks", text, len(remarks)), "warning")


def sheet_of(job: Job) -> ReadingsSheet | None:
    """Return the sheet of readings with its origin, or None if there are no readings.

    Raises InputError if the record of the origin is damaged.
    """
    if job.sheet is None or job.trial.readings is None:
        return None
    name, digest = job.trial.readings.path.name, files.sha256(job.sheet)
    origin = _recorded_origin(job.source)
    if origin is not None and origin.sha256 == digest:
        return origin
    # The lab's record is valid only for the ingested sheet.
    name += "" if origin is None else ", changed after the lab gave it"
    return ReadingsSheet(name=name, sha256=digest, operator=None, date=None)


def keep_origin(job: Job) -> None:
    """Write the origin of the readings to the run folder, so that it is moved together with the run."""
    if job.source.resolve() != job.path.resolve() and (origin := _recorded_origin(job.source)) is not None:
        files.write_if_new(job.path / ORIGIN, files.as_json(dict(origin)).encode())


def _recorded_origin(source: Path) -> ReadingsSheet | None:
    """Return the recorded origin of the readings, or None for a trial that was not made from a lab's folder."""
    if (source / ORIGIN).is_file():
        return record_files.read_record(ReadingsSheet, source / ORIGIN)
    content = files.read_json(source / RECORD) if (source / RECORD).is_file() else None
    if not isinstance(content, dict) or "ingested_utc" not in content:
        return None
    with files.reading_stage_file(source / RECORD):
        of_lab = {key: content[key] for key in ("operator", "date")}
        sheets = (file for file in content["files"] if file["role"] == "readings")
        return next((ReadingsSheet(name=file["original"], sha256=file["sha256"], **of_lab) for file in sheets), None)


def _provenance(job: Job, sheet: "ReadingsSheet | None", *, varied: bool, seeds: SeedRuns | None) -> dict[str, str]:
    done = ("digitise", "simulate", *([SEEDS] if seeds else []), *([UNCERTAINTY] if varied else []))
    stages = {stage: job.folder.manifest["stages"][stage] for stage in done}
    facts: dict[str, str] = {}
    for stage, entry in stages.items():
        facts[f"{stage}: finished"] = entry["finished_utc"]
        facts[f"{stage}: wall time"] = f"{entry['wall_time_s']:.1f} s"
        facts |= {
            f"{stage}: {name}": f"sha256 {digest}" for name, digest in entry["inputs"].items() if name in entry["given"]
        }
    facts["validate: begun"] = datetime.now(UTC).isoformat(timespec="seconds")
    if sheet is not None:
        facts[f"validate: {sheet.name}"] = f"sha256 {sheet.sha256}"
    if edited := [name for stage in stages for name in job.folder.edited(stage)]:
        facts["edited by hand since"] = ", ".join(edited)
    run = stages["simulate"]
    seed = run["seed"] if seeds is None else ", ".join(map(str, seeds.seeds))
    return provenance(facts, run["device"], seed, run["versions"], job.numbers("validate"))
