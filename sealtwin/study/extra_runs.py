"""Extra runs for the uncertainty of a simulated level: three of each particle size, and runs with inputs moved.

A design moves the inputs of particle runs, and random draws move those of the fast model. Results are written to
RUN/uncertainty, a folder like a sweep's. They are computed once: if the process is killed, the same command computes
the remaining runs.
"""

import shutil
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from sealtwin.core import files, record_files
from sealtwin.core.cluster import cores
from sealtwin.core.errors import InputError
from sealtwin.core.records import Profile, Sample
from sealtwin.core.stage_keys import stage_key
from sealtwin.study import study_folder
from sealtwin.study.drawn_runs import PLACES, draw, fast_level, level_of, takes_draws
from sealtwin.study.estimate import estimate, in_words, size_of
from sealtwin.study.moved_inputs import Base, moved_paste, moved_sample, refuse_immovable
from sealtwin.study.runner import Computing
from sealtwin.study.seed_runs import announce_seeds, compute_other_seeds
from sealtwin.study.variants import Variant, compute_variants, inputs_of, own_timing, with_seed
from sealtwin.trial.job import Above, Job
from sealtwin.trial.pipeline import REPORT_S
from sealtwin.trial.trial_file import Trial
from sealtwin.trial.validate_stage import SPREAD, UNCERTAINTY, varied_settings
from validate.uncertainty.computed import RUNS, Effect, InputDraws, SizeRuns, Spread, effects_of, two_level_design

RATIO = 1.3
"""Ratio of neighbouring particle sizes. It is the least that Celik et al. 2008 recommend: a finer run already takes
four times the computing time, and of larger particles too few would fit across the crack."""
REPLICATES = 3
"""Runs of each particle size, with different seeds. With two runs the error would have 4 instead of 7 degrees of
freedom and sqrt(3/2) times the noise: an interval 1.4 times as wide."""
A_LITTLE = 0.1  # Share of its standard uncertainty by which each input is moved in the timed run


def by_studies(jobs: int = 0) -> Above:
    """Return what studies do for a run: its other seeds, and the time of its extra runs.

    ``jobs`` is the number of worker processes of the other seeds; 0 computes them in this process.
    """
    return Above(time_of_extra_runs, compute_other_seeds, announce_seeds, jobs)


def vary(job: Job) -> bool:
    """Bring RUN/uncertainty.json up to date; return True if anything was computed.

    Raises:
        InputError: The trial's run is not finished, or other stage numbers than this version's computed it; or an input
            cannot be varied as declared.
        NumericalError: An extra run failed. The message names it, and the same command tries it again.
    """
    from simulate.device import choose_device

    if job.trial.seeds is not None:
        compute_other_seeds(job)
    inputs = inputs_of(job)
    base, settings = Base.of(job), varied_settings(job.trial)
    particles = job.trial.solver.has_particles
    device = choose_device(job.device) if particles else ""
    drawn = bool(base.inputs) and takes_draws(base)
    how = {"replicates": REPLICATES, "device": device, **({"drawn": RUNS} if drawn else {})}
    numbers = job.numbers("validate")
    key = stage_key(inputs, {**settings, **how}, numbers)
    if job.folder.is_current(UNCERTAINTY, key):
        return False
    if not (particles or drawn):
        raise InputError(
            f"{job.path / 'trial.toml'}: [uncertainty] declares no input, such as volume_ml, and the fast model has no "
            "numerical error to assess. Declare an input, or leave --uncertainty out."
        )
    began, folder = time.monotonic(), job.path / UNCERTAINTY
    folder.mkdir(exist_ok=True)
    # Draws take seconds: an input that cannot be moved is refused before particles run for minutes.
    draws = draw(base, folder / f"drawn-{key[:12]}", cores(), job.progress) if drawn else None
    drew_s = time.monotonic() - began
    runs = list[study_folder.StudyRun]()
    if particles:
        how = Computing(device, cores() if device == "cpu" else 1, later_s=REPORT_S)
        variants = _variants(base, designed=not drawn)
        runs = compute_variants(folder, variants, base, how, inputs, job.progress, UNCERTAINTY, "the uncertainty")
    spread = _spread(base, [record_files.read_profile(study_folder.run_path(folder, run.key)) for run in runs], draws)
    job.folder.clear(UNCERTAINTY)
    files.write_json(job.path / SPREAD, spread.content())
    wall_s = drew_s + sum(run.wall_s or 0.0 for run in runs)
    job.folder.record(UNCERTAINTY, key, settings, inputs, [SPREAD], wall_s, numbers=numbers)
    for parts in folder.glob("drawn-*"):
        shutil.rmtree(parts)
    return True


