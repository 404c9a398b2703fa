"""Digitise many photos in one command. Writes a run folder for each photo, and a table and a contact sheet of all."""

import base64
import glob
import traceback
from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, fields
from itertools import chain, count
from pathlib import Path
from typing import Any

from digitise.image.decoding import PHOTO_SUFFIXES
from sealtwin.core import files
from sealtwin.core.cluster import Lost, run_tasks
from sealtwin.core.doubts import ReadSheet
from sealtwin.core.errors import InputError, SealtwinError, as_text, present
from sealtwin.core.facts import texts
from sealtwin.core.progress import Progress
from sealtwin.core.record_files import SolidFile, read_record
from sealtwin.core.run_folder import MANIFEST, holding, open_folder
from sealtwin.study.pipeline import run_stages
from sealtwin.trial.digitise_stage import REFUSED
from sealtwin.trial.job import sample_files, start_job
from sealtwin.trial.trial_file import SettingValues, Trial, load_trial, sample_trial
from validate.readings.grid import letters
from validate.result import SampleFigures

BUG, SOME_FAILED = 1, 6
REMEDY = "Repeat the command with fewer --jobs to digitise the remaining photos."
LISTING = "batch.json"  # File that marks the folder of a batch, and lists the photos for programs
CSV, SHEET = "photos.csv", "index.html"
FAULT = "fault.txt"
THUMBNAIL_PX = 720  # Length of a thumbnail's longer side. It shows the walls, and a page of 100 photos still loads
OWN = {LISTING, CSV, SHEET}


@dataclass(frozen=True)
class PlannedPhoto:
    file: Path  # The photo, or a trial file that names the photo
    name: str  # Name of the photo's run folder
    settings: SettingValues  # Settings from the command line, by dotted name

    def trial(self) -> Trial:
        """Return the trial of the photo. Raises InputError if its settings cannot be used."""
        if _is_trial(self.file):
            return load_trial(self.file, self.settings)
        return sample_trial("photo", self.file, self.settings)


@dataclass(frozen=True)
class BatchRow:
    """Result of one photo. Lengths and volumes are None if the photo failed. A path without walls has only a length."""

    file: str
    folder: str
    status: str  # "ok", "failed", or "bug"
    mean_width_mm: float | None = None
    length_mm: float | None = None
    depth_mm: float | None = None
    cavity_ml: float | None = None
    sealant_ml: float | None = None
    mm_per_px: float | None = None
    scale_source: str = ""
    path_source: str = ""
    data: str = ""  # Origin of the photo
    warnings: tuple[str, ...] = ()
    reason: str = ""


@dataclass(frozen=True)
class Batch:
    out: Path
    rows: Sequence[BatchRow] = ()

    @property
    def done(self) -> list[BatchRow]:
        return [row for row in self.rows if row.status == "ok"]

    @property
    def failed(self) -> list[BatchRow]:
        return [row for row in self.rows if row.status != "ok"]

    @property
    def exit_code(self) -> int:
        if any(row.status == "bug" for row in self.rows):
            return BUG
        return SOME_FAILED if self.failed else 0

    def content(self) -> dict[str, Any]:
        """Return the content of batch.json. The command prints the same object with --json."""
        return {
            "version": 1,
            "photos": [vars(row) for row in self.rows],
            "failed": len(self.failed),
            "exit_code": self.exit_code,
        }


def are_several(targets: Sequence[Path]) -> bool:
    """Return True if ``targets`` are several photos, a folder, or a file pattern that the shell has not expanded."""
    return len(targets) > 1 or targets[0].is_dir() or _is_pattern(targets[0])


def plan(targets: Sequence[Path], settings: SettingValues) -> list[PlannedPhoto]:
    """Return an entry for each photo, in the order of ``targets``.

    ``settings`` by dotted name apply to photos, and replace settings of trial files in ``targets``. If a photo has a
    trial file with the same name in its folder, that file is used without ``settings``. Raises InputError if a folder
    or a pattern has no photo.
    """
    named = [file for target in targets for file in _photos(target)]
    files = [trial if (trial := file.with_suffix(".toml")).is_file() else file for file in named]
    # A picture that belongs to another photo's trial, such as a mask, is not digitised.
    parts = {part for file in set(files) if _is_trial(file) for part in _parts(file)}
    chosen = list(
        dict.fromkeys(file for photo, file in zip(named, files, strict=True) if photo.absolute() not in parts)
    )
    photos = {*named}
    return [
        PlannedPhoto(file, name, settings if file in photos else {})
        for file, name in zip(chosen, _names(chosen), strict=True)
    ]


