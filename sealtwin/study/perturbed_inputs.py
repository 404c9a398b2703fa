"""Change the uncertain inputs of a trial: crack, path and paste. Compute the effect of random draws (fast model).

In this package, a "moved" input has a value that differs from the trial's value.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from digitise.settings import CrackShape
from digitise.weighing.moved_walls import moved_depth, shape_by_weight, walls_apart, widened
from sealtwin.core import files, record_files
from sealtwin.core.errors import InputError, NumericalError
from sealtwin.core.facts import Facts, doubt
from sealtwin.core.progress import Progress
from sealtwin.core.records import Floats, Profile, Run, Sample
from sealtwin.core.run_figures import PARTICLES
from sealtwin.core.workers import Lost, run_tasks
from sealtwin.trial.job import Job
from sealtwin.trial.trial_file import SettingValues, Trial, as_run
from sealtwin.trial.validate_stage import read_seeds
from simulate.settings import MIN_WALL_SHARE, VISCOSITIES_PA_S
from validate.settings import ANGLE, OF_THE_WALLS
from validate.uncertainty.computed import RUNS, InputDraws, drawn_inputs

OF_THE_PATH = ("speed_mm_s", "start_mm")
PART = 50  # Number of runs of the fast model in one task
STEP_FACTOR = 2
"""Factor by which the time step of the fast model is longer here than usual.

The error of longer steps cancels, since only differences of levels are used."""
PLACES = 121  # Number of stations of a level: twice the number of cells of the fast model, plus one
LONGEST_DELAY = 0.25
"""Largest allowed uncertainty of the pump's delay, as a fraction of the time in which the path dispenses sealant.

Random draws reach nearly four times the uncertainty."""


@dataclass(frozen=True, eq=False)
class Base:
    """A trial with its first run, with which extra runs are compared. It can be sent to another process."""

    path: Path  # Path of the run folder
    trial: Trial
    sample: Sample
    run: Run
    profile: Profile
    others_mm: Floats | None = None  # Levels of the trial's other seeds, (seeds - 1, k)

    @classmethod
    def of(cls, job: Job) -> "Base":
        """Read a finished trial from its run folder."""
        run, profile, seeds = record_files.read_run(job.path), record_files.read_profile(job.path), read_seeds(job)
        others_mm = None if seeds is None else record_files.read_levels(job.path, seeds.seeds[1:])
        sample = record_files.read_sample(job.path)
        return cls(job.path, as_run(job.trial, sample), sample, run, profile, others_mm)

    @property
    def crack(self) -> CrackShape | None:
        """Depth and walls of the crack: those of its scan, if there is one."""
        from digitise.solid.scanned_shape import shape_of

        shape = self.trial.crack
        return shape if shape is None or shape.scan is None else shape_of(self.sample.solid, shape)

    @property
    def levels_mm(self) -> Floats:
        """Level of each of the trial's seeds, (seeds, k). The first row is the level of ``run``."""
        own_mm = self.profile.level_mm[None]
        return own_mm if self.others_mm is None else np.vstack([own_mm, self.others_mm])

    @property
    def inputs(self) -> dict[str, float]:
        """Standard uncertainty of each input that is changed, by name."""
        return self.trial.known_inputs(self.sample.outline, self.sample.solid).moved

    @property
    def wall_share(self) -> float:
        return self.trial.given_fluid.wall_share or 1.0

    def changed(self, changes: SettingValues) -> Trial:
        """Return the trial with ``changes`` of settings by dotted name. None removes a setting.

        Raises InputError if a changed setting is not valid.
        """
        where = Path(f"{self.path / 'trial.toml'}, with an input changed by its [uncertainty]")
        return self.trial.changed(changes, where)


