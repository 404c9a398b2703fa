"""What holds the slope of the bed: fixing particles by age, a yield stress, or nothing; on the paper's trial.

    python benchmarks/stiffening.py [--radius-mm 0.5] [--only NAME]

All three pour the same paste: 12 Pa come from the prototype, 2.58 s from the paper, and the viscosity is that of its
U = 30. Each is held against the readings when the nozzle stops, 2 s later, when its last mound has settled, and 10 s
after that, for drift. The readings are reconstructed from prose and the trial was calibrated on them: the table says
which model can make the bed, not which is true.
"""

import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from benchmarks.physics_tanks import size_of
from benchmarks.table import one_of, run_benchmark
from sealtwin.core import record_files
from sealtwin.core.progress import Progress
from sealtwin.core.records import Floats, Outline, Profile, Solid, Trajectory
from sealtwin.core.run_folder import open_folder
from sealtwin.trial.job import start_job
from sealtwin.trial.pipeline import run_stages
from sealtwin.trial.trial_file import load_trial
from simulate.injection import Injection, prepare
from simulate.profile import measure_profile, volume_ratio
from simulate.settings import Fluid, Nozzle, Solver
from simulate.setup.release_schedule import plan_releases
from validate.compare import compare
from validate.readings.read_readings import read_readings

FIXTURE = Path(__file__).parent.parent / "fixtures" / "paper-trial"
VISCOSITY_PA_S, DENSITY_KG_M3 = 0.0545, 1690.0
"""U = 30 of the paper's radius and frame, 0.322 cm2/s."""
DRAG_CM_S = 0.3 / 7.225e-3
"""D over a frame: the drag of a second must not depend on the radius."""
WATCHED_S = (0.0, 2.0, 12.0)
"""After the nozzle has stopped."""


@dataclass(frozen=True)
class Stiffening:
    name: str
    yield_stress_pa: float
    freeze_after_s: float | str

    def fluid(self, frame_s: float) -> Fluid:
        return Fluid.model_validate(
            {
                "viscosity_pa_s": VISCOSITY_PA_S,
                "density_kg_m3": DENSITY_KG_M3,
                "D_cm": DRAG_CM_S * frame_s,
                "yield_stress_pa": self.yield_stress_pa,
                "freeze_after_s": self.freeze_after_s,
            }
        )


Crack = tuple[Solid, Outline, Trajectory]
WAYS = {
    "freezing": Stiffening("fixed after 2.58 s, as in the paper", 0.0, 2.58),
    "yield": Stiffening("yield stress of 12 Pa, with sleep", 12.0, "never"),
    "neither": Stiffening("neither", 0.0, "never"),
}


@dataclass(frozen=True)
class Bed:
    """What one way made."""

    way: Stiffening
    levels: tuple[Profile, ...]
    """At WATCHED_S."""
    errors_mm: tuple[float, ...]
    escaped: int
    volume_ratio: float
    cpu_s: float
    """Until the nozzle stopped."""
    moving: tuple[int, ...]
    """Particles, at WATCHED_S."""

    @property
    def drift_mm(self) -> float:
        """Of the bin that moved most in the last ten seconds."""
        return float(np.abs(bins_mm(self.levels[2]) - bins_mm(self.levels[1])).max())


@dataclass(frozen=True)
class Sample:
    outline: Outline
    solid: Solid
    trajectory: Trajectory
    readings: Profile

    def error_mm(self, level: Profile) -> float:
        comparison = compare(
            level, self.readings, self.outline, self.solid, role="calibrated-on", photo_data="synthetic"
        )
        return comparison.mean_error_mm


def main(
    radius_mm: float = 0.5,
    only: Annotated[str | None, one_of(WAYS)] = None,
) -> None:
    sample = trace()
    for name in [only] if only else WAYS:
        _print(pour(sample, WAYS[name], radius_mm), radius_mm)


def trace(**walls: Any) -> Sample:
    """The fixture's crack and path, through the first stage; between ``walls`` if settings of the crack are given."""
    trial = load_trial(FIXTURE / "trial.toml")
    assert trial.crack is not None
    trial = trial.model_copy(update={"crack": trial.crack.model_copy(update=walls)})
    with tempfile.TemporaryDirectory() as made, open_folder(Path(made) / trial.folder_name, create=True) as folder:
        run_stages(start_job(trial, FIXTURE, folder, "cpu", Progress()), ("digitise",))
        outline, solid = record_files.read_outline(folder.path), record_files.read_solid(folder.path)
        trajectory = record_files.read_trajectory(folder.path)
    assert trial.readings is not None
    readings = read_readings(FIXTURE / trial.readings.file, trial.readings, outline.length_mm, solid.depth_mm)
    return Sample(outline, solid, trajectory, readings)


def ready(
    crack: Crack, way: Stiffening, radius_mm: float, seed: int = 0, preset: str = "accurate", **solving: Any
) -> Injection:
    """A pour before its first frame. The radius is that of an accurate run."""
    radius_mm = size_of(preset, radius_mm, crack[1].mean_width_mm)
    solver = Solver.model_validate({"radius_mm": radius_mm, "preset": preset, **solving})
    # The frame follows from the radius, and the drag from the frame.
    frame_s = plan_releases(crack[2], radius_mm, Nozzle().diameter_mm, seed).frame_s
    return prepare(*crack, [way.fluid(frame_s)], solver, Nozzle(), seed=seed, device="cpu")


def advance(injection: Injection, frame: int) -> None:
    """Go on until that frame, or until nothing moves."""
    while injection.done < frame and not injection.at_rest:
        injection.advance()


def pour(sample: Sample, way: Stiffening, radius_mm: float, **solving: Any) -> Bed:
    crack = sample.solid, sample.outline, sample.trajectory
    injection = ready(crack, way, radius_mm, settle_s=WATCHED_S[-1], **solving)
    began, cpu_s = time.process_time(), 0.0
    levels, moving = [], []
    stop = len(injection.schedule.released)
    for after_s in WATCHED_S:
        advance(injection, stop + round(after_s / injection.schedule.frame_s))
        cpu_s = cpu_s or time.process_time() - began
        (run,) = injection.results()
        levels.append(measure_profile(run, sample.outline, sample.solid))
        moving.append(injection.engine.rows)
    (run,) = injection.results()
    return Bed(
        way,
        tuple(levels),
        tuple(sample.error_mm(level) for level in levels),
        run.escaped_particles,
        volume_ratio(run, sample.solid),
        cpu_s,
        tuple(moving),
    )


def bins_mm(level: Profile) -> Floats:
    """Mean level in 10 mm each, of the crack's 80."""
    return np.array([level.level_mm[(level.s_mm >= a) & (level.s_mm < a + 10)].mean() for a in range(0, 80, 10)])


def _print(bed: Bed, radius_mm: float) -> None:
    errors = "  ".join(f"{error:.2f}" for error in bed.errors_mm)
    print(
        f"R {radius_mm:g} mm, {bed.way.name}: error {errors} mm when the nozzle stops, 2 and 12 s later; drift "
        f"{bed.drift_mm:.2f} mm in 10 s; volume kept {bed.volume_ratio:.3f}; escaped {bed.escaped}; "
        f"moving {bed.moving}; {bed.cpu_s:.0f} CPU s"
    )
    print("    bins", " ".join(f"{level:.1f}" for level in bins_mm(bed.levels[0])), flush=True)


if __name__ == "__main__":
    run_benchmark(main)