def digitise_many(
    planned: Sequence[PlannedPhoto],
    out: Path,
    progress: Progress,
    jobs: int = 1,
    *,
    locked: bool = False,
    sheets: Mapping[str, ReadSheet] | None = None,
) -> Batch:
    """Digitise each photo into a folder in ``out``. If a photo fails, the others are still digitised.

    Finished photos are not digitised again. ``locked`` is True if the caller has already locked ``out``. The page shows
    the doubtful ``sheets``, which are given by file name. Raises InputError if ``out`` contains files of other
    programs.
    """
    _refuse_foreign(out)
    with nullcontext() if locked else holding(out), progress:
        files.write_json(out / LISTING, {"version": 1, "photos": []})
        progress.start(f"Digitising {len(planned)} photos", len(planned))
        rows: dict[str, BatchRow] = {}
        # One photo at a time is digitised in this process.
        processes = min(jobs, len(planned)) if jobs > 1 else 0
        try:
            tasks = ((item, (item, out)) for item in planned)
            for done, (item, outcome) in enumerate(run_tasks(_digitise_one, tasks, processes), start=1):
                row = _failed(item, f"{outcome.reason}. {REMEDY}") if isinstance(outcome, Lost) else outcome
                rows[row.folder] = row
                if row.status != "ok":
                    progress.note(f"{row.folder}: {row.reason}")
                progress.advance(done, row.folder)
        finally:
            # After an interruption, the table lists the photos that are finished.
            batch = Batch(out, [rows[item.name] for item in planned if item.name in rows])
            files.write_json(out / LISTING, batch.content())
            write_csv(out / CSV, batch.rows)
            write_contact_sheet(out / SHEET, out, batch.rows, sheets)
    return batch


def _photos(target: Path) -> list[Path]:
    if target.is_dir():
        # Hidden files are skipped, as by a shell. macOS writes a hidden ._photo.jpg for each photo that it copies.
        visible = [file for file in target.iterdir() if not file.name.startswith(".")]
        photos = [file for file in visible if file.suffix.lower() in PHOTO_SUFFIXES]
    else:
        photos = [Path(file) for file in glob.glob(str(target))] if _is_pattern(target) else [target]  # noqa: PTH207
    if not photos:
        raise InputError(
            f"{target}: there are no photos; expected files ending in {', '.join(sorted(PHOTO_SUFFIXES))}."
        )
    return sorted(photos)


def _is_trial(file: Path) -> bool:
    return file.suffix.lower() == ".toml"


def _is_pattern(target: Path) -> bool:
    return glob.has_magic(str(target)) and not target.exists()


def _digitise_one(item: PlannedPhoto, out: Path) -> BatchRow:
    folder = out / item.name
    try:
        with open_folder(folder, create=True) as opened:
            (folder / REFUSED).unlink(missing_ok=True)
            trial = item.trial()
            done = run_stages(start_job(trial, item.file.parent, opened, "cpu", Progress()), ("digitise",))
        (folder / FAULT).unlink(missing_ok=True)
        return _done(item, folder, present(done.result.sample, "sample"))
    except SealtwinError as fault:
        return _failed(item, str(fault))
    except OSError as fault:
        return _failed(item, f"{fault.filename or item.file}: {fault.strerror}.")
    except Exception as fault:
        # A bug in one photo must not stop the others. The command then ends with exit code 1.
        return _failed(
            item, f"{type(fault).__name__}: {fault}. This is a bug; please report {write_trace(folder)}.", "bug"
        )


def _failed(item: PlannedPhoto, reason: str, status: str = "failed") -> BatchRow:
    return BatchRow(as_text(item.file), item.name, status, reason=reason)


def write_trace(folder: Path) -> str:
    """Write the current traceback to a file, and return its path. If the disk is full, return the traceback."""
    try:
        files.write_text(folder / FAULT, traceback.format_exc())
    except OSError:
        return f"it with this: {traceback.format_exc()}"
    return str(folder / FAULT)


