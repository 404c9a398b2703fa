import re

import pytest
from pydantic import ValidationError

from digitise.settings import CrackShape, NozzlePath
from sealtwin.core.facts import texts
from sealtwin.core.settings import doubts_of
from simulate.pour import Pour
from simulate.remarks import remarks_on
from simulate.settings import Fluid, Nozzle, SampleSlope, Solver
from simulate.setup.release_schedule import plan_releases
from simulate.setup_checks import resolved
from tests.support.small_fluids import path, sample_of, sealant, slot


@pytest.mark.parametrize(
    ("table", "fault"),
    [
        ({"U": 1.0, "viscosity_pa_s": 0.1, "freeze_after_s": 1.0}, "U cannot .* viscosity_pa_s"),
        ({"U": 1.0, "freeze_after_s": 0.0}, "freeze_after_s is 0"),
        ({"U": 1.0, "yield_stress_pa": 12.0, "yield_stress_most_pa": 5.0}, "yield_stress_most_pa is 5, .* which is 12"),
        # A flow index goes with a consistency and nothing else.
        ({"viscosity_pa_s": 0.5, "flow_index": 0.5}, "viscosity_pa_s cannot .* flow_index, .*consistency_pa_s_n"),
        ({"flow_index": 0.5}, "no viscosity .*consistency_pa_s_n"),
        ({"consistency_pa_s_n": 2.0}, "consistency_pa_s_n is 2: give flow_index"),
    ],
)
def test_fluid_settings_that_conflict_or_are_incomplete_are_refused(table, fault):
    with pytest.raises(ValidationError, match=fault):
        Fluid.model_validate({"freeze_after_s": "never"} | table)


@pytest.mark.parametrize("others", [{}, {"preset": "draft", "radius_mm": "auto"}])
def test_accurate_radius_mm_is_allowed_only_for_a_draft_with_a_given_radius(others):
    assert Solver(preset="draft", radius_mm=0.6, accurate_radius_mm=0.4).size_mm == 0.6
    with pytest.raises(ValidationError, match=r"accurate_radius_mm is 0\.4"):
        Solver.model_validate({"accurate_radius_mm": 0.4, **others})


@pytest.mark.parametrize(
    ("solver", "nozzle_mm", "radius_mm"),
    [
        ({"radius_mm": "auto"}, 2.4, 3.0 / 8),
        ({"preset": "draft"}, 2.4, 3.0 / 5.2),
        # A particle no wider than the nozzle it leaves.
        ({"preset": "draft"}, 1.0, 0.5),
        # Two particles that leave together take half of the frames.
        ({"preset": "draft"}, 2.2, 0.55),
        ({"radius_mm": "auto"}, 1.48, 3.0 / 8),
    ],
)
def test_an_automatic_particle_radius_follows_from_the_crack_and_the_nozzle(solver, nozzle_mm, radius_mm):
    crack, nozzle = slot(12.0, 3.0), Nozzle(diameter_mm=nozzle_mm)
    poured = sample_of(crack, path(crack[1], 0.1))
    _, chosen = resolved(poured, sealant(viscosity_pa_s=0.3), Solver.model_validate(solver), nozzle)
    assert chosen.size_mm == pytest.approx(radius_mm, rel=2e-3)


def test_a_long_thin_crack_gets_the_smallest_possible_radius_and_a_remark():
    crack = slot(900.0, 1.0)
    poured = sample_of(crack, path(crack[1], 2.0))
    fluid, solver = resolved(poured, sealant(viscosity_pa_s=0.3), Solver(), Nozzle(diameter_mm=2.4))
    assert 1.0 / 8 < solver.size_mm < 1.0 / 4
    schedule = plan_releases(poured.trajectory, solver.size_mm, 2.4, 0)
    remarks = remarks_on(Pour(poured, (fluid,), solver), schedule)
    assert "four particles across" in next(remarks).text


@pytest.mark.parametrize("table", [{"relaxation": 0.0}, {"relaxation": 1e300}, {"damping_per_s": 1e300}])
def test_solver_constants_out_of_range_are_refused(table):
    """Without relaxation a lone particle has no multiplier; 1e300 is infinite on the device."""
    (name,) = table
    with pytest.raises(ValidationError, match=name):
        Solver.model_validate(table)


@pytest.mark.parametrize(
    ("table", "slip"),
    [
        (Fluid(viscosity_pa_s=300.0), "viscosity_pa_s is 300, .* 50 Pa s: is it in mPa s"),
        (Fluid(viscosity_pa_s=0.3, density_kg_m3=1.69), "density_kg_m3 is 1.69, .*: is it in g/cm3"),
        (Nozzle(diameter_mm=6.0), "diameter_mm is 6, but is usually at most 5.8 mm"),
        (NozzlePath(speed_mm_s=0.04), "speed_mm_s is 0.04, .*: is it in m/s"),
        (SampleSlope(gradient_deg=-25.0), "gradient_deg is -25, .*: is it in percent"),
        (CrackShape(depth_mm=((0.0, 1.2), (9.0, 1.6))), "depth_mm is 1.6, but is usually at least 2.9 .*: is it in cm"),
        *((Fluid(viscosity_pa_s=real), "") for real in (0.001, 0.2, 5.0, 20.0)),  # Water, bitumen, cement paste, honey
        *((table, "") for table in (Nozzle(), NozzlePath(), SampleSlope(gradient_deg=12.0), CrackShape(depth_mm=3.0))),
    ],
)
def test_a_value_that_is_likely_in_another_unit_gives_a_warning(table, slip):
    assert re.fullmatch(f"{slip}.*" if slip else "", " ".join(texts(doubts_of(table, width_mm=2.9))))
