"""One trial through the stages, each redone only where its inputs, settings or this version changed."""

import platform
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal

from sealtwin import files
from sealtwin.errors import InputError, NumericalError
from sealtwin.folder import RunFolder, stage_key
from sealtwin.progress import Progress
from sealtwin.records import Profile, Trajectory
from sealtwin.result import read_result
from sealtwin.trial import Trial, load_trial, trial_text

StageName = Literal["digitise", "simulate", "validate"]
STAGES: tuple[StageName, ...] = ("digitise", "simulate", "validate")

DIGITISED = ("outline.json", "crack.ply", "solid.json", "trajectory.csv")
"""What the later stages read of the first."""
SIMULATED = ("particles.csv", "simulation.json", "profile.csv")
LARGEST_SHEET_BYTES = 5_000_000


@dataclass(frozen=True)
class Job:
    """A trial in the folder it is run in."""

    trial: Trial
    source: Path
    """Folder that relative names in the trial start from."""
    folder: RunFolder
    sheet: Path | None
    """The readings under the name that the user knows; the folder holds a copy of them."""
    device: str
    """As asked for; "auto" is resolved where the fluid run starts."""
    progress: Progress

    @property
    def path(self) -> Path:
        return self.folder.path


@dataclass(frozen=True)
class Outcome:
    """What a command says at its end."""

    result: dict[str, Any]
    """The --json object, and run.json."""
    redone: tuple[StageName, ...]
    gate_passed: bool | None


def start_job(trial: Trial, source: Path, folder: RunFolder, device: str, progress: Progress) -> Job:
    """Write the resolved trial into the folder, with a copy of the readings, and start from that copy.

    The photo is not copied: it may carry the place and the person that took it. Its hash is in the manifest.
    """
    resolved, sheet = trial, None
    if trial.readings is not None:
        sheet = trial.readings.file if trial.readings.file.is_absolute() else source / trial.readings.file
        copied = f"inputs/{sheet.name}"
        _copy_sheet(sheet, folder.path / copied)
        resolved = trial.model_copy(update={"readings": trial.readings.model_copy(update={"file": Path(copied)})})
    photo = resolved.photo.model_copy(update={"file": Path(resolved.photo.file.name)})
    text = trial_text(resolved.model_copy(update={"photo": photo}))
    target = folder.path / "trial.toml"
    if not target.is_file() or target.read_text(encoding="utf-8") != text:
        files.write_text(target, text)
    return Job(resolved, source, folder, sheet, device, progress)


def resume_job(folder: RunFolder, device: str, progress: Progress) -> Job:
    """The trial that a run folder already holds."""
    trial = load_trial(folder.path / "trial.toml")
    sheet = None if trial.readings is None else folder.path / trial.readings.file
    return Job(trial, folder.path, folder, sheet, device, progress)


def run_stages(job: Job, stages: Sequence[StageName]) -> Outcome:
    """Bring ``stages`` up to date, in their order.

    Raises:
        InputError, NumericalError: from a stage, or since a particle escaped; what was written stays.
    """
    work: dict[StageName, Callable[[Job], bool]] = {"digitise": _digitise, "simulate": _simulate, "validate": _validate}
    redone: list[StageName] = []
    for stage in STAGES:
        if stage == "simulate" and "validate" in stages:
            # Minutes of simulation must not pass before a typo in the sheet is found.
            _read_readings(job)
        if stage in stages and work[stage](job):
            redone.append(stage)
    result = read_result(job.folder, job.trial)
    if escaped := result.get("escaped_particles"):
        raise NumericalError(
            f"{job.path}: {escaped} particles went through a wall, which must never happen; the files are complete, "
            "but do not use them. Please report this with the trial file."
        )
    if not redone:
        job.progress.note(f"{job.path}: complete and up to date; nothing to redo.")
    return Outcome(result, tuple(redone), result.get("gate_passed"))