def _done(item: PlannedPhoto, folder: Path, sample: SampleFigures) -> BatchRow:
    walls, cavity_mm3 = sample.width_source != "none", sample.cavity_volume_mm3
    return BatchRow(
        file=as_text(item.file),
        folder=item.name,
        status="ok",
        mean_width_mm=sample.mean_width_mm,
        length_mm=sample.length_mm,
        depth_mm=read_record(SolidFile, folder / "solid.json").depth_mm if walls else None,
        cavity_ml=None if cavity_mm3 is None else cavity_mm3 / 1000,
        sealant_ml=sample.sealant_mm3 / 1000 if walls else None,
        mm_per_px=sample.mm_per_px,
        scale_source=sample.scale_source,
        path_source=sample.path_source,
        data=sample.data,
        warnings=texts(sample.warnings),
    )


def _parts(trial_file: Path) -> set[Path]:
    """Return the files of a trial's sample, except the photo. A trial that cannot be read is reported later."""
    try:
        named = sample_files(load_trial(trial_file))
    except InputError:
        return set()
    return {(trial_file.parent / file).absolute() for role, file in named.items() if role != "file"}


def _names(photos: Sequence[Path]) -> list[str]:
    """Return the name of a folder for each photo.

    The names are unique on any file system. They are not hidden, and differ from the files of the batch.
    """
    names = [as_text(Path(file.stem)) for file in photos]
    times = Counter(name.casefold() for name in names)
    taken = {*OWN, *times}
    for number, (file, name) in enumerate(zip(photos, names, strict=True)):
        if times[name.casefold()] > 1 or name.startswith(".") or name.casefold() in OWN:
            longer = f"{file.absolute().parent.name}-{as_text(Path(file.name))}".replace(".", "-").lstrip("-")
            several = chain([longer], (f"{longer}-{more}" for more in count(2)))
            names[number] = next(free for free in several if free.casefold() not in taken)
            taken.add(names[number].casefold())
    return names


def _refuse_foreign(out: Path) -> None:
    try:
        if files.read_json(out / LISTING)["version"] == 1:
            return
    except (InputError, OSError, KeyError, TypeError):
        pass  # There is no listing, or another program wrote it.
    if foreign := [name for name in (LISTING, MANIFEST, CSV, SHEET) if (out / name).exists()]:
        raise InputError(f"{out}: has a file {foreign[0]} that no batch wrote. Give another folder as --out.")


def write_csv(path: Path, rows: Sequence[BatchRow]) -> None:
    columns = [field.name for field in fields(BatchRow) if field.name != "folder"]
    cells = [vars(row) | {"warnings": "; ".join(row.warnings)} for row in rows]
    files.write_sheet(
        path,
        columns,
        ([round(value, 4) if isinstance(value := row[name], float) else value for name in columns] for row in cells),
    )


def write_contact_sheet(
    path: Path, folder: Path, rows: Sequence[BatchRow], sheets: Mapping[str, ReadSheet] | None
) -> None:
    """Write a self-contained page with a picture of each photo, which links to the photo's run folder.

    ``sheets`` are doubtful sheets of readings, which the page also shows.
    """
    from validate.figures.page import page_environment

    refused = [row.folder for row in rows if (folder / row.folder / REFUSED).is_file()]
    done = [row for row in rows if row.status == "ok"]
    page = (
        page_environment("sealtwin")
        .get_template("contact_sheet.html.j2")
        .render(
            photos=rows,
            thumbnails={row.folder: _thumbnail(folder / row.folder / "overlay.png") for row in done},
            refused={name: _thumbnail(folder / name / REFUSED) for name in refused},
            done=done,
            sheets=sheets or {},
            letters=letters,
            sealant_ml=sum(row.sealant_ml or 0.0 for row in done),
        )
    )
    files.write_text(path, page)


def _thumbnail(overlay: Path) -> str:
    """Return a small copy of a picture as a data URI."""
    import cv2
    import numpy as np

    picture = cv2.imdecode(np.frombuffer(files.read_bytes(overlay), np.uint8), cv2.IMREAD_COLOR)
    if picture is None:
        raise InputError(f"{overlay}: the picture cannot be read. Digitise again.")
    shrink = min(1.0, THUMBNAIL_PX / max(picture.shape))
    small = cv2.resize(picture, None, fx=shrink, fy=shrink, interpolation=cv2.INTER_AREA)
    _, jpeg = cv2.imencode(".jpg", small, [cv2.IMWRITE_JPEG_QUALITY, 82])
    return "data:image/jpeg;base64," + base64.b64encode(jpeg.tobytes()).decode()
