"""The paper reproduced: all its studies for both readings of the tilt, its claims held against ours, a page."""

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import replace
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
from reports.reproduction.kept import Kept, found_in, kept_of, read_kept, write_kept
from reports.reproduction.pace import Pace, is_current, read_pace
from reports.reproduction.redrawn import errors_against, first_readings, redraw
from reports.reproduction.scatter import Replicates, draws_of, join
from reports.reproduction.stages import (
    PACE,
    SLOT_RUNS,
    SLOTS,
    Part,
    Stage,
    compute,
    done_runs,
    missing_pairs,
    slot_path,
    stages,
)
from reports.reproduction.surface import CHOSEN, surface_of
from reports.reproduction.telling import FIGURES, Feeding, Study, Told, page, tell, tell_feeding
from reports.reproduction.unequal import by_sampling, of_all
from sealtwin.core import files
from sealtwin.core.files import write_sheet
from sealtwin.core.progress import Progress
from sealtwin.core.records import Floats, Profile
from sealtwin.study.study_file import load_study
from sealtwin.study.study_folder import holds_study, read_plan, run_path
from sealtwin.study.study_map import Mapped, finished_run, map_study
from validate.figures.chart import Chart, Finished

ELEMENTS = "paper_elements.toml"
EVERY_CLAIM = (*CLAIMS, DAMPING_CLAIM, FREEZING_CLAIM, *TIME_CLAIMS)
"""Those about a part, in the page's order."""
FEEDING = "unequal-samplings"
"""Name under which is kept what similaritymeasures makes of unequal samplings, in the first part that is computed."""


def reproduce(home: Path, wanted: Sequence[Part], names: Sequence[str], work: Path, progress: Progress) -> list[str]:
    """Run the stages of those names into ``work``, write pages and figures into ``home``; the lines to say at the end.

    The page is written after each study of all pairs and at the end, of what is in ``work`` and, for all else, of what
    is kept in ``home``.
    """
    sentences: list[str] = []
    for stage in stages(wanted):
        if stage.name in names:
            sentences += compute(stage, wanted, work, progress)
            if stage.part is not None and stage.kind is None:
                write_pages(home, wanted, work, progress)
    return sentences + write_pages(home, wanted, work, progress)


def write_pages(home: Path, wanted: Sequence[Part], work: Path, progress: Progress) -> list[str]:
    """Write elements.md, what is kept, and README.md and figures/ of the parts that are; the lines to say."""
    files.write_text(home / "elements.md", read_elements(home / ELEMENTS).page())
    kept, sentences, missing = read_kept(home), [], {}
    for part in wanted:
        reason = missing_pairs(part, work)
        if reason is None:
            kept[part.name], mapped = _study(home, part, work, progress)
            sentences.append(mapped.sheet.finding)
            if part is wanted[0] or FEEDING not in kept:
                progress.note("Feeding similaritymeasures unequal samplings.")
                kept[FEEDING] = replace(kept[part.name], findings={}, told=_fed(mapped.chart))
        elif part.name in kept:
            sentences.append(f"{part.title}: as kept from {kept[part.name].computed}, since {reason} here.")
        else:
            missing[part.title] = reason
            sentences.append(f"{part.title}: not on the page, since {reason}.")
        if (times := _times(part.folder(work, TIMED))) is not None:
            kept[_timed(part)] = times
    if (slots := _slots(work)) is not None:
        kept[SLOTS] = slots
    if not kept:
        return sentences
    write_kept(home, kept)
    told_of = [_told(part, kept) for part in wanted if part.name in kept]
    if not told_of:
        return sentences
    of_slots = found_in(SLOT_CLAIM, [kept[SLOTS]] if SLOTS in kept else [])
    files.write_text(home / "README.md", page(told_of, missing, of_slots, kept[FEEDING].told))
    _write_claims(home / "figures" / "claims.csv", told_of, of_slots)
    return [*sentences, f"Page: {home / 'README.md'}"]


def _timed(part: Part) -> str:
    return Stage(part, TIMED).name


def _told(part: Part, kept: Mapping[str, Kept]) -> Told:
    study, times = kept[part.name], kept.get(_timed(part))
    findings = [found_in(claim, [study, *([] if times is None else [times])]) for claim in EVERY_CLAIM]
    return Told(part.name, part.title, study, times, findings)


