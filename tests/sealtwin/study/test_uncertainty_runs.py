"""Extra runs for the uncertainty of a trial: other particle sizes, other seeds, and moved inputs."""

import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sealtwin.core import files, record_files
from sealtwin.core.errors import InputError, NumericalError, present
from sealtwin.core.progress import Progress
from sealtwin.study import runner, uncertainty_runs
from sealtwin.study.pipeline import run_stages
from sealtwin.study.study_folder import Outcome, read_plan
from sealtwin.study.uncertainty_runs import vary
from sealtwin.trial.validate_stage import SPREAD, read_spread
from tests.support.ingested_lab import edit
from tests.support.messages import Narration
from tests.support.report_stubs import leave_out_pages
from tests.support.tiny_study import TRIAL, job_in, run_tiny
from validate.report.report_facts import headline
from validate.result import read_comparison
from validate.uncertainty.validation import BedEnds

DECLARED = """
[uncertainty]
speed_mm_s = 1.0
volume_ml = 0.01
width_mm = 0.1
"""


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory) -> Path:
    """A run of the tiny trial, whose viscosity is U, with declared uncertainties of three inputs."""
    # Two particles are abreast at the coarser size too.
    return run_tiny(tmp_path_factory.mktemp("lab"), TRIAL.replace("radius_mm = 0.45", "radius_mm = 0.36") + DECLARED)


@pytest.fixture
def path(run_folder, tmp_path) -> Path:
    return shutil.copytree(run_folder, tmp_path / "run")


@pytest.fixture(scope="module")
def varied(run_folder, tmp_path_factory) -> Path:
    folder = shutil.copytree(run_folder, tmp_path_factory.mktemp("varied") / "run")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(uncertainty_runs, "cores", lambda: 0)
        narration = Narration()
        assert _vary(folder, narration)
        (remark,) = [note for note in narration.notes if note.startswith("note: ")]
        assert "fluid.U is " in remark, "as of the trial's own run"
        assert " runs (as of run 1): " in remark
    return folder


@pytest.fixture
def again(varied, tmp_path) -> Path:
    return shutil.copytree(varied, tmp_path / "run")


@pytest.fixture
def here(monkeypatch):
    """Compute in this process, since starting others takes seconds and is tested with sweeps."""
    monkeypatch.setattr(uncertainty_runs, "cores", lambda: 0)


def _vary(path: Path, progress: Progress | None = None) -> bool:
    with job_in(path, progress) as job:
        return vary(job)


def _spread(path: Path):
    """Return what the validate stage reads of the extra runs."""
    with job_in(path) as job:
        return read_spread(job)


def test_extra_runs_have_three_particle_sizes_and_a_two_level_design_of_inputs(varied):
    """The trial's own run is the third of its size, and three inputs fit into a design of four runs."""
    runs = read_plan(varied / "uncertainty").runs
    assert [run.state for run in runs] == ["done"] * 12
    radii = [run.settings.get("solver.radius_mm") for run in runs[:8]]
    assert radii == pytest.approx(np.repeat([0.36 / 1.3, 0.36, 0.36 * 1.3], (3, 2, 3)), abs=1e-4)
    assert [run.checked_trial.seed for run in runs] == [0, 1, 2, 1, 2, 0, 1, 2, 0, 0, 0, 0]
    signs = np.array([[run.settings[name] for name in ("speed_mm_s", "volume_ml", "width_mm")] for run in runs[8:]])
    assert np.abs(signs) == pytest.approx(np.tile([1.0, 0.01, 0.1], (4, 1)))
    assert signs.sum(axis=0) == pytest.approx(np.zeros(3))
    sizes = present(present(_spread(varied), "spread").sizes, "sizes")
    assert [size.levels_mm.shape[0] for size in sizes] == [3, 3, 3]
    assert min(size.levels_mm.std(axis=0, ddof=1).min() for size in sizes) > 0, "they scatter by their seeds"
    assert sizes[1].levels_mm[0] == pytest.approx(record_files.read_profile(varied).level_mm)


def test_the_physical_viscosity_is_the_same_at_every_particle_size(varied):
    """U and D depend on radius and frame; the physical viscosity of U and the drag per second do not."""
    simulation = files.read_json(varied / "simulation.json")
    base = simulation["health"]
    for run in read_plan(varied / "uncertainty").runs[0:8:7]:
        health = present(run.figures, "figures").health.recorded()
        finer = run.checked_trial.solver.size_mm / simulation["radius_mm"]
        as_stiff = base["U"] / finer**4 * health["frame_s"] / base["frame_s"]
        assert health["U"] == pytest.approx(as_stiff, rel=1e-6)
        assert health["viscosity_pa_s"] is None, "it has no yield stress"
        drag = run.checked_trial.given_fluid.D_cm / health["frame_s"]
        assert drag == pytest.approx(0.3 / base["frame_s"], rel=1e-6)


def test_the_comparison_states_numerical_and_input_uncertainties(again, monkeypatch):
    given = leave_out_pages(monkeypatch)
    with job_in(again) as job:
        run_stages(job, ("validate",))
    assert given[0].commands == ("sealtwin run trial.toml", "sealtwin validate trial.toml --uncertainty")
    assert "uncertainty: finished" in given[0].provenance
    assert not [name for name in given[0].provenance if name.endswith(("outline.json", "profile.csv"))], "by a stage"
    figures = present(read_comparison(again).uncertainty, "uncertainty")
    radii_mm = present(figures.numerics, "numerics").radii_mm
    assert radii_mm == pytest.approx([0.36 / 1.3, 0.36, 0.36 * 1.3], abs=1e-3)
    assert present(figures.mean_level.numerics_mm, "numerics_mm") > 0
    effects = {effect.name: effect.mean_level_mm for effect in figures.inputs}
    assert list(effects) == ["speed_mm_s", "volume_ml", "width_mm"]
    # 0.01 of 0.08 ml are some 0.4 mm of height in this crack; a wider one lets them sink.
    assert effects["volume_ml"] > 0.1
    assert effects["width_mm"] < 0
    assert "start_mm" in figures.inputs_left_out


