"""The fast model of a report's page: what its script computes with, and the trial file that it writes."""

from dataclasses import asdict
from typing import Any

import numpy as np

from digitise.settings import LARGEST_VOLUME_ML, SMALLEST_VOLUME_ML
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats, Outline, Solid, Trajectory
from sealtwin.trial.job import Job
from sealtwin.trial.trial_file import Trial, trial_text
from validate.report_input import LiveModel, LiveSlider, LiveWidth

REACH = {"flow_mm3_s": (0.4, 1.6), "speed_mm_s": (0.5, 2.0)}
"""Lowest and highest value of a slider, over that of the run."""
LEAST_STRESS_PA = 30.0  # Least upper end of the yield stress: fresh grouts have 5 to 37 Pa
WIDER = (-0.3, 0.0, 0.3)
"""Changes of the mean width for which solids are built. Areas are linear in it, but where the walls of a funnel meet."""
WIDER_FUNNEL = tuple(np.linspace(-0.3, 0.3, 9).tolist())
STEPS = 100  # Of a slider, about
MOST_PLACES = 2000  # Of the nozzle on the page; a path of more is thinned
NAME_KEPT = 60  # Letters of the trial's name in that of the changed one


def live_model(job: Job, outline: Outline, solid: Solid, trajectory: Trajectory) -> LiveModel | None:
    """Return the fast model of a digitised trial, as its page computes it.

    None of a trial that the fast model refuses, and of one whose crack or path was edited by hand: no trial file makes
    it.
    """
    from simulate.slot.fill import CELLS, down
    from simulate.slot.run import paste_of, unknown
    from simulate.slot.sections import Trapezoids, sections_of

    trial, fluid = job.trial, job.trial.fluid
    if fluid is None or trajectory.dispensed_mm3 <= 0 or job.folder.edited("digitise"):
        return None
    solver = trial.solver.for_crack(outline.mean_width_mm)
    try:
        paste = paste_of(fluid, solver, trial.nozzle, trajectory, trial.seed)
    except InputError:
        return None

    giving = trajectory.giving
    times_s = trajectory.t_s[giving] - trajectory.t_s[giving.start]
    at_s = times_s if len(times_s) <= MOST_PLACES else np.linspace(0.0, times_s[-1], MOST_PLACES)

    def placed(values: Floats) -> list[float]:
        return _rounded(np.interp(at_s, times_s, values[giving]))

    widths, own = [], None
    for wide, walls, path in _widths(trial, outline, solid, trajectory):
        sections: Trapezoids = sections_of(wide, walls, CELLS, reach_per_mm=0.0)
        own = sections if wide is outline else own
        arrays = {name: _rounded(getattr(sections, name)) for name in ("floor_mm", "mouth_mm", "depth_mm", "slant")}
        given_mm3 = placed(np.concatenate([[0.0], np.cumsum(path.given_mm3)]))
        reach = {"mean_width_mm": wide.mean_width_mm, "reach_mm": sections.reach_mm}
        widths.append(LiveWidth(**arrays, **reach, given_mm3=given_mm3))
    assert own is not None, "the crack as run is one of them"
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
        sliders=_sliders(trial, float(times_s[-1]), trajectory.dispensed_mm3, paste.yield_stress_pa, outline, widths),
        unknown=unknown(fluid, outline),
        trial=_changed(trial, paste.consistency_pa_s_n, len(widths) > 1),
    )


def _widths(
    trial: Trial, outline: Outline, solid: Solid, trajectory: Trajectory
) -> list[tuple[Outline, Solid, Trajectory]]:
    """Return the crack with its path at mean widths about its own, as far as a solid can be built of it.

    A mesh, a weighed cavity and one with side cracks keep their width.
    """
    from digitise.solid.build_solid import build_solid
    from digitise.trajectory import plan_trajectory
    from digitise.weighing.moved_walls import widened

    as_run = outline, solid, trajectory
    if trial.crack is None or trial.crack.fill is not None or outline.branches_kept:
        return [as_run]
    poured = trial.path.model_copy(update={"volume_ml": trajectory.dispensed_mm3 / 1e3, "fill": 1.0})
    found = []
    for share in WIDER_FUNNEL if trial.crack.tilt == "funnel" else WIDER:
        if share == 0:
            found.append(as_run)
            continue
        wide = widened(outline, share * outline.mean_width_mm)
        try:
            walls = build_solid(wide, trial.crack)
        except InputError:
            continue
        path = trajectory
        if trial.path.flow == "cross_section":
            path = plan_trajectory(wide, poured, walls.cavity_volume_mm3, walls.sections)
        found.append((wide, walls, path))
    return found


def _sliders(
    trial: Trial, gives_s: float, dispensed_mm3: float, stress_pa: float, outline: Outline, widths: list[LiveWidth]
) -> dict[str, LiveSlider]:
    """Return the sliders, within what a trial file allows."""
    flow_mm3_s, speed_mm_s = dispensed_mm3 / gives_s, trial.path.speed_mm_s
    slowest, fastest = (speed_mm_s * share for share in REACH["speed_mm_s"])
    least, most = (flow_mm3_s * share for share in REACH["flow_mm3_s"])
    # The volume is the flow in the time that the path takes.
    least = max(least, 1e3 * SMALLEST_VOLUME_ML / gives_s * fastest / speed_mm_s)
    most = min(most, 1e3 * LARGEST_VOLUME_ML / gives_s * slowest / speed_mm_s)
    sliders = {
        "flow_mm3_s": _slider(flow_mm3_s, least, most),
        "speed_mm_s": _slider(speed_mm_s, max(slowest, 0.01), min(fastest, 1000.0)),
        "yield_stress_pa": _slider(stress_pa, 0.0, min(1e4, max(LEAST_STRESS_PA, 2 * stress_pa))),
    }
    if trial.photo is not None and len(widths) > 1:
        ends_mm = widths[0].mean_width_mm, widths[-1].mean_width_mm
        slider = _slider(outline.mean_width_mm, *ends_mm)
        sliders["mean_width_mm"] = slider.model_copy(update={"said": trial.photo.mean_width_mm is not None})
    return sliders


def _slider(as_run: float, lowest: float, highest: float) -> LiveSlider:
    rough = (max(highest, as_run) - min(lowest, as_run)) / STEPS
    power = 10.0 ** np.floor(np.log10(rough))
    step = float(power * max(digit for digit in (1, 2, 5) if digit * power <= rough * (1 + 1e-9)))
    # A step short of the end, rather than beyond it.
    low, high = (max(0, int((end - as_run) * sign / step + 1e-9)) for end, sign in ((lowest, -1), (highest, 1)))
    return LiveSlider(as_run=as_run, step=step, low=-low, high=high)


def _changed(trial: Trial, consistency_pa_s_n: float, widens: bool) -> str:
    """Return the text of the trial file that the page completes, without readings: they are of what was run."""
    import tomlkit

    fluid, photo = trial.fluid, trial.photo
    assert fluid is not None, "it was run"
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


def _rounded(values: Floats) -> list[float]:
    return np.round(values, 6).tolist()
