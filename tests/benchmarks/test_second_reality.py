"""The second reality: its kept tables, its worlds, and what it refuses. Closed forms: benchmarks.second_reality."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.reality import law
from benchmarks.reality.inputs import Cavity, Numerics, Paste, Pour
from benchmarks.reality.pour import poured
from benchmarks.reality.section import Section, Solid, flows
from benchmarks.reality.worlds import WORLDS
from benchmarks.reality.yielding import yield_gradient
from benchmarks.second_reality import duct

CAVITY = Cavity.even(12.0, 4.5, 8.0, wall_deg=4.0)
PASTE = Paste(density_kg_m3=1700.0, yield_stress_pa=7.5, consistency_pa_sn=5.0)
POUR = Pour.steady(0.0, 12.0, seconds=4.0, volume_mm3=300.0)
COARSE = Numerics(cell_mm=1.5, settle_s=5.0)


@pytest.mark.parametrize("case", law.LAWS)
def test_kept_tables_are_those_of_the_sections(case):
    """At a node, deep enough that walls and floor both matter; the kept numbers have six decimals."""
    exponent, share, friction = case
    depth, narrowing, part = law.DEPTHS[3], law.NARROWINGS[4], law.YIELDS[2]
    yields = np.array([0.0, part]) / yield_gradient(depth, narrowing, share, share)
    flow = flows(Section(depth, narrowing), yields, exponent, Solid(share, friction))
    kept = [law.flow_of(law.resolved_law(*case), depth, narrowing, one)[0] for one in yields]
    assert kept == pytest.approx(flow.tolist(), rel=5e-3)  # Read linearly between nodes of the finer grid.


def test_a_duct_of_liquid_has_the_flow_of_its_series():
    assert flows(Section(1.0, 0.0), np.zeros(1), 1.0, Solid())[0] == pytest.approx(duct(1.0), rel=5e-3)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: replace(PASTE, wall_share=0.5), "wall_friction"),
        (lambda: replace(PASTE, exponent=1.2), "exponent"),
        (lambda: replace(CAVITY, right_deg=np.array([-40.0, 4.0])), "leans"),
        (lambda: replace(CAVITY, s_mm=np.array([12.0, 0.0])), "stations"),
    ],
)
def test_what_it_cannot_pour_is_refused(make, words):
    with pytest.raises(ValueError, match=words):
        make()


@pytest.mark.slow  # Compiles for some seconds.
def test_worlds_change_what_they_name_and_lose_no_paste():
    beds = {name.split()[0]: poured(CAVITY, PASTE, POUR, world, COARSE) for name, world in WORLDS.items()}
    for name, bed in beds.items():
        assert bed.in_slot_mm3 + bed.above_face_mm3 == pytest.approx(bed.volume_mm3, rel=1e-12), name
    volumes = {name: bed.volume_mm3 / 300.0 for name, bed in beds.items()}
    assert {name: one for name, one in volumes.items() if abs(one - 1.0) > 1e-9} == pytest.approx(
        {"W4": 0.9, "W5": 0.92, "W9": 0.95, "W11": 0.97 * 0.95}
    )
    steepness = {name: np.ptp(bed.mean_mm[1:-1]) for name, bed in beds.items()}
    assert steepness["W2"] != pytest.approx(steepness["W0"], rel=0.02)
    assert beds["W3"].yield_stress_pa.max() > 7.5 + 0.3
    assert (beds["W10"].mean_mm == beds["W0"].mean_mm).all()
    assert (beds["W10"].middle_mm < beds["W0"].middle_mm)[beds["W0"].mean_mm < -1.0].all()


@pytest.mark.broad
def test_a_crack_that_is_full_spills_onto_the_face():
    over = poured(CAVITY, PASTE, replace(POUR, flow_mm3_s=3.0 * POUR.flow_mm3_s), numerics=COARSE)
    assert 0 < over.beside_mouth_mm3 < over.above_face_mm3
    assert over.in_slot_mm3 + over.above_face_mm3 == pytest.approx(over.volume_mm3, rel=1e-12)
