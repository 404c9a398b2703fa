"""The extra runs that say how far a simulated level can be trusted: three particle sizes, and inputs moved by design.

They lie in RUN/uncertainty, a ledger like that of a sweep, and are computed once: the same command goes on after a
kill, and costs nothing once all are done.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from sealtwin.errors import InputError, NumericalError
from sealtwin.records import Outline, Profile, Run, Solid, Trajectory
from sealtwin.store import files, stage_files
from sealtwin.store.folder import stage_key
from sealtwin.store.settings_file import checked
from sealtwin.store.tables import read_table
from sealtwin.study.estimate import Size, estimate, size_of
from sealtwin.study.ledger import STATES, Entry, Ledger, StudyRun, profile_path
from sealtwin.study.sweep import cores
from sealtwin.study.workers import Task, run_here
from sealtwin.trials.digitising import dispensed_mm3
from sealtwin.trials.job import Job, stage_settings
from sealtwin.trials.made import DIGITISED, made_by
from sealtwin.trials.trial import Trial
from sealtwin.trials.validating import SPREAD, varied_settings
from validate.uncertainty.design import Effect, effects_of, two_level_design
from validate.uncertainty.spread import Size as SizeOfParticle
from validate.uncertainty.spread import Spread

FOLDER = "uncertainty"
"""In a run folder: ledger, samples and profiles of the extra runs."""
RATIO = 1.3
"""Between neighbouring particle sizes, the least that Celik et al. 2008 recommend: a finer run costs four times as
much, and a coarser one soon has too few particles abreast."""
BATCH = 1
"""Runs in a launch: they differ in more than their fluids."""
OF_THE_WALLS = ("width_mm", "wall_angle_deg", "depth_mm")
"""Inputs that change the solid."""
SAME_POINT_MM = 1e-6
"""Both walls at a tip."""


@dataclass(frozen=True)
class _Sample:
    """A crack, what the nozzle does over it, and the fluid that was run."""

    outline: Outline
    solid: Solid
    trajectory: Trajectory
    run: Run
    profile: Profile


@dataclass(frozen=True)
class _Variant:
    """One extra run."""

    settings: dict[str, float]
    """What is different, for people."""
    trial: Trial
    sample: _Sample


def vary(job: Job) -> bool:
    """Bring RUN/uncertainty.json up to date; whether anything was computed.

    Raises:
        InputError: the trial has no readings, its run is not finished, or an input cannot be varied as declared.
        NumericalError: an extra run failed; it is named, and the same command tries it again.
    """
    from simulate.device import choose_device

    if job.trial.readings is None:
        raise InputError(
            f"{job.path / 'trial.toml'}: no [readings]; --uncertainty is that of a comparison. Give a sheet of "
            "readings, or leave --uncertainty out."
        )
    inputs = {**made_by(job, "digitise", DIGITISED), **made_by(job, "simulate", ("particles.csv", "profile.csv"))}
    device = choose_device(job.device)
    settings = varied_settings(job.trial)
    key = stage_key(inputs, {**settings, "device": device})
    if job.folder.is_current(FOLDER, key):
        return False
    sample = _Sample(
        stage_files.read_outline(job.path),
        stage_files.read_solid(job.path),
        stage_files.read_trajectory(job.path),
        stage_files.read_run(job.path),
        stage_files.read_profile(job.path),
    )
    sizes, designed = _sizes(job, sample), _designed(job, sample)
    folder = job.path / FOLDER
    folder.mkdir(exist_ok=True)
    with Ledger(folder, create=True) as ledger:
        entries, largest = _entries(folder, [*sizes, *designed], device, inputs)
        ledger.plan(entries)
        ledger.put_back([run.key for run in ledger.runs() if not _is_kept(folder, run)])
        _run(job, ledger, Task(folder, device, BATCH, keep_runs=False), largest)
        runs = ledger.runs()
    _require_all(runs, folder)
    levels = [_level_mm(folder, run, sample.profile) for run in runs]
    spread = _spread(job.trial, sample, sizes, designed, levels)
    job.folder.clear(FOLDER)
    files.write_json(job.path / SPREAD, spread.content())
    wall_s = sum(run.wall_s or 0.0 for run in runs)
    job.folder.record(FOLDER, key, settings, inputs, [SPREAD], wall_s)
    return True


def _sizes(job: Job, sample: _Sample) -> list[_Variant]:
    """A finer and a coarser run; the trial's own stands between them."""
    radii_mm = [sample.run.radius_mm / RATIO, sample.run.radius_mm * RATIO]
    return [
        _Variant({"solver.radius_mm": round(radius_mm, 4)}, _same_physics(job, sample, radius_mm), sample)
        for radius_mm in radii_mm
    ]


