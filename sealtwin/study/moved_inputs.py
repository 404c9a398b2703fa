"""A trial with its uncertain inputs moved: crack, path and paste as they would be, were they larger or smaller."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from digitise.settings import CrackShape
from digitise.weighing.moved_walls import moved_depth, shape_by_weight, walls_apart, widened
from sealtwin.core import record_files
from sealtwin.core.errors import InputError
from sealtwin.core.records import Outline, Profile, Run, Solid
from sealtwin.core.settings import checked
from sealtwin.study.runner import Bench, read_bench
from sealtwin.trial.job import Job
from sealtwin.trial.trial_file import Trial, with_settings
from validate.settings import ANGLE, OF_THE_WALLS

OF_THE_PATH = ("speed_mm_s", "start_mm")


@dataclass(frozen=True, eq=False)
class Base:
    """The run that extra runs are held against, which can be sent to another process."""

    path: Path  # Run folder
    trial: Trial
    bench: Bench
    run: Run
    profile: Profile

    @classmethod
    def of(cls, job: Job) -> "Base":
        """Read the run of a trial."""
        records = record_files.read_run(job.path), record_files.read_profile(job.path)
        return cls(job.path, job.trial, read_bench(job.path, None), *records)

    @property
    def inputs(self) -> dict[str, float]:
        """Standard uncertainty of each input that is moved, by name."""
        return self.trial.known_inputs(self.bench.outline, self.bench.solid).moved

    def changed(self, changes: Mapping[str, Any]) -> Trial:
        """Return the trial with other settings, by dotted name; None stands for no setting. Raises InputError."""
        where = Path(f"{self.path / 'trial.toml'}, moved by its [uncertainty]")
        return checked(Trial, where, with_settings(self.trial.model_dump(mode="json", exclude_none=True), changes))


def refuse_immovable(base: Base) -> None:
    """Raises InputError for an input that the sample's walls do not have."""
    crack, outline, inputs = base.trial.crack, base.bench.outline, base.inputs
    walls, width_mm, fault = [name for name in OF_THE_WALLS if name in inputs], inputs.get("width_mm", 0.0), None
    if base.trial.path.plan is not None and (fixed := [name for name in OF_THE_PATH if name in inputs]):
        fault = f"{', '.join(fixed)}: path.plan gives the path, of which only the volume is moved. Leave it out."
    elif walls and crack is None:
        fault = f"{', '.join(walls)}: the sample is a mesh, whose walls are its own. Leave it out."
    elif width_mm and outline.branches_kept:
        fault = "width_mm: side cracks are part of the outline, and only a main crack is widened. Leave it out."
    elif width_mm > outline.mean_width_mm / 2:
        fault = f"width_mm = {width_mm:g}: of a crack {outline.mean_width_mm:.2f} mm wide at most half can be in doubt."
    elif crack is not None and crack.tilt == "vertical" and ANGLE in walls:
        fault = f"{ANGLE}: the walls are vertical. Leave it out, or give crack.tilt a reading that has an angle."
    if fault is not None:
        raise InputError(f"{base.path / 'trial.toml'}: [uncertainty] {fault}")


