"""Change the particle radius of a trial without its physics, and make a draft of it for a search."""

from collections.abc import Iterable
from typing import NamedTuple

from sealtwin.core.records import Sample
from sealtwin.trial.trial_file import Trial
from simulate.material_file import Material

OF_ANY_DRAFT = ("solver.model", "solver.settle_s")
"""Settings of the solver that a draft leaves as they are."""


def sets_resolution(names: Iterable[str]) -> bool:
    """Return True if ``names`` has a setting of the solver that a draft would replace."""
    return any(name.startswith("solver.") and name not in OF_ANY_DRAFT for name in names)


class Resolution(NamedTuple):
    """Radius of the particles and duration of a frame, on which U and D depend."""

    radius_mm: float
    frame_s: float


def at_resolution(trial: Trial, before: Resolution, after: Resolution) -> Trial:
    """Return a trial with another particle radius, and with the U and D of the same viscosity and drag per time."""
    fluid, longer = trial.given_fluid, after.frame_s / before.frame_s
    weights: dict[str, float] = {}
    if fluid.U is not None:
        weights["U"] = fluid.U * (before.radius_mm / after.radius_mm) ** 4 * longer
    if fluid.D_cm is not None:
        weights["D_cm"] = fluid.D_cm * longer
    solver = trial.solver.model_copy(update={"radius_mm": after.radius_mm})
    return trial.model_copy(update={"fluid": fluid.model_copy(update=weights), "solver": solver})


def drafted(trial: Trial, sample: Sample) -> Trial:
    """Return a trial with preset "draft": the same physics with larger particles and longer substeps.

    A trial of the fast model or of another preset is returned as it is. Particles do not become smaller. A calibrated
    material keeps the radius of its calibration.
    """
    from simulate.setup.release_schedule import plan_releases

    solver, width_mm = trial.solver, sample.outline.mean_width_mm
    if not solver.has_particles or solver.preset != "accurate":
        return trial
    changes = {"preset": "draft", "radius_mm": "auto", "pressure": "local", "substeps": None, "iterations": None}
    draft = solver.model_copy(update=changes).for_crack(width_mm, trial.nozzle)
    own_mm = solver.for_crack(width_mm, trial.nozzle).size_mm
    material = trial.given_fluid.material
    calibrated_mm = material.radius_mm if isinstance(material, Material) else None
    radius_mm = calibrated_mm or max(own_mm, draft.size_mm)

    def resolution(radius_mm: float) -> Resolution:
        return Resolution(
            radius_mm, plan_releases(sample.trajectory, radius_mm, trial.nozzle.diameter_mm, trial.seed).frame_s
        )

    return at_resolution(trial.model_copy(update={"solver": draft}), resolution(own_mm), resolution(radius_mm))
