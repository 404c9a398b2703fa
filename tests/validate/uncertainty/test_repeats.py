"""Declared errors that repeats exceed are named, and true declarations hardly ever."""

from pathlib import Path

import numpy as np

from sealtwin.core.records import Profile
from validate.settings import Readings, Uncertainty
from validate.uncertainty.repeats import contradicted

S_MM = np.linspace(0.0, 80.0, 17)
BED_MM = -6.0 + 2.0 * np.cos(S_MM / 20.0)
NO_PASSES = Uncertainty(pass_mm=0.0)


def profile(repeats_mm) -> Profile:
    repeats_mm = BED_MM[:, None] + repeats_mm
    return Profile(S_MM, np.nanmean(repeats_mm, axis=1), repeats_mm, source="caliper.csv")


def check(repeats_mm, declared: Uncertainty, **settings) -> tuple[str, ...]:
    table = {"file": Path("caliper.csv"), "data": "measured", "role": "held-out", **settings}
    return contradicted(profile(repeats_mm), Readings.model_validate(table), declared)


def refusals(sheets, declared: Uncertainty) -> list[bool]:
    """Which of the sheets exceed what is declared."""
    return [bool(check(sheet, declared)) for sheet in sheets]


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


def test_at_most_about_1_percent_of_true_declarations_are_named():
    """The sheets have repeats without passes, with several kinds of scatter, or passes of the declared size."""
    random = np.random.default_rng(5)
    kinds = ["normal", "outliers", "uneven", "missing"]
    alike = [noise_mm(random, kinds[number % 4]) for number in range(200)]
    assert sum(refusals(alike, NO_PASSES)) <= hardly_ever(200)
    apart = [noise_mm(random) + 0.2 * random.standard_normal(3) for _ in range(100)]
    assert sum(refusals(apart, Uncertainty(pass_mm=0.2))) <= hardly_ever(100)


def test_a_column_that_is_0_3_mm_higher_contradicts_declared_equal_passes():
    """With a scatter of 0.15 mm at 17 stations, nearly all sheets are named; at most 3 of 60 may be missed."""
    random = np.random.default_rng(6)
    sheets = [noise_mm(random) + np.array([0.0, 0.0, 0.3]) for _ in range(60)]
    assert sum(refusals(sheets, NO_PASSES)) >= 57
    (sentence,) = check(sheets[0], NO_PASSES)
    assert sentence.startswith("uncertainty.pass_mm is 0, but the repeats show 0.1")
    # Passes that are declared to differ by that much are accepted.
    assert [refusals(sheets[:1], Uncertainty(pass_mm=mm)) for mm in (0.2, 0.01)] == [[False], [True]]


def test_repeats_that_scatter_more_than_the_declared_repeatability_are_named():
    """0.15 mm over 34 degrees of freedom exceed 0.1 mm; a true declaration is refused once in 100."""
    random = np.random.default_rng(9)
    sheets = [noise_mm(random) for _ in range(100)]
    declared = Uncertainty(repeatability_mm=0.15, pass_mm=0.0)
    assert sum(np.greater(refusals(sheets, declared), refusals(sheets, NO_PASSES))) <= hardly_ever(100)
    (sentence,) = check(sheets[1], Uncertainty(repeatability_mm=0.05))
    assert sentence.startswith("uncertainty.repeatability_mm is 0.05, but the repeats show 0.1")
    assert check(sheets[1][:, :1], Uncertainty(repeatability_mm=0.05)) == ()
