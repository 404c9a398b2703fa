"""u_input of the shipped crack by the fast model, before and after cavity, sealant and paste are measured (EMULATED).

    python -m benchmarks.input_uncertainty [--runs 1000] [--judge] [--only-judge] [--numerics]

Nobody measured this crack or this paste. A liquid is poured into the traced crack with the shipped walls, in steps;
sealant is weighed before and after, each time to 0.05 g, and its density in a cup of 100 ml; a mini-cone of paste of
12 Pa is photographed. The viscosity stays undeclared, as in the trial. ``--judge`` moves the inputs of two slots of
``benchmarks.slot_cases`` by particles too, which takes two minutes of a core; ``--numerics`` runs particles for the
level and its numerics, which takes half an hour of one, so that u_val is known.
"""

import tempfile
import time
from collections.abc import Iterator
from math import sqrt
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from typer import Option

from benchmarks.against import HERE
from benchmarks.material_by_scale import spread_of
from benchmarks.slot_cases import TRIM_MM, drawn
from benchmarks.slumps import KEPT, replayed
from benchmarks.table import Row, run_benchmark
from benchmarks.weighing import poured_into
from digitise.settings import CrackShape
from sealtwin.core import record_files
from sealtwin.core.progress import Progress
from sealtwin.core.records import Outline, Sample
from sealtwin.core.run_folder import open_folder
from sealtwin.core.settings import checked
from sealtwin.study.drawn_runs import draw
from sealtwin.study.extra_runs import vary
from sealtwin.study.moved_inputs import Base, moved_paste, moved_sample
from sealtwin.study.runner import Sealing, seal
from sealtwin.trial.job import start_job
from sealtwin.trial.pipeline import run_stages
from sealtwin.trial.trial_file import Trial, load_trial, with_settings
from sealtwin.trial.validate_stage import read_spread, readings_of
from simulate.slot.run import pour
from validate.compare import error_uncertainty
from validate.comparison import ErrorUncertainty
from validate.uncertainty.computed import RUNS, Spread, effects_of, two_level_design
from validate.uncertainty.meniscus import Mouth
from validate.units import LABELS

SHIPPED = HERE / "fixtures" / "paper-trial"
YIELD_STRESS_PA = 12.0
PASTE = {"fluid.yield_stress_pa": YIELD_STRESS_PA, "fluid.freeze_after_s": "never"}
"""Settings that replace the shipped trial's freezing, which the fast model does not have."""
SEALANT = {"mass_g": 8.112, "mass_sd_g": 0.05 * sqrt(2), "density_kg_m3": 1690.0, "density_sd_kg_m3": 5.07}
"""4.8 ml of the trial's density: two weighings, each to 0.05 g; 0.3 % of density, by a cup whose water was weighed."""
BAR_MM = 0.20
PROCESSES, LONGEST_S = 2, 120.0
SLOTS, DOUBTS = (5, 27), {"volume_ml": 0.1, "width_mm": 0.1, "wall_angle_deg": 1.0}
"""Two of the slots inside the fast model's domain, those that particles take least long for and that open by 6 degrees
or more; and what is in doubt of them."""
AGREES = 1.25  # Largest ratio of the u_input of both models, either way


def main(
    runs: Annotated[int, Option(help="runs of the fast model for each budget")] = RUNS,
    judge: Annotated[bool, Option(help="move the inputs of two slots by particles too")] = False,
    only_judge: Annotated[bool, Option(help="that alone")] = False,
    numerics: Annotated[bool, Option(help="run particles for the level and its numerics")] = False,
) -> list[Row]:
    if not only_judge:
        # Before minutes of particles.
        KEPT.require()
    print("Fill, weighings and spread are EMULATED; nothing was measured.")
    rows = [] if only_judge else [*shipped(runs, numerics=numerics)]
    if judge or only_judge:
        rows += [row for number in SLOTS for row in judged(number, runs)]
    return rows


