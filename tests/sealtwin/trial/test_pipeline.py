"""A whole run: its files, its answer, and its continuation after an interruption."""

import json
import random
import shutil
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path

import pytest

from sealtwin.core.errors import present
from sealtwin.core.files import sha256
from simulate import watchers
from tests.support.ingested_lab import edit
from tests.support.processes import refusal, sealtwin
from tests.support.report_stubs import leave_out_figures, leave_out_pages
from tests.support.tiny_study import TRIAL, tiny_lab
from validate.result import read_comparison, read_result

LEFT = {
    "trial.toml", "overlay.png", "straight.png", "outline.json", "crack.stl", "crack.ply", "crack.glb", "solid.json",
    "trajectory.csv", "trajectory.txt", "particles.csv", "simulation.json", "profile.csv", "comparison.json",
    "report.html", "report.json", "run.json", "manifest.json",
}  # fmt: skip
NOT_IN_MANIFEST = {"trial.toml", "run.json", "manifest.json"}
"""The last two belong to the latest run, finished or not."""
SAME_IN_EVERY_RUN = LEFT - NOT_IN_MANIFEST - {"simulation.json", "report.html", "report.json"}
"""Everything but wall times."""
READINGS = "s_mm,level_1_mm,level_2_mm\n" + "".join(f"{s},-5.0,-5.{s % 2:.0f}\n" for s in (0.5, 3, 4, 7, 9, 11, 13.5))
"""A sheet with enough stations for a verdict."""
NO_PICTURES = "\n[output]\nsnapshots_s = []\n"
GATE = "\n[gate]\nmean_error_mm = 20.0\n"


def _ended(*arguments: object, code: int = 0) -> str:
    """Call a command, require its exit code, and return its narration."""
    answer = sealtwin(*arguments)
    assert answer.exit_code == code, answer.stderr
    return answer.stderr


def _json(*arguments: object, code: int = 0) -> dict:
    answer = sealtwin(*arguments, "--json")
    assert answer.exit_code == code, answer.stderr
    return json.loads(answer.stdout)


def _files(run: Path) -> dict[str, str]:
    return {path.name: sha256(path) for path in run.iterdir() if path.is_file() and not path.name.startswith(".")}


@pytest.fixture(scope="module")
def unbroken(tmp_path_factory) -> tuple[Path, Path, dict]:
    """Trial, run folder, and the answer of one run without disturbance."""
    lab = tmp_path_factory.mktemp("lab")
    trial = tiny_lab(lab / "trial").with_name("trial.toml")
    calibrated = 'data = "reconstructed"\nfitted = ["fluid.U"]\nrole'
    trial.write_text(TRIAL.replace('data = "synthetic"\nrole', calibrated) + GATE + NO_PICTURES)
    trial.with_name("readings.csv").write_text(READINGS)
    with pytest.MonkeyPatch.context() as patch:
        leave_out_figures(patch)
        return trial, lab / "run", _json("run", trial, "--out", lab / "run", "--device", "cpu")


@pytest.fixture
def copied(unbroken, tmp_path) -> Path:
    """A copy of the finished run folder, which a test may change."""
    return Path(shutil.copytree(unbroken[1], tmp_path / "copy"))


@pytest.fixture
def no_pages(monkeypatch):
    leave_out_pages(monkeypatch)


@pytest.fixture
def no_figures(monkeypatch):
    leave_out_figures(monkeypatch)


