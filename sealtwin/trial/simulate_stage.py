"""Second stage: the sealant is injected and its level measured."""

import itertools
import json
import re
import time
from collections.abc import Iterable
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Self

from sealtwin.core import files, record_files
from sealtwin.core.errors import InputError
from sealtwin.core.progress import Pace
from sealtwin.core.records import Floats, Frame, Profile, Run
from sealtwin.core.run_folder import MANIFEST
from sealtwin.core.stage_keys import stage_key
from sealtwin.core.vtk_files import read_collection, read_frame, write_collection, write_frame
from sealtwin.trial.job import DIGITISED, SIMULATED, Job, begin_writing, made_by, stage_settings
from sealtwin.trial.trial_file import Output
from simulate.injection import Injection
from simulate.output import COLUMNS, PAST_THE_END, Checkpoint, HealthLog, Moments
from simulate.settings import Fluid

CHECKPOINT = "checkpoint.npz"  # Checkpoint of a run that is not finished
FRAMES, SNAPSHOTS = Path("frames", "fill.pvd"), Path("snapshots", "snapshots.pvd")
"""Collections of frames, each beside the frames that it lists."""
FRAME = re.compile(r"\d{4,}\.\d{3}s\.vtp")
HEALTH = "health.csv"
PROGRESS = "progress.json"
PROGRESS_EVERY_S = 1.0


class FrameFiles(Moments):
    """Watcher that writes frames of a run beside a collection, which is whole at any moment."""

    def __init__(self, collection: Path, times_s: Iterable[float]) -> None:
        super().__init__(times_s, self._write)
        self._collection, self._folder = collection, collection.parent
        self._frames: dict[str, float] = {}

    def begin(self, injection: Injection) -> None:
        """Remove the frames of an earlier run, except those before the frame of a resumed one; a user's files stay."""
        there = sorted(self._folder.glob("*"))
        listed = read_collection(self._collection) if self._collection.is_file() else []
        self._frames = {path.name: t_s for t_s, path in listed if t_s <= injection.t_s and path in there}
        for path in there:
            if files.is_temporary(path) or (FRAME.fullmatch(path.name) and path.name not in self._frames):
                path.unlink()
        self._collection.unlink(missing_ok=True)
        if self._frames:
            self._collect()
        super().begin(injection)

    def _write(self, asked_s: float, frame: Frame) -> None:
        if frame.t_s in self._frames.values():
            return  # Several moments in one frame of the run, or just past its end.
        name = f"{asked_s:08.3f}s.vtp"
        write_frame(self._folder / name, frame)
        self._frames[name] = frame.t_s
        self._collect()

    def _collect(self) -> None:
        write_collection(self._collection, [(t_s, name) for name, t_s in self._frames.items()])


class StillThere:
    """Watcher that ends a run whose folder was removed, before another one makes half a folder again."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def begin(self, injection: Injection) -> None:
        self._require()

    def after_frame(self, injection: Injection) -> None:
        self._require()

    def _require(self) -> None:
        if not (self._folder / MANIFEST).is_file():
            raise InputError(f"{self._folder}: was removed while its fluid ran, and is not made again. Run it anew.")


class ProgressFile:
    """Watcher that writes the progress of a run into a small JSON, at most once a second, for other programs.

    As a context around the run it also writes how the run ended.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._injection: Injection | None = None
        self._written = 0.0
        self._pace = Pace(0.0)
        self._eta_s: float | None = None

    def begin(self, injection: Injection) -> None:
        self._injection, self._pace = injection, Pace(injection.work[-1], injection.work[injection.done])
        self._write(injection, "running")

    def after_frame(self, injection: Injection) -> None:
        self._eta_s = self._pace.left_s(injection.work[injection.done], time.monotonic())
        if time.monotonic() - self._written >= PROGRESS_EVERY_S and self._path.is_file():
            self._write(injection, "running")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, fault: BaseException | None, _: TracebackType | None) -> None:
        # Where the file is gone, so is the folder, and it is not made again.
        if self._injection is not None and self._path.is_file():
            stopped = kind is not None and issubclass(kind, KeyboardInterrupt)
            state = "finished" if kind is None else "interrupted" if stopped else "failed"
            self._write(self._injection, state, str(fault) if state == "failed" else None)

    def _write(self, run: Injection, state: str, fault: str | None = None) -> None:
        self._written = time.monotonic()
        # A bed at rest ends a run before its last frame.
        frames = run.done if state == "finished" else run.frames
        files.write_json(
            self._path,
            {
                "version": 1,
                "stage": "simulate",
                "state": state,
                "error": fault,
                "frame": run.done,
                "frames": frames,
                "t_s": round(run.t_s, 4),
                "percent": round(100 * run.done / frames, 1),
                "eta_s": None if state != "running" or self._eta_s is None else round(self._eta_s, 1),
                "particles": run.out,
                "moving": run.moving,
                "updated_utc": datetime.now(UTC).isoformat(timespec="seconds"),
            },
        )


