"""Map a study: compare all its runs with one sheet of readings, and draw the figures of the paper."""

import zipfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from string import ascii_lowercase
from typing import Any

import numpy as np

from sealtwin.core import files, record_files
from sealtwin.core.cluster import cores, run_tasks
from sealtwin.core.errors import InputError, NumericalError, present
from sealtwin.core.facts import Fact, doubt, texts
from sealtwin.core.plain_files import opened
from sealtwin.core.progress import Progress, in_words
from sealtwin.core.records import DataKind, Profile
from sealtwin.core.run_folder import holding, other_numbers
from sealtwin.core.vtk_files import Frame
from sealtwin.study.runner import INPUTS
from sealtwin.study.study_folder import (
    FILL,
    Plan,
    StudyRun,
    fluid_warnings,
    is_intact,
    other_versions,
    profile_path,
    read_level,
    read_plan,
    run_path,
)
from sealtwin.study.sweep import screening
from sealtwin.trial.job import check_sheet, numbers_up_to, shown
from sealtwin.trial.trial_file import Trial, as_run
from validate.figures.chart import (
    UNFIT,
    VOLUME_OFF,
    Chart,
    Excluded,
    Finished,
    Watched,
    as_near_as_the_best,
    axes_of,
    chosen_few,
    first_of_each_pair,
    hold,
)
from validate.figures.map_page import Fill, map_page
from validate.figures.page import Page as StudyPage
from validate.figures.page import write_page
from validate.figures.snapshots import FillScene
from validate.settings import Readings

MAP = "map"  # Default folder of the map in the study's
PAGE, CONTENT = "map.html", "map.json"
FEWEST = 4  # Fewest runs of a map: three would span a triangle with nothing inside
WATCHED, SEEN = "watched", "again.json"
"""Folder in a run's folder with the fill of the repeated run, and the file that is written last in it."""
DIGITS = {"mean_error_mm": 4, "bias_mm": 4, "worst_error_mm": 4, "worst_at_mm": 2, "share_under_1_mm": 4}
"""Decimals of a run's errors in map.json."""
LARGEST_FILL_BYTES = 1_000_000_000  # Of a million particles at forty moments
NOT_DONE = "It is not computed yet; 'sealtwin sweep' with the same study computes it."


@dataclass(frozen=True)
class Mapped:
    """A map of a study, and its page."""

    content: dict[str, Any]  # The --json object, and map.json
    chart: Chart
    page: StudyPage
    folder: Path  # Folder of the page


def map_study(
    folder: Path,
    out: Path | None,
    caliper: Path | None,
    data: DataKind | None,
    device: str | None,
    progress: Progress,
    *,
    any_volume: bool = False,
) -> Mapped:
    """Write map.html, map.json and figures/ of a sweep, finished or not, into ``out`` (default: map/ in its folder).

    Runs are compared with the sheet ``caliper`` of origin ``data`` (default: the readings of the study's trial). How
    some runs fill the crack is drawn as the sweep kept it, or computed again on ``device``; nothing is drawn if it is
    None. Runs whose volume is off by over 5 %, and runs outside the domain of the fast model, are excluded unless
    ``any_volume`` is True.

    Raises:
        InputError: The folder is not a study, it cannot be mapped, or the readings cannot be read.
        BusyError: The study is being computed, and ``device`` is given.
    """
    plan = read_plan(folder)
    done = {run.number: run for run in plan.runs if run.state == "done"}
    if len(done) < FEWEST:
        raise InputError(f"{folder}: {len(done)} of {len(plan.runs)} runs are done; a map needs at least {FEWEST}.")
    ranked = [run for run in done.values() if any_volume or run.ranked]
    if len(ranked) < FEWEST:
        raise InputError(
            f"{folder}: only {len(ranked)} of {len(done)} finished runs can be ranked; the others have a volume error "
            f"over 5 %, or are unfit runs of the fast model. A map needs at least {FEWEST}. Use finer particles or "
            "more substeps, or give --any-volume to map all runs."
        )
    chart = chart_of(folder, ranked, plan, caliper, data)
    fills: list[Fill] = []
    if device is not None:
        # The fast model has no particles to draw.
        chosen = [run for run in chosen_few(chart) if not done[run.number].fast]
        other = other_numbers(plan.numbers, numbers_up_to("simulate"))
        if chosen and other:
            text = f"{folder}: its runs were computed by {other}; the drawn fills may differ from them."
            progress.warn(doubt("file.other-version", text))
        with holding(folder), progress:
            watched = watch_runs(folder, [done[run.number] for run in chosen], device, progress, other)
        for letter, run, frames in zip(ascii_lowercase, chosen, watched, strict=False):
            scene = _scene(folder, done[run.number])
            fills.append(Fill(run, f"{letter}  {chart.said(run)}", scene, frames))
    target = out or folder / MAP
    # The map itself compares the levels, so the number of validate does not count.
    others = other_versions(folder, plan, "simulate")
    page = map_page(chart, fills, others)
    written = write_page(target / PAGE, page)
    content = {**_content(chart, plan, target, written), "other_versions": others}
    files.write_json(target / CONTENT, content)
    return Mapped(content, chart, page, target)