def test_the_run_command_writes_all_files_and_prints_the_result(unbroken):
    _, run, answer = unbroken
    assert _files(run).keys() == LEFT
    result, report = read_result(run), json.loads((run / "report.json").read_text(encoding="utf-8"))
    assert result.model_dump(mode="json") == answer == json.loads((run / "run.json").read_text(encoding="utf-8"))
    compared, fluid = present(result.comparison, "comparison"), present(result.fluid, "fluid")
    assert (fluid.escaped_particles, fluid.particles) == (0, 170)
    assert [asdict(fact) for fact in fluid.warnings] == report["cautions"][:-1]
    assert Path(answer["report"]).name == "report.html"
    assert (compared.role, compared.fitted) == ("calibrated-on", ("fluid.U",))
    uncertainty = present(compared.uncertainty, "uncertainty")
    assert uncertainty.mean_level.resolved is None
    low_mm, high_mm = uncertainty.mean_error_interval_mm
    assert low_mm < compared.mean_error_mm < high_mm
    assert compared.headline[-1].text.startswith("Gate passed: ")
    assert compared.findings[0].text.startswith("ASME V&V 20 is not assessed")
    # The time in the findings differs from machine to machine; all else is what the stage wrote.
    first, second = (one.model_copy(update={"findings": ()}) for one in (compared, read_comparison(run)))
    assert first.model_dump_json() == second.model_dump_json()
    assert report["readings"]["sha256"] == sha256(run / "inputs" / "readings.csv")
    assert {"digitise: finished", "simulate: finished", "validate: begun"} <= set(report["provenance"])
    assert "validated" not in (run / "report.html").read_text(encoding="utf-8").lower()


def test_a_failed_command_leaves_the_run_folder_unchanged(unbroken):
    """Settings of another trial must not be stored beside the results of this trial."""
    trial, run, _ = unbroken
    before, text, other = _files(run), trial.read_text(), trial.with_name("other.toml")
    for file, old, new, named in (
        (trial, 'file = "crack.png"', 'file = "none/crack.png"', "none"),
        (trial, "radius_mm = 0.45", "radius_mm = 0.9", "solver.radius_mm"),
        (other, "", "", "other.toml"),
    ):
        file.write_text(text.replace(old, new))
        assert named in refusal("run", file, "--out", run, "--device", "cpu", "--quiet")
        assert _files(run) == before
        trial.write_text(text)


def test_an_edited_profile_is_compared_without_a_verdict(copied, no_figures):
    """Plain files allow any stage to be replaced by hand, but such a result is no validation."""
    profile = copied / "profile.csv"
    rows = [line.split(",")[0] + ",-1.0" for line in profile.read_text().splitlines()[1:]]
    profile.write_text("s_mm,level_mm\n" + "\n".join(rows) + "\n")
    answer = _json("validate", copied, code=5)
    assert answer["edited"] == ["profile.csv"]
    compared = answer["comparison"]
    assert 3.0 < compared["errors"]["mean_error_mm"] < 4.5
    assert (compared["outcome"], compared["passed"], compared["findings"]) == ("undecided", False, [])
    assert [fact["key"] for fact in compared["headline"]] == ["verdict.edited"]
    page = (copied / "report.html").read_text(encoding="utf-8")
    assert page.index("after the run (profile.csv): this report") < page.index("Not a validation")
    assert '<header class="first undecided">' in page


def test_a_damaged_result_file_is_refused_without_a_traceback(copied, no_pages):
    content = json.loads((copied / "solid.json").read_text())
    content.pop("sealant_mm3")
    (copied / "solid.json").write_text(json.dumps(content))
    assert "sealant_mm3" in refusal("validate", copied)


@pytest.mark.slow
def test_snapshots_requested_later_do_not_change_the_result(copied):
    """Particles and profile are equal to the bit. A snapshot after the run's end gives a note."""
    before, trial = _files(copied), copied / "trial.toml"
    asked = trial.read_text().replace("snapshots_s = []", "snapshots_s = [0.4, 0.1, 9.0]")
    trial.write_text(asked)
    arguments = ("simulate", copied, "--device", "cpu")
    assert "note: there is no snapshot at 9 s, since the run ended at 0.61 s." in _ended(*arguments)
    for name in ("particles.csv", "profile.csv"):
        assert _files(copied)[name] == before[name]
    assert {path.name for path in (copied / "snapshots").iterdir()} == {
        "0000.100s.vtp", "0000.400s.vtp", "snapshots.pvd"
    }  # fmt: skip
    trial.write_text(asked.replace("[0.4, 0.1, 9.0]", "[0.4]"))
    (copied / "checkpoint.npz").write_bytes(b"of a run that was killed just after it was finished")
    assert "nothing to redo" in _ended(*arguments)
    assert not (copied / "checkpoint.npz").exists()


