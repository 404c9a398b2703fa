"""Set up a trial in its run folder, and determine the inputs of each stage."""

import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import digitise
import simulate
import validate
from sealtwin.core import files, plain_files, record_files
from sealtwin.core.errors import InputError
from sealtwin.core.facts import doubt
from sealtwin.core.progress import Progress
from sealtwin.core.run_folder import MANIFEST, UNNUMBERED, RunFolder, other_numbers
from sealtwin.core.settings import without_none
from sealtwin.trial.trial_file import KINDS, Trial, load_trial, seen_from, trial_text
from validate.settings import PDF, Readings

StageName = Literal["digitise", "simulate", "validate"]

NUMBERS: dict[str, int] = {
    "digitise": digitise.STAGE_NUMBER,
    "simulate": simulate.STAGE_NUMBER,
    "validate": validate.STAGE_NUMBER,
}
"""Stage number of each stage, in the order of the pipeline."""

STAGES: tuple[StageName, ...] = ("digitise", "simulate", "validate")
DIGITISED = ("outline.json", "crack.ply", "solid.json", "trajectory.csv")
"""Files of the stage digitise that later stages read."""
OVERLAY, STRAIGHT = "overlay.png", "straight.png"  # Pictures of the stage digitise that the report shows
OF_A_PATH = ("outline.json", "trajectory.csv")  # Files in DIGITISED that also exist for a path without a solid
SIMULATED = ("particles.csv", "simulation.json", "profile.csv")  # Files of the stage simulate that validate reads
TRIAL = "trial.toml"  # Trial file in a run folder
TRIAL_SUFFIX = ".toml"
FILES_OF_A_SAMPLE = ("file", "mask", "path")  # Settings of [photo], [mesh] and [drawing] that name a file
SEEDS = "simulate-seeds"
"""Name in the manifest for the runs with the trial's other seeds. In alphabetical order, it follows simulate."""
LARGEST_SHEET_BYTES = 5_000_000


def numbers_up_to(stage: StageName) -> dict[str, int]:
    """Return the stage numbers of ``stage`` and of all stages before it."""
    return {name: NUMBERS[name] for name in STAGES[: STAGES.index(stage) + 1]}


def own_numbers() -> dict[str, int]:
    """Return all stage numbers of this version. As a function, it can be called on another machine."""
    return dict(NUMBERS)


@dataclass(frozen=True)
class Job:
    """A trial in its run folder, with the options of its run."""

    trial: Trial
    source: Path  # Folder to which paths in the trial are relative
    folder: RunFolder
    sheet: Path | None  # Path of the sheet of readings that the user gave. The run folder may contain a copy
    device: str  # Device that the user gave. The fluid run resolves "auto"
    progress: Progress
    file: Path | None = None  # File to which the run folder belongs
    threads: int | None = None  # Number of CPU threads that the user gave. It does not change the result
    jobs: int = 0  # Number of worker processes for the runs with other seeds. 0 computes them in this process
    traced: dict[str, Any] = field(default_factory=dict)
    """Latest crack that this command digitised, by a key that does not depend on the nozzle's path.

    Jobs that share this dict trace the same crack only once."""

    @property
    def path(self) -> Path:
        return self.folder.path

    def numbers(self, stage: StageName) -> dict[str, int]:
        """Return the stage numbers that ``stage`` depends on: its current number, and earlier stages' recorded ones."""
        recorded = {name: self.folder.numbers_of(name).get(name, UNNUMBERED) for name in numbers_up_to(stage)}
        return {**recorded, stage: NUMBERS[stage]}

    def other_numbers(self, stage: StageName) -> str:
        """Return how the recorded stage numbers of ``stage`` differ from this version's numbers, or ""."""
        return other_numbers(self.folder.numbers_of(stage), numbers_up_to(stage))


