"""The tables of a correction, made before the pour: levels by particles, derivatives by the fast model."""

import itertools
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import with_config

from sealtwin.core import files
from sealtwin.core.arc_length import arc_length
from sealtwin.core.progress import Progress
from sealtwin.core.record_files import read_record
from sealtwin.core.records import FROM_JSON, Floats, Trajectory
from sealtwin.plan.loop_step import LoopModel
from sealtwin.plan.search import Case, areas_of, target_of
from simulate.settings import Fluid, Nozzle, Solver
from simulate.slot.flux import HerschelBulkley
from simulate.slot.sections import Trapezoids
from simulate.steered import SteeredPour

VERSION = 2  # Of the tables: with it their first pass begins lower
FIRST, AGAIN = 20, 16  # Intervals of the first pass and of the top-up
WAIT_S = 1.5  # Crawl over the first step of the way back, in which the bed comes to rest
TOP_UP_SHARE = 0.15  # Of the plan's mean flow: the top-up's unit
MOMENT_S = 0.5
NUDGE, OFF = 0.3, 0.2  # Change either way of a command or a paste for its derivative, and that of the tables' trial
TRIED = 4
CELLS, STEPS = 40, 150
FIRST_MARGIN_MM, TOP_UP_MARGIN_MM = 0.8, 1.0
"""Levels below the face at which both passes aim: nothing takes away what is too much."""
START_SHARE, START_MM = 1 / 1.3, 25.0
"""Share of the section that the first pass aims at in its beginning, and the length over which it grows to 1. So much
is filled before a level shows the pump's flow, which may be 20 % more, of a paste that heaps up."""
REACH_MM = 8.0  # Beyond an interval of the top-up, where its sealant ends; farther off a derivative is noise
REMEDY = "Delete it; 'sealtwin loop PLAN --emulate FAULTS' makes the tables anew."


@with_config(FROM_JSON)
@dataclass(frozen=True)
class LoopFile(LoopModel):
    """Content of loop.json."""

    key: str  # Of all that the tables depend on
    stage_numbers: dict[str, int]


@dataclass(frozen=True)
class TwoPasses:
    """The nozzle's motion along a plan and back, and the flow by its commands."""

    motion: Trajectory  # Its own flow does not count
    edge_s: Floats  # (n, 2)
    base_mm3_s: Floats  # (n,)
    nominal: Floats  # (n,)

    @property
    def back_s(self) -> float:
        """Begin of the top-up."""
        return float(self.edge_s[self.nominal == 0, 0].min())

    def with_flow(self, commands: Floats) -> Trajectory:
        """Return the motion with the flow of some commands; waypoints are added at the intervals' ends."""
        t_s = np.unique(np.concatenate([self.motion.t_s, self.edge_s.ravel()]).round(9))
        place_mm = np.column_stack([np.interp(t_s, self.motion.t_s, x) for x in self.motion.position_mm.T])
        speed = np.append(np.diff(arc_length(place_mm)) / np.diff(t_s), 0.0)
        flow = np.append([self.flow_at(t, commands) for t in (t_s[1:] + t_s[:-1]) / 2], 0.0)
        return Trajectory(t_s, place_mm, np.interp(t_s, self.motion.t_s, self.motion.s_mm), speed, flow)

    def flow_at(self, t_s: float, commands: Floats) -> float:
        within = np.flatnonzero((self.edge_s[:, 0] <= t_s) & (t_s < self.edge_s[:, 1]))
        return float(self.base_mm3_s[within[0]] * commands[within[0]]) if len(within) else 0.0


def targets_of(sections: Trapezoids, motion: Trajectory) -> Floats:
    """Return the areas at which the first pass and the top-up aim, (2, C)."""
    from_mm = sections.s_mm if motion.s_mm[0] < sections.s_mm.mean() else sections.s_mm[-1] - sections.s_mm
    share = np.interp(from_mm, [0.0, START_MM], [START_SHARE, 1.0])
    return np.array([share * target_of(sections, FIRST_MARGIN_MM), target_of(sections, TOP_UP_MARGIN_MM)])


