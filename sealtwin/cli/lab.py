"""A lab's folder into trials and a catalogue, and what that catalogue holds."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from sealtwin.cli.answer import Answer, Command, answers
from sealtwin.cli.options import File, Text, argument, count_option, flag, option


@answers()
def ingest(
    command: Command,
    folder: Annotated[Path, argument("FOLDER", "Photos, sheets and notes; nothing in it is changed.")],
    out: Annotated[Path, option("Gets a folder for each trial, pairing.csv and the catalogue.", "LAB")],
    pairing: Annotated[
        File, option("A pairing.csv elsewhere; LAB/pairing.csv, corrected and answered, is read anyway.", "CSV")
    ] = None,
    dry_run: Annotated[bool, flag("--dry-run", "Pair, trace, check and tell; write nothing.")] = False,
    jobs: Annotated[int, count_option("Samples traced at the same time.", 1, 64)] = 1,
) -> None:
    """Take a lab's folder of photos, caliper sheets and notes into trials and a catalogue.

    Files are paired by name: IMG_0412_P01.jpg, "p 01 Messung.xlsx" and P01_notes.toml are of one sample. Each sheet is
    shown as it was understood: its columns, their roles, units and first values. What is in doubt, before the crack is
    traced or after, is asked in LAB/pairing.csv and answered there, or in lab.toml on top of FOLDER; no file of yours
    need be edited. A note says what no photo shows, in the trial's own keys (TOML) or in a table of words and values
    ("Tiefe in mm; 16,0"); other texts are kept with their sample. A table of masses and levels is a liquid that was
    weighed into the crack.

    A sound sample runs: it is traced, and checked as 'sealtwin run' would before its first frame. Photos of samples in
    doubt are traced too, so that all questions come at once. LAB/index.html shows all walls.

    A word of a note that is not known and may be a setting is asked about; lab.toml says once what it is,
    in its table words: "Bandgeschw." = "path.speed_mm_s" (or "ignore").

    One table for several samples is divided by a column that names them, or by worksheets named after them.

    Again, the same command adds nothing; a sample that has changed, or whose trial has lost a file, becomes a new
    revision beside the old one. An answer alone goes into a trial that was neither run nor edited.

    Example: sealtwin ingest measurements --out lab --dry-run
    """
    from sealtwin.cli.folder_answer import checked_answer
    from sealtwin.lab.ingest import ingest as take_in
    from sealtwin.lab.run_checks import check_runs

    with command.progress() as progress:
        ingested = take_in(folder, out, progress, pairing=pairing, dry_run=dry_run)
    command.reply(checked_answer(ingested, *check_runs(ingested, folder, command.progress(), jobs)))


@answers(quiet=False)
def lab(
    command: Command,
    action: Annotated[Literal["list", "show", "export"], argument("list|show|export")],
    folder: Annotated[Path, argument("LAB", "The folder that 'sealtwin ingest' made.")],
    sample: Annotated[Text, argument("SAMPLE", "Of show.")] = None,
    out: Annotated[File, option("Of export.", "CSV")] = None,
) -> None:
    """Query a lab's catalogue: list LAB, show LAB SAMPLE, export LAB --out FILE.csv."""
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