def _study(home: Path, part: Part, work: Path, progress: Progress) -> tuple[Kept, Mapped]:
    """Judge all pairs of a part and what follows from them, draw its figures; what is to be kept, and the map."""
    # The paper holds all runs against the readings, those that lost volume too, which preset "paper" does.
    device = "cpu" if part.fills else None
    mapped = map_study(part.folder(work), None, None, None, device, progress, any_volume=True)
    chart, redrawn = mapped.chart, redraw()
    replicates = _replicates(chart, part.folder(work, SEEDED))
    draws, seen = draws_of(chart, replicates, redrawn), surface_of(chart)
    findings = [judge(claim, seen, draws) for claim in CLAIMS]
    findings += [_damping(chart, part.folder(work, DAMPED), redrawn), _freezing(part.folder(work, FROZEN))]
    drawn = mapped.folder / "figures"
    shown = [name for name, _ in FIGURES if (drawn / f"{name}.svg").is_file()]
    (home / "figures").mkdir(parents=True, exist_ok=True)
    for name in [*(f"{name}.svg" for name in shown), "runs.csv"]:
        shutil.copyfile(drawn / name, home / "figures" / f"{part.name}-{name}")
    fine = [] if part.fine is None else done_runs(work / load_study(part.fine).folder_name)
    finer_mm = {
        (float(run.settings["fluid.U"]), float(run.settings["fluid.D_cm"])): run.figures.mean_error_mm
        for run in fine
        if run.figures and run.figures.mean_error_mm is not None
    }
    chosen = next(run for run in chart.runs if run.at == CHOSEN)
    radius_mm = float(load_study(part.study).fixed["solver.radius_mm"])
    first = first_readings(chosen.profile, chart.readings)
    study = Study(radius_mm, chart, finer_mm, shown, first, replicates)
    last = max(run.finished_unix_s or 0.0 for run in done_runs(part.folder(work)))
    return kept_of(last, findings, tell(study)), mapped


def _fed(chart: Chart) -> dict[str, Any]:
    chosen = next(run for run in chart.runs if run.at == CHOSEN)
    samplings = by_sampling(chosen, chart.readings)
    return tell_feeding(Feeding(chart, samplings, chosen.mean_error_mm, of_all(chart)))


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


def _times(folder: Path) -> Kept | None:
    paces = _paces(folder)
    if paces is None:
        return None
    passes, solved = ({d_cm: paces[way, d_cm] for d_cm in D_CM} for way in (PASSES, SOLVED))
    last = max(path.stat().st_mtime for path in folder.rglob(PACE))
    return kept_of(last, judge_times(passes, solved))


def _slots(work: Path) -> Kept | None:
    paths = [slot_path(work, name) for name, _, _ in SLOT_RUNS]
    if not all(map(is_current, paths)):
        return None
    *wide, narrow = map(read_pace, paths)
    return kept_of(paths[-1].stat().st_mtime, [judge_slots(wide, narrow)])


def _by(folder: Path, setting: str, values: Sequence[Any]) -> list[list[Finished]] | None:
    """Return the runs of each value, as many of each; None where there are less than two of any."""
    done = done_runs(folder)
    profiles = [[finished_run(folder, run) for run in done if run.settings[setting] == value] for value in values]
    # Where one failed, all are known by as many as the least known value.
    fewest = min(map(len, profiles))
    return [alike[:fewest] for alike in profiles] if fewest > 1 else None


def _paces(folder: Path) -> dict[tuple[str, float], list[Pace]] | None:
    """Return the paces by way of solving and D in cm; None where any is missing."""
    if not holds_study(folder):
        return None
    paces: dict[tuple[str, float], list[Pace]] = {}
    for run in read_plan(folder).runs:
        path = run_path(folder, run.key) / PACE
        if not is_current(path):
            return None
        key = run.settings["solver.viscosity_solve"], float(run.settings["fluid.D_cm"])
        paces.setdefault(key, []).append(read_pace(path))
    return paces


def _write_claims(path: Path, parts: Sequence[Told], slots: Finding) -> None:
    columns = ("study", "claim", "paper", "ours", "redrawn", "judgement", "paper_says", "place", "computed")
    of = [(part.title, finding) for part in parts for finding in part.findings]
    rows = [
        (
            title,
            finding.name,
            finding.paper,
            finding.ours,
            finding.redrawn,
            finding.judgement,
            claim.words,
            claim.place,
            claim.how,
        )
        for title, finding in [*of, ("straight cracks, preset paper", slots)]
        for claim in (finding.claim,)
    ]
    write_sheet(path, columns, rows)
