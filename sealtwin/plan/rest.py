"""Plan the rest of a paused pour with the fast model, corrected by the levels that were measured so far."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from sealtwin.core import files
from sealtwin.core.arc_length import arc_length
from sealtwin.core.errors import InputError
from sealtwin.core.plain_files import read_columns
from sealtwin.core.progress import Progress
from sealtwin.core.records import Floats, Profile, Trajectory
from sealtwin.plan import PlanOptions
from sealtwin.plan.make_plan import MadePlan, PlanInputs, aim_of, case_of, write_tables
from sealtwin.plan.search import (
    Case,
    Goal,
    Knots,
    Limits,
    areas_of,
    corrected_level_mm,
    discrepancy,
    limits_of,
    path_over,
    search,
)
from sealtwin.plan.verify import Misfit, misfit
from sealtwin.trial.job import shown
from simulate.slot.fill import Filled

REPORT, TABLE = "rest.json", "rest.csv"
BOUNDS = {"s_mm": (0.0, 10_000.0), "level_mm": (-1000.0, 100.0)}
ROUNDS = 8  # Number of fills to find the flow factor. Each fill reduces the error to less than half
FLOW_FACTORS = (0.6, 1.5)  # Plausible range of the flow factor
LOW_MM = 0.5  # Depth in mm below the aim from which a position is poured again
MIN_PAUSE_S = 0.1  # Smallest pause in s, since the times of a path must increase


@dataclass(frozen=True, kw_only=True)
class Continued(Case):
    """A case whose first part is already poured. The pump gives ``flow_factor`` times the flow of the path."""

    poured: Trajectory
    flow_factor: float

    def fill(self, trajectory: Trajectory) -> Filled:
        """Fill the crack along the first part, let it settle, and fill it along ``trajectory``."""
        first, pause_s = self.poured, max(self.pour.solver.settle_s, MIN_PAUSE_S)
        later = replace(trajectory, t_s=trajectory.t_s - trajectory.t_s[0] + first.t_s[-1] + pause_s)
        names = vars(first).keys() - {"made_of"}
        joined = {name: np.concatenate([getattr(first, name), getattr(later, name)]) for name in names}
        return super().fill(_scaled(replace(first, **joined), self.flow_factor))


@dataclass(frozen=True)
class Rest:
    """The planned rest of a pour, and the level after it, from the fast model corrected by the measured levels."""

    trajectory: Trajectory
    reached_mm: float  # Arc length s at which the pour paused
    flow_factor: float  # Sealant in the crack divided by the sealant that the path dispensed so far
    level: Profile
    misfit: Misfit
    unchanged: Misfit  # Misfit if the original path is poured to its end


def read_levels(levels: Any) -> Floats:
    """Return rows of station and level in mm, sorted by station, (n, 2).

    ``levels`` is a CSV file with the columns s_mm and level_mm, or such rows. Raises InputError if it is neither.
    """
    if isinstance(levels, str | PathLike):
        columns = read_columns(Path(levels), BOUNDS, list(BOUNDS), (2, 10_000))
        levels = np.column_stack([columns[name] for name in BOUNDS])
    rows = np.asarray(levels, dtype=float)
    if rows.ndim != 2 or rows.shape[1] != 2 or len(rows) < 2 or not np.isfinite(rows).all():
        raise InputError(f"levels: the shape is {rows.shape}; give at least two rows of s_mm and level_mm, in mm.")
    return rows[np.argsort(rows[:, 0])]


def rest_of(
    case: Case, path: Trajectory, levels: Floats, limits: Limits, options: PlanOptions, where: str = "levels"
) -> Rest:
    """Plan the rest of a pour that paused at the last station in ``levels``.

    The rest begins at the first position that would remain too low, and ends at the end of ``path``. It is assumed that
    the pump continues to give the same fraction of the requested flow. Raises InputError if the levels contradict the
    path.
    """
    (s_mm, level_mm), sample, part = levels.T, case.pour.sample, path.giving
    onward = 1.0 if path.s_mm[part][-1] > path.s_mm[part][0] else -1.0
    way_mm = onward * np.array(path.s_mm[part])
    reached_mm = float(s_mm[-1] if onward > 0 else s_mm[0])
    if s_mm[-1] > sample.outline.length_mm or onward * reached_mm <= way_mm[0]:
        raise InputError(
            f"{where}: s_mm is from {s_mm[0]:g} to {s_mm[-1]:g}, but the path begins at {path.s_mm[part][0]:.1f} in a "
            f"crack of {sample.outline.length_mm:.1f} mm. Measure from the beginning of the pour to the nozzle."
        )
    poured = _until(path, float(np.interp(onward * reached_mm, np.maximum.accumulate(way_mm), path.t_s[part])))
    factor, bed, seen = _flow_factor(case, poured, Profile(s_mm, level_mm), where)
    sections, apart_mm2 = bed.sections, discrepancy(bed, seen)
    target_mm2, aim_mm = aim_of(options, sections), -options.aim_mm
    unchanged_mm = corrected_level_mm(case.fill(_scaled(path, factor)), apart_mm2)
    ahead = (onward * sections.s_mm > way_mm[0]) & (onward * sections.s_mm < onward * reached_mm)
    low = ahead & (unchanged_mm < aim_mm - LOW_MM)
    begin_mm = min([onward * reached_mm, *(onward * sections.s_mm[low])])
    begin = part.start + max(0, int(np.searchsorted(np.maximum.accumulate(way_mm), begin_mm, side="right")) - 1)
    if begin >= part.stop - 1:
        raise InputError(
            f"{where}: there is no rest to plan. The pour has reached its end, and no position is more than "
            f"{LOW_MM:g} mm too low."
        )
    knots = Knots(_evenly(path, begin), options.knots)
    lacks_mm2 = np.maximum(target_mm2 - bed.read_mm2 - apart_mm2, 0.0) / factor
    rest = Continued(**vars(case), poured=poured, flow_factor=factor)
    start = knots.first_guess(lacks_mm2, sections.s_mm, limits)
    trajectory = knots.trajectory(search([rest], knots, limits, Goal(target_mm2, apart_mm2), start))
    end, unchanged = (
        Profile(sections.s_mm, level_mm)
        for level_mm in (corrected_level_mm(rest.fill(trajectory), apart_mm2), unchanged_mm)
    )
    return Rest(trajectory, reached_mm, factor, end, misfit(sample, end), misfit(sample, unchanged))


def _flow_factor(case: Case, poured: Trajectory, measured: Profile, where: str) -> tuple[float, Filled, Profile]:
    """Return the flow factor for which the fast model has the measured volume, its filled crack, and the level.

    The level is measured where there are stations, and computed elsewhere.
    """
    factor, bed, s_mm = 1.0, case.fill(poured), measured.s_mm
    covered = (bed.sections.s_mm >= s_mm[0]) & (bed.sections.s_mm <= s_mm[-1])
    measured_mm3 = areas_of(bed.sections, measured)[covered].sum()
    for _ in range(ROUNDS):
        factor *= float(measured_mm3 / max(bed.read_mm2[covered].sum(), 1e-9))
        if not FLOW_FACTORS[0] <= factor <= FLOW_FACTORS[1]:
            raise InputError(
                f"{where}: level_mm gives {factor:.2g} times the sealant of the path so far; {FLOW_FACTORS[0]:g} to "
                f"{FLOW_FACTORS[1]:g} is allowed. Check nozzle and paste, and that levels below the face are negative."
            )
        bed = case.fill(_scaled(poured, factor))
    level_mm = np.where(covered, measured.level_at_mm(bed.sections.s_mm), bed.level_mm)
    return factor, bed, Profile(bed.sections.s_mm, level_mm)


def _scaled(path: Trajectory, factor: float) -> Trajectory:
    return replace(path, flow_mm3_s=factor * path.flow_mm3_s)


def _until(path: Trajectory, end_s: float) -> Trajectory:
    """Return the part of a path up to the time ``end_s``."""
    before = path.t_s < end_s
    t_s = np.append(path.t_s[before], end_s)
    place_mm = np.column_stack([np.interp(t_s, path.t_s, axis_mm) for axis_mm in path.position_mm.T])
    speed_mm_s, flow_mm3_s = (np.append(values[before], 0.0) for values in (path.speed_mm_s, path.flow_mm3_s))
    return Trajectory(t_s, place_mm, np.interp(t_s, path.t_s, path.s_mm), speed_mm_s, flow_mm3_s)


def _evenly(path: Trajectory, begin: int) -> Trajectory:
    """Return the part of a path from the waypoint ``begin`` on, with the path's median speed and mean flow."""
    part = path.giving
    speed = float(np.median(path.speed_mm_s[part][:-1]))
    t_s = arc_length(path.position_mm[begin:]) / speed
    speed_mm_s, flow_mm3_s = np.full(len(t_s), speed), np.zeros(len(t_s))
    speed_mm_s[-1] = 0.0
    flow_mm3_s[: part.stop - 1 - begin] = path.dispensed_mm3 / (path.t_s[part][-1] - path.t_s[part][0])
    return Trajectory(t_s, path.position_mm[begin:], path.s_mm[begin:], speed_mm_s, flow_mm3_s)


