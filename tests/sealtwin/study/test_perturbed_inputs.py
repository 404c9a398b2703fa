"""Uncertain inputs, drawn at random and propagated to the level by the fast model."""

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
from sealtwin.study import perturbed_inputs, uncertainty_runs
from sealtwin.study.perturbed_inputs import PART, Base, draw, moved_sample, refuse_immovable, takes_draws
from sealtwin.study.pipeline import run_stages
from sealtwin.study.study_folder import OUTCOME
from sealtwin.study.uncertainty_runs import DRAWS, vary
from sealtwin.trial.validate_stage import SPREAD, UNCERTAINTY
from simulate.slot import run as slot_run
from tests.support.messages import Narration
from tests.support.report_stubs import leave_out_pages
from tests.support.tiny_study import FAST, job_in, run_tiny
from validate.uncertainty.computed import RUNS as COMPUTED_RUNS

DECLARED = "\n[uncertainty]\nvolume_ml = 0.01\ndepth_mm = 0.5\n"
MM_PER_ML, MM_PER_MM, RUNS, UNFIT = 30.0, 0.3, 4 * PART, ("A mound.",)
DIFFERENCES = "uncertainty.differences"


def base_of(path: Path, **uncertainty: float) -> Base:
    """Return the base of draws from a run folder, with further uncertainties declared."""
    with job_in(path) as job:
        base = Base.of(job)
    return with_uncertainty(base, **uncertainty)


def with_uncertainty(base: Base, **uncertainty: float) -> Base:
    declared = base.trial.uncertainty.model_copy(update=uncertainty)
    return replace(base, trial=base.trial.model_copy(update={"uncertainty": declared}))


@pytest.fixture(scope="module")
def fast(tmp_path_factory) -> Path:
    return run_tiny(tmp_path_factory.mktemp("lab"), FAST + DECLARED)


@pytest.fixture
def linear(monkeypatch):
    """A level that is linear in the dispensed volume and in the depth, in place of the fast model's."""

    def bed_of(pour, paste, trajectory, **coarser):
        if not coarser:
            return fast_bed_of(pour, paste, trajectory)
        depth_mm, ends_mm = pour.sample.solid.sections.depth_mm.mean(), np.array([0.0, pour.sample.outline.length_mm])
        level_mm = MM_PER_ML * trajectory.dispensed_mm3 / 1e3 - MM_PER_MM * depth_mm
        return SimpleNamespace(sections=SimpleNamespace(s_mm=ends_mm), level_mm=np.full(2, level_mm))

    fast_bed_of = slot_run.bed_of
    monkeypatch.setattr(slot_run, "bed_of", bed_of)
    monkeypatch.setattr(uncertainty_runs, "cores", lambda: 0)
    monkeypatch.setattr(uncertainty_runs, "draw", partial(draw, runs=RUNS))


def test_the_input_uncertainty_of_a_linear_model_equals_the_closed_form(fast, linear, monkeypatch):
    leave_out_pages(monkeypatch)
    with job_in(fast) as job:
        assert vary(job)
        assert not vary(job)
        result = run_stages(job, ("validate",)).result
    figures = files.read_json(fast / "comparison.json")["uncertainty"]
    volume_mm, depth_mm = MM_PER_ML * 0.01, -MM_PER_MM * 0.5
    inputs = {name: [entry[name] for entry in figures["inputs"]] for name in ("mean_level_mm", "share", "model")}
    assert inputs["mean_level_mm"] == pytest.approx([volume_mm, depth_mm], rel=1e-3)
    assert figures["mean_level"]["inputs_mm"] == pytest.approx(0.98 * hypot(volume_mm, depth_mm), rel=0.03)
    share = volume_mm**2 / (volume_mm**2 + depth_mm**2)
    assert inputs["share"] == pytest.approx([share, 1 - share], abs=1e-3)
    # The fast model is named beside each component, and V&V 20 is not applied to its level.
    assert inputs["model"] == ["slot", "slot"]
    parts = [part["name"] for part in figures["budget"]["parts"] if part["kind"] == "inputs"]
    assert parts == [
        f"{name}, by the fast model" for name in ("volume given", "the crack's depth", "inputs in combination")
    ]
    assert figures["input_draws"]["runs"] == RUNS == len(files.read_json(fast / SPREAD)["draws"]["moved_mm"])
    assert figures["mean_level"]["numerics_mm"] is None
    assert "the fast model" in figures["findings"][0]["text"]
    assert not (fast / UNCERTAINTY / DRAWS).exists()
    assert result.comparison is not None
    assert result.comparison.model_dump(mode="json")["uncertainty"] == figures


