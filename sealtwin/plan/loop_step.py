"""One step of the correction of a fill: it computes the remaining flow from the level so far, without side effects.

A model is computed before the pour. It has the areas of the nominal plan over time, computed by particles, and their
derivatives with respect to each flow and to the paste's thickness, computed by the fast model. The levels of the fast
model are too low during the fill, so only its differences are used. Everything is linear, and a step takes some
hundredths of a second.
"""

from dataclasses import dataclass, field, replace
from operator import attrgetter

import numpy as np
from numpy.typing import NDArray
from pydantic import with_config

from sealtwin.core.record_files import Amount
from sealtwin.core.records import FROM_JSON, Floats, Numbers
from sealtwin.plan.search import DECIMALS
from simulate.slot.sections import Trapezoids

FLOW_SD, MATERIAL_SD = 0.15, 0.5
"""Standard deviations of two priors: that of the pump's flow divided by the requested flow, and that of the logarithm
of the paste's thickness divided by the plan's."""
FLOW_BOUNDS, MATERIAL_BOUNDS = (0.6, 1.5), (0.2, 5.0)  # Bounds of both estimates, over the plan's
MODEL_MM, ALIKE_MM = 0.4, 8.0  # Error of a predicted level in mid-fill, and the length over which it is correlated
SMOOTHED_MM = 2.5  # Standard deviation of the smoothing of unexplained areas
OPEN_AFTER_S = 3.0  # Time without a level after which the plan is no longer corrected
OVER_WEIGHT = (1.3, 4.0)  # Weight of overfill in the first pass, and in the top-up, after which nothing removes it
STIFF, AT_EASE, WHOLE = 0.3, 0.003, 3.0
"""Three weights, relative to the weight of the areas' relative errors: for a command's distance from the plan's flow in
the first pass, for its distance from 0 in the top-up, and for the error of the whole volume in the first pass."""
TRUSTED = 0.65, 1.5  # Bounds of a command of the first pass, within which the tables are valid
REWEIGHTED = 4  # Number of times that cells over their target are weighted anew


@with_config(FROM_JSON)
@dataclass(frozen=True)
class LoopModel:
    """Tables of a plan with a top-up pass. They have C cells, T moments and n intervals of time.

    A command multiplies ``base_mm3_s`` in its interval, which is the plan's flow, or a small flow in the top-up.
    """

    sections: Trapezoids
    moment_s: Numbers  # (T,)
    edge_s: Numbers  # (n, 2): begin and end of each interval
    base_mm3_s: Numbers  # (n,): mean
    nominal: Numbers  # (n,): 1 in the first pass, 0 in the top-up
    reference_mm2: Numbers  # (T, C): areas by particles with the nominal commands
    by_command: Numbers  # (n, T, C)
    by_material: Numbers  # (T, C)
    target_mm2: Numbers  # (2, C): of the first pass and of the top-up
    most_mm3_s: Amount
    linear_off_mm: Amount  # RMS error of the tables against the fast model, with flow and paste 20 % off

    def __post_init__(self) -> None:
        cells, moments, intervals = len(self.sections.s_mm), len(self.moment_s), len(self.nominal)
        sizes = {
            **{f"sections.{name}": (cells,) for name in ("floor_mm", "mouth_mm", "depth_mm", "slant", "bottom_mm")},
            "edge_s": (intervals, 2),
            "base_mm3_s": (intervals,),
            "reference_mm2": (moments, cells),
            "by_command": (intervals, moments, cells),
            "by_material": (moments, cells),
            "target_mm2": (2, cells),
        }
        for name, size in sizes.items():
            if (shape := attrgetter(name)(self).shape) != size:
                raise ValueError(
                    f"{name} has the shape {shape}, but moment_s, nominal and sections.s_mm require {size}"
                )
        if min(cells, moments, intervals) < 2:
            raise ValueError("moment_s, nominal and sections.s_mm must each have at least two numbers")

    @property
    def first(self) -> int:
        """Number of intervals of the first pass."""
        return int((self.nominal > 0).sum())

    def at(self, t_s: float) -> tuple[Floats, Floats, Floats]:
        """Return the reference areas at the time ``t_s``, (C,), and their derivatives by command and by material.

        The derivatives are (n, C) and (C,).
        """
        place = float(np.interp(t_s, self.moment_s, np.arange(len(self.moment_s))))
        low = min(int(place), len(self.moment_s) - 2)
        share = place - low

        def between(table: Floats) -> Floats:
            return (1 - share) * table[..., low, :] + share * table[..., low + 1, :]

        return between(self.reference_mm2), between(self.by_command), between(self.by_material)


