"""Many photos in one command: each in a run folder of its own, a table and a contact sheet of all."""

import glob
import json
import traceback
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from itertools import count
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from sealtwin.errors import InputError, SealtwinError, as_text
from sealtwin.photos.contact_sheet import write_contact_sheet, write_csv
from sealtwin.processes import end_with_parent
from sealtwin.progress import Progress
from sealtwin.store import files
from sealtwin.store.folder import MANIFEST, holding, open_folder
from sealtwin.trials.job import sample_files, start_job
from sealtwin.trials.pipeline import run_stages
from sealtwin.trials.trial import Trial, load_trial, photo_trial

BUG, SOME_FAILED = 1, 6
KILLED = (
    "the processes that digitised were killed, most likely since memory ran out; the same command goes on with what is "
    "left: give it fewer --jobs."
)
PHOTO_SUFFIXES = {".jpg", ".jpeg", ".png", ".webp", ".tif", ".tiff", ".bmp", ".heic", ".heif"}
"""Taken from a folder; what cannot be read among them is said to be so."""
LISTING = "batch.json"
"""Marks a folder as a batch's own, and lists it for programs."""
CSV, SHEET = "photos.csv", "index.html"
FAULT = "fault.txt"
OWN = {LISTING, CSV, SHEET}

Tables = Mapping[str, Mapping[str, Any]]


@dataclass(frozen=True)
class Planned:
    """One photo of a batch."""

    file: Path
    """The photo, or a trial file that names one."""
    name: str
    """Of its run folder."""
    tables: Tables
    """What the command line says about a photo without a trial file."""

    def trial(self) -> Trial:
        """Raises InputError where it cannot be one."""
        return load_trial(self.file) if _is_trial(self.file) else photo_trial(self.file, self.tables)


@dataclass(frozen=True)
class Row:
    """What became of one photo; lengths and volumes are None where it failed."""

    file: str
    folder: str
    status: str
    """"ok", "failed", or "bug"."""
    mean_width_mm: float | None = None
    length_mm: float | None = None
    depth_mm: float | None = None
    cavity_ml: float | None = None
    sealant_ml: float | None = None
    mm_per_px: float | None = None
    scale_source: str = ""
    path_source: str = ""
    warnings: tuple[str, ...] = ()
    reason: str = ""

    @property
    def fault(self) -> str:
        """Most reasons begin with the file."""
        return self.reason if self.reason.startswith(self.file) else f"{self.file}: {self.reason}"


@dataclass(frozen=True)
class Report:
    """What the command says at its end."""

    content: dict[str, Any]
    lines: list[str]
    exit_code: int


def are_several(targets: Sequence[Path]) -> bool:
    """More than one file; a folder, or a pattern that no shell has expanded, stands for several."""
    return len(targets) > 1 or targets[0].is_dir() or _is_pattern(targets[0])


def plan(targets: Sequence[Path], tables: Tables) -> list[Planned]:
    """One entry a photo, in the order given. A trial file of the photo's name beside it says more than ``tables``.

    Raises InputError where a folder or a pattern holds no photo.
    """
    named = [file for target in targets for file in _photos(target)]
    own = [beside if (beside := file.with_suffix(".toml")).is_file() else file for file in named]
    # A mask or a second photo is part of another photo's trial.
    parts = {part for file in set(own) if _is_trial(file) for part in _parts(file)}
    kept = list(dict.fromkeys(file for photo, file in zip(named, own, strict=True) if photo.absolute() not in parts))
    return [Planned(file, name, tables) for file, name in zip(kept, _names(kept), strict=True)]