def test_draws_that_a_killed_process_has_finished_are_not_computed_again(fast, linear, tmp_path, monkeypatch):
    """The process ends in the third of four parts."""
    base, levels_of, parts = base_of(fast), perturbed_inputs.levels_of, list[int]()

    def killed_in_the_third(*task):
        parts.append(len(parts))
        if len(parts) == 3:
            raise KeyboardInterrupt
        return levels_of(*task)

    whole = draw(base, 0, Progress(), tmp_path / "whole", RUNS)
    monkeypatch.setattr(perturbed_inputs, "levels_of", killed_in_the_third)
    with pytest.raises(KeyboardInterrupt):
        draw(base, 0, Progress(), tmp_path / "killed", RUNS)
    resumed = draw(base, 0, Progress(), tmp_path / "killed", RUNS)
    draw(base, 2, Progress(), tmp_path / "killed", RUNS)
    assert np.array_equal(resumed.moved_mm, whole.moved_mm)
    assert len(parts) == 3 + 2, "the last call finds all parts"


def test_the_time_of_the_whole_command_is_shown_before_the_draws(tmp_path, monkeypatch):
    text = FAST.replace('model = "slot"\n', "").replace("radius_mm = 0.45", "radius_mm = 0.36")
    particles = run_tiny(tmp_path, text + DECLARED)
    monkeypatch.setattr(uncertainty_runs, "takes_draws", lambda _: True)

    def killed(base, jobs, progress, folder):
        assert progress.later_s > 0, "of the runs after the draws"
        raise KeyboardInterrupt

    monkeypatch.setattr(uncertainty_runs, "draw", killed)
    narration = Narration()
    with job_in(particles) as job, pytest.raises(KeyboardInterrupt):
        vary(replace(job, progress=narration))
    (announced,) = [note for note in narration.notes if "runs to compute: about" in note]
    assert f"and {COMPUTED_RUNS} of the fast model" in announced
    assert not [*particles.rglob(OUTCOME)]


def test_more_sealant_raises_the_level_and_a_deeper_crack_lowers_the_level(fast):
    """More sealant raises the level by its volume over the crack's area, and a deeper crack lowers the whole level."""
    base = base_of(fast)
    outline = base.sample.outline
    s_mm = np.linspace(0, outline.length_mm, 101)
    unmoved_mm, more_mm, deeper_mm = (
        perturbed_inputs.level_of(base, steps, s_mm) for steps in ({}, {"volume_ml": 0.01}, {"depth_mm": 0.5})
    )
    rise_mm = 10 / outline.length_mm / outline.mean_width_mm
    assert (more_mm - unmoved_mm).mean() == pytest.approx(rise_mm, rel=0.15)
    assert (deeper_mm - unmoved_mm).mean() == pytest.approx(-0.5, abs=0.05)


def test_randomly_drawn_yield_stresses_and_viscosities_are_not_negative(fast):
    base = base_of(fast, yield_stress_pa=50.0, viscosity_percent=80.0)
    steps = perturbed_inputs._steps(base, {"yield_stress_pa": -3.0, "viscosity_percent": -3.0})
    assert steps == {"yield_stress_pa": -1.0, "viscosity_percent": pytest.approx(100 * (1.8**-3 - 1))}
    perturbed_inputs.level_of(base, steps, np.zeros(1))


