"""A rheometer's table: Bingham's line through it, and what is no flow curve."""

from datetime import date

import numpy as np
import pytest

from sealtwin.core.errors import InputError
from sealtwin.material.by_rheometer import TORQUE, material_of_table
from sealtwin.material.paste import PasteOnPlate

DAY = date(2026, 11, 21)


def table(folder, rows: str):
    path = folder / "curve.csv"
    path.write_text(rows, encoding="utf-8")
    return material_of_table(path, PasteOnPlate(density_kg_m3=1690.0), "synthetic", DAY)


def test_a_line_is_found_exactly_and_its_scale_is_never_better_than_the_torques(tmp_path):
    rows = "\n".join(f"{rate:g},{12 + 0.5 * rate:.9g}" for rate in np.geomspace(1, 100, 9))
    paste = table(tmp_path, f"shear_rate_per_s,stress_pa\n{rows}\n")
    assert paste.yield_stress_pa == pytest.approx(12.0, rel=1e-3)
    assert paste.viscosity_pa_s == pytest.approx(0.5, rel=1e-3)
    assert paste.yield_stress_error_pa == pytest.approx(12 * TORQUE, rel=0.01)


def test_a_curve_that_is_no_line_is_known_the_worse(tmp_path):
    """Herschel and Bulkley's 12 + 3 gamma^0.5: the line is up to 3 Pa off the yield stress, and says so."""
    rows = "\n".join(f"{rate:g},{12 + 3 * rate**0.5:.9g}" for rate in np.geomspace(1, 100, 20))
    paste = table(tmp_path, f"shear_rate_per_s,stress_pa\n{rows}\n")
    assert paste.yield_stress_95_pa[0] < 12.0 + 3.0
    assert paste.yield_stress_error_pa > 2 * TORQUE * paste.yield_stress_pa


@pytest.mark.parametrize(
    ("rows", "says"),
    [
        ("1,2\n3,4\n", "2 rows below the header; 5 to 5000"),
        ("1,9\n1,9\n1,9\n1,9\n1.1,9\n", "factor of at least 3"),
        ("1,9\n2,8\n4,7\n8,6\n16,5\n", "both must be above 0"),
        ("1,9\n2,-8\n4,7\n8,6\n16,5\n", "row 3, column stress_pa: -8"),
    ],
)
def test_what_is_no_flow_curve_is_refused(tmp_path, rows, says):
    with pytest.raises(InputError, match=says):
        table(tmp_path, f"shear_rate_per_s,stress_pa\n{rows}")