def digitise_many(
    planned: Sequence[Planned], out: Path, progress: Progress, jobs: int = 1, held_back: Sequence[Row] = ()
) -> Report:
    """Digitise every photo into a folder below ``out``, going on past those that fail.

    What is done already is not done again. Photos ``held_back`` for a fault that was told before are counted and listed
    with those that fail. Raises InputError where ``out`` is not a batch's own.
    """
    _refuse_foreign(out)
    with holding(out), progress:
        files.write_json(out / LISTING, {"version": 1, "photos": []})
        progress.start(f"Digitising {len(planned)} photos", len(planned))
        rows: dict[str, Row] = {}
        try:
            for done, row in enumerate(_rows(planned, out, jobs), start=1):
                rows[row.folder] = row
                if row.status != "ok":
                    progress.note(row.fault)
                progress.advance(done, row.folder)
        finally:
            # Interrupted, what is finished is still told of.
            ordered = [rows[item.name] for item in planned if item.name in rows]
            report = _report(ordered, held_back, out)
            files.write_json(out / LISTING, report.content)
            write_csv(out / CSV, report.content["photos"])
            write_contact_sheet(out / SHEET, out, report.content["photos"])
    return report


def _photos(target: Path) -> list[Path]:
    if target.is_dir():
        # As a shell's patterns, without hidden files: a Mac leaves a ._photo.jpg beside each photo that it copies.
        visible = [file for file in target.iterdir() if not file.name.startswith(".")]
        found = [file for file in visible if file.suffix.lower() in PHOTO_SUFFIXES]
    elif _is_pattern(target):
        found = [Path(file) for file in glob.glob(str(target))]  # noqa: PTH207
    else:
        found = [target]
    if not found:
        raise InputError(f"{target}: no photos there; expected files ending in {', '.join(sorted(PHOTO_SUFFIXES))}.")
    return sorted(found)


def _is_trial(file: Path) -> bool:
    return file.suffix.lower() == ".toml"


def _is_pattern(target: Path) -> bool:
    return glob.has_magic(str(target)) and not target.exists()


def _rows(planned: Sequence[Planned], out: Path, jobs: int) -> Iterator[Row]:
    if jobs == 1:
        yield from (_digitise_one(item, out) for item in planned)
        return
    # A fresh process each: OpenCV's and manifold's threads do not survive a fork.
    with ProcessPoolExecutor(min(jobs, len(planned)), get_context("spawn"), end_with_parent) as pool:
        at_work = {pool.submit(_digitise_one, item, out): item for item in planned}
        try:
            for future in as_completed(at_work):
                try:
                    yield future.result()
                except BrokenProcessPool:
                    yield _failed(at_work[future], KILLED)
        except BaseException:
            # Ctrl-C too: photos that wait must not be digitised after it.
            pool.shutdown(cancel_futures=True)
            raise


def _digitise_one(item: Planned, out: Path) -> Row:
    folder = out / item.name
    try:
        with open_folder(folder, create=True) as opened:
            run_stages(start_job(item.trial(), item.file.parent, opened, "cpu", Progress()), ("digitise",))
        (folder / FAULT).unlink(missing_ok=True)
        return _done(item, folder)
    except SealtwinError as fault:
        return _failed(item, str(fault))
    except OSError as fault:
        return _failed(item, f"{fault.filename or item.file}: {fault.strerror}.")
    except Exception as fault:
        # A bug of ours that one photo wakes must not cost the others theirs; it is told of, and ends with code 1.
        return _failed(item, f"{type(fault).__name__}: {fault}. A bug of ours: please report {_traced(folder)}.", "bug")


def _failed(item: Planned, reason: str, status: str = "failed") -> Row:
    return Row(as_text(item.file), item.name, status, reason=reason)


def _traced(folder: Path) -> str:
    """Where the traceback of the error at hand lies: on a full disk, in the sentence itself."""
    try:
        files.write_text(folder / FAULT, traceback.format_exc())
    except OSError:
        return f"it with this: {traceback.format_exc()}"
    return str(folder / FAULT)


def _done(item: Planned, folder: Path) -> Row:
    outline, solid = files.read_json(folder / "outline.json"), files.read_json(folder / "solid.json")
    with files.understood(folder):
        return Row(
            file=as_text(item.file),
            folder=item.name,
            status="ok",
            mean_width_mm=round(outline["mean_width_mm"], 3),
            length_mm=round(outline["length_mm"], 2),
            depth_mm=solid["depth_mm"],
            cavity_ml=round(solid["cavity_volume_mm3"] / 1000, 3),
            sealant_ml=round(solid["sealant_mm3"] / 1000, 3),
            mm_per_px=round(outline["mm_per_px"], 5),
            scale_source=outline["scale_source"],
            path_source=outline["path_source"],
            warnings=(*outline["warnings"], *solid["warnings"]),
        )


