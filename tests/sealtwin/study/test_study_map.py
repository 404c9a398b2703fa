"""Maps of sweeps: errors of runs, runs that are not ranked, and refusals."""

import json
import re
import shutil
from dataclasses import replace

import pytest

from sealtwin.cli.studies import mapped_lines
from sealtwin.core import record_files
from sealtwin.core.errors import InputError, present
from sealtwin.core.files import sha256
from sealtwin.core.progress import Progress
from sealtwin.study.study_folder import (
    FILL,
    forget_outcome,
    profile_path,
    read_plan,
    run_path,
    write_outcome,
    write_plan,
)
from sealtwin.study.study_map import map_study, read_fill
from tests.support.ingested_lab import sealtwin

pytestmark = pytest.mark.usefixtures("without_pictures")


def mapped_without_fills(folder, out=None, caliper=None, data=None):
    """Map a study at any volume, since one of the four tiny runs gains a tenth of its volume."""
    return map_study(folder, out, caliper, data, Progress(), fills=False, any_volume=True)


def test_errors_on_the_map_equal_the_errors_of_the_sweep(unbroken, tmp_path):
    """The map integrates profiles that their files round to 1e-6 mm."""
    mapped = mapped_without_fills(unbroken, tmp_path)
    ledger = {run.number: present(run.figures, "figures") for run in read_plan(unbroken).runs}
    for run in mapped.chart.runs:
        figures = ledger[run.number]
        errors_mm = figures.mean_error_mm, figures.worst_error_mm
        assert (run.mean_error_mm, run.worst_error_mm) == pytest.approx(errors_mm, abs=2e-6)
    content = json.loads((tmp_path / "map.json").read_text(encoding="utf-8"))
    assert content["against_baselines"] in mapped_lines(mapped)
    assert content["best"]["number"] == mapped.chart.best.number
    assert all((tmp_path / name).is_file() for name in content["files"])
    answer = sealtwin("map", unbroken, "--no-fills", "--out", tmp_path, "--any-volume", "--json", "--quiet")
    assert json.loads(answer.stdout) == content


@pytest.mark.parametrize("lost", [0, 1, 4])
def test_the_map_draws_stored_fills_and_names_chosen_runs_without_fills(done, lost):
    """A sweep stores no fills of runs that share a launch, for example."""
    runs = read_plan(done).runs
    fill = read_fill(run_path(done, runs[0]) / FILL)
    assert fill.frames[-1].t_s >= fill.frames[0].t_s > 0
    assert len(fill.frames[-1].position_mm) == present(runs[0].figures, "figures").particles
    for run in runs[:lost]:
        (run_path(done, run) / FILL).unlink()
    progress = Progress()
    mapped = map_study(done, None, None, None, progress, any_volume=True)
    named = ", ".join(str(run.number) for run in runs[:lost])
    assert [f"how runs {named} fill" in warned.text for warned in progress.warned] == [True] * bool(lost)
    drawn = {"figures/fills.svg", "figures/thumbnails.svg"} & set(mapped.content["files"])
    assert len(drawn) == (0 if lost == 4 else 2)


def test_runs_without_a_result_are_left_out_with_their_reasons(done):
    """One of five runs failed, so that the map has four."""
    plan = read_plan(done)
    fifth = forget_outcome(done / "elsewhere", plan.runs[0])
    fifth = replace(fifth, key="f" * 64, number=5, settings={"fluid.U": 1e6, "fluid.D_cm": 0.03})
    write_plan(done, replace(plan, runs=[*plan.runs, fifth]))
    write_outcome(done, replace(fifth, state="failed", reason="The numbers diverged."))
    mapped = mapped_without_fills(done)
    assert mapped.chart.exclusion == "1 of 5 runs are not ranked. Run 5: The numbers diverged."
    assert [each["number"] for each in mapped.content["excluded"]] == [5]


def test_a_run_with_a_wrong_volume_is_not_ranked(done):
    """The run with the wrong volume has the smallest error of five."""
    plan = read_plan(done)
    for run in plan.runs:
        figures = present(run.figures, "figures").model_copy(update={"volume_ratio": 1.05})
        write_outcome(done, replace(run, figures=figures))
    best = mapped_without_fills(done).chart.best.number
    fifth = replace(next(run for run in plan.runs if run.number == best), number=5, key="f" * 64)
    fifth = replace(fifth, settings={"fluid.U": 7.0, "fluid.D_cm": 0.03})
    shutil.copytree(run_path(done, plan.runs[best - 1]), run_path(done, fifth))
    profile = record_files.read_profile(run_path(done, fifth))
    record_files.write_profile(run_path(done, fifth), replace(profile, level_mm=0 * profile.s_mm - 1.5))
    changes = {"volume_ratio": 1.051, "profile_sha256": sha256(profile_path(done, fifth))}
    figures = present(fifth.figures, "figures").model_copy(update=changes)
    write_plan(done, replace(plan, runs=[*plan.runs, fifth]))
    write_outcome(done, replace(fifth, figures=figures))
    assert mapped_without_fills(done).chart.best.number == 5
    mapped = map_study(done, None, None, None, Progress(), fills=False)
    assert mapped.chart.best.number == best
    assert [(each["number"], each["volume_ratio"]) for each in mapped.content["excluded"]] == [(5, 1.051)]
    assert mapped.content["beats_flat_level"] is (
        mapped.chart.best.mean_error_mm < mapped.content["flat_level_error_mm"]
    )


def test_a_map_of_a_missing_too_small_or_edited_study_is_refused(done, tmp_path):
    assert "not a study" in json.loads(sealtwin("map", tmp_path, "--no-fills", "--json").stdout)["error"]
    with pytest.raises(InputError, match=r"of 4 finished runs can be ranked\. .* at least 4"):
        map_study(done, None, None, None, Progress(), fills=False)
    run = read_plan(done).runs[2]
    with profile_path(done, run).open("a") as changed:
        changed.write("99.0,1.0\n")
    with pytest.raises(InputError, match=f"was changed after run {run.number} wrote it"):
        mapped_without_fills(done)
    forget_outcome(done, run)
    with pytest.raises(InputError, match="3 of 4 runs are done"):
        mapped_without_fills(done)


def test_a_map_of_other_readings_requires_the_origin_of_the_readings(done, lab, tmp_path):
    """The study's own sheet is recognised by its content under any name."""
    same = tmp_path / "same.csv"
    shutil.copyfile(lab.parent / "readings.csv", same)
    assert mapped_without_fills(done, caliper=same).chart.readings.data == "synthetic"
    other = tmp_path / "other.csv"
    other.write_text("s_mm,level_1_mm\n1,-3\n4,-3\n7,-2\n11,-2\n", encoding="utf-8")
    with pytest.raises(InputError, match=re.escape("Give --data measured, reconstructed or synthetic")):
        mapped_without_fills(done, caliper=other)
    before = mapped_without_fills(done).chart
    after = mapped_without_fills(done, caliper=other, data="measured").chart
    assert after.readings.data == "measured"
    # Readings that are 1 mm lower raise every bias by 1 mm.
    for first, second in zip(before.runs, after.runs, strict=True):
        assert second.bias_mm - first.bias_mm == pytest.approx(1.0, abs=1e-9)