def test_pdf_and_pictures_are_written_only_if_output_pictures_is_true(copied, monkeypatch):
    leave_out_figures(monkeypatch)
    for wanted in ("true", "false"):
        answer = _ended("validate", copied, "--set", f"output.pictures={wanted}")
        assert (copied / "report.pdf").exists() == (wanted == "true")
        assert ("report.pdf: is deleted" in answer) == (wanted == "false")


def _assert_same_run(run: Path, unbroken_run: Path) -> None:
    files, others = _files(run), _files(unbroken_run)
    assert {name: files[name] for name in SAME_IN_EVERY_RUN} == {name: others[name] for name in SAME_IN_EVERY_RUN}
    assert files.keys() == LEFT


@pytest.mark.slow
def test_runs_killed_at_random_moments_give_the_same_files(unbroken, tmp_path, no_figures):
    """Each folder is killed early three times and then once late, since a finished run cannot be killed."""
    trial, run, answer = unbroken
    moments, killed = random.Random(20), 0
    for number in range(20):
        command = ("run", trial, "--out", tmp_path / f"run{number // 4}", "--device", "cpu", "--quiet")
        share = moments.uniform(0.5, 0.9) if number % 4 == 3 else moments.uniform(0.01, 0.5)
        line = [sys.executable, "-m", "sealtwin", *map(str, command)]
        try:
            # A process takes 1.5 s before it begins.
            subprocess.run(line, timeout=share * (1.5 + answer["wall_time_s"]), capture_output=True, check=False)
        except subprocess.TimeoutExpired:
            killed += 1
        if number % 4 == 3:
            _ended(*command)
            _assert_same_run(tmp_path / f"run{number // 4}", run)
    assert killed >= 12


def test_an_interrupted_run_continues_from_its_checkpoint(unbroken, tmp_path, no_pages, monkeypatch):
    """Its files equal those of an uninterrupted run to the bit. With changed settings it begins again, with a note."""
    trial, run, _ = unbroken
    command = ("run", trial, "--out", tmp_path / "run", "--device", "cpu")

    def interrupted(self, injection):
        kept(self, injection)
        if injection.done == 20:
            raise KeyboardInterrupt

    kept = watchers.Checkpoint.after_frame
    with monkeypatch.context() as patch:
        patch.setattr(watchers, "EVERY_S", 0)
        patch.setattr(watchers.Checkpoint, "after_frame", interrupted)
        assert _ended(*command, code=130).splitlines()[-1].startswith("sealtwin: interrupted")
    assert not (tmp_path / "run" / ".holder.json").exists()
    shutil.copytree(tmp_path / "run", tmp_path / "other")
    assert "checkpoint.npz: the run continues after frame 20" in _ended(*command)
    _assert_same_run(tmp_path / "run", run)
    edit(tmp_path / "other" / "trial.toml", "U = 30.0", "U = 20.0")
    assert "is from a run with other settings" in _ended("simulate", tmp_path / "other", "--device", "cpu")
    assert not (tmp_path / "other" / "checkpoint.npz").exists()


class ReachedError(Exception): ...


def test_the_threads_option_applies_only_to_fluid_runs_on_a_cpu(copied, monkeypatch):
    def launcher(device: str, rows: object, threads: int, lanes: int) -> None:
        raise ReachedError(device, threads)

    monkeypatch.setattr("simulate.fluid.solver.Launcher", launcher)
    # Another seed is another run.
    command = ("simulate", copied, "--set", "seed=1", "--threads", "2")
    answer = sealtwin(*command, "--device", "cpu")
    assert isinstance(answer.exception, ReachedError)
    assert answer.exception.args == ("cpu", 2)
    monkeypatch.setattr("simulate.device.choose_device", lambda _: "cuda:0")
    assert "--threads 2: threads apply only to a CPU, but this run is on cuda:0" in refusal(*command)