def other_versions(*folders: RunFolder, stage: StageName | None = None) -> list[str]:
    """Return a sentence for each run folder that a version with other stage numbers computed.

    The numbers are compared up to ``stage``. If it is None, they are compared up to the last finished stage.
    """
    sentences: list[str] = []
    for folder in folders:
        finished: list[StageName] = [name for name in STAGES if name in folder.finished()]
        last = stage or (finished[-1] if finished else None)
        if last and (other := other_numbers(folder.numbers_of(last), numbers_up_to(last))):
            path = display_path(folder.path)
            sentences.append(f"{path}: computed by {other}. 'sealtwin run {path}/{TRIAL}' computes it again.")
    return sentences


def run_folder_of(file: Path, trial: Trial) -> Path:
    """Return the default run folder of a trial file, or of a photo, a mesh or a drawing.

    A trial file in a run folder belongs to that folder. For any other file, it is reports/NAME.
    """
    is_inside = file.name == TRIAL and (file.parent / MANIFEST).is_file()
    return file.parent if is_inside else Path("reports", trial.folder_name)


def existing_run(path: Path) -> Path:
    """Return the run folder that a user names: the folder, or the default run folder of a trial file."""
    return path if path.suffix != TRIAL_SUFFIX or path.is_dir() else run_folder_of(path, load_trial(path))


def start_job(
    trial: Trial, source: Path, folder: RunFolder, device: str, progress: Progress, file: Path | None = None
) -> Job:
    """Set up a trial in ``folder``. No file is written before a stage has results.

    ``source`` is the folder to which paths in the trial are relative. If it is ``folder``, the trial is run in place.
    ``file`` is the trial file, or the photo, mesh or drawing from which the trial was begun, to which ``folder`` then
    belongs. Raises InputError if the folder belongs to another file, if the trial in it was edited, if the sheet of
    readings is missing, or if a file of the fluid cannot be used.
    """
    trial, sheet = trial.loaded(source), None
    in_place = source.resolve() == folder.path.resolve()
    if file is not None and not in_place:
        _require_own(folder, file, source / trial.shown_by.file)
    if trial.readings is not None:
        sheet = source / trial.readings.path
        check_sheet(sheet, trial.readings)
        kept = _seen_from(folder.path, sheet) if in_place else Path("inputs") / sheet.name
        trial = trial.model_copy(update={"readings": trial.readings.at_path(Path(kept))})
    return Job(trial, source, folder, sheet, device, progress, file)


def _require_own(folder: RunFolder, file: Path, shown: Path) -> None:
    """Raise InputError if the folder belongs to another file, or if the user edited the trial file in it.

    A photo, a mesh or a drawing with the same content counts as the same file. ``shown`` is that file.
    """
    began, written = folder.manifest.get("begun"), folder.path / TRIAL
    if began is None:
        return
    is_copy = TRIAL_SUFFIX not in (Path(began["from"]).suffix, file.suffix) and files.sha256(shown) == began["sha256"]
    if began["from"] != _seen_from(folder.path, file) and not is_copy:
        raise InputError(
            f"{display_path(folder.path)}: contains the results of {display_path(folder.path / began['from'])}, so "
            f"those of {display_path(file)} cannot be written there. Give another folder with --out."
        )
    if written.is_file() and files.sha256(written) != began["trial"]:
        raise InputError(
            f"{display_path(written)}: was edited, so {display_path(file)} must not replace it. Use 'sealtwin run "
            f"{display_path(written)}' to run the edited trial, or give another folder with --out."
        )


def _seen_from(folder: Path, file: Path) -> str:
    return seen_from(folder, {"": file})[""]


