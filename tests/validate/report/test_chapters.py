"""What a report says, in which order, and what it says where something is not there."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.evidence import axes_of, make_evidence
from validate.compare import assess
from validate.report.chapters import Paragraph, Plate, chapters, fill_plates, first_figure
from validate.report.report_data import report_data
from validate.settings import Readings, Uncertainty
from validate.uncertainty.computed import Effect, Spread
from validate.uncertainty.validation import predict
from validate.units import PageTable


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


def test_the_answer_comes_first_and_tables_come_last(content, assessed):
    """The error by place below the first page, as in the paper's Fig. 9b; every table is in the appendix."""
    for given in (content, chapters(assessed)):
        histogram = given[0].items[0]
        assert isinstance(histogram, Plate)
        assert "each 10 mm of the crack" in histogram.caption
        assert [chapter.appendix for chapter in given] == sorted(chapter.appendix for chapter in given)
        before = [item for chapter in given if not chapter.appendix for item in chapter.items]
        assert not any(isinstance(item, PageTable) for item in before)
        assert len({chapter.name for chapter in given}) == len(given)


def test_without_readings_a_prediction_draws_its_band_and_names_its_parts(plain):
    """Of a level by one run and inputs that move it by 0.1 mm, numerics unknown."""
    evidence: Any = replace(plain, readings=None, comparison=None)
    assert not titles(chapters(evidence)).keys() & {"Agreement and readings", "Uncertainty in figures", "Error"}
    s_mm = evidence.profile.s_mm
    volume = Effect("volume_ml", 0.1, np.full(len(s_mm), 0.1))
    spread = Spread(s_mm, None, (volume,), 0.0, 0.5)
    evidence = replace(evidence, prediction=predict(evidence.profile, spread, Uncertainty(volume_ml=0.1)))
    assert evidence.prediction.band_95_mm == pytest.approx(0.196, rel=0.01)
    assert evidence.prediction.mean_level_mm == pytest.approx(evidence.profile.level_mm.mean())
    content = chapters(evidence)
    drawn = first_figure(evidence).draw().axes[1].get_legend_handles_labels()[1]
    assert {"19 of 20 at one place", "19 of 20 simulated levels"} < set(drawn)
    (words,) = next(chapter for chapter in content if chapter.title == "Uncertainty").items
    assert isinstance(words, Paragraph)
    assert "± 0.20 mm (95 %" in words.sentences[0]
    assert any("numerics" in sentence and "not in the band" in sentence for sentence in words.sentences)
    assert "the nozzle's speed" in words.sentences[2]
    assert "Uncertainty in figures" in titles(content)
    data: Any = report_data(evidence)
    assert data.uncertainty == words.sentences
    assert [part.mean_level_mm for part in data.prediction.parts] == pytest.approx([0.098], rel=0.01)


def test_a_report_shows_the_fill_where_the_run_left_snapshots(evidence, frames):
    plates = {len(given): list(fill_plates(replace(evidence, frames=given))) for given in ((), tuple(frames))}
    extra = [plate for plate in plates[3] if plate.caption not in {plate.caption for plate in plates[0]}]
    assert "as in the paper's Fig. 6" in extra[0].caption
    assert [len(axes_of(plate.draw())) for plate in extra] == [3 + 1]
