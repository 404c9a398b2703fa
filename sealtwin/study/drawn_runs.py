"""The fast model on inputs drawn from their uncertainties: runs in parts, of which a kill loses those at work."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from pydantic import ConfigDict, RootModel

from sealtwin.core import files
from sealtwin.core.cluster import Lost, run_tasks
from sealtwin.core.errors import InputError, NumericalError
from sealtwin.core.progress import Progress
from sealtwin.core.record_files import read_record
from sealtwin.core.records import Floats, Numbers
from sealtwin.study.moved_inputs import Base, moved_bench, moved_paste, refuse_immovable
from validate.settings import ANGLE, Differences
from validate.uncertainty.computed import RUNS, InputDraws, drawn_inputs

PART = 50  # Runs in a part
COARSER = 2
"""Steps of time of the fast model in one step here: what longer ones do to a level, they do to both of a difference."""
PLACES = 121  # Twice the cells of the fast model and one: nothing finer is in its level


AGAIN = "Delete it, and give the same command again."


class Drawn(RootModel[Numbers]):
    """Levels of a part's runs, (runs, PLACES)."""

    model_config = ConfigDict(arbitrary_types_allowed=True)


def model_of(base: Base) -> Differences:
    """Return the model that moves a trial's inputs: the declared one, else the fast one within its domain.

    Raises InputError if the declared one cannot.
    """
    declared, own = base.trial.uncertainty.differences, base.trial.solver.model
    if own == "slot":
        if declared == "particles":
            raise InputError(
                f'{base.path / "trial.toml"}: uncertainty.differences = "particles" beside solver.model = "slot": the '
                "differences are of the model that makes the level. Leave it out."
            )
        return "slot"
    if declared is not None:
        return declared
    try:
        return "particles" if unfit_for(base) else "slot"
    except InputError:
        return "particles"  # A paste that the fast model does not know.


def unfit_for(base: Base) -> tuple[str, ...]:
    """Return why the fast model is unfit for a trial. Raises InputError for a paste that it does not know."""
    from simulate.slot.run import pour

    trial, bench = base.trial, base.bench
    assert trial.fluid is not None, "it was run"
    sample = bench.solid, bench.outline, bench.trajectory
    run, _ = pour(*sample, trial.fluid, trial.solver, trial.nozzle, seed=trial.seed, slope=trial.sample)
    assert run.bed is not None, "the fast model has one"
    return run.bed.unfit


def draw(base: Base, folder: Path, jobs: int, progress: Progress, runs: int = RUNS) -> InputDraws:
    """Run the fast model on the inputs as they are and on all draws; ``folder`` keeps the parts that are done.

    Raises:
        InputError: The fast model does not know the paste, or an input cannot be moved as far as it is drawn.
        NumericalError: Memory ran out.
    """
    refuse_immovable(base)
    inputs = base.inputs
    unfit, s_mm = unfit_for(base), np.linspace(0.0, base.bench.outline.length_mm, PLACES)
    steps = [_steps(base, dict(zip(inputs, row, strict=True))) for row in drawn_inputs(inputs, runs).tolist()]
    parts = {folder / f"{first:04d}.json": steps[first : first + PART] for first in range(0, runs, PART)}
    waiting = {path: part for path, part in parts.items() if not path.is_file()}
    progress.start("Moved inputs", len(parts), len(parts) - len(waiting))
    tasks = ((path, (base, part, s_mm)) for path, part in waiting.items())
    for done, (path, levels_mm) in enumerate(run_tasks(levels_of, tasks, min(jobs, len(waiting))), start=1):
        if isinstance(levels_mm, Lost):
            raise NumericalError(f"{folder}: {levels_mm.reason}. The same command computes what is left.")
        if isinstance(levels_mm, str):
            raise InputError(levels_mm)
        files.write_json(path, levels_mm)
        progress.advance(len(parts) - len(waiting) + done, f"{PART} runs of the fast model each")
    levels_mm = np.vstack([_read_levels(path, len(part)) for path, part in parts.items()])
    # Tenths of a micrometre keep the file small.
    return InputDraws(s_mm, inputs, np.round(levels_mm - level_of(base, {}, s_mm), 4), unfit)


def levels_of(base: Base, moves: Sequence[dict[str, float]], s_mm: Floats) -> Floats | str:
    """Return the levels of some runs, (runs, k); the sentence of an input that cannot be moved so far."""
    levels_mm = []
    for steps in moves:
        try:
            levels_mm.append(level_of(base, steps, s_mm))
        except InputError as fault:
            told = ", ".join(f"{name} {step:+.3g}" for name, step in steps.items())
            return f'{fault} One of the draws cannot be ({told}); uncertainty.differences = "particles" draws none.'
    return np.array(levels_mm)


def _read_levels(path: Path, runs: int) -> Floats:
    levels_mm = read_record(Drawn, path, AGAIN).root
    if levels_mm.shape != (runs, PLACES):
        raise InputError(f"{path}: {levels_mm.shape} levels, where {runs} runs have {PLACES} each. {AGAIN}")
    return levels_mm


def level_of(base: Base, steps: dict[str, float], s_mm: Floats) -> Floats:
    """Return the level by the fast model with inputs moved. Raises InputError for an input that cannot be."""
    from simulate.slot.fill import STEPS, fill
    from simulate.slot.run import paste_of

    bench, trial = moved_bench(base, steps, meshed=False), base.changed(moved_paste(base, steps))
    assert trial.fluid is not None, "it was run"
    paste = paste_of(trial.fluid, trial.solver, trial.nozzle, bench.trajectory, trial.seed)
    sample = bench.solid, bench.outline, bench.trajectory
    how = {"nozzle_mm": trial.nozzle.diameter_mm, "settle_s": trial.solver.settle_s, "steps": STEPS // COARSER}
    bed = fill(*sample, paste, **how, slope=trial.sample)
    return np.interp(s_mm, bed.sections.s_mm, bed.level_mm)


def _steps(base: Base, z: dict[str, float]) -> dict[str, float]:
    """Return how far each input is moved, ``z`` standard uncertainties of it.

    A viscosity is drawn in its logarithm, and nothing below a yield stress or an angle of 0.
    """
    inputs, trial = base.inputs, base.trial
    steps = {name: value * inputs[name] for name, value in z.items()}
    if "viscosity_percent" in z:
        steps["viscosity_percent"] = 100 * ((1 + inputs["viscosity_percent"] / 100) ** z["viscosity_percent"] - 1)
    if "yield_stress_pa" in z and trial.fluid is not None:
        steps["yield_stress_pa"] = max(steps["yield_stress_pa"], -trial.fluid.yield_stress_pa)
    if ANGLE in z and trial.crack is not None and base.bench.solid.figures.weighed is None:
        steps[ANGLE] = max(steps[ANGLE], -min(trial.crack.wall_angles_deg))
    return steps
