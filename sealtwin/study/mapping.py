"""A study on a map: all its runs held against one sheet of readings, the paper's figures drawn from them."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sealtwin.errors import InputError
from sealtwin.progress import OfOne, Progress
from sealtwin.records import DataKind, Profile
from sealtwin.store import files, stage_files
from sealtwin.store.folder import holding
from sealtwin.study.bench import INPUTS
from sealtwin.study.estimate import in_words
from sealtwin.study.ledger import Ledger, StudyRun, profile_path
from sealtwin.study.moments import is_seen, watch_run
from sealtwin.study.workers import trial_of
from sealtwin.trials.job import check_sheet
from sealtwin.trials.result import shown
from sealtwin.trials.trial import Trial
from validate.settings import Readings
from validate.studies.axis import axes_of
from validate.studies.chart import Chart, as_near_as_the_best, chosen_few, scatter_of_runs
from validate.studies.fills import Fill
from validate.studies.held import Excluded, Finished, hold
from validate.studies.map_sheet import lettered, map_sheet
from validate.studies.sheet import write_sheet_of_figures

MAP = "map"
"""Folder of the map in a study's, unless another is given."""
PAGE, CONTENT = "map.html", "map.json"
FEWEST = 4
"""Runs that make a map: three span a triangle, and nothing inside it is seen."""
NOT_DONE = "It is not computed yet; 'sealtwin sweep' with the same study goes on."


@dataclass(frozen=True)
class MapWish:
    """Against what the user wants runs held, and how drawn."""

    caliper: Path | None
    """A sheet of readings; None: the one that the study's trial names."""
    data: DataKind | None
    """Where they come from; needed for another sheet than the trial's."""
    fills: bool
    """Whether chosen runs are computed once more, to be drawn."""
    device: str


@dataclass(frozen=True)
class Mapped:
    """What the command says at its end."""

    content: dict[str, Any]
    lines: list[str]
    chart: Chart
    folder: Path
    """Where it was written."""


def map_study(folder: Path, out: Path | None, wish: MapWish, progress: Progress) -> Mapped:
    """Write map.html, map.json and figures/ for a sweep's folder.

    Args:
        folder: Of the sweep, finished or not.
        out: Where to; None: map/ in ``folder``.
        wish: Against which readings, and whether fills are drawn.
        progress: Told how far it is.

    Raises:
        InputError: no study is there, or one that cannot be mapped; or the readings cannot be read.
        BusyError: the study is being computed, and fills are wanted.
    """
    with Ledger(folder) as ledger:
        chart, samples = _chart(folder, ledger, wish)
        fills: tuple[Fill, ...] = ()
        if wish.fills:
            with holding(folder), progress:
                fills = _fills(folder, ledger, chart, samples, wish.device, progress)
    target = out or folder / MAP
    sheet = map_sheet(chart, fills)
    written = write_sheet_of_figures(target, PAGE, sheet)
    content = _content(chart, target, written)
    files.write_json(target / CONTENT, content)
    best = chart.best
    lines = [
        *sheet.cautions,
        f"{chart.name}: {len(chart.runs)} runs against {chart.readings.source}.",
        f"Nearest to the readings: run {best.run.number} ({chart.said(best)}), {best.mean_error_mm:.2f} mm on average.",
        chart.flatness,
        chart.exclusion,
        f"Page: {shown(target / PAGE)}",
    ]
    return Mapped(content, lines, chart, target)


def _chart(folder: Path, ledger: Ledger, wish: MapWish) -> tuple[Chart, dict[int, StudyRun]]:
    runs = ledger.runs()
    done = [run for run in runs if run.state == "done"]
    if len(done) < FEWEST:
        raise InputError(f"{folder}: {len(done)} of {len(runs)} runs are done; a map needs {FEWEST}.")
    axes = axes_of([run.settings for run in done])
    trial = trial_of(ledger.entry(done[0].key))
    sample = folder / "samples" / done[0].sample
    outline, solid = stage_files.read_outline(sample), stage_files.read_solid(sample)
    readings, settings = _readings(sample, trial, _largest_mm(folder, done), wish)
    finished = [_finished(folder, run) for run in done]
    held = tuple(hold(run, readings, axes) for run in finished)

    from validate.comparison.volumes import mouth_widths_mm
    from validate.uncertainty.intervals import bands_mm
    from validate.uncertainty.readings import budget_of

    scatter_mm = scatter_of_runs(held, axes)
    budget = budget_of(readings, settings, trial.uncertainty, mouth_widths_mm(readings.s_mm, outline, solid))
    chart = Chart(
        name=ledger.fact("study") or folder.name,
        axes=axes,
        runs=held,
        excluded=tuple(
            Excluded(run.number, run.settings, run.reason or NOT_DONE) for run in runs if run.state != "done"
        ),
        readings=readings,
        band_mm=bands_mm(budget),
        scatter_mm=scatter_mm,
        by_readings=as_near_as_the_best(held, readings, budget, scatter_mm=0.0),
        as_near=as_near_as_the_best(held, readings, budget, scatter_mm),
    )
    return chart, {run.number: run for run in done}


