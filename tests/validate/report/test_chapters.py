"""Chapters of a report, with and without readings or snapshots."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sealtwin.core.facts import texts
from tests.support.evidence import axes_of
from validate.report.chapters import Paragraph, Plate, chapters, fill_plates, first_figure
from validate.report.write_report import report_data
from validate.settings import Uncertainty
from validate.uncertainty.computed import Effect, Spread
from validate.uncertainty.validation import predict
from validate.units import PageTable


def titles(content):
    return {chapter.title: [item.title for item in chapter.items if isinstance(item, PageTable)] for chapter in content}


def test_a_report_without_readings_shows_the_predictions_band_and_its_parts(evidence):
    """The level is of one run. An input moves it by 0.1 mm, and its numerical error is unknown."""
    evidence = replace(evidence, readings=None, comparison=None)
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
    assert "the nozzle's speed" in words.sentences[-1]
    assert "Uncertainty in figures" in titles(content)
    data: Any = report_data(evidence)
    assert texts(data.uncertainty) == words.sentences
    assert [part.mean_level_mm for part in data.prediction.parts] == pytest.approx([0.098], rel=0.01)


def test_a_report_shows_the_fill_over_time_if_the_run_has_snapshots(evidence, frames):
    (rest, above), (fill, same) = (
        list(fill_plates(replace(evidence, frames=moments))) for moments in ((), tuple(frames))
    )
    assert above.caption == same.caption
    assert [len(axes_of(plate.draw())) for plate in (rest, fill)] == [1 + 1, 3 + 1]


def test_no_figure_of_the_report_exceeds_its_margins(evidence, frames):
    plates = [item for chapter in chapters(replace(evidence, frames=tuple(frames))) for item in chapter.items]
    for figure in (item.draw() for item in plates if isinstance(item, Plate)):
        (left, lower), (right, upper) = figure.get_tightbbox().get_points()
        assert min(left, lower, *(figure.get_size_inches() - (right, upper))) >= 0
