"""Whether the time that a run says it still takes is right: the paper's trial, as a paste that sleeps and as a liquid.

    python -m benchmarks.time_left [--radius-mm 0.7]

After the first tenth of its time, what a run tells is divided by the truth, which is known when it ends. Time is that
of the processor, so that nothing else which the machine computes counts.
"""

import tempfile
import time
from pathlib import Path

from benchmarks.table import Row, run_benchmark
from sealtwin.core import record_files
from sealtwin.core.progress import TENTH, Pace, Progress
from sealtwin.core.run_folder import open_folder
from sealtwin.trial.job import start_job
from sealtwin.trial.pipeline import run_stages
from sealtwin.trial.trial_file import Trial, load_trial
from simulate.run import fill

TRIAL = Path(__file__).parent.parent / "fixtures" / "paper-trial" / "trial.toml"
FACTOR = 2.0
LAST = 0.95  # Share of the time after which a second either way is a large part of what is left
PASTES = {"a paste that sleeps": 12.0, "a liquid": 0.0}
"""Name and yield stress in Pa."""


class Told(Progress):
    """The times left that a run would have shown, and when."""

    def start(self, title: str, total: int, done: int = 0) -> None:
        self._pace, self._began_s = Pace(total, done), time.process_time()
        self.times_s: list[tuple[float, float]] = []

    def advance(self, done: int, note: str = "") -> None:
        now_s = time.process_time()
        if (left_s := self._pace.left_s(done, now_s)) is not None:
            self.times_s.append((now_s - self._began_s, left_s))

    def ratios(self) -> list[float]:
        end_s, _ = self.times_s[-1]
        return [left_s / (end_s - at_s) for at_s, left_s in self.times_s if TENTH * end_s <= at_s <= LAST * end_s]


def main(radius_mm: float = 0.7) -> list[Row]:
    trial = load_trial(TRIAL)
    rows = []
    with tempfile.TemporaryDirectory() as name, open_folder(Path(name, "run"), create=True) as folder:
        run_stages(start_job(trial, TRIAL.parent, folder, "cpu", Progress()), ("digitise",))
        for paste, yield_stress_pa in PASTES.items():
            ratios = _told(trial, folder.path, radius_mm, yield_stress_pa).ratios()
            rows.append(Row(f"{paste}: least time told over the truth", min(ratios), "", 1 / FACTOR))
            rows.append(Row(f"{paste}: most", max(ratios), "", 0.0, FACTOR))
    return rows


def _told(trial: Trial, sample: Path, radius_mm: float, yield_stress_pa: float) -> Told:
    assert trial.fluid is not None, "the shipped trial has a fluid"
    fluid = trial.fluid.model_copy(update={"yield_stress_pa": yield_stress_pa})
    solver = trial.solver.model_copy(update={"radius_mm": radius_mm})
    progress = Told()
    fill(record_files.read_sample(sample), fluid, solver, trial.nozzle, seed=trial.seed, progress=progress)
    return progress


if __name__ == "__main__":
    run_benchmark(main)
