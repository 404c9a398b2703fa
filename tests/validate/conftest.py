"""A small trial as it is filled: its scene and three of its frames."""

import numpy as np
import pytest

from sealtwin.core.vtk_files import Frame, ParticleState
from tests.support.evidence import RADIUS_MM, make_evidence
from validate.figures.snapshots import FillScene


@pytest.fixture(scope="session")
def evidence(tmp_path_factory):
    return make_evidence(tmp_path_factory.mktemp("evidence"))


@pytest.fixture(scope="session")
def scene(evidence):
    return FillScene(evidence.outline, evidence.solid, evidence.trajectory, RADIUS_MM, 2.4)


def frame_of(run, t_s: float) -> Frame:
    """A part of the fill that grows with time; the last particle has spilled, and one moves 50 times as fast."""
    count = round(len(run.age_s) * t_s / 10)
    velocity_mm_s = np.zeros((count, 3))
    velocity_mm_s[:, 2] = -10.0
    velocity_mm_s[0, 2] = -500.0
    state = np.full(count, int(ParticleState.MOVING))
    state[-1] = ParticleState.SPILLED
    return Frame(t_s, run.position_mm[:count], velocity_mm_s, np.linspace(t_s, 0, count), np.ones(count), state)


@pytest.fixture(scope="session")
def frames(evidence):
    return [frame_of(evidence.run, t_s) for t_s in (0.5, 7.0, 10.0)]
