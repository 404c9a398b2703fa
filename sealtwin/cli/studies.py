"""Commands that compute a trial many times or compare runs: compare, map, sweep, calibrate, plan."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from sealtwin.cli.answer import GATE_FAILED, Command, answers
from sealtwin.cli.options import File, Given, argument, option

if TYPE_CHECKING:
    from sealtwin.calibration import CalibrationOptions
    from sealtwin.cli.models import StudyMap, StudyRuns, Sweeping, WorkerProcesses
    from sealtwin.plan import PlanOptions
    from sealtwin.study.study_map import Mapped

LAUNCH = 256  # Runs computed together on a GPU. For the paper's trial they use 2 GB, or 6 GB if nothing freezes
MAX_NAMED = 8  # Largest number of failed runs that are printed. The table contains all of them


@answers()
def compare(
    command: Command,
    folders: Annotated[list[Path], argument("RUN RUN ...", "Run folders, two or more.")],
) -> None:
    """Compare runs: their figures, and the settings and stage numbers that differ.

    Example: sealtwin compare reports/paper-trial reports/paper-trial-lean
    """
    if len(folders) < 2:
        raise typer.BadParameter("give at least two run folders")
    from sealtwin.study.run_comparison import compare_runs

    content = compare_runs(folders)
    command.reply(content, compared_lines(content))


@answers(options="sealtwin.cli.models:StudyMap")
def map(
    command: Command,
    folder: Annotated[Path, argument("STUDY", "Folder of a sweep.")],
    options: "StudyMap",
    out: Annotated[File, option("Folder for the page. Default: STUDY/map.", "DIR")] = None,
) -> None:
    """Draw a study of two settings with the paper's figures: levels, map of the error, influences, fills, cost.

    Also reports which pair of values is nearest to the readings, how many pairs fit equally well, and which runs are
    excluded and why. Writes a page, SVG files, and their numbers as CSV.

    Example: sealtwin map reports/paper-132 --caliper fixtures/paper-trial/caliper.csv
    """
    from sealtwin.study.study_map import map_study

    caliper, data, any_volume = options.caliper, options.data, options.any_volume
    mapped = map_study(folder, out, caliper, data, command.progress(), fills=options.fills, any_volume=any_volume)
    command.reply(mapped.content, mapped_lines(mapped))


@answers(options="sealtwin.cli.models:Sweeping", device=True)
def sweep(
    command: Command,
    study: Annotated[File, argument("STUDY", "A study.toml.")] = None,
    *,
    settings: Given,
    options: "Sweeping",
    out: Annotated[File, option("Folder for the sweep. Default: reports/<study name>.", "DIR")] = None,
    example: Annotated[File, option("Write an example of a study file, with comments.", "FILE")] = None,
) -> None:
    """Run a trial many times with different settings, a grid or a list, on all cores.

    The runs are drafts (solver.preset), unless the study or --set gives settings of the table solver other than model
    and settle_s.

    Finished runs are kept: after an interruption, repeat the command to compute the rest. Failed runs are listed with
    their reasons.

    Example: sealtwin sweep fixtures/paper-trial/study-paper.toml --dry-run
    """
    if example is not None:
        from sealtwin.trial.starter_files import write_example_study

        command.write_example(example, study, write_example_study)
        return
    if study is None:
        raise typer.BadParameter("give a study; --example FILE writes an example")
    from sealtwin.study.runner import StudyOptions
    from sealtwin.study.sweep import sweep as run_study

    device, jobs = command.device_and_jobs(options.jobs)
    computing = StudyOptions(
        device,
        jobs,
        options.batch or (1 if device == "cpu" else LAUNCH),
        retry=options.retry,
        dry_run=options.dry_run,
        drafts=not options.accurate,
        scheduler=options.scheduler,
    )
    swept = run_study(study, out, computing, command.progress(), settings)
    command.reply(swept, swept_lines(swept), swept["exit_code"])


@answers(options="sealtwin.calibration:CalibrationOptions", runs="sealtwin.cli.models:StudyRuns", device=True)
def calibrate(
    command: Command,
    trials: Annotated[list[Path], argument("TRIAL ...", 'Trial files with readings of the role "calibrated-on".')],
    options: "CalibrationOptions",
    settings: Given,
    runs: "StudyRuns",
    out: Annotated[File, option("Folder for the calibration. Default: reports/<trial name>-calibrated.", "DIR")] = None,
) -> None:
    """Determine the posterior distribution of settings from the readings of trials, and predict other trials.

    The runs are drafts, as in a sweep. Only the runs of the last round and of held-out trials are accurate.

    Finished runs are kept. After an interruption, repeat the command to continue; the result is the same. The exit code
    is 5 if no settings within the ranges reproduce the readings.

    Example: sealtwin calibrate trial.toml --free fluid.yield_stress_pa=3:60 --free fluid.viscosity_pa_s=0.2:5
    --hold-out other.toml
    """
    from sealtwin.calibration.calibrate import calibrate as find
    from sealtwin.study.runner import StudyOptions

    if twice := sorted(options.free.keys() & settings.keys()):
        raise typer.BadParameter(f"{twice[0]} is given with both --set and --free; give only one of them")
    device, jobs = command.device_and_jobs(runs.jobs)
    # Starting a worker process takes seconds in each round, so one job is computed in this process.
    computing = StudyOptions(device, 0 if jobs == 1 else jobs, drafts=not runs.accurate)
    content = find(trials, options, out, computing, command.progress(), settings)
    lines = [
        *content["cautions"],
        f"{content['name']}: {content['runs_of_each_trial']} runs of each trial.",
        content["finding"],
        *content["advice"],
        f"Page: {content['page']}",
    ]
    command.reply(content, lines, 0 if content["possible"] else GATE_FAILED)


@answers(options="sealtwin.plan:PlanOptions", runs="sealtwin.cli.models:WorkerProcesses", device=True)
def plan(
    command: Command,
    trial: Annotated[
        Path, argument("TRIAL", "A trial.toml with a path and a sealant whose properties do not change with its age.")
    ],
    settings: Given,
    options: "PlanOptions",
    runs: "WorkerProcesses",
    out: Annotated[File, option("Folder for the plan. Default: reports/<trial name>-plan.", "DIR")] = None,
) -> None:
    """Plan flow and speed along a crack, so that it is full and nothing overspills.

    Searches with the fast model, checks the plan with particles, corrects the fast model by the difference, and
    searches again. The runs are drafts, as in a sweep, except the last two, which correct the plan and compute its
    level. After an interruption, repeat the command to continue.

    Example: sealtwin plan trial.toml --cell cell.toml
    """
    from sealtwin.plan.make_plan import make_plan
    from sealtwin.trial.trial_file import sets_resolution

    options = options.model_copy(update={"accurate": options.accurate or sets_resolution(settings)})
    device, jobs = command.device_and_jobs(runs.jobs)
    result = make_plan(trial, out, options, command.progress(), device=device, jobs=jobs, settings=settings)
    files = f"Plan: {result.content['folder']}/plan.csv, and trial.toml to run it. Page: plan.html"
    command.reply(result.content, [*result.sentences, files])


def swept_lines(swept: dict[str, Any]) -> list[str]:
    """Return the printed lines for a sweep. ``swept`` is the object that --json prints."""
    from validate.readings.grid import listed
    from validate.units import settings_words

    runs, best = swept["runs"], swept["best"]
    counts = ", ".join(f"{number} {state}" for state, number in swept["states"].items() if number)
    lines = [f"{swept['name']}: {len(runs)} runs, {counts}.", *swept["other_versions"]]
    lines += [*filter(None, [swept["screening"]]), *swept["fluid_warnings"]]
    if best is not None:
        settings, error = settings_words(best["settings"]), f"{best['mean_error_mm']:.2f} mm on average"
        lines.append(f"Nearest to the readings: run {best['number']} ({settings}), {error}.")
        lines += filter(None, [best["against_baselines"]])
    if unranked := [f"{run['number']} (ratio {run['volume_ratio']:.3f})" for run in swept["not_ranked"]]:
        lines.append(f"Not ranked, since the settled volume is wrong by over 5 %: run {listed(unranked, MAX_NAMED)}.")
    failed = [run for run in runs if run["state"] == "failed"]
    for run in failed[:MAX_NAMED]:
        settings = {name: value for name, value in run.items() if name == "seed" or "." in name}
        lines.append(f"failed: run {run['number']} ({settings_words(settings)}): {run['reason']}")
    if len(failed) > MAX_NAMED:
        lines.append(f"failed: {len(failed) - MAX_NAMED} more runs.")
    return [*lines, f"Folder: {swept['folder']}"]


def mapped_lines(mapped: "Mapped") -> list[str]:
    """Return the printed lines for a map."""
    chart, best = mapped.chart, mapped.chart.best
    return [
        *mapped.page.cautions,
        f"{chart.name}: {len(chart.runs)} runs compared with {chart.readings.source}.",
        f"Nearest to the readings: run {best.number} ({chart.text_of(best)}), {best.mean_error_mm:.2f} mm on average.",
        chart.beside_baselines,
        chart.flatness,
        chart.exclusion,
        f"Page: {mapped.content['page']}",
    ]


def compared_lines(content: dict[str, Any]) -> list[str]:
    """Return the printed lines for a comparison of runs. ``content`` is the object that --json prints."""
    from validate.units import setting_words, words

    lines = [*content["other_versions"], *content["fluid_warnings"], content["finding"]]
    for run in content["runs"]:
        number, name, *figures = run.items()
        texts = [f"{words(key)} {setting_words(value)}" for key, value in figures if value is not None]
        lines.append(f"{number[1]}: {name[1]}: {', '.join(texts)}")
    for name, values in content["differing"].items():
        lines.append(f"{name}: {'; '.join(setting_words(value) for value in values)}")
    return lines