def time_of_extra_runs(job: Job) -> str:
    """Return the time of the extra runs in words, estimated from the time of the trial's own run.

    Empty if it is unknown, or if the trial has neither readings nor a declared input.
    """
    if job.trial.readings is None and not job.trial.uncertainty.moved:
        return ""
    base = Base.of(job)
    trial, run = base.trial, base.run
    drawn = bool(base.inputs) and takes_draws(base)
    drawn_s = 0.0
    if drawn:
        began_s = time.perf_counter()
        level_of(base, {name: A_LITTLE * by for name, by in base.inputs.items()}, np.linspace(0.0, 1.0, PLACES))
        drawn_s = RUNS * (time.perf_counter() - began_s) / cores()
    if not run.has_particles:
        return in_words(drawn_s) if drawn else ""
    designed = len(two_level_design(len(base.inputs))) if base.inputs and not drawn else 0
    # Some runs of the trial's own size are done.
    numbers = REPLICATES, max(0, REPLICATES - len(base.levels_mm)), REPLICATES + designed
    runs, sizes = list[study_folder.StudyRun](), []
    for radius_mm, number in zip(_sizes_mm(base), numbers, strict=True):
        solver = trial.solver.model_copy(update={"radius_mm": radius_mm})
        try:
            sizes.append(size_of(replace(trial.pour(base.sample), solver=solver)))
        except InputError:
            # There are too many particles, or the sealant is too stiff for them; 'sealtwin validate' reports which.
            return ""
        runs += [study_folder.StudyRun(1, "", {}, {}, "", "", sizes[-1].work_s)] * number
    jobs = cores() if run.device.startswith("CPU") else 1
    expected = estimate(runs, sizes[0], jobs, 1, keep_runs=False, timings=own_timing(base))
    return in_words(drawn_s + expected.time_s)


def _variants(base: Base, *, designed: bool) -> list[Variant]:
    """Return the runs of each particle size, but not those of the trial's seeds, and those of the design.

    The longest runs, with the finest particles, come first, so that no process waits long for the last one. The design,
    left out if ``designed`` is False, moves each declared input by a standard uncertainty. It uses the coarsest
    particles, which are quick.
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
                # A share that cannot grow so far is lowered by as much more: the two moves stay as far apart.
                steps["wall_share"] -= max(0.0, base.wall_share + inputs["wall_share"] - 1)
            if "pump_delay_s" in steps:
                # Likewise, since no pump begins early.
                steps["pump_delay_s"] += inputs["pump_delay_s"]
            sample = moved_sample(base, steps)
            variants.append((steps, _same_physics(base, sample, _sizes_mm(base)[-1], steps), sample))
    return variants


def _sizes_mm(base: Base) -> tuple[float, float, float]:
    return base.run.radius_mm / RATIO, base.run.radius_mm, base.run.radius_mm * RATIO


def _same_physics(base: Base, sample: Sample, radius_mm: float, steps: Mapping[str, float]) -> Trial:
    """Return the trial at another particle size with the same viscosity, and with inputs moved by ``steps``.

    Raises InputError if its settings cannot be used.
    """
    from simulate.setup.release_schedule import same_fluid

    trial, run = base.trial, base.run
    changes = {"fluid.D_cm": trial.given_fluid.D_cm, **moved_paste(base, steps)}
    if (weight := trial.given_fluid.U) is not None:
        # A viscosity in physical units moves particles differently from the trial's U.
        thicker = 1 + steps.get("viscosity_percent", 0.0) / 100
        changes |= {"fluid.U": weight * thicker, "fluid.viscosity_pa_s": None}
    changed, own = base.changed(changes), (run.radius_mm, base.sample.trajectory)
    fluid = same_fluid(changed.given_fluid, trial.nozzle, own, (radius_mm, sample.trajectory))
    solver = changed.solver.model_copy(update={"radius_mm": radius_mm})
    none = dict.fromkeys(("readings", "gate", "seeds"))
    return changed.model_copy(update={"fluid": fluid, "solver": solver, **none})


def _spread(base: Base, profiles: Sequence[Profile], draws: InputDraws | None) -> Spread:
    own, inputs, radii_mm = base.profile, base.inputs, _sizes_mm(base)
    fast, unfit = fast_level(base)
    if not profiles:
        return Spread(own.s_mm, None, (), None, None, draws, unfit=unfit)
    fast_mm = None if fast is None or unfit else np.interp(own.s_mm, fast.s_mm, fast.level_mm)
    levels_mm = np.array([np.interp(own.s_mm, profile.s_mm, profile.level_mm) for profile in profiles])
    waiting = max(0, REPLICATES - len(base.levels_mm))
    finer, middle, coarser, designed = np.split(levels_mm, np.cumsum([REPLICATES, waiting, REPLICATES]))
    runs_mm = finer, np.vstack([base.levels_mm, middle]), coarser
    fine, same, coarse = (SizeRuns(*size) for size in zip(radii_mm, runs_mm, strict=True))
    sizes = fine, same, coarse
    if not len(designed):
        return Spread(own.s_mm, sizes, (), None, None, draws, fast_mm, unfit)
    effects_mm, scatter_mm = effects_of(designed, len(inputs))
    if scatter_mm is None:
        # From single runs of this size: an effect is the mean of half of the runs less that of the other half.
        scatter_mm = float(np.sqrt(coarser.var(axis=0, ddof=1).mean() / len(designed)))
    effects = (Effect(*declared, level_mm) for declared, level_mm in zip(inputs.items(), effects_mm, strict=True))
    return Spread(own.s_mm, sizes, tuple(effects), scatter_mm, radii_mm[-1], None, fast_mm, unfit)
