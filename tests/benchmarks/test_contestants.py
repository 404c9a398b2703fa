"""The programs that a substep is timed against still take the same step."""

import numpy as np
import pytest

from benchmarks.pbf_cpp import CppStep, has_compiler
from benchmarks.pbf_numba import NumbaStep
from benchmarks.pbf_step import PARTICLES, SIDE_MM, TOGETHER_MM, settled_block, tank
from benchmarks.speed_bars import ALIKE_MM

FEW = 600


@pytest.mark.slow  # numba compiles for 20 s
def test_numba_takes_the_step_that_we_take():
    engine = settled_block(FEW, 1, steps=5)
    theirs = NumbaStep.copy_of(engine)
    engine.step()
    theirs.step()
    place_mm = 10 * np.column_stack([theirs.x, theirs.y, theirs.z])
    assert np.abs(place_mm - engine.state.position_mm()).max() < TOGETHER_MM


@pytest.mark.skipif(not has_compiler(), reason="no g++ on this machine")
def test_cpp_takes_the_step_that_we_take():
    """In the median: its walls are planes, where a grid of distances rounds corners off."""
    engine = settled_block(FEW, 1, steps=5)
    before_mm = engine.state.position_mm()
    theirs = CppStep(engine, SIDE_MM * (FEW / PARTICLES) ** (1 / 3), tank(FEW)[2], threads=1)
    engine.step()
    theirs.step()
    ours_mm = engine.state.position_mm()
    assert np.median(np.abs(theirs.place_mm - ours_mm).max(axis=1)) < ALIKE_MM
    assert np.median(np.abs(before_mm - ours_mm).max(axis=1)) > 2 * ALIKE_MM