def _designed(job: Job, sample: _Sample) -> list[_Variant]:
    """Each declared input a standard uncertainty up or down, after the design; at the coarser size, which is quick."""
    inputs = job.trial.uncertainty.moved
    if not inputs:
        return []
    radius_mm = sample.run.radius_mm * RATIO
    variants = []
    for signs in two_level_design(len(inputs)):
        steps = {name: float(sign * standard) for sign, (name, standard) in zip(signs, inputs.items(), strict=True)}
        moved = _moved(job, sample, steps)
        variants.append(_Variant(steps, _same_physics(job, moved, radius_mm, steps), moved))
    return variants


def _moved(job: Job, sample: _Sample, steps: Mapping[str, float]) -> _Sample:
    """The sample with its crack and its path moved. The robot knows only the crack as it was traced."""
    from digitise.solid import build_solid
    from digitise.trajectory import plan_trajectory

    trial, outline, solid = job.trial, sample.outline, sample.solid
    if any(name in steps for name in OF_THE_WALLS):
        if trial.crack is None:
            raise InputError(
                f"{job.path / 'trial.toml'}: [uncertainty] {', '.join(name for name in OF_THE_WALLS if name in steps)}:"
                " the sample is a mesh, whose walls are its own. Leave it out."
            )
        if "width_mm" in steps:
            if outline.branches_kept:
                raise InputError(
                    f"{job.path / 'trial.toml'}: [uncertainty] width_mm: side cracks are part of the outline, and only "
                    "a main crack is widened. Leave it out."
                )
            if abs(steps["width_mm"]) > outline.mean_width_mm / 2:
                raise InputError(
                    f"{job.path / 'trial.toml'}: [uncertainty] width_mm = {abs(steps['width_mm']):g}: of a crack "
                    f"{outline.mean_width_mm:.2f} mm wide at most half can be in doubt."
                )
            outline = _widened(outline, steps["width_mm"])
        changes = {
            "crack.wall_angle_deg": _shifted(trial.crack.wall_angle_deg, steps.get("wall_angle_deg", 0.0)),
            "crack.depth_mm": _deeper(trial.crack.depth_mm, steps.get("depth_mm", 0.0)),
        }
        if "wall_angle_deg" in steps and trial.crack.tilt == "vertical":
            raise InputError(
                f"{job.path / 'trial.toml'}: [uncertainty] wall_angle_deg: the walls are vertical. Leave it out, or "
                "give crack.tilt a reading that has an angle."
            )
        crack = _changed(job, changes).crack
        assert crack is not None, "it has one"
        solid = build_solid(outline, crack)
    first_mm, last_mm = trial.path.trims_mm
    start_mm = steps.get("start_mm", 0.0)
    path = _changed(
        job,
        {
            "path.speed_mm_s": trial.path.speed_mm_s + steps.get("speed_mm_s", 0.0),
            "path.volume_ml": dispensed_mm3(sample.trajectory) / 1e3 + steps.get("volume_ml", 0.0),
            "path.fill": 1.0,
            "path.trim_mm": (first_mm + start_mm, last_mm - start_mm),
        },
    ).path
    trajectory = plan_trajectory(sample.outline, path, sample.solid.cavity_volume_mm3, sample.solid.sections)
    return replace(sample, outline=outline, solid=solid, trajectory=trajectory)


