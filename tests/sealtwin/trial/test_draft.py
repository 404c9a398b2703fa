from pathlib import Path
from typing import Any

import pytest

from sealtwin.core.records import Sample
from sealtwin.trial.trial_file import Trial, drafted
from simulate.material_file import Material
from simulate.setup.release_schedule import plan_releases
from simulate.setup_checks import rheology_of
from tests.support.small_fluids import injected, path, sample_of, slot

SEEN = {"mesh": {"file": Path("crack.stl"), "data": "synthetic", "units": "mm"}, "name": "tiny"}


def sample(width_mm: float = 3.1) -> Sample:
    crack = slot(20.0, width_mm)
    return sample_of(crack, path(crack[1], 0.3))


def trial_of(fluid: dict[str, Any], **solver: Any) -> Trial:
    return Trial.model_validate({**SEEN, "fluid": {"freeze_after_s": "never", **fluid}, "solver": solver})


@pytest.mark.parametrize(
    "fluid",
    [{"U": 30.0, "D_cm": 0.3, "yield_stress_pa": 12.0}, {"viscosity_pa_s": 0.3}, {"viscosity_pa_s": 2.0, "D_cm": 0.1}],
)
def test_a_draft_has_the_trials_viscosity_and_drag_per_time(fluid):
    poured, trial = sample(), trial_of(fluid, radius_mm=0.4)
    draft = drafted(trial, poured)
    assert draft.solver.preset == "draft"
    assert draft.solver.size_mm == pytest.approx(3.1 / 5.2, rel=2e-3)
    seen = []
    for one in (trial, draft):
        radius_mm = one.solver.size_mm
        frame_s = plan_releases(poured.trajectory, radius_mm, one.nozzle.diameter_mm, one.seed).frame_s
        weights = rheology_of(one.given_fluid, 0.4 * radius_mm, frame_s)
        seen.append((weights.viscosity_pa_s, weights.yield_cm2_s2, weights.wall_weight_cm / frame_s))
    assert seen[0] == pytest.approx(seen[1], rel=1e-6)
    crack = poured.solid, poured.outline
    run = injected(crack, poured.trajectory, trial.given_fluid, preset="draft", radius_mm=0.4)
    assert run.pour.solver == draft.solver
    assert run.pastes[0].viscosity_pa_s == pytest.approx(seen[0][0])
    assert draft.model_dump(exclude={"fluid", "solver"}) == trial.model_dump(exclude={"fluid", "solver"})


def test_a_drafts_particles_are_not_smaller_than_the_trials_and_not_wider_than_the_nozzle():
    fluid = {"viscosity_pa_s": 0.3}
    assert drafted(trial_of(fluid, radius_mm=0.7), sample()).solver.size_mm == 0.7
    assert drafted(trial_of(fluid, radius_mm=0.4), sample(9.0)).solver.size_mm == 1.2


def test_a_calibrated_material_keeps_its_radius():
    calibrated = {"method": "calibration", "date": "2026-11-01", "data": "measured", "not_for": ["flow"]}
    paste = {"yield_stress_pa": 12.0, "yield_stress_error_pa": 1.0, "yield_stress_95_pa": (10.0, 14.0)}
    rest = {"viscosity_pa_s": 0.3, "density_kg_m3": 1690.0, "density_error_kg_m3": 0.0, "radius_mm": 0.5}
    rest["viscosity_error_percent"] = 10.0
    trial = trial_of({"viscosity_pa_s": 0.3}, radius_mm=0.5)
    fluid = trial.given_fluid.model_copy(update={"material": Material.model_validate({**calibrated, **paste, **rest})})
    assert drafted(trial.model_copy(update={"fluid": fluid}), sample()).solver.size_mm == 0.5
