"""Compute all runs of a study in one folder, which is called a sweep."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from sealtwin.core import files, record_files
from sealtwin.core.errors import InputError
from sealtwin.core.facts import texts
from sealtwin.core.progress import Progress
from sealtwin.core.run_folder import content_key, holding, open_folder, require_own
from sealtwin.study.pipeline import run_stages
from sealtwin.study.runner import INPUTS, MAX_NUMBERS, StudyOptions, WantedRun, bring_up_to_date, schedule
from sealtwin.study.study_file import PlannedRun, load_study, plan_runs, raise_faults
from sealtwin.study.study_folder import (
    PLAN,
    STATES,
    Plan,
    StudyFigures,
    StudyRun,
    fluid_warnings,
    holds_study,
    other_versions,
    read_plan,
    write_plan,
)
from sealtwin.trial.job import DIGITISED, display_path, numbers_up_to, require_sample, stage_settings, start_job
from sealtwin.trial.trial_file import SettingValues, drafted, load_trial, refuse_seeds, replaced, sets_resolution
from validate.metrics.verdict import kept_volume
from validate.run_facts import DRAFTED_MM

BUG, SOME_FAILED = 1, 6
DRAFTS = (
    f"at 90 % of the stations, a level is within {DRAFTED_MM:g} mm of the accurate level, which --accurate computes."
)
TABLE = "runs.csv"
FIGURES = ("mean_error_mm", "worst_error_mm", "worst_at_mm", "volume_ratio", "spilled_particles", "particles")
"""Figures of a run that are columns of runs.csv. The run's summary.json contains all figures."""


def sweep(
    file: Path,
    out: Path | None,
    options: StudyOptions,
    progress: Progress,
    settings: SettingValues | None = None,
) -> dict[str, Any]:
    """Compute the runs of a study that are not done yet. Returns the object that --json prints.

    The default of ``out`` is reports/<name of the study>. ``settings`` by dotted name replace settings of the trial.

    Raises:
        InputError: Settings of a run cannot be used (all are checked before the first run), or the folder belongs to
            another study.
        BusyError: Another process uses the folder.
    """
    study = load_study(file)
    base = file.parent / study.trial
    replacements, trial = settings or {}, load_trial(base, settings)
    refuse_seeds(trial, base)
    if twice := sorted({*(study.names & replacements.keys()), *replaced(trial, replacements, study.names)}):
        raise InputError(
            f"--set {twice[0]}: {file} also gives this setting, or one that replaces it; change that file."
        )
    planned = plan_runs(study, file, trial)
    if planned[0].trial.fluid is None:
        raise InputError(
            f"{base}: there is no table [fluid]. Give viscosity_pa_s, or U and D_cm, there or in the study."
        )
    planned = [replace(run, trial=run.trial.loaded(base.parent)) for run in planned]
    require_sample(planned[0].trial, base.parent)
    folder = out or Path("reports", study.folder_name)
    require_own(folder, PLAN, "sweep")
    if sets_resolution((*study.names, *replacements)):
        options = replace(options, drafts=False)
    with holding(folder), progress:
        adopt(folder, study.name)
        files.write_if_new(folder / "study.toml", files.read_bytes(file))
        options = replace(options, keep_fills=True)
        return report(folder, brought_up_to_date(study.name, planned, base.parent, folder, options, progress))


def brought_up_to_date(
    name: str,
    planned: Sequence[PlannedRun],
    source: Path,
    folder: Path,
    options: StudyOptions,
    progress: Progress,
    *,
    part: bool = False,
) -> Plan:
    """Compute the runs of a study that are not done, and return the plan. The caller must have locked ``folder``.

    File names in the trials are relative to ``source``. A later call may plan more runs; finished runs are not computed
    again. If the runs are ``part`` of a longer command, no time is announced here. Raises the same errors as ``sweep``.
    """
    # Each run compares its level with the readings.
    numbers = numbers_up_to("simulate" if planned[0].trial.readings is None else "validate")
    samples = _digitise(planned, source, folder, options, progress)
    runs, largest, doubts = schedule(_wanted(planned, samples, folder, options), options.device, numbers)
    plan = Plan(name, runs, numbers)
    size = f"{largest.particles:,} particles at most" if largest.particles else "the fast model, for screening"
    announced = "" if part else f"{name}: {len(runs)} runs of {size}."
    return bring_up_to_date(folder, plan, largest, options, progress, "Sweeping", announced, doubts)


def adopt(folder: Path, study: str) -> None:
    """Assign the folder to a study. Raises InputError if the folder contains another study."""
    if not holds_study(folder):
        write_plan(folder, Plan(study, []))
    present = read_plan(folder).study
    if present != study:
        raise InputError(f"{folder}: has the study '{present}', but this is '{study}'. Give another folder as --out.")


def _digitise(
    planned: Sequence[PlannedRun], source: Path, folder: Path, options: StudyOptions, progress: Progress
) -> dict[int, str]:
    """Digitise the sample of each run into samples/. Runs with the same settings of digitise share a sample.

    Returns the name of the sample's folder by the number of the run. Raises InputError if a crack cannot be digitised.
    The message lists each fault with the numbers of its runs.
    """
    runs: dict[str, list[PlannedRun]] = {}
    for run in planned:
        runs.setdefault(content_key(stage_settings(run.trial, "digitise"))[:12], []).append(run)
    faults: dict[str, list[int]] = {}
    for name, alike in runs.items():
        try:
            with open_folder(folder / "samples" / name, create=True) as sample:
                job = start_job(alike[0].trial, source, sample, "cpu", progress)
                run_stages(replace(job, traced=options.traced), ("digitise",))
        except InputError as fault:
            faults.setdefault(str(fault), []).extend(run.number for run in alike)
    raise_faults(faults)
    return {run.number: name for name, alike in runs.items() for run in alike}


