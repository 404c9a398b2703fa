"""Which figures a report has."""

from dataclasses import replace

from tests.evidence import axes_of
from validate.report.chapters import fill_plates


def test_a_report_shows_the_fill_where_the_run_left_snapshots(evidence, frames):
    plates = {len(given): list(fill_plates(replace(evidence, frames=given))) for given in ((), tuple(frames))}
    extra = [plate for plate in plates[3] if plate.caption not in {plate.caption for plate in plates[0]}]
    assert "as in the paper's Fig. 6" in extra[0].caption
    assert [len(axes_of(plate.draw())) for plate in extra] == [3 + 1, 3 + 1]