def stage_settings(trial: Trial, stage: StageName) -> dict[str, Any]:
    """Return the settings that a stage depends on.

    Settings without a value are left out. A new setting therefore does not change the keys of earlier results.
    """
    dump = trial.content
    tables: dict[StageName, tuple[str, ...]] = {
        "digitise": ("photo", "crack", "mesh", "drawing", "path"),
        "simulate": ("fluid", "solver", "nozzle", "seed"),
        "validate": ("name", "note", "assumed", "sample", "readings", "gate", "uncertainty"),
    }
    settings = {name: dump.get(name) for name in tables[stage]}
    if stage == "simulate" and not trial.sample.level:
        settings["sample"] = dump["sample"]
    if stage == "digitise" and trial.crack is not None and trial.crack.fill is not None:
        # The fit of a fill depends on the uncertainties of width and depth.
        settings["known"] = {name: getattr(trial.uncertainty, name) for name in ("width_mm", "depth_mm")}
    if stage == "validate":
        settings["sample"] = trial.shown_by.data
        if trial.path.weighed is not None:
            settings["weighed"] = trial.path.weighed.model_dump(mode="json")
        if trial.output.pictures:
            settings["pictures"] = True
    for table in (*KINDS, "crack"):
        if (values := settings.get(table)) is not None:
            # Files are compared by their hashes, so their names are left out.
            settings[table] = {key: value for key, value in values.items() if key not in (*FILES_OF_A_SAMPLE, "scan")}
    return settings


def sample_files(trial: Trial) -> dict[str, Path]:
    """Return the files that show the crack, by the setting that names the file. Paths are as in the trial file."""
    named = {role: getattr(trial.shown_by, role, None) for role in FILES_OF_A_SAMPLE}
    named |= {"scan": trial.crack and trial.crack.scan}
    return without_none(named)


def require_sample(trial: Trial, source: Path) -> None:
    """Raise InputError if the readings or a file that shows the crack are missing, before a folder is made."""
    if trial.readings is not None:
        check_sheet(source / trial.readings.path, trial.readings)
    for role, file in sample_files(trial).items():
        if not (source / file).exists():
            cure = "Put the file there, or correct the name."
            if (source / MANIFEST).is_file():
                command = f"sealtwin simulate {display_path(source)}"
                cure = f"A run folder has no copy of it; '{command}' uses the digitised crack."
            key = "crack.scan" if role == "scan" else f"{trial.kind}.{role}"
            raise InputError(f"{source / file}: not found, but {key} names it. {cure}")


def begin_writing(job: Job, stage: StageName) -> None:
    """Write the trial file, and delete earlier files of ``stage`` and the report. Edited files are renamed instead."""
    adopt_trial(job)
    (job.path / "run.json").unlink(missing_ok=True)
    if PDF in job.folder.entry_of("validate").get("outputs", ()) and not job.trial.output.pictures:
        job.progress.note(
            f"{PDF}: is deleted, since it shows an earlier result; output.pictures = true writes it again."
        )
    # A robot program for the old path must not remain in a folder with the new path.
    more = {"digitise": ("robot",), "simulate": (SEEDS,)}.get(stage, ())
    for stale in dict.fromkeys((stage, *more, "validate")):
        clear(job, stale)


def clear(job: Job, stage: str) -> None:
    """Delete the files of a stage. Edited files are renamed instead."""
    for name in job.folder.clear(stage):
        text = f"{stage}: a file was edited after this stage wrote it; your version is kept as {name}."
        job.progress.warn(doubt("file.kept", text, name))


def adopt_trial(job: Job) -> None:
    """Write the resolved trial and a copy of the readings to the run folder. A trial that is run in place is kept.

    The photo and the mesh are not copied, since a photo may contain its location and author, and a scan is large. The
    trial file has their paths from the run folder. The manifest has the file to which the folder belongs, and hashes
    of the photo and of the written trial.
    """
    written, in_place = job.path / TRIAL, job.source.resolve() == job.path.resolve()
    if in_place and load_trial(written).loaded(job.source) == job.trial:
        return
    content, manifest = job.trial.content, job.folder.manifest
    if not in_place and job.sheet is not None and job.trial.readings is not None:
        largest = plain_files.LARGEST_BYTES if job.trial.readings.scan else LARGEST_SHEET_BYTES
        files.write_if_new(job.path / job.trial.readings.path, plain_files.read_bytes(job.sheet, largest))
    for role, file in sample_files(job.trial).items():
        content["crack" if role == "scan" else job.trial.kind][role] = _seen_from(job.path, job.source / file)
    began = manifest.get("begun")
    is_edited = in_place and began is not None and files.sha256(written) != began["trial"]
    files.write_if_new(written, trial_text(content).encode())
    if job.file is not None and not in_place:
        shown = files.sha256(job.source / job.trial.shown_by.file)
        began = {"from": _seen_from(job.path, job.file), "sha256": shown}
    if began is None or is_edited:
        return
    began = {**began, "trial": files.sha256(written)}
    if began != manifest.get("begun"):
        manifest["begun"] = began
        job.folder.save()


