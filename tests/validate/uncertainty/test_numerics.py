"""Convergence over three particle sizes, for power laws of known order and for numbers that have none."""

import numpy as np
import pytest

from validate.uncertainty.validation import converge

RADII = (1 / 1.3, 1.0, 1.3)


def sizes(order: float, finer: float, coarser: float, limit: float = 5.0, scale: float = 0.3):
    """Return the values of a number with an error of scale h^order, where the middle size is 1."""
    return [limit + scale * h**order for h in (1 / finer, 1.0, coarser)]


@pytest.mark.parametrize("order", [0.7, 1.0, 1.6, 2.0])
@pytest.mark.parametrize(("finer", "coarser"), [(1.3, 1.3), (1.3, 1.5), (2.0, 1.4)])
def test_a_power_law_has_its_order_and_the_index_its_error(order, finer, coarser):
    """The middle size is off by 0.3; the index says 1.25 times that."""
    found = converge(sizes(order, finer, coarser), (1 / finer, 1.0, coarser))
    assert found.kind == "converging"
    assert found.order == pytest.approx(order, rel=1e-6)
    assert found.band == pytest.approx(1.25 * 0.3, rel=1e-6)
    assert found.standard == found.band / 2


def test_celiks_example():
    """J. Fluids Eng. 130, 078001, Table 1: reattachment length 6.063, 5.972, 5.863; r = 1.5, 1.333; p = 1.53.

    Their index is that of the fine grid, 2.2 %; that of the middle one, which is ours, has the same order.
    """
    found = converge((6.063, 5.972, 5.863), (1 / 1.5, 1.0, 1.333))
    assert found.order == pytest.approx(1.53, abs=0.01)
    assert found.band == pytest.approx(1.25 * 0.109 / (1.333**1.53 - 1), rel=0.01)


def test_a_number_that_swings_is_called_so_and_has_its_spread():
    found = converge((1.00, 1.10, 0.95), RADII)
    assert (found.kind, found.order) == ("oscillatory", None)
    assert found.band == pytest.approx(0.15)


def test_an_order_near_zero_is_none():
    """Steps that do not shrink have no limit: the index would be seven times the spread."""
    found = converge(sizes(0.1, 1.3, 1.3), RADII)
    assert found.kind == "no order"
    assert found.band == pytest.approx(np.ptp(sizes(0.1, 1.3, 1.3)))
    growing = converge((1.0, 1.2, 1.3), RADII)
    assert (growing.kind, growing.order) == ("no order", None)
    assert growing.band == pytest.approx(0.3)


def test_an_order_above_the_second_counts_as_it():
    found = converge(sizes(4.0, 1.3, 1.3), RADII)
    assert found.order == pytest.approx(4.0)
    far = 0.3 * (1.3**4 - 1)
    assert found.band == pytest.approx(1.25 * far / (1.3**2 - 1))


def test_three_that_agree_are_no_doubt():
    assert converge((1.0, 1.0, 1.0), RADII).band == 0.0
