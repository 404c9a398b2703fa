"""Flow laws fitted to the flow curve of a rheometer."""

import re
from pathlib import Path

import numpy as np
import pytest

from sealtwin.core.errors import InputError
from sealtwin.core.settings import checked
from sealtwin.material import material_text
from sealtwin.material.by_rheometer import FlowCurve, material_of_table
from sealtwin.material.flow_law import GAP, TORQUE, fit_flow_law
from simulate.settings import Fluid

PASTE = {"density_kg_m3": 1690.0, "data": "synthetic"}
RATES = np.geomspace(1, 100, 9)


def measured(folder: Path, rate, stress, **rest):
    path = folder / "curve.csv"
    rows = (f"{one:.9g},{pa:.9g}" for one, pa in zip(rate, stress, strict=True))
    path.write_text("\n".join(["shear_rate_per_s,stress_pa", *rows]) + "\n", encoding="utf-8")
    return material_of_table(path, FlowCurve(**PASTE, **rest)).material


def test_bingham_is_chosen_for_a_straight_flow_curve(tmp_path):
    paste = measured(tmp_path, RATES, 12 + 0.5 * RATES)
    assert paste.yield_stress_pa == pytest.approx(12.0, rel=1e-3)
    assert paste.viscosity_pa_s == pytest.approx(0.5, rel=1e-3)
    assert paste.consistency_pa_s_n is None
    assert paste.yield_stress_error_pa == pytest.approx(12 * TORQUE, rel=0.05)
    assert paste.viscosity_error_percent == pytest.approx(100 * np.hypot(TORQUE, GAP), rel=0.05)


@pytest.mark.parametrize("n", [0.4, 1.3])
def test_a_run_uses_the_consistency_and_flow_index_of_a_fitted_law(tmp_path, n):
    """The run reads the material file through [fluid] material."""
    paste = measured(tmp_path, RATES, 12 + 3 * RATES**n)
    (tmp_path / "material.toml").write_text(material_text(paste), encoding="utf-8")
    fluid = Fluid(material=Path("material.toml")).loaded(tmp_path)
    assert fluid.yield_stress_pa == pytest.approx(12.0, rel=2e-3)
    assert fluid.consistency_pa_s_n == pytest.approx(3.0, rel=5e-3)
    assert fluid.flow_index == pytest.approx(n, rel=2e-3)
    assert fluid.viscosity_pa_s is None
    assert paste.shear_rates_per_s == (1.0, 100.0)
    # A recorded fluid is unchanged after reading; another K beside its material is refused.
    recorded = fluid.model_dump(mode="json", exclude_none=True)
    assert checked(Fluid, tmp_path / "again", recorded) == fluid
    with pytest.raises(InputError, match="consistency_pa_s_n"):
        checked(Fluid, tmp_path / "again", {**recorded, "consistency_pa_s_n": 4.0})
    with pytest.raises(InputError, match=r"consistency_pa_s_n, but fluid\.viscosity_pa_s is 1"):
        Fluid(material=Path("material.toml"), viscosity_pa_s=1.0).loaded(tmp_path)


def test_only_rows_at_the_shear_rates_of_the_fill_are_fitted(tmp_path):
    """The curve bends below 1/s and above 100/s, which is outside of the default shear rates."""
    rate = np.geomspace(0.01, 10_000, 25)
    stress = 12 + 3 * rate**0.5
    bent = np.where(rate < 0.9, stress / 2, np.where(rate > 110, 2 * stress, stress))
    paste = measured(tmp_path, rate, bent)
    assert (paste.flow_index, paste.consistency_pa_s_n) == pytest.approx((0.5, 3.0), rel=2e-3)
    assert any("9 of 25 rows" in sentence for sentence in paste.basis)
    assert "0.5 times" in paste.doubts[0]
    with pytest.raises(InputError, match="--shear-rates"):
        measured(tmp_path, rate, bent, shear_rates=(0.01, 10_000.0))


@pytest.mark.parametrize("seed", range(5))
def test_slow_rows_far_from_the_fitted_law_give_a_doubt(tmp_path, seed):
    """Law and highest stress are of a measured cement paste (rheocem2024_public, MIT). Noise alone gives no doubt."""
    rate = np.geomspace(80, 0.02, 19)
    on_law = (15.5 + 0.382 * rate**1.35) * (1 + 0.02 * np.random.default_rng(seed).standard_normal(19))
    assert measured(tmp_path, rate, on_law).doubts == ()
    static = measured(tmp_path, rate, on_law + np.where(rate < 1, 23.2 * np.log(rate) / np.log(0.02), 0.0))
    assert re.search(r"is 2\.5 times.*uncertainty\.yield_stress_pa = 1[12]", static.doubts[0])
    assert static.yield_stress_pa == pytest.approx(15.5, rel=0.05)
    assert "doubts" in material_text(static)


def test_95_percent_intervals_contain_the_true_values_in_95_percent_of_fits():
    """Intervals with a coverage of 95 % contain fewer than 16 of 20 true values by chance once in 3000."""
    random = np.random.default_rng(7)
    true, inside = np.array([12.0, 3.0, 0.5]), []
    for _ in range(20):
        torque, gap = random.normal(0, [TORQUE, GAP])
        stress = (12 + 3 * (RATES * (1 + gap)) ** 0.5) * (1 + torque) * (1 + random.normal(0, 0.02, len(RATES)))
        law = fit_flow_law(RATES, stress)
        ends = np.array([one.interval for one in (law.yield_stress_pa, law.consistency_pa_s_n, law.flow_index)])
        inside.append((ends[:, 0] <= true) & (true <= ends[:, 1]))
    assert (np.sum(inside, axis=0) >= 16).all()


@pytest.mark.parametrize(
    ("rate", "stress", "says"),
    [
        ((1, 3), (2, 4), "2 rows have"),
        ((1, 1.1, 1.2, 1.3, 1.4), (9, 10, 11, 12, 13), "factor of at least 3"),
        ((1, 2, 4, 8, 16), (9, -8, 9, 9, 9), "row 3, column stress_pa: -8"),
    ],
)
def test_an_unusable_flow_curve_is_refused_with_the_reason(tmp_path, rate, stress, says):
    with pytest.raises(InputError, match=says):
        measured(tmp_path, rate, stress)


@pytest.mark.parametrize("mark", [";", "\t"])
def test_a_flow_curve_may_have_decimal_commas_but_not_commas_that_may_separate_thousands(tmp_path, mark):
    path, stress = tmp_path / "curve.csv", 12 + 0.5 * RATES

    def material(digits):
        rows = (f"{one:{digits}}{mark}{pa:{digits}}" for one, pa in zip(RATES, stress, strict=True))
        path.write_text("\n".join([f"shear_rate_per_s{mark}stress_pa", *rows]).replace(".", ","), encoding="utf-8")
        return material_of_table(path, FlowCurve(**PASTE)).material

    assert material(".6f").yield_stress_pa == pytest.approx(12.0, rel=1e-3)
    with pytest.raises(InputError, match="may separate thousands"):
        material(".3f")
