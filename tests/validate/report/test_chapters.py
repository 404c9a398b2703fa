"""What a report says, in which order, and what it says where something is not there."""

from dataclasses import replace
from pathlib import Path

import pytest

from tests.evidence import make_evidence
from validate.compare import assess
from validate.report.chapters import CommandLines, Model, Paragraph, PhotoBlock, Plate, chapters
from validate.report.report_data import report_data
from validate.settings import Readings, Uncertainty
from validate.units import PageTable
from validate.wording.headline import key_figures


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    return make_evidence(tmp_path_factory.mktemp("plain"))


@pytest.fixture(scope="module")
def assessed(plain):
    settings = Readings(file=Path("caliper.csv"), data="measured", role="held-out")
    return replace(plain, comparison=assess(plain, settings, Uncertainty(), None))


@pytest.fixture(scope="module")
def content(plain):
    return chapters(plain)


def titles(content):
    return {chapter.title: [item.title for item in chapter.items if isinstance(item, PageTable)] for chapter in content}


def test_from_the_photo_to_the_command_that_makes_it_again(content):
    """The order of the issue; each chapter begins with what there is to be seen."""
    assert [chapter.title for chapter in content] == [
        "Photo", "Fill", "Level", "Uncertainty", "Mass balance", "Health of the run", "Assumptions", "Left out",
        "Geometry", "Provenance",
    ]  # fmt: skip
    kinds = [type(chapter.items[0]) for chapter in content]
    assert kinds == [
        PhotoBlock,
        Model,
        Plate,
        Paragraph,
        PageTable,
        PageTable,
        Paragraph,
        Paragraph,
        Plate,
        CommandLines,
    ]
    assert len({chapter.name for chapter in content}) == len(content)


def test_figures_are_numbered_through(content):
    captions = [
        item.caption for chapter in content for item in chapter.items if isinstance(item, PhotoBlock | Model | Plate)
    ]
    assert [caption.split(".")[0] for caption in captions] == [f"Figure {number}" for number in range(1, 10)]


def test_an_error_that_was_not_assessed_has_no_interval_and_says_so(plain, content):
    """Seen to fail with the sentence left out."""
    uncertainty = next(chapter for chapter in content if chapter.title == "Uncertainty")
    (words,) = uncertainty.items
    assert isinstance(words, Paragraph)
    (sentence,) = words.sentences
    assert sentence == "Not examined: this is one run, with particles of 0.5 mm radius, held against no interval."
    data = report_data(plain)
    assert data.uncertainty is None
    assert data.metrics["mean_error_mm"].interval_95 is None


def test_an_assessed_error_has_its_interval_wherever_it_stands(assessed):
    low_mm, high_mm = assessed.comparison.uncertainty.mean_error_interval_mm
    content = chapters(assessed)
    level = next(chapter for chapter in content if chapter.title == "Level")
    agreement = next(dict(item.rows) for item in level.items if isinstance(item, PageTable))
    assert agreement["mean error = area / covered length"].endswith(
        f"0.500 mm, 95 % interval by the readings {low_mm:.3f} to {high_mm:.3f} mm"
    )
    assert dict(key_figures(assessed))["its 95 % interval by the readings"] == f"{low_mm:.2f} to {high_mm:.2f} mm"
    assert dict(key_figures(assessed))["readings were"] == "held out"
    assert titles(content)["Uncertainty"][0] == "What may be said of the error"
    assert len(titles(content)["Mass balance"]) == 2
    data = report_data(assessed)
    assert data.metrics["mean_error_mm"].interval_95 == (low_mm, high_mm)
    assert data.metrics["worst_error_mm"].interval_95 is None
    assert data.uncertainty is not None
    assert data.uncertainty.resolved is None
    assert data.uncertainty.numerics_mm is None


def test_without_readings_there_is_nothing_to_be_unsure_of(tmp_path):
    evidence = make_evidence(tmp_path, readings_data=None)
    told = titles(chapters(evidence))
    assert (told["Level"], told["Uncertainty"]) == ([], [])