def plan_rest(
    file: Path,
    levels: Any,
    out: Path | None,
    options: PlanOptions,
    progress: Progress,
    *,
    settings: Mapping[str, Any] | None = None,
) -> MadePlan:
    """Plan the rest of a trial's pour, and write it to ``out`` (default: reports/NAME-rest).

    ``levels`` is a CSV file with the columns s_mm and level_mm, or such rows. Raises InputError if the trial, the cell
    or the levels cannot be used.
    """
    rows, inputs = read_levels(levels), PlanInputs.read(file, settings, options.cell)
    where = str(levels) if isinstance(levels, str | PathLike) else "levels"
    folder = out or Path("reports", f"{inputs.file_trial.folder_name}-rest")
    with inputs.digitised(folder, progress) as sample:
        path = path_over(sample, inputs.trial.path)
        limits = limits_of(path, *inputs.limits_by, options.flow_max_mm3_s, options.keep_speed)
        rest = rest_of(case_of(replace(sample, trajectory=path), inputs.trial), path, rows, limits, options, where)
        write_tables(folder, TABLE, rest.trajectory, rest.level)
        content = {
            "version": 1,
            "name": inputs.trial.name,
            "folder": shown(folder),
            "verified": False,
            "reached_mm": rest.reached_mm,
            "flow_factor": rest.flow_factor,
            "sealant_mm3": rest.trajectory.dispensed_mm3,
            "duration_s": rest.trajectory.duration_s,
            **options.model_dump(include={"margin_mm", "reserve_mm"}),
            **rest.misfit.figures,
            "unchanged": rest.unchanged.figures,
        }
        content |= inputs.write_programs(folder, TABLE, sample, rest.trajectory)
        files.write_json(folder / REPORT, content)
    at_end, unchanged = rest.misfit, rest.unchanged
    return MadePlan(
        content,
        [
            f"Up to s = {rest.reached_mm:.1f} mm, the crack has {rest.flow_factor:.2f} times the sealant of the path. "
            f"According to the fast model, the planned rest leaves {at_end.under_mm3:.0f} mm3 missing below the face "
            f"and {at_end.over_mm3:.0f} mm3 above it. The unchanged path would leave {unchanged.under_mm3:.0f} mm3 and "
            f"{unchanged.over_mm3:.0f} mm3.",
        ],
    )