def test_a_wall_share_of_1_is_varied_only_downward(fast):
    """Paste that slides on the walls levels out further."""
    base = base_of(fast, wall_share=0.2)
    s_mm = np.linspace(0, base.sample.outline.length_mm, 101)
    unmoved_mm, slides_mm, sticks_mm = (
        perturbed_inputs.level_of(base, steps, s_mm) for steps in ({}, {"wall_share": -0.4}, {"wall_share": 0.2})
    )
    assert np.ptp(slides_mm) < 0.95 * np.ptp(unmoved_mm)
    assert np.array_equal(sticks_mm, unmoved_mm)


@pytest.mark.parametrize("weighed", [False, True])
def test_a_pump_delay_reduces_the_dispensed_volume_unless_the_volume_was_weighed(fast, weighed):
    base = base_of(fast)
    if weighed:
        mass_g = base.sample.trajectory.dispensed_mm3 / 1e3
        weight = Dispensed(mass_g=mass_g, mass_sd_g=0.01, density_kg_m3=1000.0, density_sd_kg_m3=1.0)
        path = base.trial.path.model_copy(update={"weighed": weight})
        base = replace(base, trial=base.trial.model_copy(update={"path": path}))
    unmoved, late, early = (
        moved_sample(base, {"pump_delay_s": delay_s}, meshed=False).trajectory for delay_s in (0.0, 0.5, -0.5)
    )
    assert np.array_equal((early.t_s, early.flow_mm3_s), (unmoved.t_s, unmoved.flow_mm3_s))
    share = 1.0 if weighed else 1 - 0.5 / unmoved.duration_s
    assert late.dispensed_mm3 == pytest.approx(share * unmoved.dispensed_mm3)
    assert late.t_s[late.giving][0] == pytest.approx(0.5)


def test_an_input_at_its_bound_is_moved_inward_by_twice_its_uncertainty(tmp_path):
    """The effect of an input is half the difference of both moves."""
    particles = FAST.replace('model = "slot"\n', "") + "\n[uncertainty]\nwall_share = 0.2\npump_delay_s = 0.1\n"
    variants = uncertainty_runs._variants(base_of(run_tiny(tmp_path, particles)), designed=True)
    for name, moves in (("wall_share", [-0.4, 0.0]), ("pump_delay_s", [0.0, 0.2])):
        assert sorted({steps[name] for steps, *_ in variants if name in steps}) == pytest.approx(moves)


def test_a_too_uncertain_pump_delay_or_a_wall_share_together_with_drag_is_refused(fast):
    """A draw of such a delay could leave no flow at all."""
    base = base_of(fast, wall_share=0.1)
    flows_s = base.sample.trajectory.duration_s
    fluid = base.trial.given_fluid.model_copy(update={"D_cm": 0.3})
    refuse_immovable(with_uncertainty(base, pump_delay_s=0.2 * flows_s))
    for immovable, key in (
        (with_uncertainty(base, pump_delay_s=0.3 * flows_s), r"pump_delay_s = "),
        (replace(base, trial=base.trial.model_copy(update={"fluid": fluid})), r"wall_share: fluid.D_cm"),
    ):
        with pytest.raises(InputError, match=rf"uncertainty\.{key}"):
            refuse_immovable(immovable)


def test_an_impossible_draw_is_reported_with_its_inputs(fast):
    fault = perturbed_inputs.levels_of(base_of(fast), [{"volume_ml": -1.0}], np.zeros(1))
    assert "volume_ml -1" in str(fault)
    assert DIFFERENCES in str(fault)


@pytest.mark.parametrize(
    ("model", "declared", "unfit", "drawn"),
    [(None, None, (), True), (None, None, UNFIT, False), (None, "particles", (), False), ("slot", None, UNFIT, True)],
)
def test_input_draws_use_the_fast_model_in_its_domain_or_if_declared(fast, monkeypatch, model, declared, unfit, drawn):
    monkeypatch.setattr(perturbed_inputs, "fast_level", lambda _: (None, unfit))
    base = base_of(fast)
    assert takes_draws(replace(base, trial=base.changed({"solver.model": model, DIFFERENCES: declared}))) is drawn
    with pytest.raises(InputError, match=rf"trial.toml: {DIFFERENCES}.*solver.model"):
        takes_draws(replace(base, trial=base.changed({DIFFERENCES: "particles"})))
