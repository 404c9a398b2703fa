"""The extra runs that give a simulated level its uncertainty: three of each particle size, and inputs moved by design.

They are kept in RUN/uncertainty, a folder like that of a sweep, and computed once: after a kill the same command
computes what is left.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from digitise.weighing.moved_walls import moved_depth, shape_by_weight, widened
from sealtwin.core import files, record_files
from sealtwin.core.cluster import cores
from sealtwin.core.errors import InputError, NumericalError
from sealtwin.core.records import Profile, Run
from sealtwin.core.run_folder import stage_key
from sealtwin.core.settings import checked
from sealtwin.study import study_folder
from sealtwin.study.estimate import RunSize, Timing, estimate, size_of
from sealtwin.study.runner import Bench, Computing, compute, read_bench
from sealtwin.study.study_file import with_settings
from sealtwin.trial.job import DIGITISED, Job, made_by, stage_settings
from sealtwin.trial.trial_file import Trial
from sealtwin.trial.validate_stage import SPREAD, UNCERTAINTY, varied_settings
from validate.uncertainty.validation import Effect, SizeRuns, Spread, effects_of, two_level_design

RATIO = 1.3
"""Ratio of neighbouring particle sizes, the least that Celik et al. 2008 recommend: a finer run costs four times as
much, and a coarser one soon has too few particles abreast."""
REPLICATES = 3
"""Runs of each particle size, which differ in seed. With two, the error has Student's t of 4 instead of 7 degrees of
freedom and sqrt(3/2) times the noise: its interval is 1.4 times wider."""
SEEDS = 2**31  # Number of seeds that a trial may have
OF_THE_WALLS = ("width_mm", "wall_angle_deg", "depth_mm")  # Inputs that change the solid
OF_THE_PATH = ("speed_mm_s", "start_mm")


@dataclass(frozen=True)
class _Base:
    """The run that the extra runs are held against."""

    job: Job
    bench: Bench
    run: Run
    profile: Profile

    @property
    def inputs(self) -> dict[str, float]:
        """Standard uncertainty of each input that is moved, by name."""
        outline, figures = self.bench.outline, self.bench.solid.figures
        return self.job.trial.uncertainty.with_sample(outline.width_doubt_mm, figures.weighed).moved


_Variant = tuple[dict[str, float], Trial, Bench]
"""Settings of an extra run that differ from the trial, the particle size or the steps of its inputs; and its own."""


def vary(job: Job) -> bool:
    """Bring RUN/uncertainty.json up to date, and return True if anything was computed.

    Raises:
        InputError: The trial has no readings, its run is not finished, or an input cannot be varied as declared.
        NumericalError: An extra run failed; it is named, and the same command tries it again.
    """
    from simulate.device import choose_device

    if job.trial.readings is None:
        raise InputError(
            f"{job.path / 'trial.toml'}: no [readings]; --uncertainty is that of a comparison. Give a sheet of "
            "readings, or leave --uncertainty out."
        )
    if job.trial.solver.model == "slot":
        raise InputError(
            f'{job.path / "trial.toml"}: solver.model is "slot", and --uncertainty is that of particles. Take '
            '"particles", or leave --uncertainty out.'
        )
    inputs = {**made_by(job, "digitise", DIGITISED), **made_by(job, "simulate", ("particles.csv", "profile.csv"))}
    device = choose_device(job.device)
    settings = varied_settings(job.trial)
    key = stage_key(inputs, {**settings, "replicates": REPLICATES, "device": device})
    if job.folder.is_current(UNCERTAINTY, key):
        return False
    records = record_files.read_run(job.path), record_files.read_profile(job.path)
    base = _Base(job, read_bench(job.path, None), *records)
    variants = _variants(base)
    folder = job.path / UNCERTAINTY
    folder.mkdir(exist_ok=True)
    if study_folder.holds_study(folder):
        study_folder.read_plan(folder)  # Imports what an earlier version computed.
        study_folder.remove_temporary_files(folder)
    runs, largest = _runs(folder, variants, device, inputs)
    runs = study_folder.resume(folder, study_folder.Plan(UNCERTAINTY, runs, len(runs)), retry=True)
    how = Computing(device, cores() if device == "cpu" else 1)
    timings = _own_timing(base)
    expected = estimate(runs, largest, how.jobs, how.batch, keep_runs=False, timings=timings)
    if expected.runs:
        job.progress.note(f"Extra runs for the uncertainty: {expected.sentence}")
        runs = compute(folder, runs, how, "Extra runs", job.progress, timings)
    if failed := [run for run in runs if run.state == "failed"]:
        told = "\n".join(f"{_said(run.settings)}: {run.reason}" for run in failed)
        raise NumericalError(
            f"{folder}: {len(failed)} of {len(runs)} extra runs failed, and without them nothing is said of the "
            f"uncertainty. The same command tries them again; the others are kept.\n{told}"
        )
    spread = _spread(base, [record_files.read_profile(study_folder.run_path(folder, run.key)) for run in runs])
    job.folder.clear(UNCERTAINTY)
    files.write_json(job.path / SPREAD, spread.content())
    job.folder.record(UNCERTAINTY, key, settings, inputs, [SPREAD], sum(run.wall_s or 0.0 for run in runs))
    return True


def _variants(base: _Base) -> list[_Variant]:
    """Return the runs of each size, from the finest, without the trial's own, and then those of the design.

    The longest come first, so that no process waits long for the last. The design moves each declared input by a
    standard uncertainty, at the coarser size, which is quick.
    """
    inputs, variants = base.inputs, list[_Variant]()
    for size_mm in _sizes_mm(base):
        for number in range(size_mm == base.run.radius_mm, REPLICATES):
            # The first of each size is as earlier versions ran it, and keeps its key.
            named = {"solver.radius_mm": round(size_mm, 4)} | ({"seed": number} if number else {})
            trial = _same_physics(base, base.bench, size_mm, {})
            seed = (trial.seed + number) % SEEDS
            variants.append((named, trial.model_copy(update={"seed": seed}), base.bench))
    if inputs:
        _refuse_immovable(base, inputs)
        for signs in two_level_design(len(inputs)):
            steps = {name: float(sign * standard) for sign, (name, standard) in zip(signs, inputs.items(), strict=True)}
            bench = _moved(base, steps)
            variants.append((steps, _same_physics(base, bench, _sizes_mm(base)[-1], steps), bench))
    return variants


def _sizes_mm(base: _Base) -> tuple[float, float, float]:
    return base.run.radius_mm / RATIO, base.run.radius_mm, base.run.radius_mm * RATIO


def _own_timing(base: _Base) -> list[Timing]:
    """Return how long the trial's own run took, if it is recorded: the extra runs take their time from it at first."""
    health = base.run.health
    if health.setup_s is None or health.frames_s is None:
        return []
    size = size_of(base.job.trial, base.bench.trajectory, base.bench.outline.mean_width_mm)
    return [(size.work_s, health.setup_s + health.frames_s)]


