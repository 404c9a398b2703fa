"""Sealant from the nozzle: all of it lands, where the nozzle was, after its fall."""

import numpy as np
import pytest

from sealtwin.core.records import Trajectory
from simulate.slot.fill import supplied_mm3
from tests.fluids import path, slot

EDGES_MM = np.linspace(0.0, 40.0, 81)
STRAIGHT_DOWN = np.array([0.0, 1.0])


def landed(trajectory: Trajectory, times_s: np.ndarray, down: np.ndarray = STRAIGHT_DOWN) -> np.ndarray:
    return supplied_mm3(trajectory, times_s, EDGES_MM, nozzle_mm=2.4, surface_mm=-16.0, down=down)


def test_all_of_it_lands_and_none_before_it_has_fallen():
    trajectory = path(slot(40.0)[1], 1.0, trim_mm=6.0)
    given_mm3 = landed(trajectory, np.linspace(0.0, trajectory.duration_s + 1.0, 300))
    assert given_mm3.sum() == pytest.approx(trajectory.dispensed_mm3, rel=1e-12)
    # 19 mm from 55 mm/s take 57 ms.
    early = landed(trajectory, np.array([0.0, 0.05, 2.0]))
    assert early[0].sum() == 0
    assert early[1].sum() > 0


def test_it_lands_under_the_nozzle_and_along_the_plumb_line():
    at_s = np.array([0.0, 2.0])
    still = Trajectory(
        at_s, np.tile([20.0, 0.0, 3.0], (2, 1)), np.array([20.0, 20.0]), 0 * at_s, np.array([100.0, 0.0])
    )
    middle_mm = (EDGES_MM[1:] + EDGES_MM[:-1]) / 2
    times_s = np.linspace(0.0, 3.0, 100)
    upright = landed(still, times_s).sum(axis=0)
    assert upright @ middle_mm / upright.sum() == pytest.approx(20.0, abs=1e-9)
    assert np.ptp(middle_mm[upright > 0]) <= 2.4 + 0.5
    # 30 degrees: gravity's part along the crack takes it downhill as it falls.
    leaning = landed(still, times_s, np.array([0.5, np.sqrt(0.75)])).sum(axis=0)
    assert leaning @ middle_mm / leaning.sum() > 25.0
