"""Paste that sleeps, and what wakes it."""

import numpy as np
import pytest

from simulate.fluid.solver import AGAIN_S, PATIENCE_S, RESTLESS_S, WAKING_CM_S
from simulate.kernels.status import ASLEEP, MOVING, RESTS
from simulate.setup.rheology import Rheology
from tests.support.small_fluids import FRAME_S, engine_with, slot

PASTE = Rheology(30.0, 0.3, yield_cm2_s2=71.0)


@pytest.mark.parametrize(
    ("speed", "flowed_s", "wakes"),
    [
        (1.1 * WAKING_CM_S, 0.0, True),
        (0.4 * WAKING_CM_S, 0.0, False),
        (0.4 * WAKING_CM_S, 1.1 * RESTLESS_S, True),
        (0.4 * WAKING_CM_S, 0.9 * RESTLESS_S, False),
    ],
)
def test_a_sleeper_wakes_beside_what_is_fast_or_goes_on_flowing(speed, flowed_s, wakes):
    """Paste that flows back at 2 mm/s would else stand as a step on a bed that sleeps."""
    engine = engine_with(np.array([[3.0, 0.0, -8.0], [3.0, 0.0, -7.0]]), slot(), fluid=PASTE)
    state = engine.state
    engine.find_neighbours()
    position, status = state.position.numpy().copy(), state.status.numpy().copy()
    position[0, 3], status[0] = RESTS, ASLEEP
    state.position.assign(position)
    state.status.assign(status)
    state.velocity.assign(np.array([[0.0, 0.0, 0.0], [speed, 0.0, 0.0]], dtype=np.float32))
    quiet_s = engine.lasting()["quiet_s"]
    quiet_s.assign(np.array([PATIENCE_S, -flowed_s], dtype=np.float32))
    engine.find_movers()
    engine.find_neighbours()
    engine.viscosity.weigh_pairs(engine.rows)
    engine._wake(engine.rows)
    assert (state.status.numpy()[0] == int(MOVING)) == wakes
    if wakes:
        # It lies down again soon, if it does not flow.
        assert quiet_s.numpy()[0] == pytest.approx(PATIENCE_S - AGAIN_S)


def test_a_moment_of_quiet_forgets_the_flow_and_one_of_flow_the_quiet():
    engine = engine_with(np.array([[3.0, 0.0, -8.0]]), slot(), fluid=PASTE)
    quiet_s = engine.lasting()["quiet_s"]
    for speed, before, after in ((0.0, -5.0, FRAME_S), (1.0, 0.2, -FRAME_S), (1.0, -0.2, -0.2 - FRAME_S)):
        engine.state.velocity.assign(np.array([[speed, 0.0, 0.0]], dtype=np.float32))
        quiet_s.fill_(before)
        engine._fall_asleep(engine.rows)
        assert quiet_s.numpy()[0] == pytest.approx(after, rel=1e-4)
