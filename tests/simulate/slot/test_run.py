"""A run of the fast model with a trial's settings: its record, its domain, and what it refuses."""

import re
from dataclasses import replace
from typing import Any

import pytest

from sealtwin.core import record_files
from sealtwin.core.errors import InputError
from sealtwin.core.records import Profile, Run
from simulate.injection import prepare
from simulate.settings import Fluid, Nozzle, Solver
from simulate.slot.fitness import FULLEST, fitness_of
from simulate.slot.flux import HerschelBulkley
from simulate.slot.run import pour
from tests.fluids import path, sample_of, slot

SLOT = Solver(model="slot", settle_s=2.0)


def poured(volume_ml: float = 1.2, **fluid: Any) -> tuple[Run, Profile]:
    crack = slot(40.0)
    settings: dict[str, Any] = {"viscosity_pa_s": 0.3, "yield_stress_pa": 4.0, "freeze_after_s": "never", **fluid}
    trajectory = path(crack[1], volume_ml, trim_mm=6.0)
    return pour(sample_of(crack, trajectory), Fluid.model_validate(settings), SLOT, Nozzle(), seed=0, advise=True)


def test_a_run_is_recorded_without_particles_and_read_again(tmp_path):
    run, profile = poured()
    record_files.write_run(tmp_path, run)
    record_files.write_profile(tmp_path, profile)
    again = record_files.read_run(tmp_path)
    assert again.fast_fill == run.fast_fill
    assert run.fast_fill is not None
    assert run.unfit == ()
    assert len(again.position_mm) == 0
    assert again.dispensed_volume_mm3 == pytest.approx(1200.0)
    assert run.fast_fill.in_crack_mm3 + run.fast_fill.above_face_mm3 + run.fast_fill.in_flight_mm3 == pytest.approx(
        1200.0
    )
    assert -16.0 < profile.level_mm.mean() < 0.0
    assert (profile.s_mm[0], profile.s_mm[-1]) == (0.0, 40.0)


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"yield_stress_pa": 40.0}, "stacks under the nozzle"),
        ({"volume_ml": 3.0}, "runs over the face"),
        ({"D_cm": 0.3}, "drag on particles"),
    ],
)
def test_a_case_outside_the_domain_says_why(change: dict[str, Any], why: str):
    run, _ = poured(**change)
    assert run.fast_fill is not None
    assert any(why in sentence for sentence in run.unfit)


def test_a_level_over_the_face_is_outside_and_what_it_asks_for_is_inside():
    """Stiff paste stands on the face, although it would not fill the crack."""
    run, profile = poured(volume_ml=1.6, yield_stress_pa=11.0)
    assert run.fast_fill is not None
    assert run.fast_fill.above_mm == pytest.approx(profile.level_mm.max(), abs=0.05)
    assert run.fast_fill.fill < FULLEST
    assert any("above the face" in sentence for sentence in run.unfit)
    found = re.search(r"yield_stress_pa = ([\d.]+) or less", run.unfit[-1])
    assert found is not None
    share = re.search(r"path\.fill = ([\d.]+)", run.unfit[-1])
    volume_ml = 1.6 * float(share[1]) / run.fast_fill.fill if share else 1.6
    again, _ = poured(volume_ml=volume_ml, yield_stress_pa=float(found[1]))
    assert again.fast_fill is not None
    assert again.unfit == ()


def test_paste_that_holds_a_mound_by_itself_is_outside_in_a_crack_of_any_width():
    """4 tau / rho g above 4 mm is above 16.6 Pa at 1690 kg/m3: decisions 0138 and 0151."""
    crack = slot(40.0, 12.0)
    solid, outline = crack
    paste = HerschelBulkley(1690.0, 16.4, 0.3)
    trajectory = path(outline, 2.0, trim_mm=6.0)
    assert "mound" not in str(fitness_of(solid, outline, trajectory, paste).unfit)
    stiffer = replace(paste, yield_stress_pa=16.8)
    assert "mound" in str(fitness_of(solid, outline, trajectory, stiffer).unfit)


@pytest.mark.parametrize(("room", "fit"), [(1.0, True), (1.04, True), (1.06, False), (0.94, False)])
def test_a_crack_with_room_that_sections_leave_out_is_outside(room: float, fit: bool):
    """Such as side cracks, or closed tips of walls that open downward; 5 % are allowed."""
    solid, outline = slot(40.0)
    roomy = replace(solid, cavity_volume_mm3=room * solid.cavity_volume_mm3)
    found = fitness_of(roomy, outline, path(outline, 1.2, trim_mm=6.0), HerschelBulkley(1690.0, 4.0, 0.3))
    assert ("volume" not in str(found.unfit)) is fit


@pytest.mark.parametrize("change", [{"freeze_after_s": 2.0}, {"structuration_pa_per_s": 0.1}])
def test_sealant_that_ages_is_refused(change: dict[str, Any]):
    with pytest.raises(InputError, match="does not model the age"):
        poured(**change)


def test_u_counts_as_the_viscosity_that_it_amounts_to():
    """U = 30 is 32.2 mm2/s in the paper's frame, at 320 mm3/s; frames go with the flow, here 1200 mm3 in 7 s."""
    run, _ = poured(viscosity_pa_s=None, U=30.0)
    assert run.health.viscosity_m2_s == pytest.approx(32.2e-6 * 1200 / 7 / 320, rel=0.02)


def test_a_u_whose_particles_cannot_be_released_asks_for_a_viscosity():
    """The fast model has no particles: a refusal of their number alone would say nothing."""
    crack, fluid = slot(40.0), Fluid(U=30.0, D_cm=0.3, yield_stress_pa=3.0, freeze_after_s="never")
    fine = SLOT.model_copy(update={"radius_mm": 0.03})
    with pytest.raises(InputError, match=r"Give fluid\.viscosity_pa_s"):
        pour(sample_of(crack, path(crack[1], 1.2, trim_mm=6.0)), fluid, fine, Nozzle(), seed=0)


def test_u_without_a_yield_stress_is_refused_as_it_is_no_viscosity():
    crack, fluid = slot(40.0), Fluid(U=30.0, D_cm=0.3, freeze_after_s="never")
    with pytest.raises(InputError, match=r"fluid\.U is 30: .* fluid\.viscosity_pa_s"):
        pour(sample_of(crack, path(crack[1], 1.2, trim_mm=6.0)), fluid, SLOT, Nozzle(), seed=0)


def test_particles_are_not_run_in_its_place():
    crack = slot(40.0)
    fluid = Fluid(viscosity_pa_s=0.3, freeze_after_s="never")
    with pytest.raises(InputError, match="only particles"):
        prepare(*crack, path(crack[1], 1.0), [fluid], SLOT, Nozzle(), seed=0, device="cpu")