@with_config(FROM_JSON)
@dataclass(frozen=True)
class LevelFrame:
    """Levels that a sensor measured at one moment, at the stations that it covers."""

    t_s: float
    s_mm: tuple[float, ...]
    level_mm: tuple[float, ...]

    def __post_init__(self) -> None:
        if len(self.s_mm) != len(self.level_mm):
            raise ValueError(f"s_mm has {len(self.s_mm)} numbers, but level_mm has {len(self.level_mm)}")


@dataclass(frozen=True)
class LoopState:
    """State that a step returns, and the next step takes."""

    commands: tuple[float, ...]
    level_s: float = 0.0  # Moment of the latest level
    flow: float = 1.0
    material: float = 0.0  # Logarithm
    left_mm2: tuple[float, ...] = field(default=())  # Areas that the estimates do not explain, (C,)
    stopped: str = ""  # Reason for a stop, in a sentence

    @classmethod
    def start(cls, model: LoopModel) -> "LoopState":
        return cls(commands=tuple(model.nominal.tolist()), left_mm2=(0.0,) * len(model.sections.s_mm))

    @property
    def material_factor(self) -> float:
        """Estimated thickness of the paste divided by the plan's."""
        return float(np.exp(self.material))


@dataclass(frozen=True)
class RemainingPlan:
    """Flow in each interval that begins at the time of the step or later."""

    begin_s: tuple[float, ...]
    end_s: tuple[float, ...]
    flow_mm3_s: tuple[float, ...]
    said: str  # Outcome of the step in words: corrected, as before, open loop or stopped


@with_config(FROM_JSON)
@dataclass(frozen=True)
class StepInput:
    """Input of a logged step."""

    t_s: float
    level: LevelFrame | None


@dataclass(frozen=True)
class LoggedStep(StepInput):
    """Line of a log: input and output of a step."""

    state: LoopState
    plan: RemainingPlan


def step(model: LoopModel, state: LoopState, t_s: float, level: LevelFrame | None) -> tuple[LoopState, RemainingPlan]:
    """Correct the remaining flow according to the level so far. The same arguments always give the same result.

    Parameters
    ----------
    model
        Tables of the plan, as ``read_loop`` reads them.
    state
        State that the last step returned; ``LoopState.start(model)`` for the first step.
    t_s
        Time on the plan's clock.
    level
        Latest level from the sensor, at ``t_s`` or before; None if there is no new one since the last step.

    Returns
    -------
    LoopState, RemainingPlan
        The next state, and the flow of each interval that begins from ``t_s`` on.

    Raises
    ------
    ValueError
        The state belongs to another model. An estimate out of bounds is not an error: it stops the flow, and the state
        has the reason.
    """
    if len(state.commands) != len(model.nominal):
        raise ValueError(f"the state has {len(state.commands)} commands, but the model has {len(model.nominal)}")
    outcome = "as before: no new level"
    if level is not None and level.t_s > state.level_s and not state.stopped:
        state = _estimated(model, state, level)
    if state.stopped:
        commands = np.where(model.edge_s[:, 0] >= t_s, 0.0, state.commands)
        state, outcome = replace(state, commands=tuple(commands.tolist())), f"stopped: {state.stopped}"
    elif t_s - state.level_s > OPEN_AFTER_S:
        outcome = f"open loop: no level for {t_s - state.level_s:.1f} s"
    elif level is not None:
        state, outcome = _corrected(model, state, t_s), "corrected"
    ahead = model.edge_s[:, 0] >= t_s
    begin_s, end_s = (tuple(column.tolist()) for column in model.edge_s[ahead].T)
    flow = np.array(state.commands)[ahead] * model.base_mm3_s[ahead]
    return state, RemainingPlan(begin_s, end_s, tuple(flow.tolist()), outcome)


