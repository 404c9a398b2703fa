"""Inputs drawn by the fast model: a linear one gives the closed form, a kill loses no part, and the report names it."""

from dataclasses import replace
from functools import partial
from math import hypot
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from digitise.settings import Dispensed
from sealtwin.core import files
from sealtwin.core.errors import InputError
from sealtwin.core.progress import Progress
from sealtwin.study import extra_runs, moved_inputs
from sealtwin.study.extra_runs import vary
from sealtwin.study.moved_inputs import PART, Base, draw, moved_sample, refuse_immovable, takes_draws
from sealtwin.study.pipeline import run_stages
from sealtwin.trial.validate_stage import SPREAD
from simulate.slot import run as slot_run
from tests.support.report_stubs import leave_out_pages
from tests.support.tiny_study import TRIAL, job_in, run_tiny
from validate.uncertainty.computed import drawn_inputs

PASTE = 'viscosity_pa_s = 0.05\nyield_stress_pa = 1.0\nfreeze_after_s = "never"'
FAST = TRIAL.replace("U = 30.0\nD_cm = 0.3\nfreeze_after_s = 0.2", PASTE).replace(
    "[solver]", '[solver]\nmodel = "slot"'
)
DECLARED = "\n[uncertainty]\nvolume_ml = 0.01\ndepth_mm = 0.5\n"
MM_PER_ML, MM_PER_MM, RUNS, UNFIT = 30.0, 0.3, 4 * PART, ("A mound.",)


def base_of(path: Path) -> Base:
    with job_in(path) as job:
        return Base.of(job)


@pytest.fixture(scope="module")
def fast(tmp_path_factory) -> Path:
    return run_tiny(tmp_path_factory.mktemp("lab"), FAST + DECLARED)


@pytest.fixture
def linear(monkeypatch):
    """A level that is linear in the volume given and in the depth, in place of the fast model's."""

    def bed_of(pour, paste, trajectory, **coarser):
        if not coarser:
            return whole(pour, paste, trajectory)
        depth_mm, ends_mm = pour.sample.solid.sections.depth_mm.mean(), np.array([0.0, pour.sample.outline.length_mm])
        level_mm = MM_PER_ML * trajectory.dispensed_mm3 / 1e3 - MM_PER_MM * depth_mm
        return SimpleNamespace(sections=SimpleNamespace(s_mm=ends_mm), level_mm=np.full(2, level_mm))

    whole = slot_run.bed_of
    monkeypatch.setattr(slot_run, "bed_of", bed_of)
    monkeypatch.setattr(extra_runs, "cores", lambda: 0)
    monkeypatch.setattr(extra_runs, "draw", partial(draw, runs=RUNS))


def test_of_a_linear_model_u_input_is_the_closed_form(fast, linear, monkeypatch):
    leave_out_pages(monkeypatch)
    with job_in(fast) as job:
        assert vary(job)
        assert not vary(job)
        result = run_stages(job, ("validate",)).result
    figures = files.read_json(fast / "comparison.json")["uncertainty"]
    volume_mm, depth_mm = MM_PER_ML * 0.01, -MM_PER_MM * 0.5
    assert [one["mean_level_mm"] for one in figures["inputs"]] == pytest.approx([volume_mm, depth_mm], rel=1e-3)
    assert figures["mean_level"]["inputs_mm"] == pytest.approx(0.98 * hypot(volume_mm, depth_mm), rel=0.03)
    share = volume_mm**2 / (volume_mm**2 + depth_mm**2)
    assert [one["share"] for one in figures["inputs"]] == pytest.approx([share, 1 - share], abs=1e-3)
    # Named beside each component; of a level by the fast model no sentence of V&V 20.
    assert {one["model"] for one in figures["inputs"]} == {"slot"}
    inputs = [one["name"] for one in figures["budget"]["parts"] if one["kind"] == "inputs"]
    assert inputs == [f"{name}, by the fast model" for name in ("volume given", "the crack's depth", "inputs together")]
    assert figures["input_draws"]["runs"] == RUNS
    assert figures["mean_level"]["numerics_mm"] is None
    assert "the fast model" in figures["findings"][0]["text"]
    assert result.comparison is not None
    assert result.comparison.model_dump(mode="json")["uncertainty"] == figures
    assert len(files.read_json(fast / SPREAD)["draws"]["moved_mm"]) == RUNS


def test_draws_of_all_parts_are_those_of_one_after_the_other(fast, linear):
    """Broken on purpose with all parts in the rows of the first, the second is empty."""
    base = base_of(fast)
    moved_mm = draw(base, 0, Progress(), 2 * PART).moved_mm
    inputs = drawn_inputs(base.inputs, 2 * PART)
    steps = moved_inputs._steps(base, dict(zip(base.inputs, inputs[PART].tolist(), strict=True)))
    own_mm, level_mm = (moved_inputs.level_of(base, each, np.zeros(1)) for each in ({}, steps))
    assert moved_mm[PART] == pytest.approx(float((level_mm - own_mm)[0]), abs=1e-4)


