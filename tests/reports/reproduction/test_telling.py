"""The page of the reproduction, from a study whose errors are known."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

from reports.reproduction.claims import CLAIMS
from reports.reproduction.extra_claims import SLOT_CLAIM
from reports.reproduction.judging import NOT_COMPUTED, Finding, judge, not_computed
from reports.reproduction.kept import kept_of
from reports.reproduction.redrawn import first_readings, redraw
from reports.reproduction.scatter import SEEDS, Replicates, deciding_pairs, draws_of, join
from reports.reproduction.surface import CHOSEN, surface_of
from reports.reproduction.telling import Feeding, Study, Told, page, tell, tell_feeding
from reports.reproduction.unequal import by_sampling, of_all
from tests.charts import make_chart
from validate.figures.chart import HeldRun


@cache
def findings() -> Sequence[Finding]:
    chart = make_chart()
    draws = draws_of(chart, None, redraw()[:20])
    return [judge(claim, surface_of(chart), draws) for claim in CLAIMS]


def _moved(run: HeldRun, seed: int) -> HeldRun:
    """The run with another seed, a micrometre higher: a copy would be refused."""
    return replace(run, profile=replace(run.profile, level_mm=run.profile.level_mm + 1e-3 * seed))


@cache
def told(*, again: bool = False) -> str:
    chart = make_chart()
    chosen = next(run for run in chart.runs if run.at == CHOSEN)
    replicates: Replicates | None = None
    if again:
        own = {run.at: run for run in chart.runs}
        replicates = join(chart, [(pair, _moved(own[pair], seed)) for pair in deciding_pairs(chart) for seed in SEEDS])
    first = first_readings(chosen.profile, chart.readings)
    study = tell(Study(0.6, chart, {CHOSEN: 1.23}, ["heat"], first, replicates))
    feeding = Feeding(chart, by_sampling(chosen, chart.readings), chosen.mean_error_mm, of_all(chart))
    part = Told("flare", "walls flared", kept_of(0.0, findings(), study), None, findings())
    missing = {"walls leaning": "7 of its 132 pairs are computed"}
    return page([part], missing, not_computed(SLOT_CLAIM), tell_feeding(feeding))


def rows_of(heading: str) -> dict[str, str]:
    """Lines of the tables below a heading, by their first cell."""
    below = told().partition(heading)[2].partition("\n## ")[0]
    return {line.split(" | ")[0].removeprefix("| "): line for line in below.splitlines() if line.startswith("| ")}


def test_the_page_says_what_is_not_computed_and_what_runs_scatter_by():
    assert "- walls leaning: not on this page, since 7 of its 132 pairs are computed." in told()
    assert f"({NOT_COMPUTED}; paper: 9 times)" in told()
    assert "other seeds are not computed yet" in told()
    assert "other seeds are not computed yet" not in told(again=True)
    assert f"{len(SEEDS)} other seeds of each deciding pair" in told(again=True)
    assert "| U = 30, D = 0.3 cm | 0.50 mm | 0.50 mm | 0.00 mm |" in told(again=True)


def test_the_page_calls_readings_reconstructed_wherever_it_shows_them():
    """In each section that shows numbers against them."""
    for section in told(again=True).split("\n## ")[1:]:
        if "readings" in section.lower():
            assert "RECONSTRUCTED" in section, section.splitlines()[0]
