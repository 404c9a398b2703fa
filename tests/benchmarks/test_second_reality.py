"""The second model of a pour, compared with closed forms and its stored tables, and its spilled sealant."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.reality import law
from benchmarks.reality.along import Fluid, Slot, Source, State, run
from benchmarks.reality.inputs import Cavity, Numerics, Paste, Pour
from benchmarks.reality.pour import poured
from benchmarks.reality.section import Section, Solid, flows
from benchmarks.reality.yielding import yield_gradient
from sealtwin.core.records import Floats

CAVITY = Cavity.even(12.0, 4.5, 8.0, wall_deg=4.0)
PASTE = Paste(density_kg_m3=1700.0, yield_stress_pa=7.5, consistency_pa_sn=5.0)
POUR = Pour.steady(0.0, 12.0, seconds=4.0, volume_mm3=300.0)
COARSE = Numerics(cell_mm=1.5, settle_s=5.0)


@pytest.mark.parametrize("case", law.LAWS)
def test_stored_flow_tables_equal_the_computed_flow_of_a_section(case):
    """In the compared section, walls and floor both matter. The stored numbers have six decimals."""
    exponent, share, friction = case
    depth, narrowing, part = law.DEPTHS[3], law.NARROWINGS[4], law.YIELDS[2]
    yields = np.array([0.0, part]) / yield_gradient(depth, narrowing, share, share)
    flow = flows(Section(depth, narrowing), yields, exponent, Solid(share, friction))
    kept, _ = law.flow_of(law.resolved_law(*case), depth, narrowing, yields)
    assert kept == pytest.approx(flow, rel=5e-3)  # Read linearly between nodes of the finer grid.


def test_the_flow_of_liquid_in_a_duct_equals_the_series_solution():
    """The section, 1 wide and 1 deep, is the lower half of a duct with the series of White (2006, eq. 3-48)."""
    odd = np.arange(1, 200, 2)
    duct = 1 / 12 * (1 - 96 / np.pi**5 * np.sum(np.tanh(odd * np.pi) / odd**5))
    assert flows(Section(1.0, 0.0), np.zeros(1), 1.0, Solid())[0] == pytest.approx(duct, rel=5e-3)


WEIGHT, WIDTH, CELL = 1700 * 9.81, 4e-3, 0.25e-3  # N/m3, m
X = (np.arange(320.0) + 0.5 - 160) * CELL


def settled(depth: Floats, seconds: float, yield_pa: float, law_of: law.Law) -> Floats:
    """Depths of a paste of 0.3 Pa s some time after it had others, in a slot with upright walls."""
    slot = Slot(CELL, np.full(320, WIDTH), np.zeros(320), np.full(320, -0.1), 0.0)
    fluid = Fluid(law_of, WEIGHT, yield_pa, 0.3, 0.0, np.inf, 1.0, normal_stress=0.0, yield_strain=0.1)
    state = State(depth * WIDTH, *(np.zeros(320) for _ in State._fields[1:]))
    run(state, slot, fluid, Source(np.zeros(2), np.zeros(2), np.zeros(2), np.zeros(2), 1e-3, 0.0), seconds, 1.0)
    return state.area / WIDTH


def test_a_front_between_walls_spreads_as_in_the_barenblatt_solution():
    """The profile h = t^-1/3 (1 - x^2 / (6 t^2/3)) solves h_t = (h h_x)_x; x is in 4 mm, and t runs from 1 to 8."""
    own_s = 0.3 * 12 / (WIDTH**2 * WEIGHT)
    before = 4e-3 * np.maximum(1 - (X / 4e-3) ** 2 / 6, 0.0)
    after = settled(before, 7 * own_s * 4e-3, 0.0, law.closed_law(walls=True, floor=False))
    assert after.max() / 4e-3 == pytest.approx(8 ** (-1 / 3), rel=0.02)
    lengths = [np.sqrt((depth * X**2).sum() / depth.sum()) for depth in (before, after)]
    assert lengths[1] / lengths[0] == pytest.approx(8 ** (1 / 3), rel=0.02)


@pytest.mark.slow
def test_an_overfilled_crack_spills_onto_the_face():
    over = poured(CAVITY, PASTE, replace(POUR, flow_mm3_s=3.0 * POUR.flow_mm3_s), numerics=COARSE)
    assert 0 < over.beside_mouth_mm3 < over.above_face_mm3
    assert over.in_slot_mm3 + over.above_face_mm3 == pytest.approx(over.volume_mm3, rel=1e-12)
