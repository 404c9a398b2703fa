"""Compute extra runs of a finished trial: with other seeds for the mean level, and for the uncertainty of the level.

For the uncertainty there are three runs of each of three particle sizes, and runs with changed inputs. The inputs are
changed by a factorial design in particle runs, and by random draws in runs of the fast model. The runs are in RUN/seeds
and RUN/uncertainty, which are built like the folder of a sweep. If the process is killed, the same command computes the
remaining runs.
"""

import math
import shutil
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from sealtwin.core import files, record_files
from sealtwin.core.errors import InputError
from sealtwin.core.facts import Fact, doubt, without
from sealtwin.core.records import Profile, Sample
from sealtwin.core.run_folder import stage_key
from sealtwin.core.workers import cores
from sealtwin.study.estimate import FAST_S, REPORT_S, time_left_s
from sealtwin.study.perturbed_inputs import (
    Base,
    draw,
    fast_level,
    moved_paste,
    moved_sample,
    refuse_immovable,
    takes_draws,
)
from sealtwin.study.runner import (
    StudyOptions,
    WantedRun,
    bring_up_to_date,
    require_done,
    schedule,
    words_of,
    write_sample,
)
from sealtwin.study.study_folder import Plan, StudyRun, read_level
from sealtwin.trial.job import DIGITISED, SEEDS, Job, clear, made_by, numbers_up_to, stage_settings
from sealtwin.trial.trial_file import Trial
from sealtwin.trial.validate_stage import OF_SEEDS, SEED_RUNS, SPREAD, UNCERTAINTY, varied_settings
from validate.result import SeedRuns
from validate.run_facts import facts_of_runs, fluid_warnings
from validate.uncertainty.computed import (
    RUNS,
    Z_95,
    Effect,
    InputDraws,
    SizeRuns,
    Spread,
    effects_of,
    further_run_mm2,
    require_different,
    two_level_design,
)

RATIO = 1.3
"""Ratio of neighbouring particle sizes: the smallest ratio that Celik et al. 2008 recommend.

A larger ratio would be too expensive, since the finer run already takes four times the computing time. Also, too few of
the larger particles would fit across the crack."""
REPLICATES = 3
"""Number of runs with different seeds for each particle size.

With two runs, the error would have 4 instead of 7 degrees of freedom and sqrt(3/2) times the noise. Its interval would
be 1.4 times as wide."""
DRAWS = "draws"  # Name of the folder with the finished parts of the draws, in a folder of their key
MAX_SEED = 2**31  # Upper limit of a trial's seed, excluded

Variant = tuple[dict[str, float], Trial, Sample]
"""A variant of a trial: the settings that differ (particle size and seed, or changes of inputs), the changed trial, and
its sample."""


def compute_other_seeds(job: Job) -> bool:
    """Bring the mean level of the trial's seeds up to date. Returns True if anything was computed.

    Raises:
        InputError: The trial's first run is not finished, or a version with other stage numbers computed it. Or two
            seeds gave the same level.
        NumericalError: A run failed. The message names the run, and the same command computes it again.
    """
    from simulate.device import choose_device

    count, inputs = job.trial.seeds or 1, inputs_of(job)
    settings: dict[str, Any] = {**stage_settings(job.trial, "simulate"), "seeds": count}
    numbers = numbers_up_to("simulate")
    # The key does not contain the device, so a report that is written on another machine keeps these levels.
    key = stage_key(inputs, settings, numbers)
    if job.folder.is_current(SEEDS, key):
        return False
    alone = job.trial.model_copy(update={"seeds": None, "readings": None, "gate": None})
    base, folder, device = Base.of(replace(job, trial=alone)), job.path / "seeds", choose_device(job.device)
    others: list[Variant] = [({"seed": number}, with_seed(alone, number), base.sample) for number in range(1, count)]
    jobs = min(job.jobs, len(others) if device == "cpu" else 1)
    runs = compute_variants(job, folder, others, base, inputs, device, jobs, f"the mean of {count} seeds")
    seeds = [job.trial.seed, *(int(run.trial["seed"]) for run in runs)]
    profiles = [base.profile, *(read_level(folder, run) for run in runs)]
    s_mm = base.profile.s_mm
    levels_mm = np.array([profile.level_at_mm(s_mm) for profile in profiles])
    require_different(levels_mm, [f"with seed = {seed}" for seed in seeds], str(job.path))
    half_mm = Z_95 * float(np.sqrt(further_run_mm2(levels_mm, count)))
    record = SeedRuns(
        seeds=tuple(seeds),
        mean_level_mm=float(np.trapezoid(levels_mm.mean(axis=0), s_mm) / np.ptp(s_mm)),
        scatter_mm=float(np.sqrt(levels_mm.var(axis=0, ddof=1).mean())),
        band_95_mm=half_mm,
        warnings=tuple(_other_warnings(job, base, runs)),
    )
    clear(job, SEEDS)
    record_files.write_level(job.path, s_mm, dict(zip(seeds, levels_mm, strict=True)), half_mm)
    files.write_json(job.path / SEED_RUNS, record.model_dump())
    wall_s = sum(run.wall_s or 0.0 for run in runs)
    job.folder.record(SEEDS, key, settings, inputs, OF_SEEDS, wall_s, numbers=numbers)
    return True


