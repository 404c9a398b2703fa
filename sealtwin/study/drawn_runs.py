"""Run the fast model of a trial, and with inputs drawn from their uncertainties. A killed process loses few draws."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from pydantic import ConfigDict, RootModel

from sealtwin.core import files
from sealtwin.core.cluster import Lost, run_tasks
from sealtwin.core.errors import InputError, NumericalError
from sealtwin.core.facts import Fact, doubt
from sealtwin.core.progress import Progress
from sealtwin.core.record_files import read_record
from sealtwin.core.records import Floats, Numbers, Profile
from sealtwin.core.run_figures import PARTICLES
from sealtwin.study.moved_inputs import Base, moved_paste, moved_sample, refuse_immovable
from validate.settings import ANGLE
from validate.uncertainty.computed import RUNS, InputDraws, drawn_inputs

PART = 50  # Runs in a part
COARSER = 2
"""Number of usual time steps of the fast model that one step replaces here. The error of longer steps cancels, since
only differences of levels are used."""
PLACES = 121  # Places of a level: twice the cells of the fast model and one, which resolves all of its level
AGAIN = "Delete it, and give the same command again."


class Drawn(RootModel[Numbers]):
    """Levels of the runs in one part, (runs, PLACES)."""

    model_config = ConfigDict(arbitrary_types_allowed=True)


def takes_draws(base: Base) -> bool:
    """Return True if the fast model runs the moved inputs.

    It does if the trial declares so, if the fast model computes the level, or by default if the case is in its domain.
    Raises InputError if the trial declares particles for the differences, but the fast model for the level.
    """
    declared, solver = base.trial.uncertainty.differences, base.trial.solver
    if not solver.has_particles:
        if declared == PARTICLES:
            raise InputError(
                f'{base.path / "trial.toml"}: uncertainty.differences = "{declared}" cannot be combined with '
                f'solver.model = "{solver.model}": that model also computes the differences. Remove differences.'
            )
        return True
    if declared is not None:
        return declared != PARTICLES
    return not fast_level(base)[1]


def fast_level(base: Base) -> tuple[Profile | None, tuple[Fact, ...]]:
    """Return the fast model's level of a trial, None if it does not have the paste, and reasons why it is unfit."""
    from simulate.slot.run import pour

    try:
        run, level = pour(base.trial.pour(base.sample))
    except InputError as fault:
        return None, (doubt("unfit.refused", str(fault)),)
    return level, run.unfit


def draw(base: Base, folder: Path, jobs: int, progress: Progress, runs: int = RUNS) -> InputDraws:
    """Return the change of level that each draw of the inputs causes, computed by the fast model.

    Finished parts are files in ``folder``.

    Raises:
        InputError: The fast model does not support the paste, or an input cannot be moved as far as a draw moves it.
        NumericalError: Memory ran out.
    """
    refuse_immovable(base)
    inputs = base.inputs
    s_mm = np.linspace(0.0, base.sample.outline.length_mm, PLACES)
    own_mm = level_of(base, {}, s_mm)
    steps = [_steps(base, dict(zip(inputs, row, strict=True))) for row in drawn_inputs(inputs, runs).tolist()]
    parts = {folder / f"{first:04d}.json": steps[first : first + PART] for first in range(0, runs, PART)}
    waiting = {path: part for path, part in parts.items() if not path.is_file()}
    progress.start("Moved inputs", len(parts), len(parts) - len(waiting))
    tasks = ((path, (base, part, s_mm)) for path, part in waiting.items())
    for done, (path, levels_mm) in enumerate(run_tasks(levels_of, tasks, min(jobs, len(waiting))), start=1):
        if isinstance(levels_mm, Lost):
            raise NumericalError(f"{folder}: {levels_mm.reason}. The same command computes the remaining runs.")
        if isinstance(levels_mm, str):
            raise InputError(levels_mm)
        files.write_json(path, levels_mm)
        progress.advance(len(parts) - len(waiting) + done, f"{PART} runs of the fast model each")
    levels_mm = np.vstack([_read_levels(path, len(part)) for path, part in parts.items()])
    # Tenths of a micrometre keep the file small.
    return InputDraws(s_mm, inputs, np.round(levels_mm - own_mm, 4))


def _read_levels(path: Path, runs: int) -> Floats:
    levels_mm = read_record(Drawn, path, AGAIN).root
    if levels_mm.shape != (runs, PLACES):
        raise InputError(f"{path}: has levels of shape {levels_mm.shape}, expected {(runs, PLACES)}. {AGAIN}")
    return levels_mm


def levels_of(base: Base, moves: Sequence[dict[str, float]], s_mm: Floats) -> Floats | str:
    """Return the level of a run for each of ``moves``, (runs, k); an error message if an input cannot move so far."""
    levels_mm = []
    for steps in moves:
        try:
            levels_mm.append(level_of(base, steps, s_mm))
        except InputError as fault:
            moves_text = ", ".join(f"{name} {step:+.3g}" for name, step in steps.items())
            return (
                f'{fault} A draw is out of range ({moves_text}); uncertainty.differences = "particles" needs no draws.'
            )
    return np.array(levels_mm)


def level_of(base: Base, steps: dict[str, float], s_mm: Floats) -> Floats:
    """Return the fast model's level at ``s_mm`` with inputs moved by ``steps``. Raises InputError if out of range."""
    from simulate.slot.fill import STEPS, fill
    from simulate.slot.run import paste_of

    sample, trial = moved_sample(base, steps, meshed=False), base.changed(moved_paste(base, steps))
    paste = paste_of(trial.given_fluid, trial.solver, trial.nozzle, sample.trajectory, trial.seed)
    how = {"nozzle_mm": trial.nozzle.diameter_mm, "settle_s": trial.solver.settle_s, "steps": STEPS // COARSER}
    bed = fill(sample.solid, sample.outline, sample.trajectory, paste, **how, slope=trial.sample)
    return np.interp(s_mm, bed.sections.s_mm, bed.level_mm)


def _steps(base: Base, z: dict[str, float]) -> dict[str, float]:
    """Return how far each input is moved. ``z`` has the same distances in standard uncertainties.

    For a viscosity, the logarithm is drawn. A yield stress and a wall angle are not moved below 0.
    """
    inputs, trial = base.inputs, base.trial
    steps = {name: value * inputs[name] for name, value in z.items()}
    if "viscosity_percent" in z:
        steps["viscosity_percent"] = 100 * ((1 + inputs["viscosity_percent"] / 100) ** z["viscosity_percent"] - 1)
    if "yield_stress_pa" in z and trial.fluid is not None:
        steps["yield_stress_pa"] = max(steps["yield_stress_pa"], -trial.fluid.yield_stress_pa)
    if ANGLE in z and trial.crack is not None and base.sample.solid.figures.weighed is None:
        steps[ANGLE] = max(steps[ANGLE], -min(trial.crack.wall_angles_deg))
    return steps