def test_the_fast_model_itself_is_moved(fast):
    """More sealant stands higher by its volume over the crack's area, and a deeper crack lowers its whole bed."""
    base = base_of(fast)
    outline = base.sample.outline
    s_mm = np.linspace(0, outline.length_mm, 101)
    own = moved_inputs.level_of(base, {}, s_mm)
    assert (moved_inputs.level_of(base, {"volume_ml": 0.01}, s_mm) - own).mean() == pytest.approx(
        10 / outline.length_mm / outline.mean_width_mm, rel=0.15
    )
    assert (moved_inputs.level_of(base, {"depth_mm": 0.5}, s_mm) - own).mean() == pytest.approx(-0.5, abs=0.05)
    # Without yield stress there is none to draw below 0, and a viscosity is never below 0 either.
    unsure = _unsure(base, yield_stress_pa=50.0, viscosity_percent=80.0)
    steps = moved_inputs._steps(unsure, {"yield_stress_pa": -3.0, "viscosity_percent": -3.0})
    assert steps == {"yield_stress_pa": -1.0, "viscosity_percent": pytest.approx(100 * (1.8**-3 - 1))}
    moved_inputs.level_of(unsure, steps, s_mm)


def test_walls_are_moved_to_take_up_less_stress_and_never_more_than_all_of_it(fast):
    """Paste that slides levels out further."""
    base = _unsure(base_of(fast), wall_share=0.2)
    s_mm = np.linspace(0, base.sample.outline.length_mm, 101)
    own_mm, slides_mm, sticks_mm = (
        moved_inputs.level_of(base, steps, s_mm) for steps in ({}, {"wall_share": -0.4}, {"wall_share": 0.2})
    )
    assert np.ptp(slides_mm) < 0.95 * np.ptp(own_mm)
    assert np.array_equal(sticks_mm, own_mm)


@pytest.mark.parametrize("weighed", [False, True])
def test_a_late_pump_leaves_the_beginning_empty_and_the_weighed_sealant_is_then_elsewhere(fast, weighed):
    base = base_of(fast)
    if weighed:
        mass_g = base.sample.trajectory.dispensed_mm3 / 1e3
        weighed = Dispensed(mass_g=mass_g, mass_sd_g=0.01, density_kg_m3=1000.0, density_sd_kg_m3=1.0)
        path = base.trial.path.model_copy(update={"weighed": weighed})
        base = replace(base, trial=base.trial.model_copy(update={"path": path}))
    own, late, early = (
        moved_sample(base, {"pump_delay_s": delay_s}, meshed=False).trajectory for delay_s in (0.0, 0.5, -0.5)
    )
    assert np.array_equal(early.t_s, own.t_s)
    assert np.array_equal(early.flow_mm3_s, own.flow_mm3_s)
    share = 1.0 if weighed else 1 - 0.5 / own.duration_s
    assert late.dispensed_mm3 == pytest.approx(share * own.dispensed_mm3)
    assert late.t_s[late.giving][0] == pytest.approx(0.5)


def test_an_input_at_its_end_is_moved_the_other_way_by_twice_its_uncertainty(tmp_path):
    """An effect is half the difference of both moves."""
    particles = FAST.replace('model = "slot"\n', "") + "\n[uncertainty]\nwall_share = 0.2\npump_delay_s = 0.1\n"
    variants = extra_runs._variants(base_of(run_tiny(tmp_path, particles)), designed=True)
    for name, moves in (("wall_share", [-0.4, 0.0]), ("pump_delay_s", [0.0, 0.2])):
        assert sorted({steps[name] for steps, *_ in variants if name in steps}) == pytest.approx(moves)


def test_a_delay_of_the_whole_pour_is_refused_and_a_share_of_walls_beside_their_drag(fast):
    """A draw could leave no flow at all."""
    base = base_of(fast)
    flows_s = base.sample.trajectory.duration_s
    refuse_immovable(_unsure(base, pump_delay_s=0.2 * flows_s))
    with pytest.raises(InputError, match=r"\[uncertainty\] pump_delay_s = "):
        refuse_immovable(_unsure(base, pump_delay_s=0.3 * flows_s))
    trial = _unsure(base, wall_share=0.1).trial
    drags = trial.model_copy(update={"fluid": trial.given_fluid.model_copy(update={"D_cm": 0.3})})
    with pytest.raises(InputError, match=r"\[uncertainty\] wall_share: fluid.D_cm"):
        refuse_immovable(replace(base, trial=drags))


def _unsure(base: Base, **uncertainty: float) -> Base:
    trial = base.trial.model_copy(update={"uncertainty": base.trial.uncertainty.model_copy(update=uncertainty)})
    return replace(base, trial=trial)


def test_a_draw_that_cannot_be_is_told_with_its_inputs(fast):
    fault = moved_inputs.levels_of(base_of(fast), [{"volume_ml": -1.0}], np.zeros(1))
    assert isinstance(fault, str)
    assert "volume_ml -1" in fault
    assert "uncertainty.differences" in fault


@pytest.mark.parametrize(
    ("own", "declared", "unfit", "drawn"),
    [(None, None, (), True), (None, None, UNFIT, False), (None, "particles", (), False), ("slot", None, UNFIT, True)],
)
def test_the_fast_model_is_taken_in_its_domain_or_where_declared(fast, monkeypatch, own, declared, unfit, drawn):
    monkeypatch.setattr(moved_inputs, "fast_level", lambda _: (None, unfit))
    base = base_of(fast)
    changes = {"solver.model": own, "uncertainty.differences": declared}
    assert takes_draws(replace(base, trial=base.changed(changes))) is drawn
    with pytest.raises(InputError, match=r"trial.toml: uncertainty.differences.*solver.model"):
        takes_draws(replace(base, trial=base.changed({"uncertainty.differences": "particles"})))
