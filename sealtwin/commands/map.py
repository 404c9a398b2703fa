"""A finished sweep on a map."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from sealtwin.answering import Device, Json, Quiet, answering

StudyFolder = Annotated[Path, typer.Argument(metavar="STUDY", help="The folder of a sweep.")]


def map(
    folder: StudyFolder,
    caliper: Annotated[
        Path | None,
        typer.Option(
            "--caliper",
            metavar="SHEET",
            help="Readings to hold the runs against, written as those of the study's trial are; default: those.",
        ),
    ] = None,
    data: Annotated[
        Literal["measured", "reconstructed", "synthetic"] | None,
        typer.Option("--data", help="Where the readings of another sheet come from."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Where the page goes; default: STUDY/map.")
    ] = None,
    fills: Annotated[
        bool, typer.Option("--fills/--no-fills", help="Compute some nine runs once more, to draw how they fill.")
    ] = True,
    device: Device = "auto",
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Draw a study of two settings as the paper draws its own: levels, map of the error, influences, fills, cost.

    It says which pair is nearest to the readings, how many others come as near, and which runs are not in it and why.
    A page, single SVG files, and their numbers as CSV.

    Example: sealtwin map reports/paper-132 --caliper fixtures/paper-trial/caliper.csv
    """
    with answering(device, as_json, quiet) as command:
        from sealtwin.study.mapping import MapWish, map_study
        from simulate.device import choose_device

        wish = MapWish(caliper, data, fills, choose_device(device) if fills else "cpu")
        mapped = map_study(folder, out, wish, command.progress())
        command.answer(mapped.content, mapped.lines)
