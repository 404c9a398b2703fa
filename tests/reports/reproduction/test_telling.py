"""The page of the reproduction, from a study whose errors are known."""

from reports.reproduction.claims import findings
from reports.reproduction.redrawn import errors_against, redraw
from reports.reproduction.surface import CHOSEN, surface_of, surfaces_of
from reports.reproduction.telling import Feeding, Study, page
from reports.reproduction.unequal import by_sampling, of_all
from tests.charts import make_chart


def test_the_page_states_every_claim_with_its_judgement():
    chart = make_chart()
    redrawn = redraw()[:20]
    found = findings(surface_of(chart), surfaces_of(chart, errors_against(chart, redrawn), redrawn))
    study = Study("flare", "walls flared", 0.6, chart, found, {CHOSEN: 1.23}, ["heat"])
    chosen = next(run for run in chart.runs if run.at == CHOSEN)
    feeding = Feeding(chart, by_sampling(chosen, chart.readings), chosen.mean_error_mm, of_all(chart))
    lines = page([study], feeding).splitlines()
    rows = {line.split(" | ")[0].removeprefix("| "): line for line in lines if line.startswith("| ")}
    for finding in found:
        assert finding.ours in rows[finding.name]
        assert finding.judgement in rows[finding.name]
    assert any("1.23 mm" in line for line in lines)
    assert "![Mean error over U and D (its Fig. 8)](figures/flare-heat.svg)" in lines
