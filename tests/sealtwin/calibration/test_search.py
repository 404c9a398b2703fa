"""The search of a calibration, on level profiles from a formula in place of runs."""

from dataclasses import replace

import numpy as np
import pytest

from sealtwin.calibration import search as searching
from sealtwin.calibration.search import FEWEST, FIRST, Source, search
from sealtwin.core.errors import InputError, NumericalError
from validate.calibration.posterior import Free, ReadLevels, marginals_of

S_MM = np.linspace(0.0, 40.0, 12)
FREES = [Free("fluid.viscosity_pa_s", 0.2, 5.0), Free("path.fill", 0.8, 1.2)]
TRUTH = {"fluid.viscosity_pa_s": 1.5, "path.fill": 1.05}
SCATTER_MM, READING_MM = 0.1, 0.05


def _level_mm(setting):
    slope = np.log(setting["fluid.viscosity_pa_s"])
    return -5.0 + slope * np.sin(S_MM / 12) + 8 * (setting["path.fill"] - 1) + 0.2 * slope**2 * S_MM / 40


class Twin:
    def __init__(self, lost=()):
        self.lost = lost

    def run(self, wanted):
        return [None if seed in self.lost else self._one(setting, seed) for setting, seed in wanted]

    def _one(self, setting, seed):
        return _level_mm(setting) + SCATTER_MM * np.random.default_rng(seed).standard_normal(len(S_MM))


def _source(twin, bump_mm=0.0):
    random = np.random.default_rng(77)
    noise_mm = np.hypot(SCATTER_MM, READING_MM) * random.standard_normal(len(S_MM))
    level_mm = _level_mm(TRUTH) + noise_mm + bump_mm * (S_MM > 20)
    return Source("toy", ReadLevels(S_MM, level_mm, READING_MM**2 * np.eye(len(S_MM))), twin.run)


@pytest.fixture(scope="module", autouse=True)
def few_steps():
    """Fewer steps, which are enough for these tests."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(searching, "STEPS", 150)
        patch.setattr(searching, "STEPS_OF_A_ROUND", 40)
        yield


@pytest.fixture(scope="module")
def exact(few_steps):
    """The search whose sources have no smooth errors."""
    return search(FREES, [_source(Twin())], FEWEST, lambda _: None)


def test_the_intervals_of_a_calibration_contain_the_true_settings(exact):
    result = exact
    assert result.draws is not None
    assert len(result.points) == FEWEST
    assert len({*map(tuple, result.points[-3:])}) == 1  # Three seeds confirm one setting
    for one in marginals_of(FREES, result.draws, result.best):
        assert one.low < TRUTH[one.free.name] < one.high
        assert one.identified
    off_mm = _level_mm(searching.settings_at(FREES, result.best)) - _level_mm(TRUTH)
    assert np.sqrt(np.mean(off_mm**2)) < 0.1
    # The same results of runs give the same search, which is what goes on after a kill.
    again = search(FREES, [_source(Twin())], FEWEST, lambda _: None)
    assert np.array_equal(result.points, again.points)
    assert np.array_equal(result.draws, np.asarray(again.draws))


def test_smooth_errors_widen_the_posterior_without_changing_the_search(exact):
    """A search that allowed for smooth errors would not come close to the readings."""
    source = _source(Twin())
    smooth_mm2 = np.full((len(S_MM), len(S_MM)), 0.3**2)
    allowed = replace(source, evidence=replace(source.evidence, smooth_mm2=smooth_mm2))
    result = search(FREES, [allowed], FEWEST, lambda _: None)
    assert np.array_equal(result.points, exact.points)
    assert result.draws is not None
    assert exact.draws is not None
    assert result.draws[:, 1].std() > 1.5 * exact.draws[:, 1].std(), "a fill makes the shape of such an error"


def test_readings_that_no_settings_explain_stop_the_search():
    result = search(FREES, [_source(Twin(), bump_mm=3.0)], 40, lambda _: None)
    assert not result.possible
    assert len(result.points) < 40
    assert not result.reaches[0].possible or result.least_implausibility > 1


def test_a_lost_run_is_left_out_of_the_search_unless_many_runs_are_lost():
    result = search(FREES, [_source(Twin(lost={2}))], FEWEST, lambda _: None)
    assert result.possible
    assert len(result.posterior.emulators[0].processes.points) == FEWEST - 1
    with pytest.raises(NumericalError, match="toy: 6 of 16 runs"):
        search(FREES, [_source(Twin(lost=set(range(6))))], FEWEST, lambda _: None)
    assert FIRST == 16


def test_runs_that_are_equal_for_all_seeds_are_refused():
    """Without the check the emulator takes its nugget from four copies of one run."""
    copies = Source("toy", _source(Twin()).evidence, lambda wanted: [_level_mm(setting) for setting, _ in wanted])
    with pytest.raises(
        InputError, match=r"toy: the runs \d+ \(seed \+ \d+\) and 17 \(seed \+ 16\) .* solver.radius_mm"
    ):
        search(FREES, [copies], FEWEST, lambda _: None)
