"""Plans: their variables, limits and search on the fast model."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from digitise.robots.cell import PumpTable
from digitise.settings import CrackShape, NozzlePath
from digitise.solid.build_solid import build_solid
from digitise.trajectory import plan_trajectory
from sealtwin.core.errors import InputError
from sealtwin.core.progress import Progress
from sealtwin.core.records import Profile, Sample
from sealtwin.plan import PlanOptions
from sealtwin.plan import search as searching
from sealtwin.plan.make_plan import case_of, plan_on
from sealtwin.plan.search import Case, Goal, Knots, Limits, discrepancy, limits_of, require_possible, search, target_of
from sealtwin.plan.verify import Misfit, Planned, Round, Verifier, WithMore, misfit, plan_cautions
from sealtwin.trial.trial_file import load_trial
from simulate.pour import Pour
from simulate.settings import Fluid, Solver
from simulate.slot.fill import HerschelBulkley
from tests.support.shapes import straight_slot
from tests.support.tiny_study import plannable_lab

OUTLINE = straight_slot(40.0, 4.0)
SOLID = build_solid(OUTLINE, CrackShape(depth_mm=10.0, tilt="vertical"))
OWN = plan_trajectory(OUTLINE, NozzlePath(trim_mm=3.0, speed_mm_s=3.0, lead_in_mm=4.0), SOLID.cavity_volume_mm3)
SAMPLE = Sample(OUTLINE, SOLID, OWN)
FLUID = Fluid(viscosity_pa_s=1.0, yield_stress_pa=5.0, freeze_after_s="never")
CASE = Case(Pour(SAMPLE, (FLUID,), Solver(settle_s=2.0)), HerschelBulkley(1690, 5.0, 1.0))
KNOTS = Knots(OWN, 4)
LIMITS = Limits((10.0, 500.0), (1.0, 6.0))


def test_a_plan_with_the_flow_and_speed_of_a_path_reproduces_the_path():
    flow = OWN.flow_mm3_s.max()
    same = KNOTS.trajectory(np.concatenate([np.full(4, np.log(flow)), np.full(4, np.log(3.0)), [0.0, 0.0]]))
    for name in ("t_s", "speed_mm_s", "flow_mm3_s"):
        np.testing.assert_allclose(getattr(same, name), getattr(OWN, name), rtol=1e-9)


def test_dwell_at_both_ends_adds_the_volume_of_flow_times_dwell_time():
    plan = np.concatenate([np.log([400, 100, 100, 100]), np.full(4, np.log(3.0)), [0.0, 0.0]])
    still = KNOTS.trajectory(plan)
    plan[-2:] = 1.5, 0.5
    longer = KNOTS.trajectory(plan)
    assert longer.duration_s - still.duration_s == pytest.approx(2.0)
    first, last = still.giving.start, still.giving.stop - 2
    more = longer.given_mm3 - still.given_mm3
    assert more[first] == pytest.approx(1.5 * still.flow_mm3_s[first])
    assert more[last] == pytest.approx(0.5 * still.flow_mm3_s[last])
    # The lead has no flow, whatever the plan.
    assert not longer.given_mm3[:first].any()


def level_of(bed, higher_mm=0.0) -> Profile:
    return Profile(bed.sections.s_mm, bed.level_mm + higher_mm)


def searched():
    sections = CASE.fill(OWN).sections
    goal = Goal(target_of(sections, 0.0), np.zeros(32))
    return search(CASE, KNOTS, LIMITS, goal, KNOTS.first_guess(goal.target_mm2, sections.s_mm, LIMITS))


def test_a_plan_has_at_most_a_quarter_of_the_misfit_of_constant_flow():
    """The misfit is that of the fast model, which the search uses, and not of particles."""
    own, path = CASE.fill(OWN), KNOTS.trajectory(searched())
    bed = CASE.fill(path)
    planned = misfit(SAMPLE, level_of(bed)).total_mm3
    assert planned < 0.25 * misfit(SAMPLE, level_of(own)).total_mm3
    giving = path.flow_mm3_s[path.giving][:-1]
    assert giving.min() >= 9.99
    assert giving.max() <= 500.01


def test_a_discrepancy_is_the_level_difference_times_the_width():
    bed = CASE.fill(OWN)
    assert bed.level_mm[:12].max() < 0
    np.testing.assert_allclose(discrepancy(bed, level_of(bed))[:20], 0.0, atol=0.05)
    below = discrepancy(bed, level_of(bed, -0.5))[:8]
    np.testing.assert_allclose(below, -2.0, atol=0.05)


def test_underfill_and_overfill_are_volumes_relative_to_the_face():
    volumes = misfit(SAMPLE, Profile(np.array([0.0, 19.99, 20.01, 40.0]), np.array([-1.0, -1.0, 0.5, 0.5])))
    assert volumes.under_mm3 == pytest.approx(80.0, rel=0.01)
    assert volumes.over_mm3 == pytest.approx(40.0, rel=0.01)


@pytest.mark.parametrize(("flow_max", "keep"), [(60.0, True), (20.0, False)])
def test_the_error_for_a_required_flow_above_the_limit_names_the_station(flow_max, keep):
    """A section of 40 mm2 at 3 mm/s needs 120 mm3/s, and 30 at a quarter of that speed."""
    limits = limits_of(OWN, None, None, flow_max, keep)
    with pytest.raises(InputError) as refused:
        require_possible(limits, np.full(2, 40.0), np.array([0.0, 40.0]), OWN, Path("trial.toml"))
    assert "trial.toml: at s = " in str(refused.value)
    assert f"limit is {flow_max:g}" in str(refused.value)
    assert f"a flow of {120 if keep else 30} mm3/s" in str(refused.value)


def test_the_smallest_weighed_flow_of_a_pump_is_the_lower_limit_of_a_plan():
    flows = np.array([200.0, 400.0, 600.0])
    pump = PumpTable("pump.csv", flows, flows, 0 * flows, 0.01)
    limits = limits_of(OWN, None, pump, 500.0, False)
    assert limits.flow_mm3_s == (200.0, 500.0)
    thin = np.full(2, 10.0)
    with pytest.raises(InputError, match="pump's smallest weighed flow is 200"):
        require_possible(limits, thin, np.array([0.0, 40.0]), OWN, Path("trial.toml"))


class FastModelItself(Verifier):
    """Verifier whose runs have the level of the fast model."""

    def levels(self, title, paths, *, drafts=False):
        case = case_of(replace(self.sample, trajectory=OWN), self.trial)
        return [level_of(case.along(path)) for _, path, _ in paths]


def verifier(kind: type[FastModelItself], folder: Path) -> FastModelItself:
    trial = load_trial(plannable_lab(folder) / "planned.toml").loaded(folder)
    return kind(folder, trial, Sample(OUTLINE, SOLID, OWN), "cpu", Progress())


@pytest.fixture
def particles(tmp_path, monkeypatch) -> FastModelItself:
    """Verifier of the fast model's levels, and searches of one step."""
    monkeypatch.setattr(searching, "MAX_STEPS", 1)
    return verifier(FastModelItself, tmp_path)


