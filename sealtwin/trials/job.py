"""A trial in the folder it is run in: where it comes from, and when that folder becomes its own."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from sealtwin.errors import InputError
from sealtwin.progress import Progress
from sealtwin.store import files
from sealtwin.store.folder import RunFolder
from sealtwin.trials.trial import Trial, load_trial, trial_text

StageName = Literal["digitise", "simulate", "validate"]
STAGES: tuple[StageName, ...] = ("digitise", "simulate", "validate")
FILES_OF_A_SAMPLE = ("file", "second_photo", "mask", "path")
"""Settings of [photo] and [mesh] that name a file."""
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
    threads: int = 1
    """Of a CPU, that share a fluid run; how many changes nothing in the result."""

    @property
    def path(self) -> Path:
        return self.folder.path


def start_job(trial: Trial, source: Path, folder: RunFolder, device: str, progress: Progress) -> Job:
    """A trial from outside, to be run in ``folder``. Nothing is written before a stage has something to write.

    Raises InputError where the folder holds another trial or the sheet of readings is not there.
    """
    _refuse_another_trial(folder, trial)
    sheet = None
    if trial.readings is not None:
        sheet = source / trial.readings.file
        check_sheet(sheet)
        copied = trial.readings.model_copy(update={"file": Path("inputs") / sheet.name})
        trial = trial.model_copy(update={"readings": copied})
    return Job(trial, source, folder, sheet, device, progress)


def resume_job(folder: RunFolder, device: str, progress: Progress) -> Job:
    """The trial that a run folder already holds."""
    trial = load_trial(folder.path / "trial.toml")
    sheet = None if trial.readings is None else folder.path / trial.readings.file
    return Job(trial, folder.path, folder, sheet, device, progress)


def stage_settings(trial: Trial, stage: StageName) -> dict[str, Any]:
    """What of a trial a stage depends on: its tables without what is not set, so that a new option changes no key."""
    tables: dict[StageName, dict[str, Any]] = {
        "digitise": {
            # What the files hold counts, by their hashes, and not where they lie.
            "photo": trial.photo
            and trial.photo.model_dump(mode="json", exclude_none=True, exclude=set(FILES_OF_A_SAMPLE)),
            "crack": trial.crack and trial.crack.model_dump(mode="json", exclude_none=True),
            "mesh": trial.mesh
            and trial.mesh.model_dump(mode="json", exclude_none=True, exclude=set(FILES_OF_A_SAMPLE)),
            "path": trial.path.model_dump(mode="json", exclude_none=True),
        },
        "simulate": {
            "fluid": trial.fluid and trial.fluid.model_dump(mode="json", exclude_none=True),
            "solver": trial.solver.model_dump(mode="json", exclude_none=True),
            "nozzle": trial.nozzle.model_dump(mode="json", exclude_none=True),
            "seed": trial.seed,
        },
        "validate": {
            "name": trial.name,
            "note": trial.note,
            "sample": trial.sample.data,
            "readings": trial.readings and trial.readings.model_dump(mode="json", exclude_none=True),
            "gate": trial.gate and trial.gate.model_dump(mode="json", exclude_none=True),
            "uncertainty": trial.uncertainty.model_dump(mode="json", exclude_none=True),
        },
    }
    return tables[stage]


def sample_files(trial: Trial) -> dict[str, Path]:
    """The files that show the crack, as the trial names them, by the settings that hold them."""
    named = {role: getattr(trial.sample, role, None) for role in FILES_OF_A_SAMPLE}
    return {role: file for role, file in named.items() if file is not None}


def require_sample(trial: Trial, source: Path) -> None:
    """Raises InputError where a file that shows the crack is not there: a slip of the pen must not leave a folder."""
    table = "photo" if trial.mesh is None else "mesh"
    for role, file in sample_files(trial).items():
        if not (source / file).exists():
            raise InputError(
                f"{source / file}: not found; what {table}.{role} names is looked for beside its trial file."
            )


def begin_writing(job: Job, stage: StageName) -> None:
    """From here the folder is this trial's: what ``stage`` and its reports left before goes, edited files aside."""
    adopt_trial(job)
    (job.path / "run.json").unlink(missing_ok=True)
    # A program of the old path must not lie beside the new one.
    programs = ("robot",) if stage == "digitise" else ()
    for stale in dict.fromkeys((stage, *programs, "validate")):
        for name in job.folder.clear(stale):
            job.progress.note(f"{stale}: a file was edited since this stage wrote it; yours is kept as {name}.")


def adopt_trial(job: Job) -> None:
    """Write the resolved trial, and a copy of the readings, into the folder.

    Neither photo nor mesh is copied: a photo may carry the place and the person that took it, a scan is large. Their
    hashes are in the manifest.
    """
    if job.source.resolve() == job.path.resolve():
        return
    if job.sheet is not None and job.trial.readings is not None:
        files.write_if_new(job.path / job.trial.readings.file, job.sheet.read_bytes())
    sample = job.trial.sample
    names = {role: Path(file.name) for role, file in sample_files(job.trial).items()}
    table = "photo" if sample is job.trial.photo else "mesh"
    resolved = job.trial.model_copy(update={table: sample.model_copy(update=names)})
    files.write_if_new(job.path / "trial.toml", trial_text(resolved).encode())


def check_sheet(sheet: Path) -> None:
    if not sheet.is_file():
        raise InputError(f"{sheet}: no such file; [readings] file names it. Put it there, or leave [readings] out.")
    if sheet.stat().st_size > LARGEST_SHEET_BYTES:
        raise InputError(f"{sheet}: larger than {LARGEST_SHEET_BYTES / 1e6:g} MB; a sheet of readings is some kB.")


def _refuse_another_trial(folder: RunFolder, trial: Trial) -> None:
    """A folder is one trial's: another one's results must not be replaced without a word."""
    path = folder.path / "trial.toml"
    if not path.is_file():
        return
    held = load_trial(path)
    if (held.name, held.sample.file.name) != (trial.name, trial.sample.file.name):
        raise InputError(
            f"{folder.path}: holds trial '{held.name}' of {held.sample.file.name}; this is '{trial.name}' of "
            f"{trial.sample.file.name}. Give another --out, or delete that folder."
        )