def refuse_immovable(base: Base) -> None:
    """Raise InputError if a declared uncertain input cannot be changed for this sample or path."""
    crack, outline, inputs = base.crack, base.sample.outline, base.inputs
    walls, width_mm, fault = [name for name in OF_THE_WALLS if name in inputs], inputs.get("width_mm", 0.0), None
    flows_s = float(np.ptp(base.sample.trajectory.t_s[base.sample.trajectory.giving]))
    if base.trial.path.plan is not None and (fixed := [name for name in OF_THE_PATH if name in inputs]):
        fault = f"{', '.join(fixed)}: path.plan sets the path, so only its volume can be uncertain. Remove this key."
    elif walls and crack is None:
        fault = f"{', '.join(walls)}: the sample is a mesh, whose walls are fixed. Remove this key."
    elif width_mm and outline.branches_kept:
        fault = "width_mm: the outline has side cracks, but only a main crack can be widened. Remove this key."
    elif width_mm > outline.mean_width_mm / 2:
        fault = (
            f"width_mm = {width_mm:g} is more than half of the crack's mean width, {outline.mean_width_mm:.2f} mm; "
            "give a smaller uncertainty."
        )
    elif crack is not None and not any(crack.tilting) and ANGLE in walls:
        fault = f"{ANGLE}: the walls are vertical. Remove this key, or set crack.tilt to a tilt with an angle."
    elif inputs.get("pump_delay_s", 0.0) > LONGEST_DELAY * flows_s:
        fault = (
            f"pump_delay_s = {inputs['pump_delay_s']:g} is more than a quarter of the {flows_s:.3g} s in which the "
            "path dispenses sealant; give a smaller uncertainty."
        )
    elif "wall_share" in inputs and base.trial.given_fluid.D_cm is not None:
        fault = (
            "wall_share: fluid.D_cm already sets the drag of the walls. Remove wall_share, or give "
            "fluid.viscosity_pa_s instead of U and D_cm."
        )
    if fault is not None:
        raise InputError(f"{base.path}: uncertainty.{fault}")


def moved_sample(base: Base, steps: Mapping[str, float], *, meshed: bool = True) -> Sample:
    """Return the sample with crack and path changed by ``steps``. The path is still planned for the traced crack.

    If ``meshed`` is False, only the sections of the solid are changed, since the fast model does not use the mesh.
    """
    from digitise.trajectory import begun_late, plan_trajectory

    trial, sample = base.trial, base.sample
    # After a weighed fill, the errors of width, angle and depth are correlated, so all three change together.
    step = dict.fromkeys((*OF_THE_WALLS, "speed_mm_s", "volume_ml"), 0.0) | dict(steps)
    shape, weighed = base.crack, sample.solid.figures.weighed
    if weighed is not None and shape is not None:
        shape = shape_by_weight(shape, weighed)
        root, wall_steps = np.array(weighed.steps), np.array([step[name] for name in OF_THE_WALLS])
        signs = np.divide(wall_steps, root.diagonal(), out=np.zeros(len(wall_steps)), where=root.diagonal() > 0)
        step |= dict(zip(OF_THE_WALLS, (root @ signs).tolist(), strict=True))
        # Walls that lean past the vertical would have a different tilt.
        step[ANGLE] = max(step[ANGLE], -weighed.wall_angle_deg)
    first_mm, last_mm = trial.path.trims_mm
    start_mm = steps.get("start_mm", 0.0)
    path: dict[str, Any] = {
        "path.speed_mm_s": trial.path.speed_mm_s + step["speed_mm_s"],
        "path.volume_ml": sample.trajectory.dispensed_mm3 / 1e3 + step["volume_ml"],
        "path.trim_mm": (first_mm + start_mm, last_mm - start_mm),
    }
    changes = {} if trial.path.plan is not None else path
    if shape is not None:
        angle_deg, by_deg = shape.wall_angle_deg, step[ANGLE]
        angles_deg = tuple(deg + by_deg for deg in angle_deg) if isinstance(angle_deg, tuple) else angle_deg + by_deg
        other = {"wall_angle_deg": angles_deg, "depth_mm": moved_depth(shape.depth_mm, step["depth_mm"])}
        changes |= {"crack": shape.model_copy(update=other).model_dump(mode="json", exclude_none=True)}
    changed = base.changed(changes)
    cavity_mm3, sections = sample.solid.cavity_volume_mm3, sample.solid.sections
    trajectory = plan_trajectory(sample.outline, changed.path, cavity_mm3, sections)
    if trial.path.plan is not None:
        more = 1 + 1e3 * step["volume_ml"] / trajectory.dispensed_mm3
        trajectory = replace(trajectory, flow_mm3_s=more * trajectory.flow_mm3_s)
    if (delay_s := steps.get("pump_delay_s", 0.0)) > 0:
        late = begun_late(trajectory, delay_s)
        more = 1.0 if trial.path.weighed is None else trajectory.dispensed_mm3 / late.dispensed_mm3
        trajectory = replace(late, flow_mm3_s=more * late.flow_mm3_s)
    outline, solid = sample.outline, sample.solid
    if (walls := changed.crack) is not None and any(name in steps for name in OF_THE_WALLS):
        if meshed:
            from digitise.solid.build_solid import build_solid

            outline = widened(outline, step["width_mm"])
            return Sample(outline, build_solid(outline, walls), trajectory)
        from digitise.solid.sections import crack_sections

        # Making the ring and the mesh would take longer than a run of the fast model.
        moved = {"depth_mm": walls.deepest_mm, "wall_angles_deg": walls.wall_angles_deg}
        outline = walls_apart(outline, step["width_mm"] / outline.mean_width_mm)
        solid = replace(solid, sections=crack_sections(outline, walls), **moved)
    return Sample(outline, solid, trajectory)


