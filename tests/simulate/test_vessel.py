"""The columns that a bed is measured in."""

import numpy as np
import pytest

from simulate.vessel import Vessel
from tests.fluids import slot


@pytest.mark.parametrize("cell_mm", [0.25, 0.4, 0.53, 0.67, 0.8])
def test_the_columns_of_a_slot_hold_what_the_slot_holds(cell_mm):
    """Their middles take up as much as 0.3 % more or less of it."""
    solid, _ = slot(28.0, 6.0, 8.0, "vertical", 0.0)
    x_mm, y_mm = np.meshgrid(np.linspace(-1, 29, 301), np.linspace(-4, 4, 81))
    surface_mm = np.column_stack([x_mm.ravel(), y_mm.ravel(), np.full(x_mm.size, -2.0)])
    within = Vessel(solid, cell_mm).volume_mm3(surface_mm, 0.0866)
    assert within == pytest.approx(28 * 6 * (6 + 0.0866), rel=1e-6)
