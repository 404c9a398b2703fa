"""The viscosity by an early photo, against a finer slump whose viscosity is known."""

import numpy as np
import pytest

from digitise.spread import SpreadBlob
from sealtwin.material.by_spread import Heap, PasteEstimate, viscosity
from simulate.slump import slump

DENSITY_KG_M3, STRESS_PA = 1690.0, 25.0


@pytest.mark.slow
def test_the_time_of_a_radius_tells_the_viscosity():
    heap = Heap(density_kg_m3=DENSITY_KG_M3, cone_mm=(38.0, 19.0, 57.0))
    cone = heap.cone
    assert cone is not None
    true = slump(cone, STRESS_PA, DENSITY_KG_M3, steady=True, finer=1.2)
    assert true.viscosity_pa_s is not None
    radius_mm = 0.85 * true.at_rest_mm
    early_s = float(np.interp(radius_mm, np.maximum.accumulate(true.radius_mm), true.t_s))
    found = PasteEstimate(STRESS_PA, 1.0, (23.0, 27.0), 30.0, 0.3, cone.volume_mm3, True, {})
    early = SpreadBlob(radius_mm, 0.2, 0.0, (2 * radius_mm, 2 * radius_mm), ())
    value, percent = viscosity(heap, found, [(early, early_s)])
    assert value == pytest.approx(true.viscosity_pa_s, rel=0.15)
    assert 25 < percent < 60
    # Twice as thick, it takes twice as long, and of two photos both count.
    twice, doubt = viscosity(heap, found, [(early, 2 * early_s)])
    assert twice == pytest.approx(2 * value)
    both, less = viscosity(heap, found, [(early, early_s), (early, 2 * early_s)])
    assert value < both < twice
    assert 25 < less < percent
    assert doubt < percent