def two_passes(case: Case, plan: Trajectory, back_mm_s: float) -> TwoPasses:
    """Return a plan in even intervals of time, with the volume of the first pass, and the same way back.

    By a moment it gives what the first target holds of the part of the crack that the plan's share of volume fills.
    """
    sections = case.fill(plan, CELLS, 1).sections
    part = plan.giving
    begin_s, end_s = plan.t_s[part][[0, -1]]
    first_s = np.linspace(begin_s, end_s, FIRST + 1)
    given_mm3 = np.interp(first_s, plan.t_s, np.concatenate([[0.0], np.cumsum(plan.given_mm3)]))
    back_mm = plan.position_mm[part][::-1]
    lasts_s = np.linalg.norm(np.diff(back_mm, axis=0), axis=1) / back_mm_s
    lasts_s[0] += WAIT_S
    back_s = end_s + np.concatenate([[0.0], np.cumsum(lasts_s)])
    again_s = np.linspace(end_s + WAIT_S, back_s[-1], AGAIN + 1)
    upto = slice(0, part.stop)
    motion = Trajectory(
        t_s=np.concatenate([plan.t_s[upto], back_s[1:]]),
        position_mm=np.vstack([plan.position_mm[upto], back_mm[1:]]),
        s_mm=np.concatenate([plan.s_mm[upto], plan.s_mm[part][::-1][1:]]),
        speed_mm_s=np.zeros(part.stop + len(back_s) - 1),
        flow_mm3_s=np.zeros(part.stop + len(back_s) - 1),
    )
    order = np.argsort(np.abs(sections.s_mm - plan.s_mm[0]))
    full_mm3, first_mm3 = (
        np.concatenate([[0.0], np.cumsum(mm2[order])]) * sections.step_mm
        for mm2 in (sections.full_mm2, targets_of(sections, motion)[0])
    )
    base = np.diff(np.interp(given_mm3 / given_mm3[-1], full_mm3 / full_mm3[-1], first_mm3)) / np.diff(first_s)
    return TwoPasses(
        motion,
        np.vstack([np.column_stack([edges[:-1], edges[1:]]) for edges in (first_s, again_s)]),
        np.concatenate([base, np.full(AGAIN, TOP_UP_SHARE * base.mean())]),
        np.concatenate([np.ones(FIRST), np.zeros(AGAIN)]),
    )


Reference = Callable[[Trapezoids, Floats], Floats]
"""Function of sections and moments that returns the areas of the nominal pour, (T, C)."""


def make_model(
    case: Case,
    passes: TwoPasses,
    reference: Reference,
    *,
    most_mm3_s: float,
    progress: Progress,
    cells: int = CELLS,
    steps: int = STEPS,
) -> LoopModel:
    """Make the tables: one nominal pour, as ``by_particles`` does it, and one of the fast model for each command."""
    progress.start("Tables of the loop, fast model", 2 * FIRST + AGAIN + 3 + TRIED)
    end_s = passes.motion.t_s[-1] + case.settle_s
    moments = np.append(np.arange(passes.motion.t_s[0], end_s, MOMENT_S), end_s)
    done = itertools.count(1)

    def areas(commands: Floats, thicker: float = 0.0) -> Floats:
        """Return areas over time of the fast model, (T, C)."""
        rows: list[tuple[float, Floats]] = []
        thick = replace(case, paste=thickened(case.paste, thicker))
        thick.fill(passes.with_flow(commands), cells, steps, watch=lambda t_s, mm2: rows.append((t_s, mm2.copy())))
        progress.advance(next(done))
        t_s, table = np.array([row[0] for row in rows]), np.array([row[1] for row in rows])
        return np.column_stack([np.interp(moments, t_s, column, left=0.0) for column in table.T])

    nominal, sections = areas(passes.nominal), case.fill(passes.motion, cells, 1).sections
    by_command = np.zeros((len(passes.nominal), *nominal.shape))
    for number, kept in enumerate(passes.nominal):
        moved = np.zeros(len(passes.nominal))
        moved[number] = NUDGE if kept else 1.0
        less = areas(passes.nominal - moved) if kept else nominal
        by_command[number] = (areas(passes.nominal + moved) - less) / (2 * NUDGE if kept else 1.0)
        if not kept:
            by_command[number] = _near(by_command[number], passes, number, sections, moments)
    by_material = (areas(passes.nominal, NUDGE) - areas(passes.nominal, -NUDGE)) / (2 * NUDGE)
    random, off_mm = np.random.default_rng(0), list[Floats]()
    for _ in range(TRIED):
        change = np.where(passes.nominal > 0, random.uniform(-OFF, OFF) + random.normal(0, OFF / 4, FIRST + AGAIN), 0)
        thicker = random.uniform(-OFF, OFF)
        exact_mm2 = areas(passes.nominal + change, thicker)[-1]
        guess_mm2 = nominal[-1] + change @ by_command[:, -1] + thicker * by_material[-1]
        off_mm.append((exact_mm2 - guess_mm2) / sections.mouth_mm)
    return LoopModel(
        sections=sections,
        moment_s=moments,
        edge_s=passes.edge_s,
        base_mm3_s=passes.base_mm3_s,
        nominal=passes.nominal,
        reference_mm2=reference(sections, moments),
        by_command=by_command,
        by_material=by_material,
        target_mm2=targets_of(sections, passes.motion),
        most_mm3_s=most_mm3_s,
        linear_off_mm=float(np.sqrt(np.mean(np.square(off_mm)))),
    )


