"""The step of the loop, where the fast model itself is reality: no particles, and every fault is known."""

import json
from dataclasses import asdict

import numpy as np
import pytest

from sealtwin.core.records import Floats
from sealtwin.plan.loop_model import read_model, write_model
from sealtwin.plan.loop_step import LevelFrame, LoopState, RemainingPlan, step
from tests.planned_slot import OWN, areas, model, passes


def frame(t_s: float, commands: Floats, flow: float, thicker: float = 0.0) -> LevelFrame:
    """What a sensor without noise sees of a pour with hidden faults, behind the nozzle or all of it on the way back."""
    sections = model().sections
    filled = areas(flow * commands, np.array([t_s]), thicker)[0]
    level_mm = sections.bottom_mm + sections.height_mm(filled)
    at_mm = np.interp(t_s, passes().motion.t_s, passes().motion.s_mm)
    seen = (sections.s_mm < at_mm - 6) | (t_s > passes().back_s)
    return LevelFrame(t_s, tuple(sections.s_mm[seen].tolist()), tuple(level_mm[seen].tolist()))


def poured(flow: float, thicker: float = 0.0) -> tuple[LoopState, list[RemainingPlan]]:
    state, plans = LoopState.start(model()), []
    for t_s in np.arange(passes().motion.t_s[0] + 3.0, passes().motion.t_s[-1], 2.0).tolist():
        state, plan = step(model(), state, t_s, frame(t_s, np.array(state.commands), flow, thicker))
        plans.append(plan)
    return state, plans


def error_mm3(commands: Floats, flow: float, thicker: float = 0.0) -> tuple[float, float]:
    """Volumes that are missing below the face, and above it."""
    sections = model().sections
    filled = areas(flow * commands, model().moment_s[-1:], thicker)[0]
    off = (filled - sections.full_mm2) * sections.step_mm
    return -float(off[off < 0].sum()), float(off[off > 0].sum())


@pytest.mark.parametrize(("flow", "most_over_mm3"), [(0.8, 5.0), (1.2, 110.0)])
def test_a_wrong_flow_is_found_and_made_good(flow, most_over_mm3):
    """Without correction 390 and 220 of 1,600 mm3 are wrong; what came before the first level cannot be taken back."""
    state, plans = poured(flow)
    assert state.flow == pytest.approx(flow, abs=0.06)
    assert {plan.said for plan in plans} == {"corrected"}
    under, over = error_mm3(np.array(state.commands), flow)
    open_under, open_over = error_mm3(passes().nominal, flow)
    assert under + over < 0.5 * (open_under + open_over)
    assert over < most_over_mm3


def test_no_fault_is_not_corrected_into_one():
    state, _ = poured(1.0)
    assert state.flow == pytest.approx(1.0, abs=0.03)
    assert np.exp(state.material) == pytest.approx(1.0, abs=0.1)
    assert sum(error_mm3(np.array(state.commands), 1.0)) < 80


def test_without_a_level_for_three_seconds_the_plan_stays():
    state, plan = step(model(), LoopState.start(model()), OWN.t_s[0] + 3.5, None)
    assert plan.said.startswith("open loop")
    assert state == LoopState.start(model())


def test_an_estimate_out_of_bounds_stops_the_flow():
    t_s = OWN.t_s[0] + 8.0
    seen = frame(t_s, passes().nominal, 0.1)
    state, plan = step(model(), LoopState.start(model()), t_s, seen)
    assert "estimate 0." in state.stopped
    assert plan.flow_mm3_s
    assert not any(plan.flow_mm3_s)
    again, later = step(model(), state, t_s + 1, frame(t_s + 1, passes().nominal, 1.0))
    assert again.stopped == state.stopped
    assert not any(later.flow_mm3_s)


def test_a_step_has_no_memory_but_its_state(tmp_path):
    """The same inputs give the same answer, also after state and tables went through JSON."""
    write_model(tmp_path / "loop.json", model(), "")
    t_s = OWN.t_s[0] + 6.0
    seen, start = frame(t_s, passes().nominal, 0.9), LoopState.start(model())
    first = step(model(), start, t_s, seen)
    kept = json.loads(json.dumps(asdict(start)))
    other = step(read_model(tmp_path / "loop.json"), LoopState(**kept), t_s, seen)
    assert first[0].flow == pytest.approx(other[0].flow, rel=1e-9)
    assert first[1].flow_mm3_s == pytest.approx(other[1].flow_mm3_s, rel=1e-6)


def test_the_tables_keep_their_error():
    assert 0 < model().linear_off_mm < 0.5
