"""From a photo, or a trial, to a mesh and a path."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from sealtwin.answering import Json, Out, Quiet, answering, two_numbers


def digitise(
    target: Annotated[
        Path, typer.Argument(metavar="TRIAL|PHOTO", help="A trial.toml, or a photo with the options below.")
    ],
    out: Out = None,
    depth_mm: Annotated[float | None, typer.Option(help="Photo: measured depth of the crack.")] = None,
    mm_per_px: Annotated[float | None, typer.Option(help="Photo: scale.")] = None,
    face_mm: Annotated[
        str | None, typer.Option(metavar="WxH", help="Photo: size of the sample's face; gives the scale.")
    ] = None,
    assumed: Annotated[
        bool, typer.Option("--assumed", help="Photo: the scale is assumed; every output says so.")
    ] = False,
    ends: Annotated[
        tuple[str, str] | None,
        typer.Option(metavar="X,Y X,Y", help="Photo: the crack's two ends in pixels; the nozzle starts at the first."),
    ] = None,
    tilt: Annotated[
        Literal["lean", "flare", "funnel", "vertical"] | None,
        typer.Option(help="Photo: how the walls tilt; default: lean."),
    ] = None,
    wall_angle_deg: Annotated[
        float | None, typer.Option(help="Photo: each wall's angle from vertical; default: 11.")
    ] = None,
    volume_ml: Annotated[
        float | None, typer.Option(help="Photo: sealant to give; default: what fills the crack to its face.")
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """From a photo to a watertight crack mesh and a nozzle path.

    Example: sealtwin digitise photo.png --depth-mm 16 --mm-per-px 0.1 --ends 12,340 905,377 --out crack
    """
    with answering("cpu", as_json, quiet) as command:
        if target.suffix.lower() == ".toml":
            of_a_photo = (depth_mm, mm_per_px, face_mm, ends, tilt, wall_angle_deg, volume_ml)
            if assumed or any(value is not None for value in of_a_photo):
                raise typer.BadParameter("options for a photo beside a trial file: put them into the trial file")
            command.run(target, out, ("digitise",))
            return
        if depth_mm is None:
            raise typer.BadParameter("a photo needs --depth-mm: a photo cannot show how deep a crack is")
        from sealtwin.trial import photo_trial

        trial = photo_trial(
            target,
            depth_mm=depth_mm,
            mm_per_px=mm_per_px,
            face_mm=None if face_mm is None else two_numbers(face_mm, "x", "--face-mm"),
            assumed=assumed,
            ends_px=None
            if ends is None
            else (two_numbers(ends[0], ",", "--ends"), two_numbers(ends[1], ",", "--ends")),
            tilt=tilt,
            wall_angle_deg=wall_angle_deg,
            volume_ml=volume_ml,
        )
        command.run_checked(trial, target.parent, out, ("digitise",))
