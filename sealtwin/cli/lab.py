"""Commands that take a lab's folder into trials and a catalogue, query the catalogue, and run its samples."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sealtwin.cli.answer import CheckedCommand, Command, answers
from sealtwin.cli.options import argument, option

if TYPE_CHECKING:
    from sealtwin.cli.models import Ingestion, WorkerProcesses

LabFolder = Annotated[Path, argument("LAB", "A folder of 'sealtwin ingest'.")]


@answers(options="sealtwin.cli.models:Ingestion")
def ingest(
    command: Command,
    folder: Annotated[Path, argument("FOLDER", "Photos, sheets and notes; nothing in this folder is changed.")],
    out: Annotated[Path, option("Folder for the trials, pairing.csv and the catalogue.", "LAB")],
    options: "Ingestion",
) -> None:
    """Take a lab's folder of photos, caliper sheets and notes into trials and a catalogue.

    Files are paired by name: P01.jpg, "p 01 Messung.xlsx" and notes/P01.toml belong to one sample. Everything else is
    a question in LAB/pairing.csv, beside which LAB/index.html shows how the sheets were understood. Answer there, or
    in lab.toml at the top of FOLDER; you need not edit your own files. Settings that no photo shows are keys of a
    trial: in NAME.toml, or in a text of lines such as crack.depth_mm = 16.0.

    A sample is sound if it can be run: it is traced, and checked as 'sealtwin run' would before its first frame. Photos
    of samples in question are traced too, so that all questions come at once. The lab keeps each tracing, so that
    later rounds trace only new photos. LAB/index.html shows all traced walls.

    A file of several samples gets a row of pairing.csv for each, with its own range, worksheet or columns.

    Repeating the command adds nothing. The trial of a changed sample is written again. If it was run or edited, it
    stays, beside a new revision.

    Example: sealtwin ingest measurements --out lab --dry-run
    """
    from sealtwin.cli.folder_answer import ingest_answer
    from sealtwin.lab.ingest import ingest as take_in

    dry_run, jobs = options.dry_run, 0 if options.dry_run else options.jobs
    with command.progress() as progress:
        ingested = take_in(folder, out, progress, dry_run=dry_run, jobs=jobs)
    command.reply(*ingest_answer(ingested))


@answers()
def list_lab(command: Command, folder: LabFolder) -> None:
    """List the latest trial of each sample."""
    from sealtwin.cli.folder_answer import list_answer

    command.reply(*list_answer(folder))


@answers()
def show(
    command: Command, folder: LabFolder, sample: Annotated[str, argument("SAMPLE", "Name of the sample.")]
) -> None:
    """Show all revisions of a sample, with its files and settings."""
    from sealtwin.cli.folder_answer import show_answer

    command.reply(*show_answer(folder, sample))


@answers()
def export(command: Command, folder: LabFolder, out: Annotated[Path, option("File for the table.", "CSV")]) -> None:
    """Write the latest trial of each sample as a table."""
    from sealtwin.lab.catalogue import export

    rows = export(folder, out)
    command.reply({"file": out.as_posix(), "rows": rows}, [f"{out}: {rows} rows"])


@answers(options="sealtwin.cli.models:WorkerProcesses", device=True)
def run(command: Command, folder: LabFolder, options: "WorkerProcesses") -> None:
    """Run every sound sample that is not yet run.

    The results are in LAB/SAMPLE/run. Samples with open questions are left out, and listed. After an interruption,
    repeat the command to continue.
    """
    from sealtwin.cli.folder_answer import samples_answer
    from sealtwin.lab.catalogue import run_samples
    from sealtwin.study.runner import StudyOptions

    computing = StudyOptions(*command.device_and_jobs(options.jobs))
    with command.progress() as progress:
        command.reply(*samples_answer(folder, run_samples(folder, computing, progress)))


catalogue = typer.Typer(name="lab", help="Query a lab's catalogue, or run its samples.", no_args_is_help=True)
for name, action in {"list": list_lab, "show": show, "export": export, "run": run}.items():
    catalogue.command(name, cls=CheckedCommand)(action)