def _digitise(job: Job) -> bool:
    photo_path = job.source / job.trial.photo.file
    inputs = {job.trial.photo.file.name: files.sha256(photo_path)} if photo_path.is_file() else {}
    settings = {
        "photo": job.trial.photo.model_dump(mode="json", exclude={"file"}),
        "crack": job.trial.crack.model_dump(mode="json"),
        "path": job.trial.path.model_dump(mode="json"),
    }
    key = stage_key(inputs, settings)
    if inputs and job.folder.is_current("digitise", key):
        return False
    began = _begin(job, "digitise", "Digitising", steps=5)

    import cv2

    from digitise.outline import trace_outline
    from digitise.overlay import draw_overlay
    from digitise.path import find_path
    from digitise.photo import load_photo
    from digitise.solid import build_solid
    from digitise.trajectory import plan_trajectory

    photo = load_photo(job.trial.photo, job.source)
    job.progress.advance(1, "finding the crack")
    path = find_path(photo, job.trial.photo.ends_px)
    job.progress.advance(2, "tracing its walls")
    outline = trace_outline(photo, path)
    overlay = draw_overlay(photo, outline)
    encoded, png = cv2.imencode(".png", cv2.cvtColor(overlay, cv2.COLOR_RGB2BGR))
    if not encoded:
        raise RuntimeError("OpenCV could not encode the overlay")
    files.write_bytes(job.path / "overlay.png", png.tobytes())
    files.write_outline(job.path, outline)
    job.progress.advance(3, "building the solid")
    solid = build_solid(outline, job.trial.crack)
    trajectory = plan_trajectory(outline, job.trial.path, solid.cavity_volume_mm3)
    sealant_mm3 = dispensed_mm3(trajectory)
    report = {
        **solid.report,
        "sealant_mm3": sealant_mm3,
        "cavity_to_sealant": solid.cavity_volume_mm3 / sealant_mm3,
    }
    files.write_solid(job.path, replace(solid, report=report))
    job.progress.advance(4, "planning the path")
    files.write_trajectory(job.path, trajectory)
    job.progress.advance(5)
    for warning in (*outline.warnings, *solid.report["warnings"]):
        job.progress.note(f"note: {warning}")
    outputs = ("overlay.png", "crack.stl", "trajectory.txt", *DIGITISED)
    job.folder.record("digitise", key, inputs, outputs, time.monotonic() - began, given=list(inputs))
    return True


def _simulate(job: Job) -> bool:
    trial = job.trial
    if trial.fluid is None:
        raise InputError(
            f"{job.path / 'trial.toml'}: no [fluid] table; give U and D_cm, or viscosity_pa_s, and simulate again."
        )
    from simulate.device import choose_device, describe_device

    device = choose_device(job.device)
    job.progress.note(f"Device: {describe_device(device)}")
    inputs = _hashes(job, DIGITISED, "digitise")
    settings = {
        "fluid": trial.fluid.model_dump(mode="json"),
        "solver": trial.solver.model_dump(mode="json"),
        "nozzle": trial.nozzle.model_dump(mode="json"),
        "seed": trial.seed,
        "device": device,
    }
    key = stage_key(inputs, settings)
    if job.folder.is_current("simulate", key):
        return False
    began = _begin(job, "simulate")

    from simulate.profile import measure_profile, volume_ratio
    from simulate.run import check_fit, inject

    outline, solid = files.read_outline(job.path), files.read_solid(job.path)
    trajectory = files.read_trajectory(job.path)
    check_fit(outline, solid, trial.fluid, trial.solver, trial.nozzle)
    run = inject(
        solid,
        outline,
        trajectory,
        trial.fluid,
        trial.solver,
        trial.nozzle,
        seed=trial.seed,
        device=device,
        progress=job.progress,
    )
    run = replace(run, health={**run.health, "volume_ratio": volume_ratio(run, solid)})
    files.write_run(job.path, run)
    files.write_profile(job.path, measure_profile(run, outline, solid))
    wall_time_s = time.monotonic() - began
    job.folder.record("simulate", key, inputs, SIMULATED, wall_time_s, device=describe_device(device), seed=trial.seed)
    return True


