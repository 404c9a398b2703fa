"""The paper reproduced: all its studies for both readings of the tilt, its claims held against ours, a page."""

import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from reports.reproduction.claims import CLAIMS
from reports.reproduction.derived import DAMPED, FROZEN, PASSES, SEEDED, SOLVED, TIMED
from reports.reproduction.elements import read_elements
from reports.reproduction.extra_claims import (
    D_CM,
    DAMPING_CLAIM,
    ETA_PER_S,
    FREEZE_AFTER_S,
    FREEZING_CLAIM,
    SLOT_CLAIM,
    TIME_CLAIMS,
    judge_damping,
    judge_freezing,
    judge_slots,
    judge_times,
)
from reports.reproduction.judging import Finding, judge, not_computed
from reports.reproduction.pace import Pace, read_pace
from reports.reproduction.redrawn import errors_against, first_readings, redraw
from reports.reproduction.scatter import Replicates, draws_of, join
from reports.reproduction.stages import (
    PACE,
    SLOT_RUNS,
    Part,
    compute,
    done_runs,
    missing_pairs,
    slot_path,
    stages,
)
from reports.reproduction.surface import CHOSEN, surface_of
from reports.reproduction.telling import FIGURES, Feeding, Study, page
from reports.reproduction.unequal import by_sampling, of_all
from sealtwin.core import files
from sealtwin.core.files import write_sheet
from sealtwin.core.progress import Progress
from sealtwin.core.records import Floats, Profile
from sealtwin.study.study_file import load_study
from sealtwin.study.study_folder import holds_study, read_plan, run_path
from sealtwin.study.study_map import Mapped, finished_run, map_study
from validate.study_figures.chart import Chart, Finished

ELEMENTS = "paper_elements.toml"


def reproduce(home: Path, wanted: Sequence[Part], names: Sequence[str], work: Path, progress: Progress) -> list[str]:
    """Run the stages of those names into ``work``, write pages and figures into ``home``; the lines to say at the end.

    The page is written of what is there, after each study of all pairs and at the end.
    """
    said: list[str] = []
    for stage in stages(wanted):
        if stage.name in names:
            said += compute(stage, wanted, work, progress)
            if stage.part is not None and stage.kind is None:
                write_pages(home, wanted, work, progress)
    return said + write_pages(home, wanted, work, progress)


def write_pages(home: Path, wanted: Sequence[Part], work: Path, progress: Progress) -> list[str]:
    """Write elements.md, and README.md and figures/ of the parts whose pairs are all computed; the lines to say."""
    files.write_text(home / "elements.md", read_elements(home / ELEMENTS).page())
    missing = {part.title: told for part in wanted if (told := missing_pairs(part, work)) is not None}
    there = [part for part in wanted if part.title not in missing]
    said = [f"{title}: not on the page, since {told}." for title, told in missing.items()]
    if not there:
        return said
    # The paper holds all runs against the readings, those that lost volume too, which preset "paper" does.
    maps = [
        map_study(part.folder(work), None, None, None, "cpu" if part.fills else None, progress, any_volume=True)
        for part in there
    ]
    studies = [_study(home, part, mapped, work) for part, mapped in zip(there, maps, strict=True)]
    chart = maps[0].chart
    chosen = next(run for run in chart.runs if run.at == CHOSEN)
    progress.note("Feeding similaritymeasures unequal samplings.")
    feeding = Feeding(chart, by_sampling(chosen, chart.readings), chosen.mean_error_mm, of_all(chart))
    slots = _slots(work)
    files.write_text(home / "README.md", page(studies, missing, slots, feeding))
    _write_claims(home / "figures" / "claims.csv", studies, slots)
    write_sheet(
        home / "figures" / "unequal-samplings.csv",
        ("points", "mean_error_mm"),
        [(each.points, each.error_mm) for each in feeding.samplings],
    )
    return [*(mapped.sheet.finding for mapped in maps), *said, f"Page: {home / 'README.md'}"]