def watch_runs(
    folder: Path, runs: Sequence[StudyRun], device: str, progress: Progress, other: str = ""
) -> list[Watched]:
    """Return how finished runs filled the crack: as the sweep kept it, or computed again.

    They are computed again if the sweep kept nothing, as in launches of several runs, or if ``other`` names the version
    that computed them. On a CPU the second run equals the first to the last bit. What is computed is kept for the next
    call. Raises NumericalError if a second run fails.
    """
    kept = [] if other else [run for run in runs if (run_path(folder, run.key) / FILL).is_file()]
    waiting = [run for run in runs if run not in kept and not (run_path(folder, run.key) / WATCHED / SEEN).is_file()]
    if waiting:
        jobs = min(cores() if device == "cpu" else 1, len(waiting))
        time_s = sum(run.wall_s or 0.0 for run in waiting) / max(1, jobs)
        why = "they were computed by another version" if other else "the sweep kept no pictures of them"
        progress.note(
            f"Computing {len(waiting)} runs again to draw how the crack fills, since {why}. This takes about "
            f"{in_words(time_s)}."
        )
        progress.start("Computing again", len(waiting))
        tasks = ((run, (folder.resolve(), run, device)) for run in waiting)
        for done, (run, lost) in enumerate(run_tasks(_watch, tasks, jobs), start=1):
            if lost is not None:
                raise NumericalError(f"{folder}: run {run.number}, computed again to be drawn, failed: {lost.reason}.")
            progress.advance(done, f"run {run.number}")
    return [_watched(run_path(folder, run.key), again=run not in kept) for run in runs]


def _watched(home: Path, *, again: bool) -> Watched:
    if not again:
        return read_fill(home / FILL)
    home = home / WATCHED
    with files.understood(home / SEEN):
        return read_fill(home / FILL, float(files.read_json(home / SEEN)["differs_mm"]))


def _watch(folder: Path, run: StudyRun, device: str) -> None:
    """Compute a run again and write the files that ``_watched`` reads. Raises NumericalError if the run fails."""
    from simulate.injection import ComputeOptions
    from simulate.run import fill
    from simulate.watchers import KeptFill

    home, trial = run_path(folder, run.key) / WATCHED, run.checked_trial
    sample = record_files.read_sample(folder / "samples" / run.sample)
    kept = KeptFill(trial.output.snapshots_s)
    _, again = fill(trial.pour(sample), ComputeOptions(device, watchers=[kept], in_study=True))
    before = read_level(folder, run)
    # profile.csv is rounded to 1e-6 mm.
    level_mm = np.round(again.level_at_mm(before.s_mm), 6)
    differs_mm = float(np.abs(level_mm - before.level_mm).mean())
    files.write_bytes(home / FILL, kept.content())
    files.write_json(home / SEEN, {"version": 2, "differs_mm": differs_mm})