def moved_bench(base: Base, steps: Mapping[str, float], *, meshed: bool = True) -> Bench:
    """Move crack and path of the sample by ``steps``. The path is still planned on the crack as it was traced.

    Without a mesh (``meshed`` false) the solid has moved sections alone, which is all that the fast model takes of it.
    """
    from digitise.trajectory import plan_trajectory

    trial, bench = base.trial, base.bench
    # How far each input is moved; what a weighed fill leaves of width, angle and depth moves together.
    step = dict.fromkeys((*OF_THE_WALLS, "speed_mm_s", "volume_ml"), 0.0) | dict(steps)
    shape, weighed = trial.crack, bench.solid.figures.weighed
    if weighed is not None and shape is not None:
        shape = shape_by_weight(shape, weighed)
        root, own = np.array(weighed.steps), np.array([step[name] for name in OF_THE_WALLS])
        signs = np.divide(own, root.diagonal(), out=np.zeros(len(own)), where=root.diagonal() > 0)
        step |= dict(zip(OF_THE_WALLS, (root @ signs).tolist(), strict=True))
        # Beyond upright the walls would have another tilt.
        step[ANGLE] = max(step[ANGLE], -weighed.wall_angle_deg)
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
        angle_deg, by_deg = shape.wall_angle_deg, step[ANGLE]
        angles_deg = tuple(one + by_deg for one in angle_deg) if isinstance(angle_deg, tuple) else angle_deg + by_deg
        other = {"wall_angle_deg": angles_deg, "depth_mm": moved_depth(shape.depth_mm, step["depth_mm"])}
        changes |= {"crack": shape.model_copy(update=other).model_dump(mode="json", exclude_none=True)}
    changed = base.changed(changes)
    cavity_mm3, sections = bench.solid.cavity_volume_mm3, bench.solid.sections
    trajectory = plan_trajectory(bench.outline, changed.path, cavity_mm3, sections)
    if trial.path.plan is not None:
        more = 1 + 1e3 * step["volume_ml"] / trajectory.dispensed_mm3
        trajectory = replace(trajectory, flow_mm3_s=more * trajectory.flow_mm3_s)
    outline, solid = bench.outline, bench.solid
    if changed.crack is not None and any(name in steps for name in OF_THE_WALLS):
        make = _meshed if meshed else _in_sections
        outline, solid = make(bench, changed.crack, step["width_mm"])
    return Bench(outline, solid, trajectory, None)


def _meshed(bench: Bench, shape: CrackShape, wider_mm: float) -> tuple[Outline, Solid]:
    from digitise.solid.build_solid import build_solid

    outline = widened(bench.outline, wider_mm)
    return outline, build_solid(outline, shape)


def _in_sections(bench: Bench, shape: CrackShape, wider_mm: float) -> tuple[Outline, Solid]:
    """Move walls and sections alone: ring and mesh take longer than a run of the fast model."""
    from digitise.solid.tilt_variants import crack_sections

    outline = walls_apart(bench.outline, wider_mm / bench.outline.mean_width_mm)
    moved = {"depth_mm": shape.deepest_mm, "wall_angles_deg": shape.wall_angles_deg}
    return outline, replace(bench.solid, sections=crack_sections(outline, shape), **moved)


def _fresh_pa_s(base: Base) -> float:
    """Return the viscosity of the run's sealant in Pa s, or what its U amounts to if U alone is no viscosity."""
    from simulate.setup.rheology import dynamic_viscosity
    from simulate.setup.signed_distance import CM

    fluid, health = base.trial.fluid, base.run.health
    if health.viscosity_pa_s is not None:
        return health.viscosity_pa_s
    assert fluid is not None, "it was run"
    assert health.U is not None, "recorded beside U"
    assert health.frame_s is not None, "recorded of particles, and the fast model refuses such a U"
    return dynamic_viscosity(health.U, fluid.density_kg_m3, 4 * base.run.radius_mm * CM, health.frame_s)


def moved_paste(base: Base, steps: Mapping[str, float]) -> dict[str, Any]:
    """Return the settings, by dotted name, of the moved paste in physical units: U depends on radius and frame."""
    fluid = base.trial.fluid
    assert fluid is not None, "it was run"
    thicker = 1 + steps.get("viscosity_percent", 0.0) / 100
    # Its record is of the measured numbers, not of moved ones.
    changes: dict[str, Any] = {"fluid.material": None}
    if (curve := fluid.curve) is None:
        thickness = "fluid.viscosity_pa_s" if fluid.consistency_pa_s_n is None else "fluid.consistency_pa_s_n"
        changes |= {"fluid.U": None, thickness: _fresh_pa_s(base) * thicker}
        if "yield_stress_pa" in steps:
            changes["fluid.yield_stress_pa"] = fluid.yield_stress_pa + steps["yield_stress_pa"]
        return changes
    assert not isinstance(curve, Path), "it was run"
    columns: dict[str, Any] = dict(curve.columns)
    columns["viscosity_pa_s"] = [thicker * value for value in curve.viscosity_pa_s]
    if more_pa := steps.get("yield_stress_pa"):
        stress_pa = curve.yield_stress_pa or [0.0] * len(curve.viscosity_pa_s)
        columns["yield_stress_pa"] = [max(0.0, value + more_pa) for value in stress_pa]
    return changes | {"fluid.curve": columns}