def _same_physics(job: Job, sample: _Sample, radius_mm: float, steps: Mapping[str, float] | None = None) -> Trial:
    """The trial with particles of another size, its paste as stiff as in the run: U and D follow from radius and frame.

    Raises InputError where that is no trial.
    """
    from simulate.nozzle import plan_releases

    trial, health, steps = job.trial, sample.run.health, steps or {}
    assert trial.fluid is not None, "it was run"
    frame_s = plan_releases(sample.trajectory, radius_mm, trial.nozzle.diameter_mm, trial.seed).frame_s
    changes: dict[str, Any] = {
        "solver.radius_mm": radius_mm,
        "fluid.U": None,
        "fluid.viscosity_pa_s": health["viscosity_pa_s"] * (1 + steps.get("viscosity_percent", 0.0) / 100),
        "fluid.D_cm": trial.fluid.D_cm * frame_s / health["frame_s"],
    }
    if "yield_stress_pa" in steps:
        changes["fluid.yield_stress_pa"] = trial.fluid.yield_stress_pa + steps["yield_stress_pa"]
    return _changed(job, changes).model_copy(update={"readings": None, "gate": None})


def _changed(job: Job, changes: Mapping[str, Any]) -> Trial:
    """The trial with other settings, by dotted name; None takes one away. Raises InputError."""
    content = json.loads(job.trial.model_dump_json(exclude_none=True))
    for name, value in changes.items():
        table, key = name.split(".")
        content[table][key] = value
        if value is None:
            del content[table][key]
    where = Path(f"{job.path / 'trial.toml'}, moved by its [uncertainty]")
    return checked(Trial, where, content)


def _widened(outline: Outline, by_mm: float) -> Outline:
    """Its mean width larger by ``by_mm``, every width in proportion: a tip stays one, and an open end at the face."""
    from digitise.geometry.polyline import uncrossed, without_repeats

    apart = (outline.left_wall_mm - outline.right_wall_mm) * by_mm / outline.mean_width_mm / 2
    left_mm, right_mm = outline.left_wall_mm + apart, outline.right_wall_mm - apart
    ring_mm = without_repeats(uncrossed(np.vstack([right_mm, left_mm[::-1]])), SAME_POINT_MM)
    return replace(outline, left_wall_mm=left_mm, right_wall_mm=right_mm, outline_mm=ring_mm)


def _shifted(angle_deg: float | tuple[float, float], by_deg: float) -> float | tuple[float, ...]:
    return tuple(one + by_deg for one in angle_deg) if isinstance(angle_deg, tuple) else angle_deg + by_deg


def _deeper(depth_mm: Any, by_mm: float) -> Any:
    return [(s_mm, one + by_mm) for s_mm, one in depth_mm] if isinstance(depth_mm, tuple) else depth_mm + by_mm


def _entries(
    folder: Path, variants: list[_Variant], device: str, inputs: Mapping[str, str]
) -> tuple[list[Entry], Size]:
    """Writes each sample where it is not yet. Raises InputError where particles do not fit a crack."""
    from simulate.fit import check_fit

    entries, sizes = [], []
    for number, variant in enumerate(variants, start=1):
        trial, sample = variant.trial, variant.sample
        assert trial.fluid is not None, "it was run"
        try:
            check_fit(sample.outline, sample.solid, trial.fluid, trial.solver, trial.nozzle)
            sizes.append(size_of(trial, sample.trajectory, sample.outline.mean_width_mm))
        except InputError as fault:
            raise InputError(
                f"{folder}: the extra run with {_said(variant.settings)} cannot be: {fault} Extra runs have particles "
                f"{RATIO:g} times smaller and larger than the trial's: give the trial another solver.radius_mm."
            ) from None
        name = stage_key(inputs, {"moved": {} if "solver.radius_mm" in variant.settings else variant.settings})[:12]
        _write_sample(folder / "samples" / name, sample)
        key = stage_key(inputs, {**stage_settings(trial, "simulate"), "sample": name, "device": device})
        text = trial.model_dump_json(exclude_none=True)
        entries.append(Entry(key, number, variant.settings, text, name, key, sizes[-1].work_s))
    return entries, max(sizes, key=lambda size: (size.particles, size.bytes))


