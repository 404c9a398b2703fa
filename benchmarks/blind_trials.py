"""Twenty trials as their labs know them, and as they are: EMULATED.

``blind_trials.json`` is the labs' notebook, with the truth beside it. Cracks of 40 mm, their pastes and their pumps
were drawn by SEED; the band of a prediction was changed once after they were first judged. What a lab measures of them
was emulated once, each with errors as large as the product takes them to be: the cavity by a photo, a gauge and weighed
fills, the yield stress by a spread, the viscosity by the film of that spread or by a rheometer, the flow by weighing
(release 1.0.0). The notebook stays as it is, so that the trials judge predictions alone, and not how a paste is
measured.
"""

import json
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from digitise.settings import CrackShape
from digitise.solid.build_solid import build_solid, with_weighed
from digitise.trajectory import plan_trajectory
from digitise.weighing.fit_cavity import weigh
from digitise.weighing.moved_walls import widened
from sealtwin.core.errors import present
from sealtwin.core.records import Floats, Sample
from sealtwin.core.settings import checked
from sealtwin.study.perturbed_inputs import Base
from sealtwin.trial.trial_file import Trial
from simulate.pour import Pour
from simulate.run import fill
from simulate.settings import Fluid, Solver
from simulate.slot.run import pour
from tests.support.shapes import CUT, random_crack

NOTEBOOK = Path(__file__).with_suffix(".json")
SEED = 20261127
LENGTH_MM = 40.0
STATIONS_MM = np.arange(0.0, LENGTH_MM + 0.5)
OTHER = (0.1, 0.2)  # Difference of reality's radius from the prediction's


@dataclass(frozen=True, eq=False)
class Measured:
    """A trial as its lab knows it, and the same as it is."""

    truth: dict[str, float]
    """By the names of the notebook: width, depth and wall angle of the crack, and the paste as a run takes it."""
    base: Base
    real: Sample

    @property
    def real_fluid(self) -> dict[str, float]:
        return {name: self.truth[name] for name in ("yield_stress_pa", "viscosity_pa_s", "density_kg_m3")}


@cache
def notebook() -> dict[int, dict[str, Any]]:
    return {int(number): trial for number, trial in json.loads(NOTEBOOK.read_text(encoding="utf-8")).items()}


def measured(number: int, folder: Path) -> Measured:
    """Return a trial of the notebook; ``folder`` is that of its file."""
    notes = notebook()[number]
    truth, real = notes["truth"], notes["real"]
    trial = checked(Trial, folder / "trial.toml", notes["trial"])
    gauged, declared = present(trial.crack, "the crack"), trial.uncertainty
    traced = random_crack("plain", 1000 * SEED + number, LENGTH_MM, truth["width_mm"], ends=CUT)
    moved, shape, by_weight = weigh(
        traced, gauged, present(gauged.fill, "its fill"), declared.width_mm or 0.0, declared.depth_mm or 0.0
    )
    solid = with_weighed(build_solid(moved, shape), by_weight)
    sample = Sample(moved, solid, plan_trajectory(moved, trial.path, solid.cavity_volume_mm3, solid.sections))
    base = Base(folder, trial, sample, *pour(trial.pour(sample)))
    outline = widened(traced, real["width_off_mm"])
    walls = CrackShape(depth_mm=truth["depth_mm"], tilt="flare", wall_angle_deg=truth["angle_deg"])
    real_path = trial.path.model_copy(update=real["path"] | {"trim_mm": tuple(real["path"]["trim_mm"])})
    trajectory = plan_trajectory(moved, real_path, solid.cavity_volume_mm3, solid.sections)
    return Measured(truth, base, Sample(outline, build_solid(outline, walls), trajectory))


def real_level_mm(number: int, trial: Measured, s_mm: Floats = STATIONS_MM, draw: int = SEED) -> Floats:
    """Return the level at ``s_mm`` of the true inputs by particles of another seed and size."""
    random = np.random.default_rng([draw, number, 2])
    other = 1 + float(random.uniform(*OTHER) * random.choice([-1, 1]))
    solver = trial.base.trial.solver
    solver = solver.model_copy(update={"radius_mm": round(other * solver.size_mm, 3)})
    fluid = trial.base.trial.given_fluid.model_copy(update=trial.real_fluid)
    return level_mm(trial.real, fluid, solver, trial, s_mm, seed=int(random.integers(1, 2**31)))


def level_mm(
    sample: Sample, fluid: Fluid, solver: Solver, trial: Measured, s_mm: Floats = STATIONS_MM, *, seed: int
) -> Floats:
    """Return the level at ``s_mm`` by particles."""
    _, profile = fill(Pour(sample, (fluid,), solver, trial.base.trial.nozzle, seed))
    return np.interp(s_mm, profile.s_mm, profile.level_mm)
