"""The fast model on a report's page: the input of its script, and the template of the trial file that it writes."""

from collections.abc import Collection, Iterator
from contextlib import suppress
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from digitise.settings import LARGEST_VOLUME_ML, SMALLEST_VOLUME_ML
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats, Outline, Solid, Trajectory
from sealtwin.trial.job import Job
from sealtwin.trial.trial_file import Trial, trial_text
from validate.report_input import LiveModel, LiveSlider, LiveWidth

REACH = {"flow_mm3_s": (0.4, 1.6), "speed_mm_s": (0.5, 2.0)}
"""Lowest and highest value of a slider, each divided by the value of the run."""
LEAST_STRESS_PA = 30.0  # Smallest upper end of the slider of the yield stress: fresh grouts have 5 to 37 Pa
WIDER, WIDTHS = 0.03, 10  # Relative step of the slider of the mean width, and largest number of steps either way
STEPS = 100  # Approximate number of steps of a slider
MOST_PLACES = 1000  # Largest number of nozzle positions on the page; a longer path is thinned out
NAME_KEPT = 60  # Characters of the trial's name in the name of the changed one


def live_model(job: Job, outline: Outline, solid: Solid, trajectory: Trajectory) -> LiveModel | None:
    """Return the input of the fast model on the page of a digitised trial.

    None if the trial has no fluid or no sealant, if the fast model does not support its paste, or if crack or path were
    edited by hand, since no trial file can describe the edit.
    """
    from simulate.slot.fill import CELLS, down
    from simulate.slot.fitness import LIMITS, fitness_of
    from simulate.slot.run import paste_of, unknown
    from simulate.slot.sections import sections_of

    trial, fluid = job.trial, job.trial.fluid
    if fluid is None or trajectory.dispensed_mm3 <= 0 or job.folder.edited("digitise"):
        return None
    solver = trial.solver.for_crack(outline.mean_width_mm, trial.nozzle)
    try:
        paste = paste_of(fluid, solver, trial.nozzle, trajectory, trial.seed)
    except InputError:
        return None

    giving = trajectory.giving
    times_s = trajectory.t_s[giving] - trajectory.t_s[giving.start]
    at_s = times_s if len(times_s) <= MOST_PLACES else np.linspace(0.0, times_s[-1], MOST_PLACES)

    def placed(values: Floats) -> list[float]:
        return _rounded(np.interp(at_s, times_s, values[giving]), digits=9)

    widths: dict[int, LiveWidth] = {}
    for step, wide, walls, path in _widths(trial, outline, solid, trajectory):
        sections = sections_of(wide, walls, CELLS, reach_per_mm=0.0)
        arrays = {name: _rounded(getattr(sections, name)) for name in ("floor_mm", "mouth_mm", "depth_mm", "slant")}
        given_mm3 = placed(np.concatenate([[0.0], np.cumsum(path.given_mm3)]))
        widths[step] = LiveWidth(**arrays, reach_mm=sections.reach_mm, given_mm3=given_mm3)
    own = sections_of(outline, solid, CELLS, reach_per_mm=0.0)
    along, into = down(outline, own, trial.sample)
    return LiveModel(
        s_mm=own.s_mm.tolist(),
        widths=widths,
        along=_rounded(along),
        into=into,
        paste=asdict(paste),
        nozzle_mm=trial.nozzle.diameter_mm,
        settle_s=solver.settle_s,
        path={"t_s": placed(trajectory.t_s - trajectory.t_s[giving.start]), "s_mm": placed(trajectory.s_mm)}
        | {"z_mm": placed(trajectory.position_mm[:, 2])},
        after_s=float(trajectory.t_s[-1] - trajectory.t_s[giving.stop - 1]),
        sliders=_sliders(trial, float(times_s[-1]), trajectory.dispensed_mm3, paste.yield_stress_pa)
        | _width_slider(trial, outline, widths),
        limits=LIMITS,
        # The page computes the other reasons; those about the shape of the crack are of the run.
        unknown=(*fitness_of(solid, outline, trajectory, paste).of_the_crack, *unknown(fluid, outline)),
        trial=_changed(trial, paste.consistency_pa_s_n, len(widths) > 1),
    )


