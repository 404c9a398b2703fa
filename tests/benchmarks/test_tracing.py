"""Errors of a traced outline, as measured by the benchmark of tracing."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.tracing_figures import measured
from digitise.crack_path.find_path import find_path
from digitise.outline import trace_outline
from digitise.photo import Photo
from fixtures.generate.recipe import Recipe
from fixtures.generate.specimen import Specimen, make_specimen
from sealtwin.core.records import Floats, Outline
from tests.support.photos import photo_of

CLOSED = Recipe(face_mm=(70, 40), length_mm=45, ends="closed", mm_per_px=0.15)


@pytest.fixture(scope="module")
def truth() -> Specimen:
    return make_specimen(5, CLOSED)


@pytest.fixture(scope="module")
def photo(truth, tmp_path_factory) -> Photo:
    return photo_of(truth, tmp_path_factory.mktemp("closed"))


@pytest.fixture(scope="module")
def traced(truth, photo) -> Outline:
    return trace_outline(photo, find_path(photo, truth.ends_px))


def moved(truth: Specimen, traced: Outline, by: Floats, stretch: float = 1.0) -> Outline:
    """The truth itself as an outline, moved and stretched; of the tracing, only what is beside its lines."""
    lines = {
        name: getattr(truth, name) * stretch + by
        for name in ("centreline_mm", "left_wall_mm", "right_wall_mm", "outline_mm")
    }
    return replace(traced, **lines)


def test_the_true_outline_has_no_tracing_error(truth, photo, traced):
    """Points of the true line are up to 1 um away from the line by the method of distance_mm."""
    figures = measured(moved(truth, traced, np.zeros(2)), photo, truth)
    assert (figures.centreline_mm, figures.wall_mm) == pytest.approx((0, 0), abs=1e-3)
    assert (figures.width_percent, figures.length_percent) == pytest.approx((0, 0), abs=1e-9)


def test_a_shift_and_a_stretch_of_an_outline_are_measured_at_their_true_size(truth, photo, traced):
    """The crack runs 30 degrees to x, so that 0.2 mm along y are 0.17 mm across it."""
    aside = measured(moved(truth, traced, np.array([0.0, 0.2])), photo, truth)
    assert aside.centreline_mm == pytest.approx(0.2 * np.cos(np.radians(30)), rel=0.05)
    stretched = measured(moved(truth, traced, np.zeros(2), 1.02), photo, truth)
    assert stretched.length_percent == pytest.approx(2, rel=1e-3)
    assert stretched.length_mm == pytest.approx(0.02 * 45, rel=1e-3)
    assert stretched.width_percent == pytest.approx(2, rel=1e-3)
