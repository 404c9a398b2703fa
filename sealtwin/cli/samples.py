"""Commands that print a frame of markers, trace photos, make solids and nozzle paths, and export traced cracks."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sealtwin.cli.answer import Command, answers
from sealtwin.cli.options import SAMPLE, File, Given, Out, argument, option
from sealtwin.cli.trial_answer import run_file
from sealtwin.core.errors import InputError

if TYPE_CHECKING:
    from digitise.scale.marker_scale import MarkerFrame
    from sealtwin.cli.models import DrawnCrack, Tracing


@answers(*SAMPLE)
def digitise(
    command: Command,
    target: Annotated[Path, argument("FILE", "Photo from above, mesh (STL, PLY, GLB), drawing (DXF) or trial.toml.")],
    settings: Given,
    out: Out = None,
) -> None:
    """Make a watertight mesh of the crack and a nozzle path.

    For a photo, a mesh or a drawing, also writes RUN/trial.toml with all settings. Continue with
    'sealtwin run RUN/trial.toml'.

    Example: sealtwin digitise photo.png --depth-mm 16 --mm-per-px 0.1 --ends 12,340 905,377 --out crack

    Example: sealtwin digitise scan.stl --units mm --set mesh.up=z --out scan

    Example: sealtwin digitise crack.dxf --line CENTRELINE --width-mm 3 --depth-mm 16 --out drawn
    """
    run_file(command, target, out, ("digitise",), settings)


@answers(options="sealtwin.cli.models:DrawnCrack")
def export(
    command: Command,
    folder: Annotated[Path, argument("RUN", "Digitised run folder.")],
    options: "DrawnCrack",
    out: Annotated[Path, option("Folder for the files.", "DIR")],
) -> None:
    """Write a traced crack as a mask or as a drawing for CAD (DXF).

    A DXF has layers for the outline, both walls, the centreline, side cracks, the face and the nozzle's path.

    Example: sealtwin export reports/paper-trial --format dxf,mask --out drawn
    """
    from sealtwin.core.run_folder import look_into
    from sealtwin.trial.exports import KINDS, export_run
    from sealtwin.trial.job import display_path, other_versions

    names = [*map(display_path, export_run(folder, [kind for kind in KINDS if kind in options.formats], out))]
    others = other_versions(look_into(folder), stage="digitise")
    command.reply({"files": names, "other_versions": others}, [*others, *names])


@answers(options="digitise.scale.marker_scale:MarkerFrame")
def markers(
    command: Command,
    options: "MarkerFrame",
    out: Annotated[Path, option("PDF file of the page to print.", "FILE")],
    toml: Annotated[File, option("File for the table, which is otherwise printed.", "FILE")] = None,
) -> None:
    """Write a page with a frame of markers, to be printed, cut out and laid level with the face.

    Also prints the table of the markers for the trial file.

    Example: sealtwin markers --face-mm 160x40 --out frame.pdf
    """
    if out.suffix.lower() != ".pdf":
        raise InputError(f"--out = '{out}': should be a file that ends in .pdf.")
    from digitise.scale.marker_scale import board_around, board_toml, frame_pdf
    from sealtwin.core.files import write_unless_other

    if toml is not None and toml.resolve() == out.resolve():
        raise InputError(f"--toml = '{toml}': is the same file as --out; give another name.")
    face = options.face_mm
    board = board_around(face, options.size_mm, options.dictionary, int(options.count))
    page, table = frame_pdf(face, board, options.paper), board_toml(face, board)
    written = {out: page} if toml is None else {out: page, toml: table.encode()}
    # The files are written before the hint below, which could otherwise be read as a question for a file name.
    write_unless_other(written)
    command.say(f"{out}: print this page at 100 %, and measure its ruler.")
    if toml is not None:
        command.say(f"Then: sealtwin digitise PHOTO --markers {toml} --face-mm {face[0]:g}x{face[1]:g} --depth-mm ...")
    elif not command.as_json:
        command.say("For the trial file:")
    content = {"file": out.as_posix(), "face_mm": face, "markers": board.model_dump()}
    command.reply(content, table.splitlines())


@answers(options="sealtwin.cli.models:Tracing")
def trace(
    command: Command,
    target: Annotated[
        Path,
        argument("TRIAL|PHOTO", "A trial.toml, or a photo without a trial."),
    ],
    settings: Given,
    options: "Tracing",
) -> None:
    """Click a crack's ends on its photo, check and correct its walls, and save.

    Opens a page in your browser that only this machine can reach. The command ends when you save or quit on the page.
    For a photo, a new trial is written to the photo's folder. In an existing trial, only the hints for the photo, the
    depth and walls of the crack, and the settings of --set change.
    """
    import webbrowser

    from digitise.trace_page.page import TracePage
    from sealtwin.trial.trace_photo import opened

    photo = opened(target, settings)
    try:
        page = TracePage(photo, options.port or 0)
    except OSError as fault:
        raise InputError(f"--port {options.port}: {fault.strerror}. Give another port, or omit --port.") from None
    with page, page.doorway() as door:
        # The address is printed with --quiet too, since there is no other way to find the page.
        typer.echo(f"Trace page: {page.url}", err=True)
        command.say(
            "If no page appears, open this address. The command ends when you save or quit there, or with Ctrl-C."
        )
        if not options.no_browser and not webbrowser.open(door):
            command.say("No browser could be opened. Open this address yourself, or write photo.ends_px.")
        try:
            page.wait()
        except KeyboardInterrupt:
            command.interrupted("the trial was saved." if page.saved else "nothing was saved.")
    saved = page.saved or {"file": None, "changed": [], "summary": "Nothing was saved."}
    lines = [saved["summary"], *([f"Next: {saved['next']}"] if page.saved else [])]
    command.reply({"saved": saved["file"], "changed": saved["changed"]}, lines)
