"""Map a study: compare all runs of the study with one sheet of readings, and draw the figures of the paper."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from string import ascii_lowercase
from typing import Any

import numpy as np

from sealtwin.core import files, record_files
from sealtwin.core.errors import InputError, present
from sealtwin.core.facts import Fact, doubt
from sealtwin.core.plain_files import opened
from sealtwin.core.progress import Progress
from sealtwin.core.records import DataKind, Profile
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
    read_plan,
    run_path,
)
from sealtwin.study.sweep import screening
from sealtwin.trial.job import check_sheet, display_path
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
from validate.figures.page import Page, write_page
from validate.figures.snapshots import FillScene
from validate.settings import Readings

MAP = "map"  # Default name of the map's folder in the folder of the study
PAGE, CONTENT = "map.html", "map.json"
FEWEST = 4  # Smallest number of runs for a map. Three runs would span a triangle without a run inside
ERRORS = ("mean_error_mm", "bias_mm", "worst_error_mm", "worst_at_mm", "share_under_1_mm")  # Errors in map.json
LARGEST_FILL_BYTES = 1_000_000_000  # Largest fill.npz that is read: a million particles at 40 moments
NOT_DONE = "This run is not computed yet; 'sealtwin sweep' with the same study computes it."


@dataclass(frozen=True)
class Mapped:
    """A map of a study, and its page."""

    content: dict[str, Any]  # Content of map.json, which --json also prints
    chart: Chart
    page: Page
    folder: Path  # Folder that contains the page


def map_study(
    folder: Path,
    out: Path | None,
    caliper: Path | None,
    data: DataKind | None,
    progress: Progress,
    *,
    fills: bool = True,
    any_volume: bool = False,
) -> Mapped:
    """Write map.html, map.json and figures/ of a finished or unfinished sweep.

    The files are written to ``out`` (default: map/ in the folder of the sweep). Runs are compared with the sheet
    ``caliper`` of the origin ``data`` (default: the readings of the study's trial). If ``fills`` is True, the page
    shows how some runs fill the crack. Runs with a volume error above 5 %, and runs for which the fast model is not
    valid, are excluded unless ``any_volume`` is True.

    Raises InputError if the folder is not a study, if the study cannot be mapped, or if the readings cannot be read.
    """
    plan = read_plan(folder)
    done = {run.number: run for run in plan.runs if run.state == "done"}
    if len(done) < FEWEST:
        raise InputError(f"{folder}: {len(done)} of {len(plan.runs)} runs are done; a map needs at least {FEWEST}.")
    ranked = [run for run in done.values() if any_volume or run.ranked]
    if len(ranked) < FEWEST:
        raise InputError(
            f"{folder}: only {len(ranked)} of {len(done)} finished runs can be ranked. The others have a volume error "
            f"above 5 %, or the fast model is not valid for them. A map needs at least {FEWEST}. Use smaller "
            "particles, more substeps or another model, or give --any-volume to map all runs."
        )
    chart = chart_of(folder, ranked, plan, caliper, data)
    # The fast model has no particles to draw.
    chosen = [run for run in chosen_few(chart) if fills and not done[run.number].fast]
    kept = [run for run in chosen if _fill_path(folder, done[run.number]).is_file()]
    if missing := sorted(run.number for run in chosen if run not in kept):
        text = (
            f"{folder}: the sweep did not store how runs {', '.join(map(str, missing))} fill the crack. It stores this "
            "only for runs that are computed singly, as in a new sweep with --batch 1."
        )
        progress.warn(doubt("study.no-fills", text))
    drawn = [
        Fill(
            run,
            f"{letter}  {chart.text_of(run)}",
            _scene(folder, done[run.number]),
            read_fill(_fill_path(folder, done[run.number])),
        )
        for letter, run in zip(ascii_lowercase, kept, strict=False)
    ]
    target = out or folder / MAP
    # The map compares the levels itself, so the number of the stage validate is not checked.
    others = other_versions(folder, plan, "simulate")
    page = map_page(chart, drawn, others)
    written = write_page(target / PAGE, page)
    content = {**_content(chart, plan, target, written), "other_versions": others}
    files.write_json(target / CONTENT, content)
    return Mapped(content, chart, page, target)


def _fill_path(folder: Path, run: StudyRun) -> Path:
    return run_path(folder, run) / FILL


def read_fill(path: Path) -> Watched:
    """Read a file fill.npz. Speeds and densities are NaN, since a map does not show them.

    Raises InputError if the file is damaged.
    """
    from simulate.watchers import GRAIN_MM, UNREADABLE

    try:
        with opened(path, LARGEST_FILL_BYTES) as file, np.load(file, allow_pickle=False) as arrays:
            content = {name: arrays[name] for name in arrays.files}
        ends = np.cumsum(content["particles"])[:-1]
        places, ages, states = (np.split(content[name].T, ends) for name in ("place", "age_s", "state"))
        frames = tuple(
            Frame(
                t_s=float(t_s),
                position_mm=position * GRAIN_MM,
                velocity_mm_s=np.full(position.shape, np.nan),
                age_s=age_s.astype(float),
                density=np.full(len(position), np.nan),
                state=state.astype(int),
            )
            for t_s, position, age_s, state in zip(content["t_s"], places, ages, states, strict=True)
        )
        moved = content["moving"] > 0
        return Watched(frames, content["moving"][moved], content["frame_ms"][moved])
    except UNREADABLE as fault:
        raise InputError(
            f"{path}: is damaged ({fault}). Delete it; the map is then drawn without the pictures of this run."
        ) from None


def chart_of(
    folder: Path, done: Sequence[StudyRun], plan: Plan, caliper: Path | None = None, data: DataKind | None = None
) -> Chart:
    """Compare the finished runs of a study with a sheet of readings. Raises the same errors as ``map_study``."""
    from validate.uncertainty.meniscus import Mouth
    from validate.uncertainty.reading_errors import budget_of

    axes = axes_of([run.settings for run in done])
    trial = done[0].checked_trial
    sample = folder / "samples" / done[0].sample
    readings, settings = _readings(sample, trial, _largest_mm(folder, done), caliper, data)
    fast = all(run.fast for run in done)
    compared = [hold(finished_run(folder, run), readings, axes) for run in done]
    runs, replicates = first_of_each_pair(compared, f"{folder}", fast=fast)
    as_near = tuple(run is min(runs, key=lambda other: other.mean_error_mm) for run in runs)
    outline, solid = record_files.read_outline(sample), record_files.read_solid(sample)
    budget = budget_of(readings, settings, trial.uncertainty, Mouth.of(outline, solid, trial.given_fluid.density_kg_m3))
    if replicates is not None:
        as_near = as_near_as_the_best(runs, readings, budget, replicates.scatter_mm)
    numbers = {run.number for run in done}
    return Chart(
        name=plan.study,
        axes=axes,
        runs=runs,
        excluded=tuple(_excluded(run) for run in plan.runs if run.number not in numbers),
        readings=readings,
        total=len(plan.runs),
        band_mm=budget.profile_band_mm,
        as_near=as_near,
        replicates=replicates,
        fluid_warnings=tuple(fluid_warnings(done)),
        screening=screening([run for run in plan.runs if run.state == "done"]),
        fast=fast,
        fitted=len({*(axis.setting for axis in axes), *(settings.fitted or ())}),
    )


def _excluded(run: StudyRun) -> Excluded:
    if run.figures is not None:
        reason = UNFIT if run.figures.unfit else VOLUME_OFF
        return Excluded(run.number, run.settings, reason, run.figures.volume_ratio)
    return Excluded(run.number, run.settings, Fact("failed", run.reason or NOT_DONE))


def finished_run(folder: Path, run: StudyRun) -> Finished:
    """Read a finished run. Raises InputError if its profile was changed."""
    path = profile_path(folder, run)
    if not is_intact(folder, run):
        raise InputError(
            f"{path}: was changed after run {run.number} wrote it. 'sealtwin sweep' with this study computes it again."
        )
    profile = record_files.read_profile(path.parent)
    return Finished(run.number, run.settings, profile, run.wall_s or 0.0)


def _largest_mm(folder: Path, runs: Sequence[StudyRun]) -> tuple[float, float]:
    """Return the length of the study's longest crack and the depth of its deepest crack, as limits of the readings."""
    samples = [folder / "samples" / name for name in dict.fromkeys(run.sample for run in runs)]
    lengths_mm = [record_files.read_outline(sample).length_mm for sample in samples]
    return max(lengths_mm), max(record_files.read_solid(sample).depth_mm for sample in samples)


def _readings(
    sample: Path, trial: Trial, crack_mm: tuple[float, float], caliper: Path | None, data: DataKind | None
) -> tuple[Profile, Readings]:
    from validate.readings.read_readings import read_readings

    settings, trial_sheet = trial.readings, None
    if settings is not None:
        trial_sheet = sample / INPUTS / settings.path.name
    sheet = caliper or trial_sheet
    if sheet is None:
        raise InputError(f"{sample.parent.parent}: the study's trial has no readings. Give --caliper SHEET and --data.")
    check_sheet(sheet, settings)
    if trial_sheet is None or files.sha256(sheet) != files.sha256(trial_sheet):
        if data is None:
            raise InputError(
                f"{sheet}: this is not the sheet of the study's trial, so its origin is unknown. Give --data measured, "
                "reconstructed or synthetic."
            )
        # The settings for the trial's sheet are also used for this sheet.
        settings = settings or Readings(file=sheet, data=data, role="held-out")
        settings = settings.model_copy(update={"data": data})
    settings = present(settings, "the settings of the study's own sheet")
    crack = record_files.read_outline(sample), record_files.read_solid(sample)
    return read_readings(sheet, settings, *crack_mm, crack), settings


def _scene(folder: Path, run: StudyRun) -> FillScene:
    sample, trial = record_files.read_sample(folder / "samples" / run.sample), run.checked_trial
    trial = as_run(trial, sample)
    return FillScene(sample.outline, sample.solid, sample.trajectory, trial.solver.size_mm, trial.nozzle.size_mm)


def _content(chart: Chart, plan: Plan, target: Path, written: Sequence[str]) -> dict[str, Any]:
    rows = [
        {
            "number": run.number,
            "settings": run.settings,
            **{name: getattr(run, name) for name in ERRORS},
            "as_near_as_the_best": near,
            "wall_s": run.wall_s,
        }
        for run, near in zip(chart.runs, chart.as_near, strict=True)
    ]
    return {
        "version": 1,
        "name": chart.name,
        "stage_numbers": plan.numbers,
        "page": display_path(target / PAGE),
        "readings": {"source": chart.readings.source, "data": chart.readings.data, "dialect": chart.readings.dialect},
        "axes": [{name: getattr(axis, name) for name in ("setting", "unit", "logarithmic")} for axis in chart.axes],
        "best": rows[int(np.argmin(chart.errors_mm))],
        "as_near_as_the_best": [row["number"] for row in rows if row["as_near_as_the_best"]],
        "flat_level_error_mm": chart.best.flat_level_error_mm,
        "beats_flat_level": chart.best.mean_error_mm < chart.best.flat_level_error_mm,
        "baselines": [asdict(baseline) for baseline in chart.baselines],
        "against_baselines": chart.beside_baselines,
        "scatter_of_replicates_mm": None if chart.replicates is None else chart.replicates.scatter_mm,
        "screening": chart.screening,
        "fluid_warnings": chart.fluid_warnings,
        "excluded": [{**vars(run), "reason": run.reason.text} for run in chart.excluded],
        "runs": rows,
        "files": [CONTENT, *written],
    }