def _estimated(model: LoopModel, state: LoopState, level: LevelFrame) -> LoopState:
    """Return the state with flow and thickness estimated from the level and priors, and the areas left unexplained."""
    it = model.sections
    covered, area_mm2 = _covered_areas(it, level)
    reference, by_command, by_material = model.at(level.t_s)
    commands = np.array(state.commands)
    given = commands @ by_command
    measured_mm2 = area_mm2 - reference + model.nominal @ by_command
    # Error of a single cell; neighbours share their errors over some length.
    sd_mm2 = it.mouth_mm * MODEL_MM * np.sqrt(max(1.0, ALIKE_MM / it.step_mm))
    rows = np.column_stack([given, by_material])[covered] / sd_mm2[covered, None]
    prior = np.diag([1 / FLOW_SD, 1 / MATERIAL_SD])
    wanted = np.concatenate([measured_mm2[covered] / sd_mm2[covered], [1 / FLOW_SD, 0.0]])
    flow, material = np.linalg.lstsq(np.vstack([rows, prior]), wanted)[0].tolist()
    stopped = ""
    estimates = ("flow", flow, FLOW_BOUNDS), ("material", float(np.exp(material)), MATERIAL_BOUNDS)
    for name, value, (low, high) in estimates:
        if not low <= value <= high:
            stopped = (
                f"the {name} estimate {value:.2f} is outside {low:g} to {high:g}: check for a blocked nozzle or "
                "another paste"
            )
    left_mm2 = np.where(covered, measured_mm2 - flow * given - material * by_material, 0.0)
    near = np.exp(-0.5 * ((it.s_mm[:, None] - it.s_mm) / SMOOTHED_MM) ** 2) * covered
    left_mm2 = np.where(covered, near @ left_mm2 / np.maximum(near.sum(axis=1), 1e-12), 0.0)
    return replace(
        state, level_s=level.t_s, flow=flow, material=material, left_mm2=tuple(left_mm2.tolist()), stopped=stopped
    )


def _covered_areas(sections: Trapezoids, level: LevelFrame) -> tuple[NDArray[np.bool_], Floats]:
    """Return a flag for each cell, True if it has a level, (C,), and the area under its mean level, otherwise 0."""
    cells = len(sections.s_mm)
    cell = np.clip((np.array(level.s_mm) / sections.step_mm).astype(int), 0, cells - 1)
    count = np.bincount(cell, minlength=cells)
    mean_mm = np.bincount(cell, np.array(level.level_mm), cells) / np.maximum(count, 1)
    return count > 0, np.where(count > 0, sections.area_mm2(mean_mm - sections.bottom_mm)[0], 0.0)


def _corrected(model: LoopModel, state: LoopState, t_s: float) -> LoopState:
    """Choose the remaining commands of the present pass so that the bed meets the target at the end of the pass."""
    from scipy.optimize import lsq_linear

    first, begin_s = model.first, model.edge_s[:, 0]
    again = t_s >= model.edge_s[first - 1, 1]
    own = np.arange(len(begin_s)) >= first if again else np.arange(len(begin_s)) < first
    free = own & (begin_s >= t_s)
    if not free.any():
        return state
    ends_s = model.moment_s[-1] if again else float(begin_s[first])
    reference, by_command, by_material = model.at(ends_s)
    commands, target_mm2 = np.array(state.commands), model.target_mm2[int(again)]
    fixed = np.where(free, 0.0, commands)
    bed_mm2 = reference + (state.flow * fixed - model.nominal) @ by_command + state.material * by_material
    if again:
        # In the first pass, most unexplained area is at the moving front, which the tables place badly.
        bed_mm2 = bed_mm2 + np.array(state.left_mm2)
    # In the first pass, any area between both targets is right. In the top-up, an area over its target stays.
    highest_mm2 = np.inf if again else model.target_mm2[1]
    lacks_mm2 = np.clip(bed_mm2, target_mm2, np.maximum(target_mm2, highest_mm2)) - bed_mm2
    scale = 1 / target_mm2.mean() / np.sqrt(len(target_mm2))
    table, lacks = scale * state.flow * by_command[free].T, scale * lacks_mm2
    most = np.maximum(model.most_mm3_s / model.base_mm3_s[free], 1e-6)
    least = np.zeros(len(most))
    if not again:
        least, most = np.minimum(TRUSTED[0], most / 2), np.minimum(TRUSTED[1], most)
    # The top-up gives as little as possible.
    still, stiff = (0.0, AT_EASE) if again else (1 / state.flow, STIFF)
    stiffness = stiff / np.sqrt(free.sum()) * np.eye(int(free.sum()))
    # Make the volume right even if the tables place it badly.
    whole = 0.0 if again else WHOLE / np.sqrt(len(lacks))
    weight, chosen = np.ones(len(lacks)), commands[free]
    for _ in range(REWEIGHTED):
        rows = np.vstack([weight[:, None] * table, whole * table.sum(axis=0), stiffness])
        wanted = np.concatenate([weight * lacks, [whole * lacks.sum()], stiffness @ np.full(len(chosen), still)])
        chosen = lsq_linear(rows, wanted, (least, most)).x
        weight = np.where(table @ chosen > lacks, OVER_WEIGHT[int(again)], 1.0)
    commands[free] = np.clip(chosen.round(DECIMALS), least, most)
    return replace(state, commands=tuple(commands.tolist()))
