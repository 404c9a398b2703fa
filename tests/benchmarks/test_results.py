"""Changes of the code after which the record of all benchmarks requires a benchmark to run again."""

import subprocess

import pytest

from benchmarks.results import KEEPING, code_sha256, remove_older_runs


@pytest.fixture
def checkout(tmp_path):
    """A file of one character for each name, which git knows."""

    def make(*names):
        for name in names:
            (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / name).write_text("1")
        subprocess.run(["git", "init", "-q"], cwd=tmp_path, check=True)
        return tmp_path

    return make


FOLLOWS = (
    ("benchmarks/solids.py", True),
    ("benchmarks/table.py", True),
    ("digitise/solid/build_solid.py", True),
    ("digitise/__init__.py", True),
    ("simulate/__init__.py", False),
    ("fixtures/paper-trial/trial.toml", True),
    ("constraints.txt", True),
    ("simulate/run.py", False),
    ("validate/compare.py", False),
    ("validate/labels.toml", False),
    ("benchmarks/calibration.csv", False),
    ("README.md", False),
)


@pytest.mark.parametrize(("name", "follows"), FOLLOWS)
def test_the_code_hash_of_a_benchmark_changes_only_with_its_imports_and_inputs(checkout, name, follows):
    root = checkout(*(name for name, _ in FOLLOWS))
    before = code_sha256(root, "-m benchmarks.solids")
    (root / name).write_text("2")
    assert (code_sha256(root, "-m benchmarks.solids") != before) == follows


@pytest.mark.parametrize(
    ("name", "kept", "changed"),
    [
        ("slot", "slot/levels.csv", "simulate/run.py"),
        ("blind_own_band", "blind/real.csv", "benchmarks/blind_trials.json"),
        ("calibration", "calibration.csv", "benchmarks/calibration.py"),
    ],
)
def test_kept_runs_are_removed_if_other_code_began_them(checkout, name, kept, changed):
    numbers = f"benchmarks/{KEEPING[name]}.json"
    root = checkout(changed, numbers, f"benchmarks/{kept}")
    runs = root / "benchmarks" / kept
    remove_older_runs(root, name)
    assert not runs.exists()
    runs.parent.mkdir(exist_ok=True)
    runs.write_text("runs of today's code, stopped half way")
    (root / numbers).write_text("2")
    remove_older_runs(root, name)
    assert runs.exists()
    (root / changed).write_text("2")
    remove_older_runs(root, name)
    assert not runs.exists()