def _widths(
    trial: Trial, outline: Outline, solid: Solid, trajectory: Trajectory
) -> Iterator[tuple[int, Outline, Solid, Trajectory]]:
    """Yield each step of the mean width with its crack, solid and path.

    Only sections and block of the solid follow the width; its mesh remains that of the trial. A mesh, a weighed cavity
    and a crack with side cracks have step 0 alone. In each direction the steps end at the first width for which no
    solid can be laid out.
    """
    from digitise.solid.build_solid import shape_as_long_as
    from digitise.solid.footprint import lay_out
    from digitise.solid.tilt_variants import crack_sections
    from digitise.solid.wedges import wall_shifts_mm
    from digitise.trajectory import plan_trajectory
    from digitise.weighing.moved_walls import widened

    yield 0, outline, solid, trajectory
    if trial.crack is None or trial.crack.fill is not None or outline.branches_kept:
        return
    shape, _ = shape_as_long_as(outline.length_mm, trial.crack)
    poured = trial.path.model_copy(update={"volume_ml": trajectory.dispensed_mm3 / 1e3, "fill": 1.0})
    for way in (-1, 1):
        with suppress(InputError):
            for step in range(way, way * (WIDTHS + 1), way):
                wide = widened(outline, WIDER * step * outline.mean_width_mm)
                block_mm = lay_out(wide, shape, max(wall_shifts_mm(shape))).block_mm
                walls = replace(solid, sections=crack_sections(wide, shape), block_mm=block_mm)
                path = trajectory
                if poured.flow == "cross_section":
                    path = plan_trajectory(wide, poured, sections=walls.sections)
                yield step, wide, walls, path


def _sliders(trial: Trial, gives_s: float, dispensed_mm3: float, stress_pa: float) -> dict[str, LiveSlider]:
    """Return the sliders of path and paste. Their ends are limited to values that a trial file allows."""
    flow_mm3_s, speed_mm_s = dispensed_mm3 / gives_s, trial.path.speed_mm_s
    slowest, fastest = (speed_mm_s * share for share in REACH["speed_mm_s"])
    least, most = (flow_mm3_s * share for share in REACH["flow_mm3_s"])
    # Volume = flow times the duration of the path.
    least = max(least, 1e3 * SMALLEST_VOLUME_ML / gives_s * fastest / speed_mm_s)
    most = min(most, 1e3 * LARGEST_VOLUME_ML / gives_s * slowest / speed_mm_s)
    return {
        "flow_mm3_s": _slider(flow_mm3_s, least, most),
        "speed_mm_s": _slider(speed_mm_s, max(slowest, 0.01), min(fastest, 1000.0)),
        "yield_stress_pa": _slider(stress_pa, 0.0, min(1e4, max(LEAST_STRESS_PA, 2 * stress_pa))),
    }


def _width_slider(trial: Trial, outline: Outline, widths: Collection[int]) -> dict[str, LiveSlider]:
    """Return the slider of the mean width; empty if the width is fixed."""
    if trial.photo is None or len(widths) == 1:
        return {}
    width_mm, in_trial = outline.mean_width_mm, trial.photo.mean_width_mm is not None
    slider = LiveSlider(as_run=width_mm, step=WIDER * width_mm, low=min(widths), high=max(widths), in_trial=in_trial)
    return {"mean_width_mm": slider}


def _slider(as_run: float, lowest: float, highest: float) -> LiveSlider:
    rough = (max(highest, as_run) - min(lowest, as_run)) / STEPS
    power = 10.0 ** np.floor(np.log10(rough))
    step = float(power * max(digit for digit in (1, 2, 5) if digit * power <= rough * (1 + 1e-9)))
    # Round inward, so that no step is beyond the end.
    low, high = (max(0, int((end - as_run) * sign / step + 1e-9)) for end, sign in ((lowest, -1), (highest, 1)))
    return LiveSlider(as_run=as_run, step=step, low=-low, high=high)


def _changed(trial: Trial, consistency_pa_s_n: float, widens: bool) -> str:
    """Return the template of a trial file that the page completes. It has no readings, which belong to the run."""
    import tomlkit

    fluid, photo = trial.given_fluid, trial.photo
    if fluid.U is not None:
        # U is the viscosity of particles, and changes with flow and speed.
        fluid = fluid.model_copy(update={"U": None, "viscosity_pa_s": consistency_pa_s_n})
    changes: dict[str, Any] = {
        "name": f"{trial.name[:NAME_KEPT]} (changed)",
        "fluid": fluid.model_copy(update={"material": None}),
        "path": trial.path.model_copy(update={"fill": 1.0}),
        "readings": None,
        "gate": None,
    }
    written = [("path", "volume_ml"), ("path", "speed_mm_s"), ("fluid", "yield_stress_pa")]
    if photo is not None and widens:
        changes["photo"] = photo.model_copy(update={"mean_width_mm": 1.0})
        written.append(("photo", "mean_width_mm"))
    document: Any = tomlkit.parse(trial_text(trial.model_copy(update=changes)))
    for table, key in written:
        document[table][key] = "@"
    return tomlkit.dumps(document)


def _rounded(values: Floats, digits: int = 5) -> list[float]:
    return np.round(values, digits).tolist()