def _write_sample(folder: Path, sample: _Sample) -> None:
    if not all((folder / name).is_file() for name in DIGITISED):
        stage_files.write_outline(folder, sample.outline)
        stage_files.write_solid(folder, sample.solid)
        # Last: with it the sample is whole.
        stage_files.write_trajectory(folder, sample.trajectory)


def _is_kept(folder: Path, run: StudyRun) -> bool:
    """Done, its level as it was written. A run that failed is tried again by whoever asks again."""
    profile = profile_path(folder, run.key)
    if run.state != "done" or run.figures is None or not profile.is_file():
        return False
    return files.sha256(profile) == run.figures["profile_sha256"]


def _run(job: Job, ledger: Ledger, task: Task, largest: Size) -> None:
    runs = ledger.runs()
    jobs = cores() if task.device == "cpu" else 1
    expected = estimate(runs, largest, jobs, BATCH, keep_runs=False)
    if not expected.runs:
        return
    job.progress.note(f"Extra runs for the uncertainty: {expected.sentence}")
    began_s = ledger.progress_s()
    # Hundredths, since a bar counts in whole steps.
    job.progress.start("Extra runs", max(1, round(100 * (sum(run.work_s for run in runs) - began_s))))

    def look(ledger: Ledger) -> None:
        counts = {state: ledger.count(state) for state in STATES}
        said = ", ".join(f"{number} {state}" for state, number in counts.items() if number)
        job.progress.advance(round(100 * (ledger.progress_s() - began_s)), said)

    run_here(task, jobs, look)


def _require_all(runs: list[StudyRun], folder: Path) -> None:
    failed = [run for run in runs if run.state == "failed"]
    if failed:
        told = "\n".join(f"{_said(run.settings)}: {run.reason}" for run in failed)
        raise NumericalError(
            f"{folder}: {len(failed)} of {len(runs)} extra runs failed, and without them nothing is said of the "
            f"uncertainty. The same command tries them again; the others are kept.\n{told}"
        )


def _said(settings: Mapping[str, float]) -> str:
    """A size as it is, an input by how much it is moved."""
    return ", ".join(
        f"{name} = {value:g}" if "." in name else f"{name} {value:+g} from the trial's"
        for name, value in settings.items()
    )


def _level_mm(folder: Path, run: StudyRun, profile: Profile) -> np.ndarray:
    rows = read_table(profile_path(folder, run.key), ("s_mm", "level_mm"))
    return np.interp(profile.s_mm, rows[:, 0], rows[:, 1])


def _spread(
    trial: Trial, sample: _Sample, sizes: list[_Variant], designed: list[_Variant], levels: list[np.ndarray]
) -> Spread:
    radius_mm, profile = sample.run.radius_mm, sample.profile
    finer, coarser = levels[: len(sizes)]
    inputs = trial.uncertainty.moved
    effects: tuple[Effect, ...] = ()
    scatter_mm = None
    if designed:
        found_mm, scatter_mm = effects_of(np.array(levels[len(sizes) :]), len(inputs))
        effects = tuple(
            Effect(name, standard, level_mm)
            for (name, standard), level_mm in zip(inputs.items(), found_mm, strict=True)
        )
    return Spread(
        profile.s_mm,
        (
            SizeOfParticle(radius_mm / RATIO, finer),
            SizeOfParticle(radius_mm, profile.level_mm),
            SizeOfParticle(radius_mm * RATIO, coarser),
        ),
        effects,
        scatter_mm,
        radius_mm * RATIO if designed else None,
    )
