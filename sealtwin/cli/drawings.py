"""Commands that hand a traced crack to other programs, and take one drawn in CAD."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from sealtwin.cli.answer import Answer, Command, answers
from sealtwin.cli.drawing_words import of_a_drawing
from sealtwin.cli.options import Given, Number, Text, argument, number_option, option
from sealtwin.cli.trial_answer import run_trial

LEAST_MM, MOST_MM = 0.1, 500.0
"""Limits of a drawn crack's depth and width: those of [crack] depth_mm."""


@answers()
def export(
    command: Command,
    folders: Annotated[list[Path], argument("RUN...", "Digitised run folders.")],
    formats: Annotated[
        str,
        option(
            "mask: a PNG of the photo's size, white where the crack is; coco: one JSON of all; dxf: lines in mm.",
            "mask,coco,dxf",
            "--format",
        ),
    ],
    out: Annotated[Path, option("Folder for the files.", "DIR")],
) -> None:
    """Write traced cracks as masks, as annotations in COCO's form, or as drawings for CAD.

    A DXF has the outline, both walls, the centreline, side cracks, the face and the nozzle's path, each on its layer.

    Example: sealtwin export reports/paper-trial --format dxf,mask --out drawn
    """
    from sealtwin.core.run_folder import look_into
    from sealtwin.trial.exports import KINDS, export_runs
    from sealtwin.trial.job import other_versions, shown

    asked = formats.split(",")
    if unknown := [name for name in asked if name not in KINDS]:
        raise typer.BadParameter(f"--format {unknown[0]}: allowed are {', '.join(KINDS)}")
    written = export_runs(folders, [kind for kind in KINDS if kind in asked], out)
    names = [shown(path) for path in written]
    others = other_versions(*map(look_into, folders), stage="digitise")
    command.reply(Answer({"version": 1, "files": names, "other_versions": others}, [*others, *names]))


@answers()
def import_dxf(
    command: Command,
    drawing: Annotated[Path, argument("DRAWING", "A DXF of the crack seen from above.")],
    depth_mm: Annotated[float, number_option("Depth of the crack's level floor.")],
    out: Annotated[Path, option("Folder for the mesh, trial.toml and run/.", "DIR")],
    settings: Given,
    outline: Annotated[Text, option("Layer with the crack's edge as a closed line; default: OUTLINE.", "LAYER")] = None,
    walls: Annotated[
        tuple[str, str] | None,
        option("Two layers with a wall each, as an open line; default: WALL_LEFT WALL_RIGHT.", "LAYER LAYER"),
    ] = None,
    line: Annotated[Text, option("Layer with the crack's middle as an open line; needs --width-mm.", "LAYER")] = None,
    width_mm: Annotated[Number, number_option("Width of the crack along that line.")] = None,
    units: Annotated[
        Literal["mm", "cm", "m", "inch", "foot"] | None,
        option("Unit of the drawing, in place of the one that it states; where it states none, it is not guessed."),
    ] = None,
) -> None:
    """Turn a crack drawn in CAD into a solid with upright walls and a nozzle path.

    It is taken from an outline, from two walls, or from a line and a width; a closed line on the layer FACE is the edge
    of the sample. The trial that is written runs like any other: 'sealtwin run DIR/trial.toml --out DIR/run'.

    Example: sealtwin import-dxf crack.dxf --line CENTRELINE --width-mm 3 --depth-mm 16 --out drawn
    """
    if (line is None) != (width_mm is None):
        raise typer.BadParameter("--line and --width-mm go together: a line has no width of its own")
    if sum(given is not None for given in (outline, walls, line)) > 1:
        raise typer.BadParameter("--outline, --walls and --line: give one of them")
    if walls is not None and walls[0].upper() == walls[1].upper():
        raise typer.BadParameter(f"--walls {walls[0]} {walls[1]}: the walls are on two layers, one each")
    for name, value in (("--depth-mm", depth_mm), ("--width-mm", width_mm)):
        if value is not None and not LEAST_MM < value <= MOST_MM:
            raise typer.BadParameter(f"{name} {value:g}: expected more than {LEAST_MM:g}, at most {MOST_MM:g}")
    from sealtwin.trial.drawn_trial import write_drawn_trial

    drawn = None if line is None or width_mm is None else (line, width_mm)
    shown_by = {"outline": outline, "walls": walls, "line": drawn}
    with of_a_drawing(drawing):
        trial, notes = write_drawn_trial(drawing, out, depth_mm, units, shown_by, settings)
        for note in notes:
            command.warn(f"note: {note}")
        run_trial(command, trial, out / "run", ("digitise",))
