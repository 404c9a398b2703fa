"""Compare finished run folders on a page."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from sealtwin.core import files, record_files
from sealtwin.core.errors import InputError
from sealtwin.core.facts import texts
from sealtwin.core.progress import Progress
from sealtwin.core.run_folder import UNNUMBERED, look_into
from sealtwin.trial.job import (
    DIGITISED,
    SEEDS,
    SIMULATED,
    STAGES,
    Job,
    display_path,
    made_by,
    other_versions,
    resume_job,
)
from sealtwin.trial.validate_stage import read_level, readings_of
from validate.figures.compare_page import COLOURS, STAGE_NUMBER, Side, compare_page, differing, runs_table
from validate.figures.page import Page, write_page
from validate.result import COMPARISON, read_comparison
from validate.run_facts import facts_of_runs, run_warnings

PAGE, CONTENT = "compare.html", "compare.json"
NOT_SETTINGS = ("name", "note", "output")  # Keys and tables of a trial that do not change the result


def compare_runs(folders: Sequence[Path], out: Path) -> tuple[dict[str, Any], Page]:
    """Write compare.html, compare.json and figures/ into ``out``. Returns the content of compare.json, and the page.

    Raises InputError if a folder is not a finished run, if settings or files of a run were changed
    after the results were written, or if there are too many folders.
    """
    if len(folders) > len(COLOURS):
        raise InputError(
            f"{len(folders)} runs are given, but at most {len(COLOURS)} can be distinguished in a plot. To show a "
            "study, use 'sealtwin map'."
        )
    jobs = [_finished(folder) for folder in folders]
    sides = [_side(job) for job in jobs]
    others = other_versions(*(job.folder for job in jobs))
    by_run = {number: side.fluid_warnings for number, side in enumerate(sides, start=1)}
    warned = texts(facts_of_runs(by_run, len(sides)))
    page = compare_page(sides, [*others, *warned])
    table = runs_table(sides).numbers
    content = {
        "version": 2,
        "page": display_path(out / PAGE),
        "finding": page.finding,
        "runs": [dict(zip(table, row, strict=True)) for row in zip(*table.values(), strict=True)],
        "differing": differing(sides),
        "other_versions": others,
        "fluid_warnings": warned,
        "files": [CONTENT, *write_page(out / PAGE, page)],
    }
    files.write_json(out / CONTENT, content)
    return content, page


def _finished(folder: Path) -> Job:
    """Read a run, and check its files with the manifest, as 'sealtwin validate' does."""
    job = resume_job(look_into(folder), "cpu", Progress())
    made_by(job, "digitise", DIGITISED)
    made_by(job, "simulate", SIMULATED)
    if job.trial.readings is not None:
        made_by(job, "validate", [COMPARISON])
        if changed := job.folder.changed_since("validate"):
            raise InputError(
                f"{job.path}: {changed[0]} was changed after the readings were compared. Run 'sealtwin validate "
                f"{job.path}' again."
            )
    return job


def _side(job: Job) -> Side:
    readings, (profile, seeds) = readings_of(job), read_level(job)
    run = record_files.read_simulation(job.path)
    with files.reading_stage_file(job.path / "simulation.json"):
        volume_ratio = run.volume_ratio
    stages = STAGES if readings is not None else STAGES[:-1]
    numbers = {STAGE_NUMBER + stage: job.folder.numbers_of(stage).get(stage, UNNUMBERED) for stage in stages}
    return Side(
        name=f"{job.trial.name} ({display_path(job.path)})",
        settings=_flat(job.trial.model_dump(mode="json", exclude=set(NOT_SETTINGS))) | numbers,
        profile=profile,
        readings=readings,
        comparison=None if readings is None else read_comparison(job.path),
        volume_ratio=volume_ratio,
        escaped_particles=run.escaped_particles,
        fluid_warnings=run_warnings(run, volume_ratio, seeds),
        edited=[file for stage in (*STAGES, SEEDS) for file in job.folder.edited(stage)],
    )


def _flat(content: dict[str, Any], before: str = "") -> dict[str, Any]:
    """Return the settings that are set, by dotted name. ``before`` is the prefix of the names."""
    flat: dict[str, Any] = {}
    for key, value in content.items():
        if isinstance(value, dict):
            flat |= _flat(value, f"{before}{key}.")
        elif value is not None:
            flat[f"{before}{key}"] = value
    return flat