def _other_warnings(job: Job, base: Base, runs: list[StudyRun]) -> list[Fact]:
    """Return the warnings about the fluid of the other runs, without warnings that the first run also has."""
    keys = [fact.key for fact in fluid_warnings(base.run, record_files.read_simulation(job.path).volume_ratio)]
    others = {run.number + 1: without(run.figures.fluid_warnings, *keys) if run.figures else () for run in runs}
    return facts_of_runs(others, len(runs) + 1)


def rounds_of_seeds(job: Job) -> int:
    """Return the time for the other seeds as a multiple of the time of one run. A CPU computes several at a time."""
    jobs = max(1, job.jobs) if job.device == "cpu" else 1
    return 0 if job.trial.seeds is None else math.ceil((job.trial.seeds - 1) / jobs)


def vary(job: Job) -> bool:
    """Bring RUN/uncertainty.json up to date. Returns True if anything was computed.

    Raises:
        InputError: The trial's run is not finished, or a version with other stage numbers computed it. Or an input
            cannot be changed as declared.
        NumericalError: An extra run failed. The message names the run, and the same command computes it again.
    """
    from simulate.device import choose_device

    if job.trial.seeds is not None:
        compute_other_seeds(job)
    inputs = inputs_of(job)
    base, settings = Base.of(job), varied_settings(job.trial)
    particles = job.trial.solver.has_particles
    device = choose_device(job.device) if particles else ""
    drawn = bool(base.inputs) and takes_draws(base)
    numerics = {"replicates": REPLICATES, "device": device, **({"drawn": RUNS} if drawn else {})}
    numbers = job.numbers("validate")
    key = stage_key(inputs, {**settings, **numerics}, numbers)
    if job.folder.is_current(UNCERTAINTY, key):
        return False
    if not (particles or drawn):
        raise InputError(
            f"{job.path / 'trial.toml'}: [uncertainty] declares no input, such as volume_ml, and the numerical error "
            "of the fast model is not assessed. Declare an input, or leave out --uncertainty."
        )
    began, folder = time.monotonic(), job.path / UNCERTAINTY
    folder.mkdir(exist_ok=True)
    variants, jobs = _variants(base, designed=not drawn) if particles else [], cores() if device == "cpu" else 1
    extra = partial(compute_variants, job, folder, variants, base, inputs, device, jobs, "the uncertainty")
    draws, runs = None, list[StudyRun]()
    if drawn:
        # Draws come first, so that an input that cannot be changed is refused before the long runs.
        if variants:
            runs = extra(RUNS * FAST_S / max(1, cores()))
        job.progress.later(time_left_s(runs, jobs) + REPORT_S)
        draws = draw(base, cores(), job.progress, folder / DRAWS / key)
    if variants:
        runs = extra()
    spread = _spread(base, [read_level(folder, run) for run in runs], draws)
    job.folder.clear(UNCERTAINTY)
    files.write_json(job.path / SPREAD, spread.content())
    job.folder.record(UNCERTAINTY, key, settings, inputs, [SPREAD], time.monotonic() - began, numbers=numbers)
    shutil.rmtree(folder / DRAWS, ignore_errors=True)
    return True


