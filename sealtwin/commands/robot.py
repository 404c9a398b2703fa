"""From a run's nozzle path to files for a robot."""

from pathlib import Path
from typing import Annotated

import typer

from sealtwin.answering import Json, Quiet, answering


def robot(
    folder: Annotated[Path | None, typer.Argument(metavar="RUN", help="A digitised run folder.")] = None,
    cell: Annotated[
        Path | None, typer.Option("--cell", metavar="FILE", help="The robot's cell: taught points, limits, languages.")
    ] = None,
    formats: Annotated[
        str | None,
        typer.Option(
            "--format",
            metavar="A,B|all",
            help="Of txt, csv, spel, gcode, urscript; all: those that the cell has tables for; default: its formats.",
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Where the files go; default: robot/ in the run folder.")
    ] = None,
    allow_automatic: Annotated[
        bool, typer.Option("--allow-automatic", help="Also where the crack was found automatically, once you looked.")
    ] = False,
    example: Annotated[
        Path | None, typer.Option("--example", metavar="FILE", help="Write a commented cell file to start from.")
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Write a run's nozzle path for a robot: txt, CSV, Epson SPEL+, G-code, URScript.

    Example: sealtwin robot reports/paper-trial --cell cell.toml --format spel
    """
    with answering("cpu", as_json, quiet) as command:
        if example is not None:
            if folder is not None or cell is not None:
                raise typer.BadParameter("--example beside RUN or --cell: it only writes a cell file to start from")
            from sealtwin.trials.cell_example import write_example_cell

            write_example_cell(example)
            command.answer({"version": 1, "file": example.as_posix()}, [str(example)])
            return
        if folder is None or cell is None:
            raise typer.BadParameter("give RUN and --cell FILE; --example FILE writes a cell file to start from")
        from digitise.robots.cell import FORMATS
        from sealtwin.store.folder import open_folder
        from sealtwin.trials.robot import headline, write_robot_files

        asked = [] if formats is None else formats.split(",")
        if unknown := [name for name in asked if name not in (*FORMATS, "all")]:
            raise typer.BadParameter(f"--format {unknown[0]}: allowed are {', '.join(FORMATS)} and all")
        with open_folder(folder, create=False) as run:
            report = write_robot_files(run, cell, asked, out, allow_automatic=allow_automatic)
        for name in report["kept"]:
            command.say(f"a robot file was edited since it was written; yours is kept as {name}.")
        for warning in report["warnings"]:
            command.say(f"note: {warning}")
        command.answer(report, headline(report))
