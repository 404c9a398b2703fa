"""Trials whose inputs were measured, predicted by one run of particles before they are poured by another: EMULATED.

    python -m benchmarks.blind_cases [--tune]

Twenty cracks of 40 mm and their pastes are drawn by a fixed seed, and the lab's measurements of them emulated
(``benchmarks.blind_measured``). A trial outside the fast model's domain, as its lab would be told, is passed over. The
prediction is one run at the measured values, and the doubt of these values by 200 draws of the fast model. Reality is
particles with another seed, a radius 10 to 20 % larger or smaller, and the true values. ``benchmarks/blind/`` keeps
what is finished. ``--tune`` runs trials of another draw, and each at its measured values with reality's seed and
radius: what these differ by is the numerics of a prediction.
"""

import csv
import tempfile
import time
from pathlib import Path
from typing import Annotated

import numpy as np
from typer import Option

from benchmarks import slumps
from benchmarks.blind_measured import COURSES, KEPT, LENGTH_MM, Measured, measured, record
from benchmarks.table import run_benchmark
from sealtwin.core.progress import Progress
from sealtwin.core.records import Floats, Sample
from sealtwin.study.drawn_runs import draw, unfit_for
from simulate.run import fill
from simulate.settings import Fluid, Solver

FOLDER = COURSES.parent
TRIALS, TUNING = 20, 3
JUDGED_SEED, TUNING_SEED = 20261123, 7
ANEW_SEED = 20261127  # Of the trials of ``benchmarks.blind_labs``, drawn after all tuning
DRAWS = 200  # A standard deviation by so many is known to 5 %
OTHER = (0.1, 0.2)  # Difference of reality's radius from the prediction's
STATIONS_MM = np.arange(0.0, LENGTH_MM + 0.5)


def finished(seed: int) -> dict[int, dict[str, Floats]]:
    """Return what is known of each trial of a draw: columns along ``STATIONS_MM``.

    Leaves if another solver computed them, or none is there.
    """
    KEPT.require()
    if not (levels := _levels(seed)):
        raise SystemExit(f"{FOLDER.name}/{seed}: no trial is kept: '{KEPT.command}' computes them.")
    return levels


def _levels(seed: int) -> dict[int, dict[str, Floats]]:
    path = FOLDER / f"{seed}.csv"
    if not path.is_file():
        return {}
    (_, *names), *rows = csv.reader(path.read_text(encoding="utf-8").splitlines())
    trials, *columns = np.array(rows, dtype=float).T
    return {
        int(number): {name: column[trials == number] for name, column in zip(names, columns, strict=True)}
        for number in np.unique(trials)
    }


def run_trial(seed: int, number: int, *, again: bool) -> bool:
    """Run a trial and keep its levels; False for one outside the fast model's domain."""
    began = time.process_time()
    with tempfile.TemporaryDirectory() as place:
        one = measured(seed, number, Path(place))
        base = one.base
        if unfit := unfit_for(base):
            print(f"trial {number}: passed over. {unfit[0]}", flush=True)
            return False
        draws = draw(base, Path(place, "draws"), 0, Progress(), DRAWS)
    random = np.random.default_rng([seed, number, 2])
    other = 1 + float(random.uniform(*OTHER) * random.choice([-1, 1]))
    solver = base.trial.solver
    assert base.trial.fluid is not None
    real_solver = solver.model_copy(update={"radius_mm": round(other * solver.size_mm, 3)})
    real_seed = int(random.integers(1, 2**31))
    real_fluid = base.trial.fluid.model_copy(update=one.real_fluid)
    inputs_mm = _half_of_band(draws.inputs.at(draws.s_mm, STATIONS_MM).errors()) / 2
    columns = {
        "s_mm": STATIONS_MM,
        "predicted_mm": level_mm(base.sample, base.trial.fluid, solver, one, seed=0),
        "real_mm": level_mm(one.real, real_fluid, real_solver, one, seed=real_seed),
        "inputs_mm": inputs_mm,
    }
    if again:
        columns["again_mm"] = level_mm(base.sample, base.trial.fluid, real_solver, one, seed=real_seed)
    rows = [[f"{number}", *(f"{value:.3f}" for value in row)] for row in zip(*columns.values(), strict=True)]
    FOLDER.mkdir(exist_ok=True)
    facts = {
        "trial": number,
        "radius_mm": solver.size_mm,
        "real_radius_mm": real_solver.size_mm,
        "real_seed": real_seed,
        **one.facts,
        "processor_s": f"{time.process_time() - began:.0f}",
    }
    with (FOLDER / f"{seed}-trials.csv").open("a", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, facts)
        if file.tell() == 0:
            writer.writeheader()
        writer.writerow(facts)
    with (FOLDER / f"{seed}.csv").open("a", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([*([] if file.tell() else [["trial", *columns]]), *rows])
    off_mm = columns["real_mm"] - columns["predicted_mm"]
    print(
        f"trial {number}: real less predicted {off_mm.mean():+.2f} mm in the mean, {np.sqrt(np.mean(off_mm**2)):.2f} "
        f"RMS; u of inputs {inputs_mm.mean():.2f} mm; {facts['processor_s']} s",
        flush=True,
    )
    return True


def level_mm(sample: Sample, fluid: Fluid, solver: Solver, one: Measured, *, seed: int) -> Floats:
    _, profile = fill(sample, fluid, solver, one.base.trial.nozzle, seed=seed)
    return np.interp(STATIONS_MM, profile.s_mm, profile.level_mm)


def _half_of_band(components: list) -> Floats:
    from validate.uncertainty.budget import Budget

    return Budget(len(STATIONS_MM), tuple(components)).band_mm


def main(tune: Annotated[bool, Option(help="trials of the draw that the numerics are measured on")] = False) -> None:
    # Trials are emulated by them: they come first.
    slumps.KEPT.require()
    KEPT.begin()
    if not COURSES.is_file():
        record()
    if tune:
        first_trials(TUNING_SEED, TUNING, again=True)
    else:
        first_trials(JUDGED_SEED, TRIALS)


def first_trials(seed: int, wanted: int, *, again: bool = False) -> None:
    """Run the first trials of a draw that are inside the fast model's domain, and are not kept yet."""
    number, done, levels = 0, 0, _levels(seed)
    while done < wanted:
        done += number in levels or run_trial(seed, number, again=again)
        number += 1


if __name__ == "__main__":
    run_benchmark(main)