def _finished(folder: Path, run: StudyRun) -> Finished:
    """Raises InputError where it is not as the run left it: a figure of it would not be the study's."""
    path = profile_path(folder, run.key)
    if not path.is_file() or run.figures is None or files.sha256(path) != run.figures["profile_sha256"]:
        raise InputError(f"{path}: not as run {run.number} left it. 'sealtwin sweep' with its study computes it again.")
    profile = stage_files.read_profile(path.parent)
    return Finished(run.number, run.settings, profile, run.wall_s or 0.0, run.figures["volume_ratio"])


def _largest_mm(folder: Path, runs: Sequence[StudyRun]) -> tuple[float, float]:
    """Length and depth of the study's longest and deepest crack: what no run's crack can hold is no reading of any."""
    samples = [folder / "samples" / name for name in dict.fromkeys(run.sample for run in runs)]
    depths_mm = []
    for sample in samples:
        with files.understood(sample / "solid.json"):
            depths_mm.append(float(files.read_json(sample / "solid.json")["depth_mm"]))
    return max(stage_files.read_outline(sample).length_mm for sample in samples), max(depths_mm)


def _readings(sample: Path, trial: Trial, crack_mm: tuple[float, float], wish: MapWish) -> tuple[Profile, Readings]:
    from validate.caliper import read_readings

    own = None if trial.readings is None else sample / INPUTS / trial.readings.file.name
    sheet = wish.caliper or own
    if sheet is None:
        raise InputError(f"{sample.parent.parent}: its trial names no readings. Give --caliper SHEET and --data.")
    check_sheet(sheet)
    if trial.readings is not None and own is not None and files.sha256(sheet) == files.sha256(own):
        settings = trial.readings
    elif wish.data is None:
        raise InputError(
            f"{sheet}: another sheet than the study's trial names; give --data measured, reconstructed or synthetic."
        )
    elif trial.readings is not None:
        # The same lab writes its sheets the same way.
        settings = trial.readings.model_copy(update={"data": wish.data})
    else:
        settings = Readings(file=sheet, data=wish.data, role="held-out")
    return read_readings(sheet, settings, *crack_mm), settings


def _fills(
    folder: Path, ledger: Ledger, chart: Chart, runs: dict[int, StudyRun], device: str, progress: Progress
) -> tuple[Fill, ...]:
    from validate.drawing.snapshots import Scene

    chosen = chosen_few(chart)
    waiting = {run.run.number: run.run.wall_s for run in chosen if not is_seen(folder, runs[run.run.number])}
    places = {number: f"{place} of {len(waiting)}" for place, number in enumerate(waiting, start=1)}
    if waiting:
        time_s = sum(waiting.values())
        progress.note(f"{len(waiting)} runs are computed once more, to be drawn: about {in_words(time_s)}.")
    fills = []
    for index, held in enumerate(chosen):
        run = runs[held.run.number]
        name = f"run {run.number}, {chart.said(held)} ({places.get(run.number, 'seen before')})"
        seen = watch_run(folder, ledger, run, device, OfOne(progress, name))
        sample = folder / "samples" / run.sample
        trial = trial_of(ledger.entry(run.key))
        outline = stage_files.read_outline(sample)
        scene = Scene(
            outline,
            stage_files.read_solid(sample),
            stage_files.read_trajectory(sample),
            trial.solver.for_crack(outline.mean_width_mm).size_mm,
            trial.nozzle.diameter_mm,
        )
        title = lettered(chart, index, held.at)
        fills.append(Fill(held, title, scene, seen.frames, seen.particles, seen.frame_ms, seen.differs_mm))
    return tuple(fills)


def _content(chart: Chart, target: Path, written: Sequence[str]) -> dict[str, Any]:
    """The --json object, and map.json."""
    return {
        "version": 1,
        "name": chart.name,
        "page": shown(target / PAGE),
        "readings": {"source": chart.readings.source, "data": chart.readings.data, "dialect": chart.readings.dialect},
        "axes": [{"setting": axis.setting, "unit": axis.unit, "logarithmic": axis.logarithmic} for axis in chart.axes],
        "best": _row(chart, chart.runs.index(chart.best)),
        "as_near_as_the_best": [run.run.number for run, near in zip(chart.runs, chart.as_near, strict=True) if near],
        "scatter_of_runs_mm": round(chart.scatter_mm, 4),
        "excluded": [
            {"number": each.number, "settings": dict(each.settings), "reason": each.reason} for each in chart.excluded
        ],
        "runs": [_row(chart, index) for index in range(len(chart.runs))],
        "files": [CONTENT, *written],
    }


def _row(chart: Chart, index: int) -> dict[str, Any]:
    run = chart.runs[index]
    return {
        "number": run.run.number,
        "settings": dict(run.run.settings),
        "mean_error_mm": round(run.mean_error_mm, 4),
        "bias_mm": round(run.bias_mm, 4),
        "worst_error_mm": round(run.worst_error_mm, 4),
        "worst_at_mm": round(run.worst_at_mm, 2),
        "share_under_1_mm": round(run.share_under_1_mm, 4),
        "as_near_as_the_best": chart.as_near[index],
        "wall_s": round(run.run.wall_s, 2),
    }
