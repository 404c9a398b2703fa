"""No particle leaves through a wall: in the paper's range, on slopes, and by settings that nobody plans for."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pytest

from digitise.settings import CrackShape
from digitise.solid.build_solid import build_solid
from sealtwin.core.records import Outline
from simulate.settings import LEVEL, SampleSlope
from tests.support.shapes import OPEN, closed_crack, straight_slot
from tests.support.small_fluids import path, pour, sealant

WATERY = {"U": 0.1, "D_cm": 1e-3}
THE_PAPERS = {"U": 30.0, "D_cm": 0.3, "freeze_after_s": 2.58}
STIFF = {"U": 1e4, "D_cm": 3.0, "freeze_after_s": 0.3}
STEEP = SampleSlope(gradient_deg=-30.0, crossfall_deg=20.0)
EDGE_AT_HAND_MM = (-2.0, -3.0, 14.0, 3.0)

STONE = replace(straight_slot(12.0, 7.0), islands_mm=(np.array([(4.0, -1.5), (5.0, 1.5), (7.0, 1.0), (7.5, -1.0)]),))


@dataclass(frozen=True)
class Case:
    """A short crack in coarse particles, and what is odd about it."""

    name: str
    volume_ml: float
    outline: Outline = field(default_factory=lambda: straight_slot(12.0))
    fluid: dict[str, Any] = field(default_factory=lambda: WATERY)
    crack: dict[str, Any] = field(default_factory=dict)
    path: dict[str, Any] = field(default_factory=dict)
    solver: dict[str, Any] = field(default_factory=dict)
    nozzle_mm: float = 2.4
    slope: SampleSlope = LEVEL


CORNERS = {"thinnest": {"U": 1e-2, "D_cm": 1e-4}, "thickest": {"U": 1e4, "D_cm": 3.0}}
"""Of the paper's range."""
FINER = {"radius_mm": 0.5, "settle_s": 0.1}
CASES = [
    Case("thinnest", 0.1, fluid=CORNERS["thinnest"] | {"freeze_after_s": 0.3}, solver=FINER),
    Case("thickest", 0.1, fluid=CORNERS["thickest"] | {"freeze_after_s": 0.3}, solver={**FINER, "preset": "paper"}),
    Case("undercut", 0.1, fluid=THE_PAPERS, crack={"tilt": "undercut", "wall_angle_deg": 5.5}, solver=FINER),
    Case("a steep slope", 0.1, fluid=CORNERS["thinnest"], slope=STEEP, solver=FINER),
    Case("walls that close soon", 0.2, crack={"tilt": "funnel", "wall_angle_deg": 45.0}),
    Case("tips under stiff paste", 0.3, closed_crack(0, 20.0, 3.5), STIFF, {"tilt": "lean"}, {"trim_mm": 0.0}),
    Case("low dams, overfull", 0.6, straight_slot(16.0, ends=OPEN), crack={"depth_mm": 4.0, "dam_height_mm": 0.5}),
    Case("edge at hand", 0.6, straight_slot(12.0, face_mm=EDGE_AT_HAND_MM), crack={"depth_mm": 6.0}),
    Case("a floor as thin as foil", 0.4, crack={"depth_mm": 6.0, "floor_thickness_mm": 0.2}),
    Case("a nozzle far wider than the mouth", 0.8, straight_slot(24.0), nozzle_mm=12.0, crack={"depth_mm": 6.0}),
    Case("the largest radius", 0.3, fluid=STIFF, solver={"radius_mm": 0.775, "preset": "paper"}),
    Case("a fall of 100 mm", 0.2, path={"nozzle_height_mm": 100.0}),
    Case("hardly a crack", 0.1, crack={"depth_mm": 0.3}),
    Case("a step in the floor", 0.3, crack={"depth_mm": ((5.0, 3.0), (5.2, 10.0)), "tilt": "lean"}),
    Case("a stone under a flare of two angles", 0.5, STONE, crack={"tilt": "flare", "wall_angle_deg": (3.0, 12.0)}),
]


@pytest.mark.parametrize("case", CASES, ids=[case.name for case in CASES])
def test_nothing_escapes(case):
    shape = {"depth_mm": 12.0, "tilt": "vertical"} | case.crack
    solid = build_solid(case.outline, CrackShape.model_validate(shape))
    way, fluid = path(case.outline, case.volume_ml, **{"speed_mm_s": 40.0, **case.path}), sealant(**case.fluid)
    how = {"slope": case.slope, "nozzle_mm": case.nozzle_mm, "radius_mm": 0.7} | case.solver
    run = pour((solid, case.outline), way, fluid, **how)
    assert run.escaped_particles == 0
    assert np.isfinite(run.position_mm).all()
    assert np.isfinite(run.velocity_mm_s).all()
    assert run.position_mm[~run.spilled, 2].min() > -solid.depth_mm