def _refuse_immovable(base: _Base, inputs: Mapping[str, float]) -> None:
    """Raises InputError for an input that the sample's walls do not have."""
    crack, outline = base.job.trial.crack, base.bench.outline
    walls, width_mm, fault = [name for name in OF_THE_WALLS if name in inputs], inputs.get("width_mm", 0.0), None
    if base.job.trial.path.plan is not None and (fixed := [name for name in OF_THE_PATH if name in inputs]):
        fault = f"{', '.join(fixed)}: path.plan gives the path, of which only the volume is moved. Leave it out."
    elif walls and crack is None:
        fault = f"{', '.join(walls)}: the sample is a mesh, whose walls are its own. Leave it out."
    elif width_mm and outline.branches_kept:
        fault = "width_mm: side cracks are part of the outline, and only a main crack is widened. Leave it out."
    elif width_mm > outline.mean_width_mm / 2:
        fault = f"width_mm = {width_mm:g}: of a crack {outline.mean_width_mm:.2f} mm wide at most half can be in doubt."
    elif crack is not None and crack.tilt == "vertical" and "wall_angle_deg" in walls:
        fault = "wall_angle_deg: the walls are vertical. Leave it out, or give crack.tilt a reading that has an angle."
    if fault is not None:
        raise InputError(f"{base.job.path / 'trial.toml'}: [uncertainty] {fault}")