def read_health(folder: Path) -> dict[str, Floats]:
    """Read the columns of health.csv; NaN stands for an empty field."""
    return dict(zip(COLUMNS, files.read_table(folder / HEALTH, COLUMNS).T, strict=True))


def bring_up_to_date(job: Job) -> bool:
    """Run the stage unless its files are current; return True if it ran.

    Raises InputError if the settings do not fit the crack, NumericalError if the run becomes unstable.
    """
    trial, fluid = job.trial, _fluid_of(job)
    if trial.solver.model == "slot":
        return _fill_fast(job, fluid)
    from simulate.device import choose_device, describe_device

    device = choose_device(job.device)
    if job.threads > 1 and device != "cpu":
        raise InputError(f"--threads {job.threads}: threads are a CPU's, and this run is on {device}. Leave it out.")
    job.progress.note(f"Device: {describe_device(device)}")
    inputs = made_by(job, "digitise", DIGITISED)
    settings, numbers = stage_settings(trial, "simulate"), job.numbers("simulate")
    key = stage_key(inputs, {**settings, "device": device}, numbers)
    if job.folder.is_current("simulate", key) and _has_pictures(job, trial.output):
        # A run that was killed just after its end leaves its checkpoint.
        (job.path / CHECKPOINT).unlink(missing_ok=True)
        return False
    began = time.monotonic()

    from simulate.profile import measure_profile, volume_ratio
    from simulate.run import inject
    from simulate.setup_checks import check_fit
    from validate.figures.snapshots import FillScene, write_gallery

    outline, solid = record_files.read_outline(job.path), record_files.read_solid(job.path)
    trajectory = record_files.read_trajectory(job.path)
    physics = fluid, trial.solver, trial.nozzle
    check_fit(outline, solid, *physics, trial.sample)
    # First, since it may resume the run before the others begin.
    checkpoint = Checkpoint(job.path / CHECKPOINT, f"{key} {trial.output.model_dump_json()}", job.progress.note)
    every_s = trial.output.frames_every_s
    frames_s = () if every_s is None else (every_s * number for number in itertools.count())
    with ProgressFile(job.path / PROGRESS) as progress_file:
        snapshots = FrameFiles(job.path / SNAPSHOTS, sorted(set(trial.output.snapshots_s)))
        frame_files, health_log = FrameFiles(job.path / FRAMES, frames_s), HealthLog(job.path / HEALTH)
        # The first to begin, and the first after a frame.
        still_there = StillThere(job.path)
        watchers = still_there, checkpoint, frame_files, snapshots, health_log
        sample = solid, outline, trajectory
        run = inject(
            *sample,
            *physics,
            seed=trial.seed,
            device=device,
            progress=job.progress,
            slope=trial.sample,
            threads=job.threads,
            watchers=(*watchers, progress_file, still_there),
        )
        run = replace(run, health=run.health.model_copy(update={"volume_ratio": volume_ratio(run, solid)}))
        profile = measure_profile(run, outline, solid)
        begin_writing(job, "simulate")
        record_files.write_run(job.path, run)
        record_files.write_profile(job.path, profile)
        job.progress.start("Drawing", 1)
        scene = FillScene(outline, solid, trajectory, run.radius_mm, trial.nozzle.diameter_mm)
        frames = {Path(name).stem: read_frame(job.path / name) for name in snapshots_of(job)}
        pictures = write_gallery(job.path, frames, scene, read_health(job.path))
        health = run.health.recorded()
        end_s = health["frames"] * health["frame_s"]
        if late := [f"{t_s:g}" for t_s in sorted(set(trial.output.snapshots_s)) if t_s > PAST_THE_END * end_s]:
            job.progress.note(f"note: no snapshot at {', '.join(late)} s: the run ended after {end_s:.2f} s.")
        facts = {"device": describe_device(device), "seed": trial.seed, "output": trial.output.model_dump(mode="json")}
        outputs, wall_time_s = (*SIMULATED, *pictures), time.monotonic() - began
        job.folder.record("simulate", key, settings, inputs, outputs, wall_time_s, numbers=numbers, **facts)
        checkpoint.remove()
    return True