def shipped(runs: int, *, numerics: bool) -> Iterator[Row]:
    """The shipped trial with a paste, and what its lab could measure of it with a scale and a printed sheet."""
    base = load_trial(SHIPPED / "trial.toml", PASTE)
    content = base.model_dump(mode="json", exclude_none=True)
    with tempfile.TemporaryDirectory() as place:
        trial = checked(Trial, SHIPPED, with_settings(content, {"solver.model": "slot"}))
        uncertainty, _ = budget(trial, Path(place, "as it is"), runs)
        yield from rows_of("nothing measured", uncertainty)
        outline = record_files.read_outline(Path(place, "as it is"))
        content = filled(content, outline)
        for name, model in (("EMULATED fill", "slot"), ("EMULATED fill, sealant, spread", "slot")):
            if "sealant" in name:
                content = weighed_and_spread(content, Path(place))
            trial = checked(Trial, SHIPPED, with_settings(content, {"solver.model": model}))
            uncertainty, spent_s = budget(trial, Path(place, name), runs)
            high_mm = BAR_MM if "sealant" in name else np.inf
            yield from rows_of(name, uncertainty, high_mm)
            if "sealant" in name:
                each_s = spent_s / PROCESSES * RUNS / runs
                yield Row(f"{RUNS:,} runs, processor time of each of {PROCESSES}", each_s, "s", 0, LONGEST_S, "60")
        if numerics:
            trial = checked(Trial, SHIPPED, with_settings(content, {"uncertainty.differences": "slot"}))
            uncertainty, _ = budget(trial, Path(place, "particles"), runs)
            yield from rows_of("EMULATED, level by particles", uncertainty)


def filled(content: dict[str, Any], outline: Outline) -> dict[str, Any]:
    """The trial with an emulated fill in place of the angle that nobody saw."""
    crack = content["crack"]
    fill, _ = poured_into(np.random.default_rng(0), outline, CrackShape.model_validate(crack), "steps")
    crack = {name: value for name, value in crack.items() if name != "wall_angle_deg"}
    inputs = {name: value for name, value in content["uncertainty"].items() if name != "wall_angle_deg"}
    return {**content, "crack": {**crack, "fill": fill.model_dump(mode="json")}, "uncertainty": inputs}


def weighed_and_spread(content: dict[str, Any], folder: Path) -> dict[str, Any]:
    """The same with sealant that was weighed, and a yield stress that was measured by its spread."""
    spread = spread_of(YIELD_STRESS_PA, 1, np.random.default_rng(0), replayed(), folder)
    print(f"Spread of {spread.true:g} Pa, EMULATED: {spread.found:.2f} Pa, 95 % {spread.low:.2f} to {spread.high:.2f}")
    path = {name: value for name, value in content["path"].items() if name != "volume_ml"} | {"weighed": SEALANT}
    inputs = {name: value for name, value in content["uncertainty"].items() if name != "volume_ml"}
    inputs["yield_stress_pa"] = (spread.high - spread.low) / 4
    fluid = content["fluid"] | {"yield_stress_pa": spread.found}
    return {**content, "path": path, "fluid": fluid, "uncertainty": inputs}


def budget(trial: Trial, folder: Path, runs: int) -> tuple[ErrorUncertainty, float]:
    """Return the uncertainty of the trial's error with its inputs drawn, and the processor time of the draws."""
    with open_folder(folder, create=True) as there:
        job = start_job(trial, SHIPPED, there, "cpu", Progress())
        run_stages(job, ("digitise", "simulate"))
        base, began = Base.of(job), time.process_time()
        if trial.solver.model == "slot":
            draws = draw(base, folder / "drawn", 0, Progress(), runs)
            spread = Spread(base.profile.s_mm, None, (), None, None, draws)
        else:
            vary(job)
            spread = read_spread(job)
        spent_s = time.process_time() - began
        outline, solid, readings = base.sample.outline, base.sample.solid, readings_of(job, base.profile)
        assert readings is not None
        assert job.trial.readings is not None
        inputs, mouth = job.trial.known_inputs(outline, solid), Mouth.of(outline, solid, base.run.density_kg_m3)
        uncertainty = error_uncertainty(base.profile, readings, mouth, job.trial.readings, inputs, spread)
    return uncertainty, spent_s


