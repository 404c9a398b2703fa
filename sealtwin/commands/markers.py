"""A printable frame of markers, which gives photos their scale."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from sealtwin.answering import Json, Quiet, answering
from sealtwin.photos.photo_options import two_numbers


def markers(
    face_mm: Annotated[str, typer.Option(metavar="WxH", help="Size of the sample's face: the opening of the frame.")],
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="The page to print: .pdf or .svg.")],
    size_mm: Annotated[float, typer.Option(min=5, max=200, help="Outer edge of a marker's black square.")] = 16.0,
    dictionary: Annotated[
        Literal["4x4_50", "5x5_100", "6x6_250", "apriltag_36h11"], typer.Option(help="Kind of the markers.")
    ] = "4x4_50",
    count: Annotated[
        Literal["4", "8"], typer.Option(help="At the corners of the face, or also in the middle of its sides.")
    ] = "8",
    paper: Annotated[Literal["a4", "a3", "letter"], typer.Option(help="Size of the paper, either way up.")] = "a4",
    toml: Annotated[
        Path | None, typer.Option("--toml", metavar="FILE", help="Also write the table for the trial file here.")
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Write a frame of markers to print, cut out and lay level with the face; print its table for the trial file.

    Example: sealtwin markers --face-mm 160x40 --out frame.pdf
    """
    with answering("cpu", as_json, quiet) as command:
        if out.suffix.lower() not in (".pdf", ".svg"):
            raise typer.BadParameter(f"--out {out}: expected a file that ends in .pdf or .svg")
        from digitise.scaling.board import board_around, board_toml, checked_face, draw_frame
        from digitise.scaling.sheet import as_pdf, as_svg
        from sealtwin.store.files import refuse_other, write_bytes

        if toml is not None and toml.resolve() == out.resolve():
            raise typer.BadParameter(f"--toml {toml}: the same file as --out")
        face = checked_face(two_numbers(face_mm, "x", "--face-mm"))
        frame = draw_frame(face, board_around(face, size_mm, dictionary, int(count)), paper)
        table = board_toml(frame)
        page = as_pdf(frame.sheet) if out.suffix.lower() == ".pdf" else as_svg(frame.sheet).encode()
        written = {out: page} if toml is None else {out: page, toml: table.encode()}
        # "For the trial file" is easily read as a wish for its name.
        for file, content in written.items():
            refuse_other(file, content)
        for file, content in written.items():
            write_bytes(file, content)
        command.say(f"{out}: print it at 100 %, and measure its ruler.")
        if toml is not None:
            command.say(f"Then: sealtwin digitise PHOTO --markers {toml} --face-mm {face_mm} --depth-mm ...")
        elif not as_json:
            command.say("For the trial file:")
        answer = {"version": 1, "file": out.as_posix(), "face_mm": face, "markers": frame.board.model_dump()}
        command.answer(answer, table.splitlines())
