"""The judge of the fluid: what a tolerance means, and which order of convergence three sizes show."""

import numpy as np
import pytest

from benchmarks.physics import CASES
from benchmarks.physics_findings import Finding, within
from benchmarks.physics_flow import REFINED, _off_table, convergence_index
from benchmarks.physics_tanks import block_mm
from benchmarks.physics_yield import stability_number, steepest
from simulate.settings import particle_volume


def test_a_figure_passes_inside_its_tolerance_and_nowhere_else():
    band = within("width", 10.4, "mm", 10.0, 0.05, "a ruler")
    assert band.met
    assert band.judged
    assert not within("width", 10.6, "mm", 10.0, 0.05, "a ruler").met
    assert not within("width", 9.4, "mm", 10.0, 0.5, "a ruler", share=False).met
    assert not Finding("width", float("nan"), "mm", "10", "a ruler", 9.5, 10.5).met
    assert not Finding("width", 3.0, "mm", "10", "a ruler", high=2.0).met
    assert not Finding("width", 3.0, "mm", "10", "a ruler").judged


@pytest.mark.parametrize("order", [1.0, 2.0])
def test_the_index_of_convergence_is_roaches(order):
    """Of f = 2 + 0.3 R^p it finds p, and 1.25 times the error that the finest has, relative."""
    coarse, middle, fine = (2 + 0.3 * REFINED ** (order * power) for power in (2, 1, 0))
    found = convergence_index(coarse, middle, fine)
    assert f"order {order:.1f}" in found.name
    assert found.measured == pytest.approx(100 * 1.25 * 0.3 / 2.3)


@pytest.mark.parametrize(("three", "said"), [((1.0, 1.2, 1.1), "oscillatory"), ((1.0, 1.1, 1.3), "no order")])
def test_what_does_not_converge_gets_no_index(three, said):
    assert said in convergence_index(*three).reference


def test_a_block_holds_the_volume_of_its_box():
    """To half a layer of its height."""
    fluid = block_mm((0.0, -2.0, 0.0), (9.0, 2.0, 20.0), 0.4)
    volume_mm3 = len(fluid) * particle_volume(0.4)
    layer_mm3 = volume_mm3 * 0.7 / 20
    assert abs(volume_mm3 - 9 * 4 * 20) < layer_mm3 / 2
    assert fluid.min(axis=0) == pytest.approx([0.344, -1.656, 0.344], abs=0.04)


def test_what_a_slot_holds_is_the_stability_number_while_that_is_small():
    """For 15 Pa, 13.7 mm deep, by hand: S = 0.905 (2 / 3.1 + 1 / 13.7) = 0.650, over its cosine 0.855, 15 % more.

    Seen to fail with the tangent for the sine, and with half of what a finite heap holds more.
    """
    assert steepest(0.01, 10.0) == pytest.approx(stability_number(0.01, 10.0), rel=1e-3)
    assert stability_number(15.0, 13.7) == pytest.approx(0.650, abs=1e-3)
    assert steepest(15.0, 13.7) == pytest.approx(0.855 / (1 - 2 * 0.905 / 13.7), abs=2e-3)


def test_a_dam_is_off_a_table_by_its_share_of_the_place_and_a_delay_counts():
    """Seen to fail without the delay."""
    front = np.column_stack([np.linspace(0, 4, 41), 1 + np.linspace(0, 4, 41)])
    table = np.array([[1.0, 2.0], [2.0, 2.5]])
    assert _off_table("front", front, table, 5.0, 0.0, "a table").measured == pytest.approx(20.0)
    assert _off_table("front", front, table, 5.0, 0.5, "a table").measured == pytest.approx(-25.0)


def test_every_case_says_what_it_is():
    for case in CASES.values():
        assert len((case.__doc__ or "").splitlines()[0]) > 30