def _fresh_pa_s(base: Base) -> float:
    """Return the viscosity of the run's sealant in Pa s. It is computed from U if the run did not record it."""
    from simulate.setup.rheology import dynamic_viscosity
    from simulate.setup.signed_distance import CM

    fluid, health = base.trial.given_fluid, base.run.health
    if health.viscosity_pa_s is not None:
        return health.viscosity_pa_s
    if health.U is None or health.frame_s is None:
        raise InputError(f"{base.path / 'simulation.json'}: health.viscosity_pa_s is missing. Simulate again.")
    return dynamic_viscosity(health.U, fluid.density_kg_m3, 4 * base.run.radius_mm * CM, health.frame_s)


def moved_paste(base: Base, steps: Mapping[str, float]) -> dict[str, Any]:
    """Return the settings of the paste, changed by ``steps``, by dotted name. They are in physical units, without U."""
    from simulate.material_curve import MaterialCurve

    fluid = base.trial.given_fluid
    thicker = 1 + steps.get("viscosity_percent", 0.0) / 100
    # The material file is removed, since it contains the measured numbers and not the changed ones.
    changes: dict[str, Any] = {"fluid.material": None}
    if "wall_share" in steps:
        changes["fluid.wall_share"] = min(1.0, max(MIN_WALL_SHARE, base.wall_share + steps["wall_share"]))
    if not isinstance(curve := fluid.curve, MaterialCurve):
        key = fluid.given_by if fluid.given_by in VISCOSITIES_PA_S else "viscosity_pa_s"
        changes |= {"fluid.U": None, f"fluid.{key}": _fresh_pa_s(base) * thicker}
        if "yield_stress_pa" in steps:
            changes["fluid.yield_stress_pa"] = fluid.yield_stress_pa + steps["yield_stress_pa"]
        return changes
    columns: dict[str, Any] = curve.model_dump(exclude_none=True)
    columns["viscosity_pa_s"] = [thicker * value for value in curve.viscosity_pa_s]
    if more_pa := steps.get("yield_stress_pa"):
        stress_pa = curve.yield_stress_pa or [0.0] * len(curve.viscosity_pa_s)
        columns["yield_stress_pa"] = [max(0.0, value + more_pa) for value in stress_pa]
    return changes | {"fluid.curve": columns}


def takes_draws(base: Base) -> bool:
    """Return True if the fast model computes the effect of changed inputs.

    This is so if the trial declares it, or if the fast model also computes the level. By default, it is so if the fast
    model is valid for the case. Raises InputError if the trial declares particles for the differences, but the fast
    model for the level.
    """
    declared, solver = base.trial.uncertainty.differences, base.trial.solver
    if not solver.has_particles:
        if declared == PARTICLES:
            raise InputError(
                f'{base.path / "trial.toml"}: uncertainty.differences = "{declared}" cannot be combined with '
                f'solver.model = "{solver.model}", since that model also computes the differences. Remove differences.'
            )
        return True
    if declared is not None:
        return declared != PARTICLES
    return not fast_level(base)[1]


