"""Flow between plates and free clouds, by the settings of a trial file; ``benchmarks/channels.py`` has all of them."""

import pytest
from pydantic import ValidationError

from benchmarks.channels import CLOUDS, Channel, drift
from simulate.injection import prepare
from simulate.settings import Fluid, Nozzle, Solver
from simulate.setup.rheology import added_viscosity
from tests.fluids import path, slot


@pytest.mark.parametrize("cloud", CLOUDS)
def test_viscosity_neither_pushes_nor_turns_a_cloud(cloud):
    """Without the last shift of a solve the first is 1e-4; with pairs that pull any way the second is 0.1."""
    pushed, turned = drift(*CLOUDS[cloud], alone=True)
    assert pushed < 1e-5
    assert turned < 0.01


@pytest.mark.parametrize(
    ("channel", "off"),
    [
        (Channel(5.0, 322.0), 0.1),
        (Channel(5.0, 3000.0), 0.1),
        (Channel(8.0, 32.0, 0.5), 0.1),
        (Channel(8.0, 226.0, 0.2, index=0.5, radius_mm=0.25), 0.1),
    ],
)
def test_a_fluid_flows_between_plates_as_its_closed_form_says(channel, off):
    """Viscous, Bingham's, and one that thins. A yield stress off by a tenth is 15 % of the third's flow.

    Particles that move before the viscosity acts are 1.5 and 5.5 times as fast in the first two.
    """
    mean_mm_s, exact_mm_s = channel.flow(0.15)
    assert mean_mm_s / exact_mm_s == pytest.approx(1.0, abs=off)


def test_paste_stands_between_plates_that_bear_less_than_its_yield_stress():
    """Awake: it creeps at the slowest shear that float32 allows, 0.002 /s."""
    creep_mm_s, _ = Channel(8.0, 32.0, 1.2, mean_mm_s=6.0).flow(0.15, sleep=False)
    assert 0 <= creep_mm_s < 0.01


@pytest.mark.parametrize(
    ("table", "fault"),
    [
        (
            {"viscosity_pa_s": 0.5, "flow_index": 0.5},
            "flow_index is 0.5 and viscosity_pa_s 0.5: give consistency_pa_s_n",
        ),
        ({"U": 30.0, "flow_index": 0.5}, "flow_index is 0.5 and U 30"),
        ({"flow_index": 0.5}, "flow_index is 0.5: give consistency_pa_s_n"),
        ({"consistency_pa_s_n": 2.0}, "consistency_pa_s_n is 2 and flow_index 1: give viscosity_pa_s"),
        ({"consistency_pa_s_n": 2.0, "flow_index": 2.5}, "flow_index"),
    ],
)
def test_a_flow_index_goes_with_a_consistency_and_nothing_else(table, fault):
    with pytest.raises(ValidationError, match=fault):
        Fluid.model_validate({"freeze_after_s": "never", **table})


def test_a_fluid_that_its_particles_thicken_is_told_before_the_run():
    """Water of 1 mm2/s, at particles of 0.6 mm."""
    crack = slot(12.0)
    trajectory = path(crack[1], 0.02, speed_mm_s=40.0)
    said, recorded = {}, {}
    for viscosity_pa_s in (0.001, 0.1):
        fluid = Fluid(viscosity_pa_s=viscosity_pa_s, density_kg_m3=1000.0, freeze_after_s="never")
        injection = prepare(*crack, trajectory, [fluid], Solver(radius_mm=0.6), Nozzle(), seed=0, device="cpu")
        said[viscosity_pa_s] = injection.remarks()
        recorded[viscosity_pa_s] = injection.engine.step_s
    (remark,) = said[0.001]
    added_mm2_s = 100 * added_viscosity(0.06, recorded[0.001])
    assert remark.startswith("fluid.viscosity_pa_s is 0.001: 1 mm2/s")
    assert f"acts as one of {1 + added_mm2_s:.3g} mm2/s" in remark
    assert not said[0.1]


