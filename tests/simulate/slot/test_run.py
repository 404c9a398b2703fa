"""A run of the fast model with a trial's settings: its domain, its refusals and its callers."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sealtwin.core.errors import InputError
from sealtwin.core.records import Profile, Run, Sample
from simulate.injection import ComputeOptions, prepare
from simulate.pour import Pour
from simulate.run import fill, fill_each
from simulate.settings import FAST_READS, Fluid, SampleSlope, Solver
from simulate.slot.fill import HerschelBulkley
from simulate.slot.fitness import FULLEST, fitness_of
from simulate.slot.run import pour
from tests.support.small_fluids import path, sample_of, slot

FAST = Solver(model="slot", radius_mm=0.4, settle_s=2.0)
PASTE: dict[str, Any] = {"viscosity_pa_s": 0.3, "yield_stress_pa": 4.0, "freeze_after_s": "never"}


def poured(volume_ml: float = 1.2, solver: Solver = FAST, **fluid: Any) -> tuple[Run, Profile]:
    return pour(Pour(sample(volume_ml), (Fluid.model_validate(PASTE | fluid),), solver))


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ({"yield_stress_pa": 40.0}, "slope"),
        ({"volume_ml": 3.0}, "overfull"),
        # Stiff paste stands on the face, although it would not fill the crack.
        ({"volume_ml": 1.6, "yield_stress_pa": 11.0}, "above-face"),
    ],
)
def test_a_trial_outside_the_domain_of_the_fast_model_is_unfit_with_a_reason(change: dict[str, Any], key: str):
    run, profile = poured(**change)
    assert f"unfit.{key}" in [why.key for why in run.unfit]
    assert run.fast_fill is not None
    assert (run.fast_fill.fill > FULLEST) == (key == "overfull")
    if key == "above-face":
        assert run.fast_fill.above_mm == pytest.approx(profile.level_mm.max(), abs=0.05)


@pytest.mark.parametrize(("room", "fit"), [(1.04, True), (1.06, False), (0.94, False)])
def test_a_cavity_whose_volume_differs_by_5_percent_from_its_sections_is_unfit(room: float, fit: bool):
    """Side cracks, or closed tips of walls that widen downward, make such a difference."""
    solid, outline = slot(40.0)
    roomy = replace(solid, cavity_volume_mm3=room * solid.cavity_volume_mm3)
    fitness = fitness_of(roomy, outline, path(outline, 1.2, trim_mm=6.0), HerschelBulkley(1690.0, 4.0, 0.3))
    assert ("volume" not in str(fitness.unfit)) is fit


POWER: dict[str, Any] = {"viscosity_pa_s": None, "consistency_pa_s_n": 0.3, "flow_index": 0.5}
AGED: dict[str, Any] = {"viscosity_pa_s": None, "yield_stress_pa": 0.0}
FIELDS: dict[str, tuple[dict[str, Any], Any]] = {
    "U": ({"viscosity_pa_s": None, "U": 30.0}, 300.0),
    "consistency_pa_s_n": (POWER, 3.0),
    "flow_index": (POWER, 0.9),
    "curve": (AGED, {"age_s": [0, 9], "viscosity_pa_s": [0.3, 3]}),
    "D_cm": ({}, 0.3),
    "wall_share": ({}, 0.5),
    "viscosity_pa_s": ({}, 30.0),
    "density_kg_m3": ({}, 1000.0),
    "yield_stress_pa": ({}, 8.0),
    "structuration_pa_per_s": ({}, 0.1),
    "yield_stress_most_pa": ({}, 20.0),
    "freeze_after_s": ({}, 2.0),
}
"""For each setting of a fluid except material: the settings beside it, and a value that changes the run."""


@pytest.mark.parametrize("name", sorted(Fluid.model_fields.keys() - {"material"}))
def test_the_fast_model_uses_or_refuses_every_setting_of_a_fluid(name: str):
    beside, value = FIELDS[name]
    if name not in FAST_READS:
        with pytest.raises(InputError, match=rf"fluid\.{name}: "):
            poured(**{**beside, name: value})
        return
    run, level = poured(**{**beside, name: value})
    named = any(f"fluid.{name} " in sentence.text for sentence in run.unfit)
    assert named or np.abs(level.level_mm - poured(**beside)[1].level_mm).max() > 0.05


@pytest.mark.parametrize(
    ("change", "solver", "says"),
    [
        # The fast model has no particles: a refusal of their number alone would say nothing.
        ({"viscosity_pa_s": None, "U": 30.0, "D_cm": 0.3}, {"radius_mm": 0.03}, r"Give fluid\.viscosity_pa_s"),
        ({"viscosity_pa_s": None, "U": 30.0, "yield_stress_pa": 0.0}, {}, r"fluid\.U is 30: .* fluid\.viscosity_pa_s"),
    ],
)
def test_a_sealant_that_the_fast_model_cannot_compute_is_refused(change, solver, says):
    with pytest.raises(InputError, match=says):
        poured(**change, solver=FAST.model_copy(update=solver))


def test_the_viscosity_weight_u_is_converted_to_its_equivalent_viscosity():
    """U = 30 is 32.2 mm2/s at the paper's flow of 320 mm3/s, and proportional to the flow, here 1200 mm3 in 7 s."""
    run, _ = poured(viscosity_pa_s=None, U=30.0)
    assert run.health.viscosity_m2_s == pytest.approx(32.2e-6 * 1200 / 7 / 320, rel=0.02)


def test_the_particle_solver_refuses_a_trial_for_the_fast_model():
    crack = slot(40.0)
    fluid = Fluid(viscosity_pa_s=0.3, freeze_after_s="never")
    with pytest.raises(InputError, match="only particles"):
        prepare(Pour(sample_of(crack, path(crack[1], 1.0)), (fluid,), FAST))


def sample(volume_ml: float) -> Sample:
    crack = slot(40.0)
    return sample_of(crack, path(crack[1], volume_ml, trim_mm=6.0))


def test_the_low_end_of_a_sloping_sample_has_the_higher_level_in_the_fast_model():
    """With a gradient of 6 degrees thin paste runs towards -x, where its level is over 1 mm higher."""
    level = Pour(sample(1.2), (Fluid.model_validate(PASTE | {"yield_stress_pa": 1.0}),), FAST)
    sloped = replace(level, slope=SampleSlope(gradient_deg=6.0))
    _, bed = fill(level)
    alone, (each,) = fill(sloped), fill_each(sloped, ComputeOptions())
    assert isinstance(each, tuple)
    for run, profile in (alone, each):
        assert run.settings["sample"] == sloped.slope.model_dump()
        higher_mm = profile.level_mm - bed.level_mm
        assert higher_mm[:20].mean() > 1 > -1 > higher_mm[-20:].mean()
