"""Dam breaks that others have filmed, by which the fluid is judged."""

import numpy as np
import pytest

from benchmarks.measured import best_shift, computed_mm
from tests.support.dam_breaks import content, dam_breaks, fluid_of, with_curve

OUTLINE_S = content()["clock"]["outline_s"]


def test_the_measured_fronts_of_all_dam_breaks_advance():
    """An outline was read to about a millimetre, so that a front at rest may seem to go back."""
    cases = dam_breaks([*content()["materials"]])
    assert len(cases) == 21
    for case in cases:
        assert len(case.measured_mm) == 9
        assert (np.diff(case.measured_mm) > -1.0).all(), case.name


def test_a_material_with_a_flow_curve_has_the_settings_of_its_fit():
    fluid = fluid_of("okonomiyaki")
    assert fluid.density_kg_m3 == 1175.0
    assert None not in (fluid.consistency_pa_s_n, fluid.flow_index)


def test_the_shift_of_the_clock_is_recovered_from_fronts_that_are_early():
    cases = dam_breaks(with_curve())
    courses = {case: ((np.arange(9) + 0.4) * OUTLINE_S, case.measured_mm) for case in cases}
    assert best_shift(courses) == pytest.approx(0.4)
    assert computed_mm(courses[cases[0]], 0.4) == pytest.approx(cases[0].measured_mm)
