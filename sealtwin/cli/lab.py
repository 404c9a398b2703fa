"""Commands that take a lab's folder into trials and a catalogue, and that query the catalogue."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from sealtwin.cli.answer import Answer, Command, answers
from sealtwin.cli.options import File, Text, argument, count_option, flag, option


@answers()
def ingest(
    command: Command,
    folder: Annotated[Path, argument("FOLDER", "Photos, sheets and notes; nothing in this folder is changed.")],
    out: Annotated[Path, option("Folder for the trials, pairing.csv and the catalogue.", "LAB")],
    dry_run: Annotated[bool, flag("--dry-run", "Pair, read and report; trace and write nothing.")] = False,
    jobs: Annotated[int, count_option("Samples traced at the same time.", 1, 64)] = 1,
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

    with command.progress() as progress:
        ingested = take_in(folder, out, progress, dry_run=dry_run, jobs=0 if dry_run else jobs)
    command.reply(ingest_answer(ingested))


@answers(device=True)
def lab(
    command: Command,
    action: Annotated[Literal["list", "show", "export", "run"], argument("list|show|export|run")],
    folder: Annotated[Path, argument("LAB", "A folder of 'sealtwin ingest'.")],
    sample: Annotated[Text, argument("SAMPLE", "Name of the sample, for show.")] = None,
    out: Annotated[File, option("File for export.", "CSV")] = None,
    jobs: Annotated[
        int | None, count_option("Processes, for run; default: one for each core, one on a GPU.", 1, 512)
    ] = None,
) -> None:
    """Query a lab's catalogue, or run its samples: list LAB, show LAB SAMPLE, export LAB --out FILE.csv, run LAB.

    run computes every sound sample that is not yet run, into LAB/SAMPLE/run, and lists the samples that it leaves out
    because they have open questions. After an interruption, repeat the command to continue.
    """
    if (action == "show") != (sample is not None):
        raise typer.BadParameter("show needs a sample; list, export and run do not take one")
    if (action == "export") != (out is not None):
        raise typer.BadParameter("export needs --out; list, show and run do not take it")
    if action != "run" and (jobs is not None or command.device != "auto"):
        raise typer.BadParameter("only run takes --jobs and --device")
    from sealtwin.cli.folder_answer import list_answer, show_answer
    from sealtwin.lab.catalogue import export

    if action == "run":
        command.reply(_run(command, folder, jobs))
    elif out is not None:
        rows = export(folder, out)
        command.reply(Answer({"file": out.as_posix(), "rows": rows}, [f"{out}: {rows} rows"]))
    elif sample is not None:
        command.reply(show_answer(folder, sample))
    else:
        command.reply(list_answer(folder))


def _run(command: Command, folder: Path, jobs: int | None) -> Answer:
    from sealtwin.cli.folder_answer import samples_answer
    from sealtwin.lab.catalogue import run_samples
    from sealtwin.study.runner import StudyOptions

    options = StudyOptions(*command.device_and_jobs(jobs))
    with command.progress() as progress:
        return samples_answer(folder, run_samples(folder, options, progress))
