"""The fill as a film."""

from pathlib import Path
from typing import Annotated

import typer

from sealtwin.answering import Json, Quiet, RunFolderPath, answering

FilmOut = Annotated[
    Path | None,
    typer.Option("--out", metavar="FILE", help="A name that ends in .gif or .mp4; default: RUN/fill.gif."),
]


def film(folder: RunFolderPath, out: FilmOut = None, as_json: Json = False, quiet: Quiet = False) -> None:
    """Make a film of the fill from RUN/frames, which 'sealtwin run TRIAL --frames-every-s 0.1' writes.

    It shows the section along the crack and the crack from above, coloured by speed, in the run's own time. GIF plays
    anywhere; MP4 (VP9) has all colours, plays in browsers and VLC, and needs an OpenCV that can write it.
    """
    with answering("auto", as_json, quiet) as command:
        from sealtwin.trials.film import make_film
        from sealtwin.trials.result import shown

        path = out or folder / "fill.gif"
        with command.progress() as progress:
            frames, lasts_s = make_film(folder, path, progress)
        content = {"version": 1, "film": shown(path), "frames": frames, "lasts_s": round(lasts_s, 2)}
        command.answer(content, [f"Film: {shown(path)}, {frames} frames, {lasts_s:.1f} s."])