def fast_level(base: Base) -> tuple[Profile | None, Facts]:
    """Return the level that the fast model computes for a trial, and why the fast model is not valid for the trial.

    The level is None if the fast model does not support the paste.
    """
    from simulate.slot.run import pour

    try:
        run, level = pour(base.trial.pour(base.sample))
    except InputError as fault:
        return None, (doubt("unfit.refused", str(fault)),)
    return level, run.unfit


def draw(base: Base, jobs: int, progress: Progress, folder: Path, runs: int = RUNS) -> InputDraws:
    """Return the change of level that each random draw of the inputs causes, computed with the fast model.

    Each finished part is written to ``folder``. If the process is killed, the next call computes the other parts.

    Raises:
        InputError: The fast model does not support the paste, or a drawn value of an input is out of range.
        NumericalError: Memory ran out.
    """
    refuse_immovable(base)
    inputs = base.inputs
    s_mm = np.linspace(0.0, base.sample.outline.length_mm, PLACES)
    steps = [_steps(base, dict(zip(inputs, row, strict=True))) for row in drawn_inputs(inputs, runs).tolist()]
    parts = {folder / f"{first}.bin": steps[first : first + PART] for first in range(0, runs, PART)}
    tasks = {part: (base, moves, s_mm) for part, moves in parts.items() if not part.is_file()}
    done = len(parts) - len(tasks)
    progress.start("Moved inputs", len(parts), done)
    for part, part_mm in run_tasks(levels_of, tasks.items(), jobs):
        if isinstance(part_mm, Lost):
            raise NumericalError(f"{base.path}: {part_mm.reason}. Repeat the command.")
        if isinstance(part_mm, str):
            raise InputError(part_mm)
        files.write_bytes(part, part_mm.tobytes())
        done += 1
        progress.advance(done, f"{done} of {len(parts)} parts of {PART} runs of the fast model")
    levels_mm = np.frombuffer(b"".join(map(files.read_bytes, parts))).reshape(-1, PLACES)
    # Rounding to tenths of a micrometre keeps the file small.
    return InputDraws(s_mm, inputs, np.round(levels_mm - level_of(base, {}, s_mm), 4))


def levels_of(base: Base, moves: Sequence[dict[str, float]], s_mm: Floats) -> Floats | str:
    """Return the level of a run for each of ``moves``, (runs, k), or an error message if an input is out of range."""
    levels_mm = []
    for steps in moves:
        try:
            levels_mm.append(level_of(base, steps, s_mm))
        except InputError as fault:
            moves_text = ", ".join(f"{name} {step:+.3g}" for name, step in steps.items())
            return (
                f"{fault} A random draw of the inputs is out of range ({moves_text}). "
                'uncertainty.differences = "particles" does not use random draws.'
            )
    return np.array(levels_mm)


def level_of(base: Base, steps: dict[str, float], s_mm: Floats) -> Floats:
    """Return the level that the fast model computes at ``s_mm``, (k,), with inputs changed by ``steps``.

    Raises InputError if an input is out of range.
    """
    from simulate.slot.fill import STEPS
    from simulate.slot.run import bed_of, paste_of

    pour = base.changed(moved_paste(base, steps)).pour(moved_sample(base, steps, meshed=False))
    bed = bed_of(pour, paste_of(pour), pour.sample.trajectory, steps=STEPS // STEP_FACTOR)
    return np.interp(s_mm, bed.sections.s_mm, bed.level_mm)


def _steps(base: Base, z: dict[str, float]) -> dict[str, float]:
    """Return the change of each input. ``z`` gives the changes in standard uncertainties.

    The change of a viscosity applies to its logarithm. A yield stress and a wall angle do not become less than 0.
    """
    inputs, trial = base.inputs, base.trial
    steps = {name: value * inputs[name] for name, value in z.items()}
    if "viscosity_percent" in z:
        steps["viscosity_percent"] = 100 * ((1 + inputs["viscosity_percent"] / 100) ** z["viscosity_percent"] - 1)
    if "yield_stress_pa" in z and trial.fluid is not None:
        steps["yield_stress_pa"] = max(steps["yield_stress_pa"], -trial.fluid.yield_stress_pa)
    if ANGLE in z and base.crack is not None and base.sample.solid.figures.weighed is None:
        steps[ANGLE] = max(steps[ANGLE], -min(base.crack.wall_angles_deg))
    return steps