def _fill_fast(job: Job, fluid: Fluid) -> bool:
    """Run the fast model in place of particles unless its files are current; return True if it ran."""
    trial, inputs = job.trial, made_by(job, "digitise", DIGITISED)
    settings, numbers = stage_settings(trial, "simulate"), job.numbers("simulate")
    key = stage_key(inputs, settings, numbers)
    if job.folder.is_current("simulate", key):
        return False
    if trial.output.frames_every_s is not None:
        job.progress.warn("note: the fast model has no particles, and writes no frames.")
    began = time.monotonic()
    run, profile = _poured(job, fluid)
    begin_writing(job, "simulate")
    # Of a run of particles before it.
    for name in (CHECKPOINT, PROGRESS, HEALTH):
        (job.path / name).unlink(missing_ok=True)
    for collection in (job.path / FRAMES, job.path / SNAPSHOTS):
        for _, frame in read_collection(collection) if collection.is_file() else []:
            frame.unlink(missing_ok=True)
        collection.unlink(missing_ok=True)
    record_files.write_run(job.path, run)
    record_files.write_profile(job.path, profile)
    facts = {"numbers": numbers, "device": run.device, "seed": trial.seed}
    job.folder.record("simulate", key, settings, inputs, SIMULATED, time.monotonic() - began, **facts)
    return True


def _poured(job: Job, fluid: Fluid) -> tuple[Run, Profile]:
    from simulate.slot.run import pour

    trial, solid, outline = job.trial, record_files.read_solid(job.path), record_files.read_outline(job.path)
    sample = solid, outline, record_files.read_trajectory(job.path)
    return pour(*sample, fluid, trial.solver, trial.nozzle, seed=trial.seed, slope=trial.sample, advise=True)


def check(job: Job) -> None:
    """Prepare the run of a digitised trial up to its first frame, on this machine's CPU, and drop it.

    Raises InputError as the run would.
    """
    trial, fluid = job.trial, _fluid_of(job)
    if trial.solver.model == "slot":
        _poured(job, fluid)
        return
    from simulate.device import start_warp
    from simulate.injection import prepare

    start_warp()
    solid, outline = record_files.read_solid(job.path), record_files.read_outline(job.path)
    sample = solid, outline, record_files.read_trajectory(job.path)
    prepare(*sample, [fluid], trial.solver, trial.nozzle, seed=trial.seed, device="cpu", slope=trial.sample)


def _fluid_of(job: Job) -> Fluid:
    if job.trial.fluid is None:
        raise InputError(
            f"{job.path / 'trial.toml'}: no [fluid] table; give U and D_cm, or viscosity_pa_s, and simulate again."
        )
    return job.trial.fluid


def _has_pictures(job: Job, wanted: Output) -> bool:
    """Return True if the finished run wrote all frames and pictures that the trial asks for now."""
    with files.understood(job.path / MANIFEST):
        made = Output.model_validate_json(json.dumps(job.folder.manifest["stages"]["simulate"].get("output", {})))
    if wanted.frames_every_s is not None and not (job.path / FRAMES).is_file():
        return False
    return wanted.frames_every_s in (None, made.frames_every_s) and set(wanted.snapshots_s) <= set(made.snapshots_s)


def snapshots_of(job: Job) -> list[str]:
    """Return the files of the run's snapshots in the order of time."""
    if not (job.path / SNAPSHOTS).is_file():
        return []
    return [f"{SNAPSHOTS.parent}/{path.name}" for _, path in read_collection(job.path / SNAPSHOTS)]
