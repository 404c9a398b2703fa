import pytest
from pydantic import ValidationError

from simulate.settings import Fluid, Solver


@pytest.mark.parametrize(
    ("table", "fault"),
    [
        ({"freeze_after_s": 1.0}, "give either U"),
        ({"U": 1.0, "viscosity_pa_s": 0.1, "freeze_after_s": 1.0}, "not both"),
        ({"U": 1.0, "freeze_after_s": 0.0}, "freeze_after_s is 0"),
        ({"U": 1.0, "freeze_after_s": "no"}, "never"),
        ({"U": 1.0, "freeze_after_s": float("nan")}, "finite"),
        ({"U": -1.0, "freeze_after_s": "never"}, "U"),
        ({"U": "30", "freeze_after_s": "never"}, "U"),
        (
            {"U": 1.0, "freeze_after_s": "never", "yield_stress_pa": 12.0, "yield_stress_most_pa": 5.0},
            "yield_stress_most_pa is 5, below yield_stress_pa, which is 12",
        ),
    ],
)
def test_an_impossible_fluid_is_refused_with_its_reason(table, fault):
    with pytest.raises(ValidationError, match=fault):
        Fluid.model_validate(table)


def test_presets_differ_where_the_issue_says_and_nowhere_else():
    accurate, paper = Solver(preset="accurate").scheme, Solver(preset="paper").scheme
    assert accurate.iterations == paper.iterations == 4
    assert (accurate.wall, paper.wall) == ("calibrated", "source")
    assert (accurate.frozen_answer, paper.frozen_answer) == (1.0, 0.0)
    # 4/3 pi R^3 over 4 sqrt(2) 0.97^3 R^3.
    assert paper.volume_factor == pytest.approx(0.8113, abs=1e-4)


def test_what_the_user_sets_replaces_the_presets_value():
    scheme = Solver(preset="paper", iterations=7, volume_factor=1.0).scheme
    assert (scheme.iterations, scheme.volume_factor, scheme.wall) == (7, 1.0, "source")


@pytest.mark.parametrize("table", [{"relaxation": 0.0}, {"relaxation": 1e300}, {"damping_per_s": 1e300}])
def test_constants_out_of_their_range_are_refused(table):
    """No relaxation leaves a particle alone without a multiplier; 1e300 is infinite on the device."""
    (name,) = table
    with pytest.raises(ValidationError, match=name):
        Solver.model_validate(table)