def _moved(base: _Base, steps: Mapping[str, float]) -> Bench:
    """Move crack and path of the sample. The path is still planned on the crack as it was traced."""
    from digitise.solid.build_solid import build_solid
    from digitise.trajectory import plan_trajectory

    trial, bench = base.job.trial, base.bench
    # How far each input is moved; what a weighed fill leaves of width, angle and depth moves together.
    step = {"width_mm": 0.0, "wall_angle_deg": 0.0, "depth_mm": 0.0, "speed_mm_s": 0.0, "volume_ml": 0.0} | dict(steps)
    shape, weighed = trial.crack, bench.solid.figures.weighed
    if weighed is not None and shape is not None:
        shape = shape_by_weight(shape, weighed)
        root, own = np.array(weighed.steps), np.array([step[name] for name in OF_THE_WALLS])
        signs = np.divide(own, root.diagonal(), out=np.zeros(len(own)), where=root.diagonal() > 0)
        step |= dict(zip(OF_THE_WALLS, (root @ signs).tolist(), strict=True))
        # A flare or a funnel has no other angle.
        step["wall_angle_deg"] = max(step["wall_angle_deg"], -weighed.wall_angle_deg)
    first_mm, last_mm = trial.path.trims_mm
    start_mm = steps.get("start_mm", 0.0)
    path: dict[str, Any] = {
        "path.speed_mm_s": trial.path.speed_mm_s + step["speed_mm_s"],
        "path.volume_ml": bench.trajectory.dispensed_mm3 / 1e3 + step["volume_ml"],
        "path.fill": 1.0,
        "path.trim_mm": (first_mm + start_mm, last_mm - start_mm),
    }
    changes = {} if trial.path.plan is not None else path
    if shape is not None:
        angle_deg, by_deg = shape.wall_angle_deg, step["wall_angle_deg"]
        angles_deg = tuple(one + by_deg for one in angle_deg) if isinstance(angle_deg, tuple) else angle_deg + by_deg
        moved = {"wall_angle_deg": angles_deg, "depth_mm": moved_depth(shape.depth_mm, step["depth_mm"])}
        changes |= {"crack": shape.model_copy(update=moved).model_dump(mode="json", exclude_none=True)}
    changed = _changed(base.job, changes)
    cavity_mm3, sections = bench.solid.cavity_volume_mm3, bench.solid.sections
    trajectory = plan_trajectory(bench.outline, changed.path, cavity_mm3, sections)
    if trial.path.plan is not None:
        more = 1 + 1e3 * step["volume_ml"] / trajectory.dispensed_mm3
        trajectory = replace(trajectory, flow_mm3_s=more * trajectory.flow_mm3_s)
    outline, solid = bench.outline, bench.solid
    if changed.crack is not None and any(name in steps for name in OF_THE_WALLS):
        outline = widened(outline, step["width_mm"])
        solid = build_solid(outline, changed.crack)
    return Bench(outline, solid, trajectory, None)


def _same_physics(base: _Base, bench: Bench, radius_mm: float, steps: Mapping[str, float]) -> Trial:
    """Return the trial at another particle size with the same viscosity: U and D depend on radius and frame.

    Raises InputError if its settings cannot be used.
    """
    from simulate.setup.release_schedule import plan_releases

    trial, health = base.job.trial, base.run.health.recorded()
    assert trial.fluid is not None, "it was run"
    frame_s = plan_releases(bench.trajectory, radius_mm, trial.nozzle.diameter_mm, trial.seed).frame_s
    thicker = 1 + steps.get("viscosity_percent", 0.0) / 100
    if (curve := trial.fluid.curve) is None:
        thickness = "fluid.viscosity_pa_s" if trial.fluid.consistency_pa_s_n is None else "fluid.consistency_pa_s_n"
        paste: dict[str, Any] = {"fluid.U": None, thickness: health["viscosity_pa_s"] * thicker}
        if "yield_stress_pa" in steps:
            paste["fluid.yield_stress_pa"] = trial.fluid.yield_stress_pa + steps["yield_stress_pa"]
    else:
        assert not isinstance(curve, Path), "it was run"
        columns: dict[str, Any] = dict(curve.columns)
        columns["viscosity_pa_s"] = [thicker * value for value in curve.viscosity_pa_s]
        if more_pa := steps.get("yield_stress_pa"):
            stress_pa = curve.yield_stress_pa or [0.0] * len(curve.viscosity_pa_s)
            columns["yield_stress_pa"] = [max(0.0, value + more_pa) for value in stress_pa]
        paste = {"fluid.curve": columns}
    changes: dict[str, Any] = {
        "solver.radius_mm": radius_mm,
        # Its record is of the measured numbers, not of moved ones.
        "fluid.material": None,
        **paste,
        # Left out, it follows from the viscosity again.
        "fluid.D_cm": None if trial.fluid.D_cm is None else trial.fluid.D_cm * frame_s / health["frame_s"],
    }
    return _changed(base.job, changes).model_copy(update={"readings": None, "gate": None})