def _study(home: Path, part: Part, mapped: Mapped, work: Path) -> Study:
    chart, redrawn = mapped.chart, redraw()
    replicates = _replicates(chart, part.folder(work, SEEDED))
    draws, seen = draws_of(chart, replicates, redrawn), surface_of(chart)
    found = [judge(claim, seen, draws) for claim in CLAIMS]
    found += [_damping(chart, part.folder(work, DAMPED), redrawn), _freezing(part.folder(work, FROZEN))]
    found += _times(part.folder(work, TIMED))
    drawn = mapped.folder / "figures"
    shown = [name for name, _ in FIGURES if (drawn / f"{name}.svg").is_file()]
    (home / "figures").mkdir(parents=True, exist_ok=True)
    for name in [*(f"{name}.svg" for name in shown), "runs.csv"]:
        shutil.copyfile(drawn / name, home / "figures" / f"{part.name}-{name}")
    fine = [] if part.fine is None else done_runs(work / load_study(part.fine).folder_name)
    finer_mm = {
        (float(run.settings["fluid.U"]), float(run.settings["fluid.D_cm"])): run.figures["mean_error_mm"]
        for run in fine
        if run.figures
    }
    chosen = next(run for run in chart.runs if run.at == CHOSEN)
    radius_mm = float(load_study(part.study).fixed["solver.radius_mm"])
    first = first_readings(chosen.profile, chart.readings)
    return Study(part.name, part.title, radius_mm, chart, found, finer_mm, shown, first, replicates)


def _replicates(chart: Chart, folder: Path) -> Replicates | None:
    again = [
        ((float(run.settings["fluid.U"]), float(run.settings["fluid.D_cm"])), finished_run(folder, run))
        for run in done_runs(folder)
    ]
    return join(chart, again) if again else None


def _damping(chart: Chart, folder: Path, redrawn: Sequence[Profile]) -> Finding:
    runs = _by(folder, "solver.damping_per_s", ETA_PER_S)
    if runs is None:
        return not_computed(DAMPING_CLAIM)
    every, readings = [chart.readings, *redrawn], chart.readings
    error_mm = errors_against([run for alike in runs for run in alike], readings, every)
    range_mm: Floats = np.ptp(errors_against(chart.runs, readings, every), axis=1)
    return judge_damping(error_mm.reshape(len(every), len(runs), -1), range_mm)


def _freezing(folder: Path) -> Finding:
    runs = _by(folder, "fluid.freeze_after_s", FREEZE_AFTER_S)
    if runs is None:
        return not_computed(FREEZING_CLAIM)
    return judge_freezing([[run.profile for run in alike] for alike in runs])


def _times(folder: Path) -> list[Finding]:
    paces = _paces(folder)
    if paces is None:
        return [not_computed(claim) for claim in TIME_CLAIMS]
    passes, solved = ({d_cm: paces[way, d_cm] for d_cm in D_CM} for way in (PASSES, SOLVED))
    return judge_times(passes, solved)


def _slots(work: Path) -> Finding:
    paths = [slot_path(work, name) for name, _, _ in SLOT_RUNS]
    if not all(path.is_file() for path in paths):
        return not_computed(SLOT_CLAIM)
    *wide, narrow = map(read_pace, paths)
    return judge_slots(wide, narrow)


def _by(folder: Path, setting: str, values: Sequence[Any]) -> list[list[Finished]] | None:
    """Return the runs of each value, as many of each; None where there are less than two of any."""
    done = done_runs(folder)
    found = [[finished_run(folder, run) for run in done if run.settings[setting] == value] for value in values]
    # Where one failed, all are known by as many as the least known value.
    fewest = min(map(len, found))
    return [alike[:fewest] for alike in found] if fewest > 1 else None


def _paces(folder: Path) -> dict[tuple[str, float], list[Pace]] | None:
    """Return the paces by way of solving and D in cm; None where any is missing."""
    if not holds_study(folder):
        return None
    found: dict[tuple[str, float], list[Pace]] = {}
    for run in read_plan(folder).runs:
        path = run_path(folder, run.key) / PACE
        if not path.is_file():
            return None
        key = run.settings["solver.viscosity_solve"], float(run.settings["fluid.D_cm"])
        found.setdefault(key, []).append(read_pace(path))
    return found


def _write_claims(path: Path, studies: Sequence[Study], slots: Finding) -> None:
    columns = ("study", "claim", "paper", "ours", "redrawn", "judgement", "paper_says", "place", "computed")
    of = [(study.title, finding) for study in studies for finding in study.findings]
    rows = [
        (
            title,
            found.name,
            found.paper,
            found.ours,
            found.redrawn,
            found.judgement,
            claim.words,
            claim.place,
            claim.how,
        )
        for title, found in [*of, ("straight cracks, preset paper", slots)]
        for claim in (found.claim,)
    ]
    write_sheet(path, columns, rows)