def read_fill(path: Path, differs_mm: float | None = None) -> Watched:
    """Read a file fill.npz. Speeds and densities are NaN, since no map shows them. Raises InputError if damaged."""
    from simulate.watchers import GRAIN_MM

    try:
        with opened(path, LARGEST_FILL_BYTES) as file, np.load(file, allow_pickle=False) as arrays:
            content = {name: arrays[name] for name in arrays.files}
        at = np.cumsum(content["particles"])[:-1]
        places, ages, states = (np.split(content[name].T, at) for name in ("place", "age_s", "state"))
        frames = tuple(
            Frame(
                t_s=float(t_s),
                position_mm=place * GRAIN_MM,
                velocity_mm_s=np.full(place.shape, np.nan),
                age_s=age_s.astype(float),
                density=np.full(len(place), np.nan),
                state=state.astype(int),
            )
            for t_s, place, age_s, state in zip(content["t_s"], places, ages, states, strict=True)
        )
        moved = content["moving"] > 0
        return Watched(frames, content["moving"][moved], content["frame_ms"][moved], differs_mm)
    except (OSError, InputError, KeyError, ValueError, EOFError, zipfile.BadZipFile) as fault:
        raise InputError(f"{path}: damaged ({fault}). Delete it; 'sealtwin map' then computes the run again.") from None


def chart_of(
    folder: Path, done: Sequence[StudyRun], plan: Plan, caliper: Path | None = None, data: DataKind | None = None
) -> Chart:
    """Compare the finished runs of a study with a sheet of readings. Raises InputError as ``map_study`` does."""
    from validate.uncertainty.meniscus import Mouth
    from validate.uncertainty.reading_errors import budget_of

    axes = axes_of([run.settings for run in done])
    trial = done[0].checked_trial
    sample = folder / "samples" / done[0].sample
    readings, settings = _readings(sample, trial, _largest_mm(folder, done), caliper, data)
    fast = all(run.fast for run in done)
    compared = [hold(finished_run(folder, run), readings, axes) for run in done]
    runs, replicates = first_of_each_pair(compared, f"{folder}", fast=fast)
    as_near = tuple(run is min(runs, key=lambda each: each.mean_error_mm) for run in runs)
    outline, solid = record_files.read_outline(sample), record_files.read_solid(sample)
    budget = budget_of(readings, settings, trial.uncertainty, Mouth.of(outline, solid, trial.given_fluid.density_kg_m3))
    if replicates is not None and replicates.scatter_mm is not None:
        as_near = as_near_as_the_best(runs, readings, budget, replicates.scatter_mm)
    numbers = {run.number for run in done}
    return Chart(
        name=plan.study,
        axes=axes,
        runs=runs,
        excluded=tuple(_excluded(run) for run in plan.runs if run.number not in numbers),
        readings=readings,
        band_mm=budget.profile_band_mm,
        as_near=as_near,
        replicates=replicates,
        unused=texts(budget.unused),
        fluid_warnings=tuple(fluid_warnings(done)),
        screening=screening([run for run in plan.runs if run.state == "done"]),
        fitted=len({*(axis.setting for axis in axes), *(settings.fitted or ())}),
    )


def _excluded(run: StudyRun) -> Excluded:
    if run.state == "done" and run.figures is not None:
        reason = UNFIT if run.figures.unfit else VOLUME_OFF
        return Excluded(run.number, run.settings, reason, run.figures.volume_ratio)
    return Excluded(run.number, run.settings, Fact("failed", run.reason or NOT_DONE))