def _changed(job: Job, changes: Mapping[str, Any]) -> Trial:
    """Return the trial with other settings, by dotted name; None stands for no setting. Raises InputError."""
    where = Path(f"{job.path / 'trial.toml'}, moved by its [uncertainty]")
    return checked(Trial, where, with_settings(job.trial.model_dump(mode="json", exclude_none=True), changes))


def _runs(
    folder: Path, variants: Sequence[_Variant], device: str, inputs: Mapping[str, str]
) -> tuple[list[study_folder.StudyRun], RunSize]:
    """Return the runs, their samples written. Raises InputError if particles do not fit a crack."""
    from simulate.setup_checks import check_fit

    runs, sizes = [], []
    for number, (moved, trial, bench) in enumerate(variants, start=1):
        assert trial.fluid is not None, "it was run"
        try:
            check_fit(bench.outline, bench.solid, trial.fluid, trial.solver, trial.nozzle, trial.sample)
            sizes.append(size_of(trial, bench.trajectory, bench.outline.mean_width_mm))
        except InputError as fault:
            raise InputError(
                f"{folder}: the extra run with {_said(moved)} cannot be: {fault} Extra runs have particles "
                f"{RATIO:g} times smaller and larger than the trial's: give the trial another solver.radius_mm."
            ) from None
        name = stage_key(inputs, {"moved": {} if "solver.radius_mm" in moved else moved})[:12]
        sample = folder / "samples" / name
        if not all((sample / file).is_file() for file in DIGITISED):
            record_files.write_outline(sample, bench.outline)
            record_files.write_solid(sample, bench.solid)
            # Last: with it the sample is whole.
            record_files.write_trajectory(sample, bench.trajectory)
        # A sloping sample has a table of that name.
        place = {"sample" if trial.sample.level else "bench": name}
        key = stage_key(inputs, {**stage_settings(trial, "simulate"), **place, "device": device})
        content = trial.model_dump(mode="json", exclude_none=True)
        runs.append(study_folder.StudyRun(number, key, moved, content, name, key, sizes[-1].work_s))
    return runs, max(sizes, key=lambda size: (size.particles, size.bytes))


def _said(settings: Mapping[str, float]) -> str:
    """Describe a run by its particle size and what was added to the seed, or by how far its inputs are moved."""
    return ", ".join(
        f"{name} = {value:g}" if "." in name else f"{name} {value:+g} from the trial's"
        for name, value in settings.items()
    )


def _spread(base: _Base, profiles: Sequence[Profile]) -> Spread:
    own, inputs, radii_mm = base.profile, base.inputs, _sizes_mm(base)
    levels_mm = np.array([np.interp(own.s_mm, profile.s_mm, profile.level_mm) for profile in profiles])
    finer, middle, coarser, designed = np.split(levels_mm, np.cumsum([REPLICATES, REPLICATES - 1, REPLICATES]))
    runs_mm = finer, np.vstack([own.level_mm, middle]), coarser
    fine, same, coarse = (SizeRuns(*size) for size in zip(radii_mm, runs_mm, strict=True))
    if not len(designed):
        return Spread(own.s_mm, (fine, same, coarse), (), None, None)
    found_mm, scatter_mm = effects_of(designed, len(inputs))
    if scatter_mm is None:
        # Of single runs of this size, of which an effect is the mean of half less that of the other half.
        scatter_mm = float(np.sqrt(coarser.var(axis=0, ddof=1).mean() / len(designed)))
    effects = (Effect(*declared, level_mm) for declared, level_mm in zip(inputs.items(), found_mm, strict=True))
    return Spread(own.s_mm, (fine, same, coarse), tuple(effects), scatter_mm, radii_mm[-1])