def test_a_plan_predicts_the_level_in_the_middle_of_the_crack(particles):
    """The mean level across the crack would be 0.11 mm lower for this paste."""
    planned = plan_on(particles, PlanOptions(knots=3, verify=1, seeds=1))
    assert planned.rounds[0].off_mm == pytest.approx(0.0, abs=1e-6)
    # One run shows no scatter: a band of no width would be false.
    assert planned.half_width_mm is None
    with pytest.raises(InputError, match=r"seed = 0 and with seed = 1 have the same level .* solver.radius_mm"):
        plan_on(particles, PlanOptions(knots=3, verify=1, seeds=2))


class DraftsStandLower(FastModelItself):
    """Verifier whose runs have the level of the fast model, and drafts a level 0.8 mm lower."""

    draft_mm = -0.8

    def levels(self, title, paths, *, drafts=False):
        levels = super().levels(title, paths)
        return [replace(level, level_mm=level.level_mm + self.draft_mm * drafts) for level in levels]


@pytest.fixture(scope="module")
def corrected(tmp_path_factory) -> Planned:
    particles = verifier(DraftsStandLower, tmp_path_factory.mktemp("plan"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(searching, "MAX_STEPS", 2)
        return plan_on(particles, PlanOptions(knots=3, verify=2, seeds=1, reserve_mm=0.0))


def test_an_accurate_run_corrects_a_plan_made_by_draft_runs(corrected):
    """Drafts whose level is too low make a plan that dispenses too much."""
    assert corrected.best.name == "corrected by the accurate run"
    assert [one.name for one in corrected.rounds] == ["round 1", "round 2"]
    assert corrected.of_draft == corrected.rounds[1].misfit
    filled = [plan_trajectory(OUTLINE, one.path).dispensed_mm3 for one in (corrected.best, corrected.rounds[1])]
    assert filled[1] - filled[0] == pytest.approx(0.8 * 4.0 * 40.0, rel=0.25)


def test_a_plan_states_the_overfill_at_10_percent_more_sealant(corrected):
    constant = plan_trajectory(OUTLINE, corrected.baselines[0].path, SOLID.cavity_volume_mm3, SOLID.sections)
    assert constant.dispensed_mm3 == pytest.approx(SOLID.cavity_volume_mm3, rel=0.02)
    more = corrected.with_more
    # A tenth more of 1600 mm3, less the reserve and what lies beside the mouth.
    assert 60.0 < more.over_mm3 < 160.0
    assert more.constant_flow_over_mm3 > corrected.baselines[0].misfit.over_mm3
    worse = replace(corrected, with_more=replace(more, over_mm3=more.constant_flow_over_mm3 + 1.0))
    assert any("Give a larger --reserve-mm" in text for text in plan_cautions(worse, []))


def test_only_a_long_low_stretch_of_a_plan_is_reported():
    """Volumes alone once did not show that the last 20 mm of a plan were 2.5 mm low."""
    s_mm = np.linspace(0.0, 100.0, 101)
    level_mm = np.where(s_mm > 80, -2.5, -0.5) - np.where((s_mm > 10) & (s_mm < 14), 3.0, 0.0)
    none = Misfit(0.0, 0.0, 0.0)
    best = Round("round 1", NozzlePath(), Profile(s_mm, level_mm), none)
    more, options = WithMore(0.0, 0.0), PlanOptions()
    planned = Planned(options, best, (best,), (), OWN, best.level, None, none, (none,), more, None, 0.0)
    (low,) = planned.low_stretches
    assert (low["from_mm"], low["to_mm"], low["mean_mm"]) == (81.0, 100.0, 2.5)
    lower = replace(planned, options=PlanOptions(margin_mm=2.0))
    assert not lower.low_stretches[1:], "a plan that aims lower is not low there"


def test_the_caution_of_a_plan_that_aims_too_low_names_reserve_mm(particles):
    planned = plan_on(particles, PlanOptions(knots=3, reserve_mm=3.0, seeds=1, verify=1))
    assert planned.unfilled_mm3 == pytest.approx(planned.options.aim_mm * 40.0 * 4.0, rel=0.01)
    lost = replace(planned, best=planned.baselines[0])
    (first, *_), (other, *_) = (plan_cautions(one, []) for one in (lost, replace(lost, unfilled_mm3=0.0)))
    assert "--reserve-mm" in first
    assert "--reserve-mm" not in other


def test_a_plan_that_aims_below_the_floor_is_refused(particles):
    with pytest.raises(InputError, match=r"--margin-mm 4 and --reserve-mm 6: their sum must be less than .* 10 mm"):
        plan_on(particles, PlanOptions(margin_mm=4.0, reserve_mm=6.0))
