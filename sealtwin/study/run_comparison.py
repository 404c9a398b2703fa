"""Compare finished run folders on a page."""

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
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
    made_by,
    other_versions,
    resume_job,
    shown,
    stage_settings,
)
from sealtwin.trial.trial_file import Trial
from sealtwin.trial.validate_stage import read_level, readings_of
from validate.figures.compare_page import MAX_RUNS, Side, compare_page, differing, first_with_readings
from validate.figures.page import Page, write_page
from validate.result import COMPARISON, Comparison, read_comparison
from validate.run_facts import facts_of_runs, run_warnings

PAGE, CONTENT = "compare.html", "compare.json"
LISTED = (
    "mean_error_mm",
    "flat_level_error_mm",
    "beats_flat_level",
    "baselines",
    "beats_baseline",
    "role",
    "fitted",
)  # Figures of a comparison that are written to compare.json
NOT_SETTINGS = ("name", "note", "output")  # Keys and tables of a trial that do not change the result
WITHOUT_EFFECT = ("gate.", "uncertainty.")  # Prefixes of settings that change neither the level nor its error


def compare_runs(folders: Sequence[Path], out: Path) -> tuple[dict[str, Any], Page]:
    """Write compare.html, compare.json and figures/ into ``out``. Returns the content of compare.json, and the page.

    Raises InputError if a folder is not a finished run or is given twice, if settings or files of a run were changed
    after the results were written, or if there are too many folders.
    """
    if len(folders) > MAX_RUNS:
        raise InputError(
            f"{len(folders)} runs are given, but at most {MAX_RUNS} can be distinguished in a plot. To show a study, "
            "use 'sealtwin map'."
        )
    twice = [str(folder) for folder, times in Counter(folder.resolve() for folder in folders).items() if times > 1]
    if twice:
        raise InputError(f"{twice[0]}: this run is given twice; give each run once.")
    jobs = [_finished(folder) for folder in folders]
    names = Counter(job.trial.name for job in jobs)
    sides = [
        _side(job, job.trial.name if names[job.trial.name] == 1 else f"{job.trial.name} ({shown(job.path)})")
        for job in jobs
    ]
    others = other_versions(*(job.folder for job in jobs))
    warned = texts(facts_of_runs({k: side.fluid_warnings for k, side in enumerate(sides, start=1)}, len(sides)))
    page = compare_page(sides, [*others, *warned])
    written = write_page(out / PAGE, page)
    content = {
        "version": 1,
        "page": shown(out / PAGE),
        "finding": page.finding,
        "runs": [
            {
                "number": index + 1,
                "name": side.name,
                "folder": shown(folders[index]),
                **_listed(side.comparison),
                "not_ranked": side.unranked or None,
                "readings_of_run": None if first is None else first + 1,
                "edited": side.edited,
                "facts": side.facts,
            }
            for index, (side, first) in enumerate(zip(sides, first_with_readings(sides), strict=True))
        ],
        "differing": differing(sides),
        "other_versions": others,
        "fluid_warnings": warned,
        "files": [CONTENT, *written],
    }
    files.write_json(out / CONTENT, content)
    return content, page


def _listed(comparison: Comparison | None) -> dict[str, Any]:
    if comparison is None:
        return dict.fromkeys(LISTED)
    content = comparison.model_dump(mode="json", include=set(LISTED))
    figures = {**vars(comparison.errors), "beats_flat_level": comparison.beats_flat_level, **content}
    return {name: figures[name] for name in LISTED}


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


def _side(job: Job, name: str) -> Side:
    readings, (profile, seeds) = readings_of(job), read_level(job)
    run = record_files.read_simulation(job.path)
    counted = run.has_particles
    facts: dict[str, float | None] = {
        "particles": run.particles if counted else None,
        "particle radius (mm)": run.radius_mm if counted else None,
        "spilled particles": run.spilled_particles if counted else None,
        "escaped particles (must be 0)": run.escaped_particles if counted else None,
        "volume kept": run.health.volume_ratio,
        "frames": run.health.frames,
        "time of the frames (s)": run.health.frames_s,
    }
    with files.reading_stage_file(job.path / "simulation.json"):
        volume_ratio = run.volume_ratio
    stages = STAGES if readings is not None else STAGES[:-1]
    numbers = {f"stage_number.{stage}": job.folder.numbers_of(stage).get(stage, UNNUMBERED) for stage in stages}
    settings = _flat(job.trial.model_dump(mode="json", exclude=set(NOT_SETTINGS)))
    return Side(
        name=name,
        settings=settings | numbers,
        without_effect=frozenset(_without_effect(job.trial, run, settings)),
        profile=profile,
        readings=readings,
        comparison=None if readings is None else read_comparison(job.path),
        facts=facts,
        volume_ratio=volume_ratio,
        escaped_particles=run.escaped_particles,
        fluid_warnings=run_warnings(run, volume_ratio, seeds),
        edited=[file for stage in (*STAGES, SEEDS) for file in job.folder.edited(stage)],
    )


def _without_effect(trial: Trial, run: record_files.Simulation, settings: Iterable[str]) -> Iterator[str]:
    """Yield the settings that change neither the level nor its error."""
    # A weighed fill depends on some of the uncertainties. The fast model depends on few settings of the solver.
    fitted = {f"uncertainty.{name}" for name in stage_settings(trial, "digitise").get("known", ())}
    solver = {f"solver.{name}" for name in run.settings.get("solver", {})}
    for name in settings:
        if (name.startswith(WITHOUT_EFFECT) and name not in fitted) or (
            name.startswith("solver.") and ".".join(name.split(".")[:2]) not in solver
        ):
            yield name


def _flat(content: dict[str, Any], before: str = "") -> dict[str, Any]:
    """Return the settings that are set, by dotted name. ``before`` is the prefix of the names."""
    flat: dict[str, Any] = {}
    for key, value in content.items():
        if isinstance(value, dict):
            flat |= _flat(value, f"{before}{key}.")
        elif value is not None:
            flat[f"{before}{key}"] = value
    return flat