def check_sheet(sheet: Path, readings: Readings | None = None) -> None:
    """Raise InputError if the sheet or the scan of readings is missing, or if a sheet is too large."""
    is_scan = readings is not None and readings.scan is not None
    if not sheet.is_file():
        key = "scan" if is_scan else "file"
        raise InputError(f"{sheet}: not found, but readings.{key} names it. Put the file there, or remove [readings].")
    if not is_scan and sheet.stat().st_size > LARGEST_SHEET_BYTES:
        raise InputError(
            f"{sheet}: is larger than {LARGEST_SHEET_BYTES / 1e6:g} MB, but a sheet of readings has only some kB."
        )


def require_digitised(folder: RunFolder) -> None:
    """Raise InputError if the crack of a run folder is not digitised."""
    if folder.settings_of("digitise") is None:
        raise InputError(
            f"{folder.path}: the stage digitise is not finished. First run 'sealtwin run TRIAL --out {folder.path}'."
        )


def require_solid(job: Job) -> None:
    """Raise InputError if only the path of the crack was digitised, without walls."""
    solid, outline = (job.path / name for name in ("solid.json", "outline.json"))
    if not solid.is_file() and outline.is_file() and record_files.read_outline(job.path).width_source == "none":
        raise InputError(
            f"{job.path}: has only the crack's path, without walls, so there is no solid to fill. Give crack.depth_mm "
            "and photo.width_mm, or a photo from a shorter distance, and digitise again."
        )


def made_by(job: Job, stage: StageName, names: Sequence[str]) -> dict[str, str]:
    """Return the current hashes of files that ``stage`` wrote.

    Raises InputError if the stage is not finished, or if it ran with settings that differ from the trial.
    """
    require_solid(job)
    file = display_path(job.file or job.path / TRIAL)
    again = f"'sealtwin run {file}'"
    made_with = job.folder.settings_of(stage)
    missing = [name for name in names if not (job.path / name).is_file()]
    if made_with is None or missing:
        cause = f" ({missing[0]} is missing)" if missing else ""
        raise InputError(f"{job.path}: the stage {stage} is not finished{cause}. First run {again}.")
    wanted = stage_settings(job.trial, stage)
    if differing := [table for table in {**wanted, **made_with} if made_with.get(table) != wanted.get(table)]:
        raise InputError(
            f"{file}: [{'], ['.join(differing)}] differs from the settings with which {stage} ran. First run {again}."
        )
    if other := job.other_numbers(stage):
        text = f"{job.path}: the files of {stage} were computed by {other}. {again} computes them again."
        job.progress.warn(doubt("file.other-version", text, stage))
    for name in job.folder.edited(stage):
        job.progress.warn(
            doubt("file.edited", f"{name}: was edited after {stage} wrote it; the edited file is used.", name)
        )
    return files.hashes(job.path, names)


def display_path(path: Path) -> str:
    """Return a path as text. A path inside the current folder becomes relative, so that it does not name the user."""
    try:
        below = path.absolute().is_relative_to(Path.cwd())
    except FileNotFoundError:
        below = False  # The current folder was deleted.
    return Path(os.path.relpath(path)).as_posix() if below else path.as_posix()