def _wanted(
    planned: Sequence[PlannedRun], samples: Mapping[int, str], folder: Path, options: StudyOptions
) -> list[WantedRun]:
    """Return the runs with their digitised samples. They are drafts unless the options or the run require accuracy."""
    readings = planned[0].trial.readings
    names = [*DIGITISED, *([] if readings is None else [f"{INPUTS}/{readings.path.name}"])]
    homes = {name: folder / "samples" / name for name in dict.fromkeys(samples.values())}
    digitised = {name: record_files.read_sample(home) for name, home in homes.items()}
    inputs = {name: files.hashes(home, names) for name, home in homes.items()}
    wanted = list[WantedRun]()
    for run in planned:
        name = samples[run.number]
        trial = drafted(run.trial, digitised[name]) if options.drafts and not run.accurate else run.trial
        compared = stage_settings(trial, "validate")["readings"]
        if compared is not None:
            # The key fitted only names the fitted settings, and does not change the result.
            compared.pop("fitted", None)
        depends = {"readings": compared}
        wanted.append(WantedRun(run.number, run.settings, trial, digitised[name], name, inputs[name], depends))
    return wanted


def report(folder: Path, plan: Plan) -> dict[str, Any]:
    """Return the object that --json prints for a study, and write the runs to runs.csv."""
    runs = plan.runs
    failed = [run for run in runs if run.state == "failed"]
    rows = [_row(run) for run in runs]
    if rows:
        cells = (
            [json.dumps(value) if isinstance(value, list | tuple) else value for value in row.values()] for row in rows
        )
        files.write_sheet(folder / TABLE, list(rows[0]), cells)
    return {
        "name": plan.study,
        "folder": display_path(folder),
        "states": {state: sum(run.state == state for run in runs) for state in STATES},
        "stage_numbers": plan.numbers,
        "other_versions": other_versions(folder, plan),
        "best": _best(runs),
        "not_ranked": _not_ranked(runs),
        "screening": screening(runs),
        "fluid_warnings": fluid_warnings(runs),
        "exit_code": BUG if any(run.trace for run in failed) else SOME_FAILED if failed else 0,
        "runs": rows,
    }


def _best(runs: Sequence[StudyRun]) -> dict[str, Any] | None:
    """Return the ranked run with the smallest mean error, and its baselines. None if there is no such run."""
    compared = [
        (run.figures.mean_error_mm, run, run.figures)
        for run in runs
        if run.figures is not None and run.figures.mean_error_mm is not None and run.ranked
    ]
    if not compared:
        return None
    error_mm, run, figures = min(compared, key=lambda triple: triple[0])
    flat_mm = figures.flat_level_error_mm
    return {
        "number": run.number,
        "settings": run.settings,
        "mean_error_mm": error_mm,
        "flat_level_error_mm": flat_mm,
        "beats_flat_level": None if flat_mm is None else error_mm < flat_mm,
        **_baselines(run, figures, error_mm),
    }


def _baselines(run: StudyRun, figures: StudyFigures, error_mm: float) -> dict[str, Any]:
    """Compare the best run with baseline curves.

    A curve has as many coefficients as there are settings that vary or were fitted.
    """
    from validate.metrics.verdict import ALWAYS, against_baselines, beaten

    declared = (run.trial.get("readings") or {}).get("fitted") or ()
    varied = {name for name in run.settings if name != "seed"}
    fitted = len(varied | {*declared})
    curves = [curve for curve in figures.baselines if curve.numbers in (*ALWAYS, min(fitted, MAX_NUMBERS))]
    sentence = None
    if curves:
        sentence = against_baselines(error_mm, curves, "calibrated-on", fitted or None, figures.stations_compared)
    return {
        "varied": len(varied),
        "fitted": fitted,
        "baselines": [asdict(curve) for curve in curves],
        # If only the seed varies, the readings still select one of the runs, which counts as one fitted number.
        "beats_baseline": beaten(error_mm, curves, "calibrated-on", fitted or 1),
        "against_baselines": sentence,
    }


def _not_ranked(runs: Sequence[StudyRun]) -> list[dict[str, Any]]:
    """Return the runs with a volume error above 5 %, and the ratio of settled to dispensed volume of each."""
    ratios = ((run.number, run.figures.volume_ratio) for run in runs if run.figures is not None)
    return [{"number": number, "volume_ratio": ratio} for number, ratio in ratios if not kept_volume(ratio)]


def screening(runs: Sequence[StudyRun]) -> str:
    """Return a sentence about runs of the fast model or drafts. Returns "" if there are none."""
    if not (fast := [run for run in runs if run.fast]):
        drafts = sum(run.trial.get("solver", {}).get("preset") == "draft" for run in runs)
        return f"{drafts} of {len(runs)} runs are drafts: {DRAFTS}" if drafts else ""
    unfit = sum(run.figures is not None and bool(run.figures.unfit) for run in fast)
    which = f"not valid for {unfit} of these runs" if unfit else "valid for all of these runs"
    return (
        f"The fast model computed {len(fast)} of {len(runs)} runs. It is only for screening: confirm its levels with "
        f"particles. It is {which}."
    )


def _row(run: StudyRun) -> dict[str, Any]:
    figures = run.figures
    return {
        "number": run.number,
        **run.settings,
        "model": run.method,
        "unfit": " ".join(texts(figures.unfit if figures else ())) or None,
        "state": run.state,
        **{name: getattr(figures, name, None) for name in FIGURES},
        "wall_s": run.wall_s,
        "reason": run.reason,
        "folder": f"runs/{run.key[:16]}" if run.state == "done" else None,
    }