def _validate(job: Job) -> bool:
    trial = job.trial
    inputs = {
        **_hashes(job, (*DIGITISED, "overlay.png"), "digitise"),
        **_hashes(job, SIMULATED, "simulate"),
    }
    given = () if trial.readings is None else (trial.readings.file.as_posix(),)
    inputs |= _hashes(job, given, "run")
    settings = {
        "name": trial.name,
        "note": trial.note,
        "photo": trial.photo.data,
        "readings": trial.readings and trial.readings.model_dump(mode="json"),
        "gate": trial.gate and trial.gate.model_dump(mode="json"),
    }
    key = stage_key(inputs, settings)
    if job.folder.is_current("validate", key):
        return False
    began = _begin(job, "validate", "Validating", steps=2)

    from validate.compare import compare
    from validate.evidence import Evidence
    from validate.report import write_report

    outline, solid = files.read_outline(job.path), files.read_solid(job.path)
    run, profile = files.read_run(job.path), files.read_profile(job.path)
    readings, comparison = _read_readings(job), None
    if trial.readings is not None and readings is not None:
        comparison = compare(
            profile,
            readings,
            outline,
            solid,
            gate=trial.gate,
            role=trial.readings.role,
            photo_data=trial.photo.data,
        )
        files.write_comparison(job.path, comparison)
    job.progress.advance(1, "writing the report")
    evidence = Evidence(
        name=trial.name,
        note=trial.note,
        outline=outline,
        solid=solid,
        trajectory=files.read_trajectory(job.path),
        run=run,
        profile=profile,
        readings=readings,
        comparison=comparison,
        volume_ratio=run.health["volume_ratio"],
        overlay_path=job.path / "overlay.png",
        photo_data=trial.photo.data,
        provenance=_provenance(job),
        command="sealtwin run trial.toml",
    )
    write_report(job.path, evidence)
    job.progress.advance(2)
    outputs = ["report.html", "report.pdf"] + (["comparison.json"] if comparison else [])
    job.folder.record("validate", key, inputs, outputs, time.monotonic() - began, given=given)
    return True


def _read_readings(job: Job) -> Profile | None:
    if job.trial.readings is None or job.sheet is None:
        return None
    from validate.caliper import read_readings

    length_mm = files.read_outline(job.path).length_mm
    return read_readings(job.sheet, job.trial.readings, length_mm, job.trial.crack.depth_mm)


def dispensed_mm3(trajectory: Trajectory) -> float:
    """What flows out along a trajectory: each row's flow holds until the next."""
    return float((trajectory.flow_mm3_s[:-1] * (trajectory.t_s[1:] - trajectory.t_s[:-1])).sum())


def _begin(job: Job, stage: StageName, title: str = "", steps: int = 0) -> float:
    for name in job.folder.keep_changed(stage):
        job.progress.note(f"{stage}: a file was edited since this stage wrote it; yours is kept as {name}.")
    job.folder.forget(stage)
    if steps:
        job.progress.start(title, steps)
    return time.monotonic()


def _hashes(job: Job, names: Sequence[str], stage: str) -> dict[str, str]:
    """Hashes of files that ``stage`` should have left. Raises InputError, naming the first that is missing."""
    for name in names:
        if not (job.path / name).is_file():
            raise InputError(f"{job.path / name}: not found. Run 'sealtwin {stage}' first, or 'sealtwin run' for all.")
    return {name: files.sha256(job.path / name) for name in names}


def _copy_sheet(sheet: Path, target: Path) -> None:
    if not sheet.is_file():
        raise InputError(f"{sheet}: not found; [readings] file names it. Put it there, or leave [readings] out.")
    if sheet.stat().st_size > LARGEST_SHEET_BYTES:
        raise InputError(f"{sheet}: larger than {LARGEST_SHEET_BYTES / 1e6:g} MB; a sheet of readings is some kB.")
    content = sheet.read_bytes()
    if not target.is_file() or target.read_bytes() != content:
        files.write_bytes(target, content)


def _provenance(job: Job) -> dict[str, str]:
    stages = job.folder.manifest["stages"]
    facts = {"sealtwin": version("sealtwin"), "system": f"{platform.system()} {platform.machine()}"}
    for stage, entry in stages.items():
        if stage == "validate":
            continue
        facts[f"{stage}: wall time"] = f"{entry['wall_time_s']:.1f} s"
        facts |= {f"{stage}: {name}": f"sha256 {digest}" for name, digest in entry["inputs"].items()}
    facts["device"] = stages["simulate"]["device"]
    facts["seed"] = str(stages["simulate"]["seed"])
    return facts | {name: text for name, text in stages["simulate"]["versions"].items() if name != "sealtwin"}
