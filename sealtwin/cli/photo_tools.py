"""Commands for photos: a frame of markers to print, and the page to trace a crack on."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from sealtwin.cli.answer import Answer, Command, answers
from sealtwin.cli.options import File, Given, argument, count_option, flag, number_option, option, read_numbers
from sealtwin.core.errors import InputError


@answers()
def markers(
    command: Command,
    face_mm: Annotated[str, option("Size of the sample's face, which is the opening of the frame.", "WxH")],
    out: Annotated[Path, option("File of the page to print, .pdf.", "FILE")],
    size_mm: Annotated[float, number_option("Outer edge of a marker's black square.", 5, 200)] = 16.0,
    dictionary: Annotated[
        Literal["4x4_50", "5x5_100", "6x6_250", "apriltag_36h11"],
        option("Dictionary of the markers: cells across and number of markers, or an AprilTag family."),
    ] = "4x4_50",
    count: Annotated[
        Literal["4", "8"], option("4: at the corners of the face; 8: also in the middle of its sides.")
    ] = "8",
    paper: Annotated[Literal["a4", "a3", "letter"], option("Size of the paper, portrait or landscape.")] = "a4",
    toml: Annotated[File, option("Also write the table for the trial file here.", "FILE")] = None,
) -> None:
    """Write a frame of markers to print, cut out and lay level with the face. Prints its table for the trial file.

    Example: sealtwin markers --face-mm 160x40 --out frame.pdf
    """
    if out.suffix.lower() != ".pdf":
        raise typer.BadParameter(f"--out {out}: expected a file that ends in .pdf")
    from digitise.scale.marker_print import board_around, board_toml, frame_pdf
    from sealtwin.core.files import write_unless_other

    if toml is not None and toml.resolve() == out.resolve():
        raise typer.BadParameter(f"--toml {toml} is the same file as --out; give another name")
    face = read_numbers(face_mm, "WxH", "--face-mm")
    board = board_around(face, size_mm, dictionary, int(count))
    page, table = frame_pdf(face, board, paper), board_toml(face, board)
    written = {out: page} if toml is None else {out: page, toml: table.encode()}
    # The hint below could otherwise be read as a question for a file name.
    write_unless_other(written)
    command.say(f"{out}: print it at 100 %, and measure its ruler.")
    if toml is not None:
        command.say(f"Then: sealtwin digitise PHOTO --markers {toml} --face-mm {face_mm} --depth-mm ...")
    elif not command.as_json:
        command.say("For the trial file:")
    content = {"version": 1, "file": out.as_posix(), "face_mm": face, "markers": board.model_dump()}
    command.reply(Answer(content, table.splitlines()))


@answers()
def trace(
    command: Command,
    target: Annotated[
        Path,
        argument("TRIAL|PHOTO|FOLDER", "A trial.toml, a photo without a trial, or a folder with trials or photos."),
    ],
    settings: Given,
    port: Annotated[int | None, count_option("Port of the page; default: any free port.", 1024, 65535)] = None,
    no_browser: Annotated[bool, flag("--no-browser", "Print the page's address and do not open a browser.")] = False,
) -> None:
    """Click a crack's ends on its photo, check and correct its walls, and save.

    Opens a page in your browser that only this machine can reach; the command ends when you save or quit there.
    In a trial, only the hints for its photo, the depth and walls of the crack, and the settings of --set change; for a
    photo, a new trial is written into its folder. With a folder, the page shows one photo after another.
    """
    import webbrowser

    from digitise.trace_page.page import TracePage
    from sealtwin.trial.trace_sheets import sheet_of, sheets_in

    sheets = sheets_in(target, settings) if target.is_dir() else [sheet_of(target, settings)]
    try:
        page = TracePage(sheets, port or 0)
    except OSError as fault:
        raise InputError(f"--port {port}: {fault.strerror}. Give another port, or omit --port.") from None
    with page, page.doorway() as door:
        # Printed with --quiet too: there is no other way to find the page.
        typer.echo(f"Trace page: {page.url}", err=True)
        command.say(
            "If no page appears, open that address. The command ends when you save or quit there, or with Ctrl-C."
        )
        if not no_browser and not webbrowser.open(door):
            command.say("No browser could be opened; open that address yourself.")
        try:
            page.wait()
        except KeyboardInterrupt:
            command.interrupted("saved photos remain saved." if page.saved else "nothing was saved.")
    summaries = [one["summary"] for one in page.saved] or ["Nothing was saved."]
    listed = [{"file": one["file"], "changed": one["changed"]} for one in page.saved]
    if len(sheets) > 1:
        open_ = [photo["name"] for photo in page.photos if not photo["done"]]
        rest = f"Not traced yet: {', '.join(open_)}." if open_ else f"All {len(sheets)} photos are traced."
        command.reply(Answer({"version": 1, "saved": listed, "not_traced": open_}, [*summaries, rest]))
        return
    saved = listed[0] if listed else {"file": None, "changed": []}
    content = {"version": 1, "saved": saved["file"], "changed": saved["changed"]}
    command.reply(Answer(content, [*summaries, *(f"Next: {one['next']}" for one in page.saved)]))