def rows_of(name: str, uncertainty: ErrorUncertainty, high_mm: float = np.inf) -> Iterator[Row]:
    """u_input with each of its components, u of the readings, and u_val where the numerics are known."""
    mean = uncertainty.mean_level
    assert mean.inputs_mm is not None
    yield Row(f"{name}: u_input", mean.inputs_mm, "mm", 0, high_mm, "0.15" if high_mm < np.inf else "")
    for one in uncertainty.inputs:
        words, unit = LABELS["inputs"][one.name]
        yield Row(f"  {words}, by {one.standard:.3g} {unit}", one.mean_level_mm, "mm")
    if uncertainty.input_draws is not None:
        yield Row("  share of its variance that no input makes alone", uncertainty.input_draws.together, "")
    yield Row("  u of the readings", mean.data_mm, "mm")
    if mean.numerics_mm is not None:
        yield Row("  u_num", mean.numerics_mm, "mm")
        yield Row("  u_val", mean.validation_mm, "mm")


def judged(number: int, runs: int) -> Iterator[Row]:
    """u_input of a slot by both models: four runs of particles, each input up in two of them and down in two."""
    base = base_of(number)
    with tempfile.TemporaryDirectory() as place:
        draws = draw(base, Path(place), 0, Progress(), runs)
    fast, _ = draws.inputs.reported(draws.s_mm)
    results = [_level_mm(base, dict(zip(DOUBTS, signs, strict=True))) for signs in two_level_design(len(DOUBTS))]
    slow, _ = effects_of(np.array(results)[:, None], len(DOUBTS))
    for one, effect_mm in zip(fast, slow[:, 0], strict=True):
        words = f"slot {number}: {LABELS['inputs'][one.name][0]}"
        yield Row(f"{words}, by particles", float(effect_mm), "mm")
        yield Row(f"{words}, by the fast model", one.mean_level_mm, "mm")
    both = sqrt(sum(one.mean_level_mm**2 for one in fast)), float(np.linalg.norm(slow))
    yield Row(f"slot {number}: u_input by particles", both[1], "mm")
    yield Row(f"slot {number}: u_input, fast model over particles", both[0] / both[1], "", 1 / AGREES, AGREES, "1.1")


def base_of(number: int) -> Base:
    """A drawn slot as a trial, with its run by the fast model."""
    case = drawn()[number]
    content = {
        "name": f"slot {number}",
        "photo": {"file": "drawn.png", "data": "synthetic", "mm_per_px": 0.1},
        "crack": {"depth_mm": case.depth_mm, "tilt": "flare", "wall_angle_deg": case.angle_deg},
        "path": {
            "volume_ml": case.trajectory.dispensed_mm3 / 1e3,
            "speed_mm_s": case.speed_mm_s,
            "trim_mm": TRIM_MM,
        },
        "fluid": case.fluid.model_dump(mode="json", exclude_none=True),
        "solver": case.solver.model_dump(mode="json", exclude_none=True),
        "nozzle": case.nozzle.model_dump(mode="json"),
        "uncertainty": DOUBTS,
    }
    trial = checked(Trial, Path(f"slot-{number}.toml"), content)
    sample = Sample(case.outline, case.solid, case.trajectory)
    return Base(Path(), trial, sample, *pour(sample, case.fluid, case.solver, case.nozzle, seed=0))


def _level_mm(base: Base, signs: dict[str, float]) -> float:
    """Mean level by particles with inputs moved."""
    steps = {name: float(sign * DOUBTS[name]) for name, sign in signs.items()}
    (sealing,) = seal(
        moved_sample(base, steps), [base.changed(moved_paste(base, steps))], device="cpu", keep_runs=False
    )
    assert isinstance(sealing, Sealing), sealing
    s_mm = sealing.profile.s_mm
    return float(np.trapezoid(sealing.profile.level_mm, s_mm) / (s_mm[-1] - s_mm[0]))


if __name__ == "__main__":
    run_benchmark(main)
