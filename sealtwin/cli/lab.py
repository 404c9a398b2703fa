"""Commands for a lab: make trials and a catalogue from a folder of files, and run the samples."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from sealtwin.cli.answer import Command, answers
from sealtwin.cli.options import argument, option

if TYPE_CHECKING:
    from sealtwin.cli.models import Ingestion, WorkerProcesses


@answers(options="sealtwin.cli.models:Ingestion")
def ingest(
    command: Command,
    folder: Annotated[Path, argument("FOLDER", "Folder of photos and sheets. Nothing in it is changed.")],
    out: Annotated[Path, option("Folder for the trials, pairing.csv and the catalogue.", "LAB")],
    options: "Ingestion",
) -> None:
    """Make trials and a catalogue from a lab's folder of photos and caliper sheets.

    Files are paired by name: P01.jpg and "p 01 Messung.xlsx" belong to one sample. All open questions
    are written to LAB/pairing.csv, and LAB/index.html shows how the sheets were interpreted. Answer in pairing.csv, or
    in lab.toml at the top of FOLDER. You need not edit your own files. Settings that a photo does not show, such as
    crack.depth_mm, are given in lab.toml for all samples, or in a column of pairing.csv for one.

    A sample is sound if it can be run. To find out, its photo is traced, and the trial is checked as 'sealtwin run'
    does before its first frame. Photos of samples with open questions are traced too, so that all questions are listed
    together. Traced photos are kept, so a later call traces only new photos. LAB/index.html shows all traced walls.

    If a file has several samples, each gets a row in pairing.csv, with its own range, worksheet or columns.

    You may repeat the command: unchanged samples stay as they are. The trial of a changed sample is written again. If
    that trial was run or edited, it is kept, and a new revision is added.

    Example: sealtwin ingest measurements --out lab --dry-run
    """
    from sealtwin.cli.folder_answer import ingest_answer
    from sealtwin.lab.ingest import ingest as take_in

    dry_run, jobs = options.dry_run, 0 if options.dry_run else options.jobs
    with command.progress() as progress:
        ingested = take_in(folder, out, progress, dry_run=dry_run, jobs=jobs)
    command.reply(*ingest_answer(ingested))


@answers(options="sealtwin.cli.models:WorkerProcesses", device=True)
def lab(
    command: Command,
    folder: Annotated[Path, argument("LAB", "A folder that 'sealtwin ingest' wrote.")],
    options: "WorkerProcesses",
) -> None:
    """Run every sound sample that has not been run yet.

    The results are in LAB/SAMPLE/run, and LAB/catalogue.csv lists all samples with their mean errors. Samples with open
    questions are left out and listed. After an interruption, repeat the command to continue.
    """
    from sealtwin.cli.folder_answer import samples_answer
    from sealtwin.lab.catalogue import run_samples
    from sealtwin.study.runner import StudyOptions

    computing = StudyOptions(*command.device_and_jobs(options.jobs))
    with command.progress() as progress:
        command.reply(*samples_answer(folder, run_samples(folder, computing, progress)))
