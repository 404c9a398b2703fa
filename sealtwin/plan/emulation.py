"""Emulate a pour that is corrected: by particles and a sensor, with faults that the plan does not include."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from digitise.settings import CrackShape
from digitise.solid.build_solid import build_solid
from digitise.weighing.moved_walls import widened_by
from sealtwin.core.records import Outline, Profile
from sealtwin.core.settings import Settings
from sealtwin.plan.loop_model import TwoPasses
from sealtwin.plan.loop_step import LevelFrame, LoggedStep, LoopModel, LoopState, step
from sealtwin.plan.verify import Misfit, misfit
from simulate.settings import Fluid, Nozzle, SampleSlope, Solver
from simulate.steered import SteeredPour

Factor = Annotated[float, Field(ge=0.1, le=10)]
SEEN_EVERY_MM = 1.0  # Spacing of the stations of the emulated sensor
WIDENED_MM = 8.0  # Standard deviation, along the crack, of a widening


class Faults(Settings):
    """Content of faults.toml: faults that the plan does not include. A missing key means no such fault."""

    flow_factor: Factor = 1.0
    """Flow of the pump divided by the requested flow."""
    material_factor: Factor = 1.0
    """Yield stress and viscosity of the paste, each divided by that of the plan."""
    wider_percent: float = Field(default=0.0, ge=-50, le=100)
    """Increase of the crack's width at ``wider_at_mm``, in percent. At 8 mm on either side it is 0.6 times as large."""
    wider_at_mm: float = Field(default=45.0, ge=0, le=10_000)
    noise_mm: float = Field(default=0.0, ge=0, le=10)
    """Standard deviation of the sensor's level at each station. Stations are 1 mm apart."""
    latency_s: float = Field(default=0.0, ge=0, le=10)
    """Age of the sensor's level when it arrives."""
    lost_share: float = Field(default=0.0, ge=0, le=1)
    """Share of the sensor's levels that do not arrive."""
    blind_mm: float = Field(default=6.0, ge=0, le=1000)
    """Distance from the nozzle within which the sensor has no level."""
    period_s: float = Field(default=1.0, ge=0.05, le=60)
    """Time between two corrections of the flow."""


@dataclass(frozen=True)
class Emulated:
    """Result of an emulated pour. EMULATED: no number is measured."""

    misfit: Misfit
    after_first: Misfit
    level: Profile
    given_mm3: float
    lines: tuple[LoggedStep, ...]


def emulate(
    model: LoopModel,
    passes: TwoPasses,
    outline: Outline,
    shape: CrackShape,
    physics: tuple[Fluid, Solver, Nozzle],
    faults: Faults,
    *,
    seed: int,
    slope: SampleSlope,
    corrects: bool = True,
    report: Callable[[int], None] = lambda t_s: None,
) -> Emulated:
    """Emulate a pour with faults, and correct its flow with ``step``. If not ``corrects``, pour the plan unchanged."""
    fluid, solver, nozzle = physics
    share = faults.wider_percent / 100 * np.exp(-0.5 * ((outline.s_mm - faults.wider_at_mm) / WIDENED_MM) ** 2)
    real = widened_by(outline, share)
    solid = build_solid(real, shape)
    thickness = fluid.fresh.viscosity_pa_s or 0.0
    key = "viscosity_pa_s" if fluid.consistency_pa_s_n is None else "consistency_pa_s_n"
    stress_pa = faults.material_factor * fluid.yield_stress_pa
    hidden = fluid.model_copy(update={key: faults.material_factor * thickness, "yield_stress_pa": stress_pa})
    most_mm3_s = max(1.0, faults.flow_factor) * model.most_mm3_s
    pour = SteeredPour(
        solid, real, passes.motion, hidden, solver, nozzle, most_mm3_s=most_mm3_s, seed=seed, slope=slope
    )
    random, state, lines = np.random.default_rng(seed), LoopState.start(model), list[LoggedStep]()
    begin_s, end_s = float(passes.motion.t_s[0]), float(passes.motion.t_s[-1])

    def flow(t_s: float) -> float:
        return faults.flow_factor * passes.flow_at(t_s, np.array(state.commands))

    after_first, back_s = None, passes.back_s
    for t_s in np.arange(begin_s + faults.period_s, end_s, faults.period_s).tolist():
        pour.advance(t_s - faults.latency_s, flow)
        frame = _sensed(pour, passes, faults, random) if random.random() >= faults.lost_share else None
        pour.advance(t_s, flow)
        if after_first is None and t_s + faults.period_s > back_s:
            level = pour.level()
            after_first = misfit(real, solid, level.s_mm, level.level_mm)
        if corrects:
            state, plan = step(model, state, t_s, frame)
            lines.append(LoggedStep(t_s, frame, state, plan))
        report(round(t_s))
    pour.advance(end_s + solver.settle_s, flow)
    level = pour.level()
    at_end = misfit(real, solid, level.s_mm, level.level_mm)
    return Emulated(at_end, after_first or at_end, level, pour.given_mm3, tuple(lines))


def _sensed(pour: SteeredPour, passes: TwoPasses, faults: Faults, random: np.random.Generator) -> LevelFrame | None:
    """Return the sensor's level behind the nozzle, except within ``blind_mm`` of it; None if it covers no station."""
    level, t_s = pour.level(), pour.t_s
    s_mm = np.arange(SEEN_EVERY_MM / 2, level.s_mm[-1], SEEN_EVERY_MM)
    at_mm, start_mm = np.interp(t_s, passes.motion.t_s, passes.motion.s_mm), passes.motion.s_mm[0]
    so_far_mm = passes.motion.s_mm[passes.motion.t_s <= t_s]
    farthest_mm = so_far_mm[np.abs(so_far_mm - start_mm).argmax()] if len(so_far_mm) else start_mm
    onward = 1.0 if farthest_mm >= start_mm else -1.0
    visible = (t_s >= passes.back_s) | (onward * (farthest_mm - s_mm) > 0)
    visible &= np.abs(s_mm - at_mm) > faults.blind_mm
    if not visible.any():
        return None
    s_mm = s_mm[visible]
    noisy_mm = np.interp(s_mm, level.s_mm, level.level_mm) + random.normal(0, faults.noise_mm, len(s_mm))
    return LevelFrame(t_s, tuple(s_mm.tolist()), tuple(noisy_mm.tolist()))
