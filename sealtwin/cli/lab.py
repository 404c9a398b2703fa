"""A lab's folder into trials and a catalogue, and what that catalogue holds."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from sealtwin.cli.answer import Answer, File, Json, Quiet, Text, answering, argument, flag, option
from sealtwin.cli.numbers import count_option


def ingest(
    folder: Annotated[Path, argument("FOLDER", "Photos, sheets of readings and notes; nothing in it is changed.")],
    out: Annotated[Path, option("Gets a folder for each trial, pairing.csv and the catalogue.", "LAB")],
    pairing: Annotated[
        File, option("LAB/pairing.csv as you have corrected it: file, role, sample, part.", "CSV")
    ] = None,
    dry_run: Annotated[bool, flag("--dry-run", "Pair, check and tell; write nothing.")] = False,
    digitise: Annotated[
        bool, flag("--digitise", "Trace each sound sample too; LAB/index.html shows all walls.")
    ] = False,
    jobs: Annotated[int, count_option("Of --digitise: samples traced at the same time.", 1, 64)] = 1,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Take a lab's folder of photos, caliper sheets and notes into trials and a catalogue.

    Files are paired by name: P01_top.jpg, "p 01 Messung.xlsx" and P01_notes.toml are of one sample. What is in doubt is
    asked, what is wrong is named, the rest goes on. A note says what no photo shows, in the trial's own keys (TOML) or
    in a table of words and values ("Tiefe in mm; 16,0"); lab.toml on top of FOLDER says it for all samples.

    One table for several samples is divided by a column that names them, or by worksheets named after them.

    Again, the same command adds nothing; a sample that has changed, or whose trial has lost a file, becomes a new
    revision beside the old one.

    Example: sealtwin ingest measurements --out lab --dry-run
    """
    with answering("cpu", as_json, quiet) as command:
        if digitise and dry_run:
            raise typer.BadParameter("--digitise writes what it traces; give it without --dry-run")
        from sealtwin.cli.folder_answer import ingest_answer, traced_answer
        from sealtwin.lab.ingest import ingest as take_in
        from sealtwin.lab.ingest import trace

        with command.progress() as progress:
            ingested = take_in(folder, out, progress, pairing=pairing, dry_run=dry_run)
        if digitise:
            command.reply(traced_answer(ingested, *trace(ingested, command.progress(), jobs)))
        else:
            command.reply(ingest_answer(ingested))


def lab(
    action: Annotated[Literal["list", "show", "export"], argument("list|show|export")],
    folder: Annotated[Path, argument("LAB", "The folder that 'sealtwin ingest' made.")],
    sample: Annotated[Text, argument("SAMPLE", "Of show.")] = None,
    out: Annotated[File, option("Of export.", "CSV")] = None,
    as_json: Json = False,
) -> None:
    """Query a lab's catalogue: list LAB, show LAB SAMPLE, export LAB --out FILE.csv."""
    with answering("cpu", as_json, quiet=False) as command:
        if (action == "show") != (sample is not None):
            raise typer.BadParameter("give a sample with show, and with show only")
        if (action == "export") != (out is not None):
            raise typer.BadParameter("give --out with export, and with export only")
        from sealtwin.cli.folder_answer import list_answer, show_answer
        from sealtwin.lab.catalogue import export

        if out is not None:
            rows = export(folder, out)
            command.reply(Answer({"version": 1, "file": out.as_posix(), "rows": rows}, [f"{out}: {rows} rows"]))
        elif sample is not None:
            command.reply(show_answer(folder, sample))
        else:
            command.reply(list_answer(folder))