def _near(areas_mm2: Floats, passes: TwoPasses, number: int, sections: Trapezoids, moments: Floats) -> Floats:
    """Return the areas that an interval of the top-up adds, (T, C), of its own volume, without noise farther off.

    A bed that yields comes to rest a little otherwise whatever is added, by some 0.1 mm anywhere, which over all
    intervals is as much as a top-up gives.
    """
    begin_s, end_s = passes.edge_s[number]
    way_mm = np.interp((begin_s, end_s), passes.motion.t_s, passes.motion.s_mm)
    near = np.abs(sections.s_mm - np.clip(sections.s_mm, way_mm.min(), way_mm.max())) < REACH_MM
    given_mm3 = passes.base_mm3_s[number] * np.clip(moments - begin_s, 0.0, end_s - begin_s)
    found_mm3 = (near * areas_mm2).sum(axis=1) * sections.step_mm
    # While the sealant falls, little of it is in the bed.
    return near * areas_mm2 * (given_mm3 / np.maximum(found_mm3, given_mm3 / 2 + 1e-9))[:, None]


def by_particles(
    case: Case,
    passes: TwoPasses,
    physics: tuple[Fluid, Solver, Nozzle],
    *,
    most_mm3_s: float,
    seed: int,
    progress: Progress,
) -> Reference:
    """Return the reference by particles, with the nominal commands."""

    def reference(sections: Trapezoids, moments: Floats) -> Floats:
        how: dict[str, Any] = {"most_mm3_s": most_mm3_s, "seed": seed, "slope": case.slope}
        pour = SteeredPour(case.solid, case.outline, passes.motion, *physics, **how)
        rows = []
        progress.start("Tables of the loop, particles", len(moments))
        for moment_s in moments:
            pour.advance(float(moment_s), lambda t_s: passes.flow_at(t_s, passes.nominal))
            level = pour.level()
            rows.append(areas_of(sections, level.s_mm, level.level_mm))
            progress.advance(len(rows))
        return np.array(rows)

    return reference


def thickened(paste: HerschelBulkley, log_factor: float) -> HerschelBulkley:
    """Return a paste whose yield stress and viscosity are both larger by a factor, given as its logarithm."""
    factor = float(np.exp(log_factor))
    return replace(
        paste,
        yield_stress_pa=factor * paste.yield_stress_pa,
        consistency_pa_s_n=factor * paste.consistency_pa_s_n,
    )


def write_model(path: Path, model: LoopModel, key: str, numbers: Mapping[str, int]) -> None:
    """Write the tables as JSON, with the key of all that they depend on, and its stage numbers."""
    files.write_json(path, {"version": VERSION, "key": key, "stage_numbers": dict(numbers), **asdict(model)})


def read_model(path: Path) -> LoopFile:
    """Read the tables. Raises InputError, naming the table, if one is damaged."""
    return read_record(LoopFile, path, REMEDY)