def _variants(base: Base, *, designed: bool) -> list[Variant]:
    """Return the runs of each particle size, without runs that the trial's seeds already give, and the design's runs.

    The runs with the finest particles take longest and come first, so that no process waits long for the last run. If
    ``designed`` is True, the runs of a factorial design follow. The design changes each declared input by its standard
    uncertainty, with the coarsest particles, which take least time.
    """
    inputs, variants = base.inputs, list[Variant]()
    for size_mm in _sizes_mm(base):
        for number in range(len(base.levels_mm) if size_mm == base.run.radius_mm else 0, REPLICATES):
            named = {"solver.radius_mm": round(size_mm, 4)} | ({"seed": number} if number else {})
            trial = _same_physics(base, base.sample, size_mm, {})
            variants.append((named, with_seed(trial, number), base.sample))
    if inputs and designed:
        refuse_immovable(base)
        for signs in two_level_design(len(inputs)):
            steps = {name: float(sign * standard) for sign, (name, standard) in zip(signs, inputs.items(), strict=True)}
            if "wall_share" in steps:
                # If wall_share would exceed 1, both its values are lowered. Their difference remains the same.
                steps["wall_share"] -= max(0.0, base.wall_share + inputs["wall_share"] - 1)
            if "pump_delay_s" in steps:
                # Both delays are increased, since a pump cannot begin early. Their difference remains the same.
                steps["pump_delay_s"] += inputs["pump_delay_s"]
            sample = moved_sample(base, steps)
            variants.append((steps, _same_physics(base, sample, _sizes_mm(base)[-1], steps), sample))
    return variants


def _sizes_mm(base: Base) -> tuple[float, float, float]:
    return base.run.radius_mm / RATIO, base.run.radius_mm, base.run.radius_mm * RATIO


def _same_physics(base: Base, sample: Sample, radius_mm: float, steps: Mapping[str, float]) -> Trial:
    """Return the trial with another particle size but the same viscosity, and with inputs changed by ``steps``.

    Raises InputError if the changed settings cannot be used.
    """
    from simulate.setup.release_schedule import same_fluid

    trial, run = base.trial, base.run
    changes = {"fluid.D_cm": trial.given_fluid.D_cm, **moved_paste(base, steps)}
    if (weight := trial.given_fluid.U) is not None:
        # The trial has U, so U is changed. A viscosity in physical units would move the particles differently.
        thicker = 1 + steps.get("viscosity_percent", 0.0) / 100
        changes |= {"fluid.U": weight * thicker, "fluid.viscosity_pa_s": None}
    changed, release = base.changed(changes), (run.radius_mm, base.sample.trajectory)
    fluid = same_fluid(changed.given_fluid, trial.nozzle, release, (radius_mm, sample.trajectory))
    solver = changed.solver.model_copy(update={"radius_mm": radius_mm})
    none = dict.fromkeys(("readings", "gate", "seeds"))
    return changed.model_copy(update={"fluid": fluid, "solver": solver, **none})


def _spread(base: Base, profiles: Sequence[Profile], draws: InputDraws | None) -> Spread:
    trial_profile, inputs, radii_mm = base.profile, base.inputs, _sizes_mm(base)
    fast, unfit = fast_level(base)
    if not profiles:
        return Spread(trial_profile.s_mm, None, (), None, None, draws, unfit=unfit)
    fast_mm = None if fast is None or unfit else fast.level_at_mm(trial_profile.s_mm)
    levels_mm = np.array([profile.level_at_mm(trial_profile.s_mm) for profile in profiles])
    waiting = max(0, REPLICATES - len(base.levels_mm))
    finer, middle, coarser, designed = np.split(levels_mm, np.cumsum([REPLICATES, waiting, REPLICATES]))
    same = SizeRuns(radii_mm[1], np.vstack([base.levels_mm, middle]))
    sizes = SizeRuns(radii_mm[0], finer), same, SizeRuns(radii_mm[2], coarser)
    if not len(designed):
        return Spread(trial_profile.s_mm, sizes, (), None, None, draws, fast_mm, unfit)
    effects_mm, scatter_mm = effects_of(designed, len(inputs))
    if scatter_mm is None:
        # An effect is the difference of the means of two halves of the runs. Its scatter follows from that of one run.
        scatter_mm = float(np.sqrt(coarser.var(axis=0, ddof=1).mean() / len(designed)))
    effects = (Effect(*declared, level_mm) for declared, level_mm in zip(inputs.items(), effects_mm, strict=True))
    return Spread(trial_profile.s_mm, sizes, tuple(effects), scatter_mm, radii_mm[-1], None, fast_mm, unfit)