def _report(rows: Sequence[Row], held_back: Sequence[Row], out: Path) -> Report:
    failed = [row for row in rows if row.status != "ok"]
    listed = [*rows, *held_back]
    bugs = any(row.status == "bug" for row in rows)
    exit_code = BUG if bugs else SOME_FAILED if failed or held_back else 0
    content = {
        "version": 1,
        "photos": [vars(row) for row in listed],
        "failed": len(failed) + len(held_back),
        "exit_code": exit_code,
    }
    return Report(
        content, [*_table(rows), *_ending(listed, out), *(f"failed: {row.fault}" for row in failed)], exit_code
    )


def _table(rows: Sequence[Row]) -> list[str]:
    broad = max((len(row.folder) for row in rows), default=0)
    head = f"{'photo':<{broad}}  {'width mm':>8} {'length mm':>9} {'cavity ml':>9} {'sealant ml':>10}  path"
    lines = [
        f"{row.folder:<{broad}}  {row.mean_width_mm:8.2f} {row.length_mm:9.1f} {row.cavity_ml:9.2f} "
        f"{row.sealant_ml:10.2f}  {row.path_source}"
        for row in rows
        if row.status == "ok"
    ]
    return [head, *lines] if lines else []


def _ending(rows: Sequence[Row], out: Path) -> list[str]:
    done = sum(row.status == "ok" for row in rows)
    proposals = sum(row.path_source == "automatic" for row in rows)
    lines = [f"{done} of {len(rows)} photos digitised. Look at {out / SHEET}; table: {out / CSV}"]
    if proposals:
        lines.append(f"{proposals} cracks were found automatically: proposals, until somebody has looked at them.")
    return lines


def _parts(trial_file: Path) -> set[Path]:
    """Pictures that a trial needs beside its photo; none where it cannot be read, which is said when its turn comes."""
    try:
        named = sample_files(load_trial(trial_file))
    except InputError:
        return set()
    return {(trial_file.parent / file).absolute() for role, file in named.items() if role != "file"}


def _names(kept: Sequence[Path]) -> list[str]:
    """A folder's name for each photo: no two alike on any file system, and none hidden, above, or the batch's own."""
    names = [_whole(file) if file.stem.startswith(".") or file.stem.casefold() in OWN else _stem(file) for file in kept]
    for longer in (_whole, lambda file: f"{file.absolute().parent.name.lstrip('.')}-{_stem(file)}"):
        times = Counter(name.casefold() for name in names)
        names = [longer(file) if times[name.casefold()] > 1 else name for file, name in zip(kept, names, strict=True)]
    taken = {name.casefold() for name in names}
    seen: set[str] = set()
    for place, name in enumerate(names):
        if name.casefold() in seen:
            names[place] = next(longer for number in count(2) if (longer := f"{name}-{number}").casefold() not in taken)
        seen.add(name.casefold())
        taken.add(names[place].casefold())
    return names


def _stem(file: Path) -> str:
    return as_text(Path(file.stem))


def _whole(file: Path) -> str:
    return as_text(Path(file.name)).replace(".", "-")


def _refuse_foreign(out: Path) -> None:
    if _is_listing(out / LISTING):
        return
    foreign = [name for name in (LISTING, MANIFEST, CSV, SHEET) if (out / name).exists()]
    if foreign:
        raise InputError(f"{out}: holds {foreign[0]}, which no batch wrote; give --out another folder.")


def _is_listing(file: Path) -> bool:
    try:
        return file.is_file() and json.loads(file.read_text(encoding="utf-8"))["version"] == 1
    except (ValueError, KeyError, TypeError, RecursionError):
        return False
