"""Remarks before a run on how a fluid will behave as particles or in this crack."""

import pytest

from sealtwin.core.facts import texts
from simulate.injection import Injection
from tests.support.small_fluids import injected, path, sealant, slot


def injection_of(**fluid) -> Injection:
    """A run of a fluid of 1,000 kg/m3 between walls 3.1 mm apart, of 0.2 s and the seconds to settle."""
    crack = slot(12.0)
    way, settle_s = path(crack[1], 0.02, speed_mm_s=40.0), fluid.pop("settle_s", 2.0)
    return injected(crack, way, sealant(density_kg_m3=1000.0, **fluid), radius_mm=0.6, settle_s=settle_s)


SINKS = "between walls 3.1 mm apart the sealant sinks by its own weight at up to"
LEVELS = "at any U, sealant levels like a thin liquid"
HOLDS = "supports the paste between walls 3.1 mm apart"
STANDS = {"age_s": [0.0, 9.0], "viscosity_pa_s": [1.0, 1.0], "yield_stress_pa": [20.0, 20.0]}
THINS = {"age_s": [0.0, 0.1], "viscosity_pa_s": [100.0, 0.5]}


@pytest.mark.parametrize(
    ("fluid", "begins", "says"),
    [
        ({"viscosity_pa_s": 0.001}, "viscosity_pa_s is 0.001: this is a viscosity of 1 mm2/s", "but it does not"),
        # It has none of the keys of the others; the remark once ended in StopIteration for it.
        (
            {"curve": {"age_s": [0.0, 9.0], "viscosity_pa_s": [0.001, 0.1]}},
            "curve begins thin: this is a viscosity of 1 mm2/s",
            "",
        ),
        # 9810 * 3.1^2 / 12e5
        ({"viscosity_pa_s": 100.0}, f"viscosity_pa_s is 100: {SINKS} 0.079 mm/s", ""),
        # tau_w = 15.2 Pa at the wall, m = 1/n: w/2 (tau_w / K)^m / (m + 2)
        ({"consistency_pa_s_n": 20.0, "flow_index": 0.5}, f"consistency_pa_s_n is 20: {SINKS} 0.22 mm/s", ""),
        # Bingham: w/2 tau_w/mu (1 - p)^2 (1 - (1 - p)/3) / 2 with p = 10/15.2
        ({"viscosity_pa_s": 2.0, "yield_stress_pa": 10.0}, f"viscosity_pa_s is 2: {SINKS} 0.61 mm/s", ""),
        # U = 30, with or without what freezes, is the paper's own.
        ({"U": 30.0}, f"U is 30: {LEVELS}.", "Viscous flow needs fluid.viscosity_pa_s."),
        ({"U": 30.0, "freeze_after_s": 2.58}, f"U is 30: {LEVELS} until it freezes. Viscous flow needs", ""),
        # Its weight overcomes 1000 * 9.81 * 3.1e-3 / 2 = 15.2 Pa between rough walls.
        ({"viscosity_pa_s": 1.0, "yield_stress_pa": 15.3}, "yield_stress_pa: a yield stress of 15.3 Pa", HOLDS),
        ({"viscosity_pa_s": 1.0, "yield_stress_pa": 30.0, "wall_share": 0.9}, "yield_stress_pa: a yield", HOLDS),
        ({"curve": STANDS}, f"curve: a yield stress of 20 Pa {HOLDS}", ""),
    ],
)
def test_a_remark_before_the_run_states_how_the_fluid_will_behave(fluid, begins, says):
    (remark,) = texts(injection_of(**fluid).remarks_on(0))
    assert remark.startswith(f"fluid.{begins}")
    assert says in remark


@pytest.mark.parametrize(
    "fluid",
    [
        {"viscosity_pa_s": 0.5},
        {"viscosity_pa_s": 100.0, "D_cm": 0},
        {"U": 300.0, "yield_stress_pa": 3.0},
        # At 0.5 Pa s it falls 16 mm in a second.
        {"curve": THINS},
        {"viscosity_pa_s": 100.0, "settle_s": 400.0},
    ],
)
def test_sealant_that_settles_slips_or_yields_gives_no_remark(fluid):
    assert not injection_of(**fluid).remarks_on(0)


@pytest.mark.parametrize(
    ("law", "age_s"),
    [
        # 15.2 Pa are reached in 0.15 s, in which the nozzle moves on by 9 mm, and paste of 1 Pa s sinks by 0.4 mm
        ({"viscosity_pa_s": 1.0, "structuration_pa_per_s": 100.0}, "0.15"),
        ({"viscosity_pa_s": 1.0, "structuration_pa_per_s": 100.0, "yield_stress_most_pa": 15.0}, None),
        # Thin paste has sunk by then; but the nozzle moves on by 0.6 widths in 0.03 s, and by 3 in 0.15 s
        ({"viscosity_pa_s": 0.02, "structuration_pa_per_s": 500.0, "yield_stress_most_pa": 20.0}, "0.031"),
        ({"U": 30.0, "structuration_pa_per_s": 100.0}, None),
        ({"curve": {"age_s": [0.0, 1.0], "viscosity_pa_s": [1.0, 1.0], "yield_stress_pa": [0.0, 100.0]}}, "0.15"),
    ],
)
def test_paste_that_stiffens_before_sinking_gives_a_remark(law, age_s):
    remarks = texts(injection_of(**law).remarks_on(0))
    stands = [remark for remark in remarks if remark.partition(": ")[2].startswith("from an age of")]
    assert len(stands) == (age_s is not None)
    if age_s is not None:
        assert f"from an age of {age_s} s" in stands[0]
        assert "the first paste is 0.2 s old" in stands[0]
        assert "settle_s" not in str(remarks), "it sinks no further"
