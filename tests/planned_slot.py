"""A planned slot of 40 mm, with the tables of its loop by the fast model alone."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from scipy.optimize import lsq_linear

from digitise.settings import CrackShape, NozzlePath
from digitise.solid.build_solid import build_solid
from digitise.trajectory import plan_trajectory
from sealtwin.core.progress import Progress
from sealtwin.core.records import Floats
from sealtwin.plan.loop_model import TwoPasses, make_model, thickened, two_passes
from sealtwin.plan.loop_step import LoopModel
from sealtwin.plan.search import Case
from sealtwin.plan.shape import Knots
from simulate.slot.flux import HerschelBulkley
from simulate.slot.sections import Trapezoids
from tests.shapes import straight_slot

OUTLINE = straight_slot(40.0, 4.0)
SOLID = build_solid(OUTLINE, CrackShape(depth_mm=10.0, tilt="vertical"))
OWN = plan_trajectory(OUTLINE, NozzlePath(trim_mm=3.0, speed_mm_s=3.0), SOLID.cavity_volume_mm3)
CASE = Case(SOLID, OUTLINE, HerschelBulkley(1690, 5.0, 1.0), 2.4, 2.0)
CELLS, STEPS = 20, 60
FLOWS = (221.0, 132.0, 125.0, 61.0, 18.0)
"""Flow at knots of a plan that the fast model finds for this slot at 3 mm/s, rounded."""


@cache
def passes() -> TwoPasses:
    plan = np.concatenate([np.log(FLOWS), np.full(len(FLOWS), np.log(3.0)), [1.8, 0.2]])
    return two_passes(CASE, Knots(OWN, len(FLOWS)).trajectory(plan), 6.0)


def areas(commands: Floats, moments: Floats, thicker: float = 0.0) -> Floats:
    rows: list[tuple[float, Floats]] = []
    case = replace(CASE, paste=thickened(CASE.paste, thicker))
    case.fill(passes().with_flow(commands), CELLS, STEPS, watch=lambda t_s, mm2: rows.append((t_s, mm2.copy())))
    t_s, table = np.array([row[0] for row in rows]), np.array([row[1] for row in rows])
    return np.column_stack([np.interp(moments, t_s, column, left=0.0) for column in table.T])


@cache
def model() -> LoopModel:
    def reference(_: Trapezoids, moments: Floats) -> Floats:
        return areas(passes().nominal, moments)

    how: dict[str, Any] = {"most_mm3_s": 600.0, "cells": CELLS, "steps": STEPS}
    return make_model(CASE, passes(), reference, **how, progress=Progress())


def with_other_last_bits(*inputs: Any) -> Any:
    """``lsq_linear`` as another processor's BLAS solves it."""
    solution = lsq_linear(*inputs)
    solution.x = solution.x * (1 + 1e-13 * np.random.default_rng(len(solution.x)).normal(size=len(solution.x)))
    return solution