def test_a_thin_fluid_of_a_table_is_told_too():
    """Such a fluid has none of the keys of the others; the remark once ended in StopIteration for it."""
    crack = slot(12.0)
    table = {"age_s": [0.0, 9.0], "viscosity_pa_s": [0.001, 0.1]}
    fluid = Fluid.model_validate({"curve": table, "density_kg_m3": 1000.0, "freeze_after_s": "never"})
    trajectory = path(crack[1], 0.02, speed_mm_s=40.0)
    injection = prepare(*crack, trajectory, [fluid], Solver(radius_mm=0.6), Nozzle(), seed=0, device="cpu")
    (remark,) = injection.remarks()
    assert remark.startswith("fluid.curve begins thin: 1 mm2/s")


def test_sealant_too_thick_to_sink_is_told_before_the_run():
    """1e5 mm2/s between walls 3.1 mm apart: 9810 * 3.1^2 / 12e5 = 0.08 mm/s. With U it is another matter."""
    crack = slot(12.0)
    trajectory = path(crack[1], 0.02, speed_mm_s=40.0)
    said = {}
    for name, fluid in {
        "thick": {"viscosity_pa_s": 100.0},
        "thick and long": {"viscosity_pa_s": 100.0, "settle_s": 400.0},
        "thin": {"viscosity_pa_s": 1.0},
        "by U": {"U": 1e5, "D_cm": 0.3},
        "slipping": {"viscosity_pa_s": 100.0, "D_cm": 0.0},
    }.items():
        solver = Solver(radius_mm=0.6, settle_s=fluid.pop("settle_s", 2.0))
        liquid = Fluid.model_validate({**fluid, "density_kg_m3": 1000.0, "freeze_after_s": "never"})
        injection = prepare(*crack, trajectory, [liquid], solver, Nozzle(), seed=0, device="cpu")
        said[name] = injection.remarks()
    (remark,) = said.pop("thick")
    assert remark.startswith("fluid.viscosity_pa_s is 100: between walls 3.1 mm apart")
    assert "0.079 mm/s at most" in remark
    assert said == {"thick and long": [], "thin": [], "by U": [], "slipping": []}


def remarks_of(**fluid) -> list[str]:
    """Remarks on a fluid of 1,000 kg/m3 between walls 3.1 mm apart, in a run of 2.2 s."""
    crack = slot(12.0)
    asked = Fluid.model_validate({**fluid, "density_kg_m3": 1000.0, "freeze_after_s": "never"})
    trajectory = path(crack[1], 0.02, speed_mm_s=40.0)
    solver = Solver(radius_mm=0.6, settle_s=2.0)
    return prepare(*crack, trajectory, [asked], solver, Nozzle(), seed=0, device="cpu").remarks()


def test_paste_that_stands_between_the_walls_is_told_before_the_run():
    """Its weight overcomes 1000 * 9.81 * 3.1e-3 / 2 = 15.2 Pa, with U as well."""
    for law in ({"viscosity_pa_s": 1.0}, {"U": 30.0}, {"viscosity_pa_s": 1.0, "D_cm": 0.3}):
        (remark,) = remarks_of(**law, yield_stress_pa=15.3)
        assert remark.startswith("fluid.yield_stress_pa: 15.3 Pa hold paste up between walls 3.1 mm apart")
        assert "15 Pa" in remark
        assert not remarks_of(**law, yield_stress_pa=15.1)
    table = {"age_s": [0.0, 9.0], "viscosity_pa_s": [1.0, 1.0], "yield_stress_pa": [20.0, 20.0]}
    (remark,) = remarks_of(curve=table)
    assert remark.startswith("fluid.curve: 20 Pa hold paste up")


def test_a_curve_that_thins_sinks_by_what_it_becomes():
    """100 Pa s for good sinks by a fraction of a millimetre; at 0.5 Pa s it falls 16 mm in a second."""
    thick, thins = ({"age_s": [0.0, 0.1], "viscosity_pa_s": [100.0, last]} for last in (100.0, 0.5))
    (remark,) = remarks_of(curve=thick)
    assert remark.startswith("fluid.curve is thick")
    assert "0.079 mm/s at most" in remark
    assert not remarks_of(curve=thins)


def test_shorter_substeps_add_more():
    assert added_viscosity(0.04, 1e-3) > added_viscosity(0.04, 2e-3) > added_viscosity(0.025, 2e-3)
