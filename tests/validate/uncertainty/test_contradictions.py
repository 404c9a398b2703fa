"""Declared errors that readings contradict are refused by name, and true declarations hardly ever."""

from pathlib import Path

import numpy as np
import pytest

from sealtwin.core.errors import InputError
from sealtwin.core.records import Profile
from validate.settings import Readings, Uncertainty
from validate.uncertainty.contradictions import refuse_contradicted

S_MM = np.linspace(0.0, 80.0, 17)
BED_MM = -6.0 + 2.0 * np.cos(S_MM / 20.0)
NO_PASSES = Uncertainty(pass_mm=0.0)


def profile(repeats_mm) -> Profile:
    repeats_mm = BED_MM[:, None] + repeats_mm
    return Profile(S_MM, np.nanmean(repeats_mm, axis=1), repeats_mm, source="caliper.csv")


def check(repeats_mm, declared: Uncertainty, **settings) -> None:
    table = {"file": Path("caliper.csv"), "data": "measured", "role": "held-out", **settings}
    refuse_contradicted(profile(repeats_mm), Readings.model_validate(table), declared)


def refusals(sheets, declared: Uncertainty) -> list[bool]:
    """Which of the sheets are refused."""
    answers = list[bool]()
    for sheet in sheets:
        try:
            check(sheet, declared)
            answers.append(False)
        except InputError:
            answers.append(True)
    return answers


def noise_mm(random: np.random.Generator, kind: str = "normal") -> np.ndarray:
    normal = 0.15 * random.standard_normal((17, 3))
    if kind == "outliers":
        return normal + (random.random((17, 3)) < 0.05) * 1.5 * random.standard_normal((17, 3))
    if kind == "uneven":
        return normal * np.exp(0.7 * random.standard_normal((17, 1)))
    if kind == "missing":
        return np.where((random.random((17, 3)) < 0.3) & (np.arange(3) > 0), np.nan, normal)
    return normal


def hardly_ever(sheets: int) -> float:
    """At most 1 in 100, and three standard deviations more."""
    return sheets * (0.01 + 3 * np.sqrt(0.01 * 0.99 / sheets))


def test_at_most_about_1_percent_of_true_declarations_are_refused():
    """The sheets have repeats without passes, with several kinds of scatter, or passes of the declared size."""
    random = np.random.default_rng(5)
    kinds = ["normal", "outliers", "uneven", "missing"]
    alike = [noise_mm(random, kinds[number % 4]) for number in range(200)]
    assert sum(refusals(alike, NO_PASSES)) <= hardly_ever(200)
    apart = [noise_mm(random) + 0.2 * random.standard_normal(3) for _ in range(100)]
    assert sum(refusals(apart, Uncertainty(pass_mm=0.2))) <= hardly_ever(100)


def test_a_column_that_is_0_3_mm_higher_contradicts_declared_equal_passes():
    """With a scatter of 0.15 mm at 17 stations, 99 of 100 sheets are refused; at most 3 of 60 may be missed."""
    random = np.random.default_rng(6)
    sheets = [noise_mm(random) + np.array([0.0, 0.0, 0.3]) for _ in range(60)]
    assert sum(refusals(sheets, NO_PASSES)) >= 57
    words = r"^caliper\.csv: the repeats contradict uncertainty\.pass_mm = 0:.* repeat 3 is 0\.2.*pass_mm"
    with pytest.raises(InputError, match=words):
        check(sheets[0], NO_PASSES)
    # Passes that are declared to differ by that much are accepted.
    assert [refusals(sheets[:1], Uncertainty(pass_mm=mm)) for mm in (0.2, 0.01)] == [[False], [True]]


def test_repeats_that_scatter_more_than_the_declared_repeatability_are_refused():
    """0.15 mm over 34 degrees of freedom exceed 0.1 mm; a true declaration is refused once in 100."""
    random = np.random.default_rng(9)
    sheets = [noise_mm(random) for _ in range(100)]
    declared = Uncertainty(repeatability_mm=0.15, pass_mm=0.0)
    assert sum(np.greater(refusals(sheets, declared), refusals(sheets, NO_PASSES))) <= hardly_ever(100)
    words = r"uncertainty\.repeatability_mm = 0\.05: .* scatter by 0\.1\d mm \(28 degrees"
    with pytest.raises(InputError, match=words):
        check(sheets[1], Uncertainty(repeatability_mm=0.05))


@pytest.mark.parametrize(("key", "declared_mm"), [("repeatability_mm", 1.0), ("station_each_mm", 4.0)])
def test_readings_that_are_smoother_than_a_declared_error_are_refused(key, declared_mm):
    """The bed bends by 0.04 mm from station to station and rises by up to 0.1 mm a mm: both errors would leave more.

    Errors of the declared size are refused in at most 1 of 100 sheets: in none of 200 on this bed, which adds to them.
    """
    declared = Uncertainty.model_validate({key: declared_mm})
    with pytest.raises(InputError, match=rf"uncertainty\.{key} = {declared_mm:g}: .* differ from the line.*common_mm"):
        check(np.zeros((17, 1)), declared)
    random, size_mm = np.random.default_rng(10), declared_mm * np.ones(17)
    if key == "station_each_mm":
        size_mm = declared_mm * np.abs(np.gradient(BED_MM, S_MM))
    sheets = [(size_mm * random.standard_normal(17))[:, None] for _ in range(200)]
    assert sum(refusals(sheets, declared)) <= 6


def test_readings_finer_than_the_declared_resolution_are_refused():
    """A few readings may be estimated between two marks. The default, the caliper's last digit, is not checked."""
    random = np.random.default_rng(11)
    fine_mm = np.round(BED_MM[:, None] + noise_mm(random), 2) - BED_MM[:, None]
    with pytest.raises(InputError, match=r"readings\.resolution_mm = 0\.5: \d+ of 51 are not multiples"):
        check(fine_mm, Uncertainty(), resolution_mm=0.5)
    coarse_mm = 0.37 + np.round((BED_MM[:, None] + noise_mm(random)) * 2) / 2 - BED_MM[:, None]
    check(coarse_mm, Uncertainty(), resolution_mm=0.5)
    coarse_mm[3, 1] += 0.25
    check(coarse_mm, Uncertainty(), resolution_mm=0.5)
    check(noise_mm(random), Uncertainty())
