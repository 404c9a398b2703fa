"""Trace the trials of a lab, each in its run folder, and write a page with all traced walls."""

import traceback
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from sealtwin.core import files
from sealtwin.core.doubts import ReadSheet
from sealtwin.core.errors import SealtwinError
from sealtwin.core.progress import Progress
from sealtwin.core.run_folder import open_folder
from sealtwin.core.workers import Lost, run_tasks
from sealtwin.study.pipeline import run_stages
from sealtwin.trial.digitise_stage import REFUSED
from sealtwin.trial.job import start_job
from sealtwin.trial.trial_file import SettingValues, load_trial
from validate.readings.grid import letters
from validate.result import SampleFigures

REMEDY = "Repeat the command with fewer --jobs to trace the remaining photos."
SHEET = "index.html"
FAULT = "fault.txt"
THUMBNAIL_PX = 720  # Length of a thumbnail's longer side. It shows the walls, and a page of 100 photos still loads


@dataclass(frozen=True)
class PlannedTrace:
    trial: Path  # Trial file
    folder: str  # Name of the run folder in the lab
    settings: SettingValues  # Settings by dotted name that replace those of the trial


@dataclass(frozen=True)
class TracedRow:
    """Result of one photo."""

    folder: str
    status: str  # "ok", "asked" if the user must choose the crack, "failed", or "bug"
    reason: str = ""
    sample: SampleFigures | None = None  # None if the photo failed


def trace_all(
    planned: Sequence[PlannedTrace], lab: Path, progress: Progress, jobs: int, sheets: Mapping[str, ReadSheet]
) -> list[TracedRow]:
    """Trace each trial into its run folder in ``lab``. If a photo fails, the others are still traced.

    Traced photos are not traced again. The page shows the doubtful ``sheets``, which are given by file name.
    """
    progress.start(f"Tracing {len(planned)} photos", len(planned))
    rows: dict[str, TracedRow] = {}
    # One photo at a time is traced in this process.
    processes = min(jobs, len(planned)) if jobs > 1 else 0
    for done, (item, outcome) in enumerate(
        run_tasks(_trace, ((item, (item, lab)) for item in planned), processes), start=1
    ):
        row = _failed(item, f"{outcome.reason}. {REMEDY}") if isinstance(outcome, Lost) else outcome
        rows[row.folder] = row
        progress.advance(done, row.folder)
    traced = [rows[item.folder] for item in planned]
    write_contact_sheet(lab, traced, sheets)
    return traced


def _trace(item: PlannedTrace, lab: Path) -> TracedRow:
    from digitise.crack_path.find_path import RivalCracksError

    folder = lab / item.folder
    try:
        with open_folder(folder, create=True) as opened:
            (folder / REFUSED).unlink(missing_ok=True)
            trial = load_trial(item.trial, item.settings)
            done = run_stages(start_job(trial, item.trial.parent, opened, "cpu", Progress()), ("digitise",))
        (folder / FAULT).unlink(missing_ok=True)
        return TracedRow(item.folder, "ok", sample=done.result.sample)
    except RivalCracksError as rivals:
        return _failed(item, str(rivals), "asked")
    except SealtwinError as fault:
        return _failed(item, str(fault))
    except OSError as fault:
        return _failed(item, f"{fault.filename or item.trial}: {fault.strerror}.")
    except Exception as fault:
        # A bug in one photo must not stop the others. The command then ends with exit code 1.
        return _failed(
            item, f"{type(fault).__name__}: {fault}. This is a bug; please report {write_trace(folder)}.", "bug"
        )


def _failed(item: PlannedTrace, reason: str, status: str = "failed") -> TracedRow:
    return TracedRow(item.folder, status, reason=reason)


def write_trace(folder: Path) -> str:
    """Write the current traceback to a file, and return its path. If the disk is full, return the traceback."""
    try:
        files.write_text(folder / FAULT, traceback.format_exc())
    except OSError:
        return f"it with this: {traceback.format_exc()}"
    return str(folder / FAULT)


def write_contact_sheet(folder: Path, rows: Sequence[TracedRow], sheets: Mapping[str, ReadSheet]) -> None:
    """Write a self-contained page with a picture of each photo, which links to the photo's run folder.

    ``sheets`` are doubtful sheets of readings, which the page also shows.
    """
    from validate.figures.page import page_environment

    def thumbnail(*names: str) -> str:
        return files.as_uri(files.as_jpeg(files.read_picture(folder.joinpath(*names), THUMBNAIL_PX)))

    refused = [row.folder for row in rows if (folder / row.folder / REFUSED).is_file()]
    done = [row for row in rows if row.status == "ok"]
    page = (
        page_environment("sealtwin")
        .get_template("contact_sheet.html.j2")
        .render(
            photos=rows,
            thumbnails={row.folder: thumbnail(row.folder, "overlay.png") for row in done},
            refused={name: thumbnail(name, REFUSED) for name in refused},
            done=done,
            sheets=sheets,
            letters=letters,
            sealant_mm3=sum(row.sample.sealant_mm3 for row in done if row.sample),
        )
    )
    files.write_text(folder / SHEET, page)