def finished_run(folder: Path, run: StudyRun) -> Finished:
    """Read a run. Raises InputError if its profile was changed since."""
    path = profile_path(folder, run.key)
    if run.figures is None or not is_intact(folder, run):
        raise InputError(
            f"{path}: changed since run {run.number} wrote it. 'sealtwin sweep' with its study computes it again."
        )
    profile = record_files.read_profile(path.parent)
    return Finished(run.number, run.settings, profile, run.wall_s or 0.0)


def _largest_mm(folder: Path, runs: Sequence[StudyRun]) -> tuple[float, float]:
    """Return the length of the study's longest crack and the depth of its deepest, as limits for the readings."""
    samples = [folder / "samples" / name for name in dict.fromkeys(run.sample for run in runs)]
    lengths_mm = [record_files.read_outline(sample).length_mm for sample in samples]
    return max(lengths_mm), max(record_files.read_solid(sample).depth_mm for sample in samples)


def _readings(
    sample: Path, trial: Trial, crack_mm: tuple[float, float], caliper: Path | None, data: DataKind | None
) -> tuple[Profile, Readings]:
    from validate.readings.read_readings import read_readings

    settings, own = trial.readings, None
    if settings is not None:
        own = sample / INPUTS / settings.file.name
    sheet = caliper or own
    if sheet is None:
        raise InputError(f"{sample.parent.parent}: its trial has no readings. Give --caliper SHEET and --data.")
    check_sheet(sheet)
    if own is None or files.sha256(sheet) != files.sha256(own):
        if data is None:
            raise InputError(
                f"{sheet}: this is not the sheet of the study's trial, so its origin is unknown; give --data measured, "
                "reconstructed or synthetic."
            )
        # The settings of the trial's own sheet apply to the other one too.
        settings = settings or Readings(file=sheet, data=data, role="held-out")
        settings = settings.model_copy(update={"data": data})
    settings = present(settings, "the settings of the study's own sheet")
    return read_readings(sheet, settings, *crack_mm), settings


def _scene(folder: Path, run: StudyRun) -> FillScene:
    sample, trial = record_files.read_sample(folder / "samples" / run.sample), run.checked_trial
    size_mm = as_run(trial, sample).solver.size_mm
    return FillScene(sample.outline, sample.solid, sample.trajectory, size_mm, trial.nozzle.diameter_mm)


def _content(chart: Chart, plan: Plan, target: Path, written: Sequence[str]) -> dict[str, Any]:
    rows = [
        {
            "number": run.number,
            "settings": run.settings,
            **{name: round(getattr(run, name), digits) for name, digits in DIGITS.items()},
            "as_near_as_the_best": near,
            "wall_s": round(run.wall_s, 2),
        }
        for run, near in zip(chart.runs, chart.as_near, strict=True)
    ]
    scatter_mm = chart.scatter_of_replicates_mm
    return {
        "version": 1,
        "name": chart.name,
        "stage_numbers": plan.numbers,
        "page": shown(target / PAGE),
        "readings": {"source": chart.readings.source, "data": chart.readings.data, "dialect": chart.readings.dialect},
        "axes": [{"setting": axis.setting, "unit": axis.unit, "logarithmic": axis.logarithmic} for axis in chart.axes],
        "best": rows[int(np.argmin(chart.errors_mm))],
        "as_near_as_the_best": [row["number"] for row in rows if row["as_near_as_the_best"]],
        "flat_level_error_mm": round(chart.best.flat_level_error_mm, 4),
        "beats_flat_level": chart.best.mean_error_mm < chart.best.flat_level_error_mm,
        "baselines": [asdict(one) for one in chart.baselines],
        "against_baselines": chart.beside_baselines,
        "scatter_of_replicates_mm": scatter_mm and round(scatter_mm, 4),
        "screening": chart.screening,
        "unused": chart.unused,
        "fluid_warnings": chart.fluid_warnings,
        "excluded": [{**vars(run), "reason": run.reason.text} for run in chart.excluded],
        "runs": rows,
        "files": [CONTENT, *written],
    }