def inputs_of(job: Job) -> dict[str, str]:
    """Return the hashes of the files of the trial's first run.

    Raises InputError if that run is not finished, or if a version with other stage numbers computed it.
    """
    inputs = {**made_by(job, "digitise", DIGITISED), **made_by(job, "simulate", ("particles.csv", "profile.csv"))}
    if other := job.other_numbers("simulate"):
        raise InputError(
            f"{job.path}: the level was computed by {other}, so extra runs would use a different solver. First run "
            f"'sealtwin run {job.path}/trial.toml'."
        )
    return inputs


def with_seed(trial: Trial, number: int) -> Trial:
    """Return the trial with one run, whose seed is the trial's seed plus ``number``."""
    return trial.model_copy(update={"seed": (trial.seed + number) % MAX_SEED, "seeds": None})


def compute_variants(
    job: Job,
    folder: Path,
    variants: Sequence[Variant],
    base: Base,
    inputs: Mapping[str, str],
    device: str,
    jobs: int,
    why: str,
    draws_s: float = 0.0,
) -> list[StudyRun]:
    """Compute the variants that are not yet finished in ``folder``, and return the runs of all variants.

    ``inputs`` contains the hashes of the files of the trial's first run. ``why`` completes the text "Extra runs for ".
    ``draws_s`` is the time of random draws that come before the runs. If it is not 0, the function computes nothing,
    and shows the time of the whole command. Raises InputError if the particles are too large or too small for a crack,
    and NumericalError if a run failed.
    """
    dry_run, wanted = draws_s > 0, list[WantedRun]()
    for number, (moved, trial, sample) in enumerate(variants, start=1):
        # Runs with another particle size or seed have the same sample as the trial.
        steps = {} if moved.keys() & {"solver.radius_mm", "seed"} else moved
        home = stage_key(inputs, {"moved": steps}, numbers_up_to("digitise"))[:12]
        # The settings of a sloping sample already have a table "sample".
        depends = {"sample" if trial.sample.level else "bench": home}
        wanted.append(WantedRun(number, moved, trial, sample, home, inputs, depends))
        write_sample(folder, wanted[-1])
    try:
        runs, largest, doubts = schedule(wanted, device, numbers_up_to("simulate"))
    except InputError as fault:
        raise InputError(
            f"{folder}: an extra run is not possible: {fault}\nExtra runs have smaller and larger particles than the "
            "trial. Give the trial another solver.radius_mm."
        ) from None
    plan = Plan(folder.name, runs, numbers=numbers_up_to("simulate"))
    options = StudyOptions(device, jobs, later_s=draws_s + REPORT_S, retry=True, dry_run=dry_run)
    plan = bring_up_to_date(
        folder,
        plan,
        largest,
        options,
        job.progress,
        "Extra runs",
        f"Extra runs for {why}{f', and {RUNS} of the fast model with moved inputs' * dry_run}:",
        () if dry_run else doubts,
    )
    if dry_run:
        return plan.runs
    require_done(folder, plan.runs, f"there is no result for {why}")
    if finer := [words_of(run.settings) for run in plan.runs if run.figures and run.figures.health.finer]:
        text = (
            f"{len(finer)} of {len(runs)} extra runs failed, and were computed again with more substeps "
            f"({finer[0]}). Their difference from the other runs may not be due to the seed alone. Give the trial more "
            "solver.substeps, so that no run fails."
        )
        job.progress.warn(doubt("runs.finer", text, len(finer)))
    return plan.runs
