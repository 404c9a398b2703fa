"""Studies of the fast model: computed without particles, and named in every row, on the sheet and on the map."""

import csv

from sealtwin.cli.studies import swept_lines
from sealtwin.core.progress import Progress
from sealtwin.study.runner import StudyOptions
from sealtwin.study.study_folder import read_plan
from sealtwin.study.study_map import chart_of
from sealtwin.study.sweep import sweep
from tests.support.tiny_study import tiny_lab
from validate.figures.map_page import map_page

FAST = """
[fixed]
"solver.model" = "slot"
"solver.settle_s" = 1.0
"fluid.freeze_after_s" = "never"

[grid]
"fluid.viscosity_pa_s" = [0.05, 0.5]
"fluid.yield_stress_pa" = [0.5, 1.0, 40.0]
"""


def test_a_study_of_the_fast_model_is_named_wherever_it_is_shown(tmp_path):
    study, out = tiny_lab(tmp_path, FAST), tmp_path / "out"
    swept = sweep(study, out, StudyOptions("cpu", 0), Progress())
    assert swept["states"] == {"waiting": 0, "done": 6, "failed": 0}
    with (out / "runs.csv").open(newline="", encoding="utf-8") as table:
        rows = list(csv.DictReader(table))
    assert [row["model"] for row in rows] == ["slot"] * 6
    assert {row["particles"] for row in rows} == {""}
    # The stiff pastes stack under the nozzle.
    assert ["slope" in row["unfit"] for row in rows] == [False, False, True] * 2
    assert swept["screening"].startswith("6 of 6 runs are by the fast model")
    assert "It is unfit for 2 of them" in swept["screening"]
    assert swept["screening"] in swept_lines(swept)
    plan = read_plan(out)
    assert [run.ranked for run in plan.runs] == [True, True, False] * 2
    chart = chart_of(out, [run for run in plan.runs if run.ranked], plan)
    assert {run.number: run.reason.key for run in chart.excluded} == {3: "unfit", 6: "unfit"}
    assert "do not scatter" in chart.flatness
    assert map_page(chart, []).cautions[0] == swept["screening"]


def test_a_study_asks_about_a_slip_of_unit_before_it_begins(tmp_path):
    progress, slip = Progress(), FAST.replace("[0.05, 0.5]", "[0.5, 300.0]")
    sweep(tiny_lab(tmp_path, slip), tmp_path / "out", StudyOptions("cpu", 0, dry_run=True), progress)
    assert ("setting.viscosity_pa_s", 300) in [(fact.key, fact.value) for fact in progress.warned]


def test_the_meniscus_of_a_map_is_that_of_the_sealants_density(tmp_path):
    """Gravity flattens a meniscus: the band of readings of heavy sealant is narrower."""
    band_mm = []
    for density in (700.0, 4000.0):
        (folder := tmp_path / f"{density:g}").mkdir()
        table = f'[fixed]\n"fluid.density_kg_m3" = {density}\n'
        varies = FAST.replace("[fixed]\n", table).replace("[0.5, 1.0, 40.0]", "[0.5, 1.0]")
        study, out = tiny_lab(folder, varies), folder / "out"
        with (folder / "trial.toml").open("a", encoding="utf-8") as trial:
            trial.write("\n[uncertainty]\nsurface_tension_n_m = 0.07\n")
        sweep(study, out, StudyOptions("cpu", 0), Progress())
        plan = read_plan(out)
        band_mm.append(chart_of(out, [run for run in plan.runs if run.ranked], plan).band_mm.mean())
    assert band_mm[0] > band_mm[1]