def test_only_missing_extra_runs_are_computed_again_after_a_kill(varied, again, monkeypatch, here):
    """The folder has its ledger, but lacks its result and the profile of one run."""
    edit(again / "trial.toml", "volume_ml = 0.01", "volume_ml = 0.0100")
    (again / SPREAD).unlink()
    lost = read_plan(again / "uncertainty").runs[9]
    shutil.rmtree(again / "uncertainty" / "runs" / lost.key[:16])
    waiting, compute = [], runner.compute

    def noted(folder, runs, *rest):
        waiting.extend(run.key for run in runs if run.state == "waiting")
        return compute(folder, runs, *rest)

    monkeypatch.setattr(runner, "compute", noted)
    assert _vary(again)
    assert (again / SPREAD).read_bytes() == (varied / SPREAD).read_bytes()
    assert not _vary(again)
    assert waiting == [lost.key]
    edit(again / "trial.toml", "width_mm = 0.1", "width_mm = 0.2")
    assert _spread(again) is None, "of other settings the old runs say nothing"


def test_failed_extra_runs_give_an_error_and_no_result(path, monkeypatch, here):
    monkeypatch.setattr(runner, "seal", lambda *_, **__: [Outcome("failed", reason="diverged in frame 7.")])
    with pytest.raises(NumericalError, match=r"12 of 12 runs failed.*\nsolver.radius_mm = 0.2769: diverged in"):
        _vary(path)
    assert not (path / SPREAD).exists()


def test_a_trial_without_readings_gives_a_predicted_level_with_its_band(again, monkeypatch):
    """The extra runs are those of the comparison, since they need no readings."""
    text = (again / "trial.toml").read_text()
    (again / "trial.toml").write_text(re.sub(r"(?s)\[readings\].*?(?=\n\[|$)", "", text))
    assert not _vary(again), "none is computed again"
    given = leave_out_pages(monkeypatch)
    # The tiny trial's fluid has no yield stress, and so no mound.
    monkeypatch.setattr(BedEnds, "of", lambda trajectory, run: BedEnds(trajectory.s_mm[0], trajectory.s_mm[-1], 2.0))
    with job_in(again) as job:
        result = run_stages(job, ("validate",)).result
    predicted, computed = files.read_json(again / "prediction.json"), record_files.read_profile(again)
    assert result.prediction is not None
    assert result.prediction.model_dump(mode="json") == predicted
    level_mm = np.interp(predicted["s_mm"], computed.s_mm, computed.level_mm)
    assert predicted["level_mm"] == pytest.approx(level_mm, abs=1e-3)
    assert np.mean(predicted["mean_level_95_mm"]) == pytest.approx(predicted["mean_level_mm"])
    parts = np.array([predicted[name] for name in ("numerics_mm", "inputs_mm", "model_mm")])
    assert parts[2].max() > 0.5
    band_mm = np.array(predicted["band_95_mm"])
    assert band_mm == pytest.approx(2 * np.sqrt(np.square(parts).sum(axis=0)), rel=0.25)
    assert (np.array(predicted["profile_band_95_mm"]) >= band_mm).all()
    assert np.ptp(predicted["flat_level_mm"]) < 1e-3
    assert [missing["setting"] for missing in predicted["missing"]] == ["uncertainty.surface_tension_n_m"]
    (fact,), outcome = headline(given[0])
    assert outcome == "open"
    assert fact.text.startswith("Predicted, with no setting fitted to this sample: the mean level is ")


def test_extra_runs_with_particles_too_large_for_the_crack_are_refused(path, monkeypatch):
    monkeypatch.setattr(uncertainty_runs, "RATIO", 1.6)
    with pytest.raises(
        InputError, match=r"not possible. runs 6, 7, 8: solver.radius_mm is 0.576: fewer than 2 particles"
    ):
        _vary(path)


@pytest.mark.parametrize(
    ("declared", "message"),
    [
        ("start_mm = 3.0", "trim_mm"),
        ("wall_angle_deg = 1.0", "the walls are vertical"),
        ("yield_stress_pa = 5.0", r"yield_stress_pa = -5\.0"),
    ],
)
def test_declared_uncertainties_that_cannot_be_applied_are_refused(path, declared, message, here):
    """The path begins 1 mm from the end, the walls have no angle, and the paste no yield stress."""
    edit(path / "trial.toml", "speed_mm_s = 1.0\n", f"{declared}\n")
    with pytest.raises(InputError, match=message):
        _vary(path)


def test_extra_runs_repeated_with_more_substeps_give_a_note(again, monkeypatch):
    """Runs with different substeps do not scatter by their seeds alone."""
    resume = runner.resume

    def resumed(*given, **more):
        first, *others = resume(*given, **more)
        figures = present(first.figures, "figures")
        finer = figures.model_copy(update={"health": figures.health.model_copy(update={"finer": 2})})
        return [replace(first, figures=finer), *others]

    monkeypatch.setattr(runner, "resume", resumed)
    monkeypatch.setattr("sealtwin.core.run_folder.RunFolder.is_current", lambda *_: False)
    _vary(again, narration := Narration())
    (named,) = [note for note in narration.notes if "solver.substeps" in note]
    assert named.startswith("note: 1 of 12 extra runs failed, and were computed again with more substeps (")
