"""From a photo, or a trial, to a mesh and a path; from many photos to a table and a contact sheet."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from sealtwin.answering import Json, Out, Quiet, answering
from sealtwin.photos.photo_options import beside_nothing, board, depth, one_or_two, points, two_numbers


def digitise(
    targets: Annotated[
        list[Path],
        typer.Argument(
            metavar="TRIAL|PHOTO...", help="A trial.toml, or a photo with the options below; several, or a folder."
        ),
    ],
    out: Out = None,
    depth_mm: Annotated[
        str | None, typer.Option(metavar="MM|CSV", help="Measured depth, or a CSV of s_mm,depth_mm along the crack.")
    ] = None,
    mm_per_px: Annotated[float | None, typer.Option(help="Scale.")] = None,
    assumed: Annotated[bool, typer.Option("--assumed", help="That scale is assumed; every output says so.")] = False,
    markers: Annotated[
        Path | None, typer.Option(metavar="TOML", help="Markers in the photo, as 'sealtwin markers' writes them.")
    ] = None,
    face_mm: Annotated[
        str | None, typer.Option(metavar="WxH", help="Size of the sample's face; without markers it gives the scale.")
    ] = None,
    face_corners: Annotated[
        str | None,
        typer.Option(
            metavar="'X,Y ...'", help="Its corners in pixels: lower left, lower right, upper right, upper left."
        ),
    ] = None,
    ruler: Annotated[
        str | None, typer.Option(metavar="'X,Y X,Y'", help="Two points on a ruler in the plane of the face, in pixels.")
    ] = None,
    ruler_mm: Annotated[float | None, typer.Option(help="Their distance on the ruler.")] = None,
    ends: Annotated[
        tuple[str, str] | None,
        typer.Option(metavar="X,Y X,Y", help="The crack's two ends in pixels; the nozzle starts at the first."),
    ] = None,
    via: Annotated[
        str | None, typer.Option(metavar="'X,Y ...'", help="Points between the ends that the crack passes, in order.")
    ] = None,
    roi: Annotated[
        str | None,
        typer.Option(metavar="'X,Y ...'", help="Search only in this box (two corners) or polygon, in pixels."),
    ] = None,
    mask: Annotated[
        Path | None, typer.Option(metavar="PICTURE", help="The crack painted white on black; nothing is searched for.")
    ] = None,
    second_photo: Annotated[
        Path | None, typer.Option(metavar="PHOTO", help="From the same camera, lit from the other side.")
    ] = None,
    edge_fraction: Annotated[
        float | None, typer.Option(help="Share of the contrast at which a wall lies; default 0.5, 0.7 for lit walls.")
    ] = None,
    keep_branches: Annotated[
        bool, typer.Option("--keep-branches", help="Side cracks belong to the solid too.")
    ] = False,
    tilt: Annotated[
        Literal["lean", "flare", "funnel", "vertical"] | None, typer.Option(help="How the walls tilt; default: lean.")
    ] = None,
    wall_angle_deg: Annotated[
        str | None,
        typer.Option(metavar="DEG|L,R", help="Each wall's angle from vertical, or left and right; default: 11."),
    ] = None,
    volume_ml: Annotated[
        float | None, typer.Option(help="Sealant to give; default: what fills the crack to its face.")
    ] = None,
    jobs: Annotated[int, typer.Option(min=1, max=64, help="Photos digitised at the same time.")] = 1,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """From a photo to a watertight crack mesh and a nozzle path.

    Examples: sealtwin digitise photo.png --depth-mm 16 --mm-per-px 0.1 --ends 12,340 905,377 --out crack

    sealtwin digitise photos/*.jpg --depth-mm 16 --face-mm 160x40 --out photos-digitised
    """
    with answering("cpu", as_json, quiet) as command:
        tables = {
            "photo": {
                "mm_per_px": mm_per_px,
                "scale_is": "assumed" if assumed else None,
                "markers": board(markers),
                "face_mm": None if face_mm is None else two_numbers(face_mm, "x", "--face-mm"),
                "face_corners_px": points(face_corners, "--face-corners"),
                "ruler_px": points(ruler, "--ruler"),
                "ruler_mm": ruler_mm,
                "ends_px": None if ends is None else [two_numbers(end, ",", "--ends") for end in ends],
                "via_px": points(via, "--via"),
                "roi_px": points(roi, "--roi"),
                "mask": beside_nothing(mask),
                "second_photo": beside_nothing(second_photo),
                "edge_fraction": edge_fraction,
                "branches": "keep" if keep_branches else None,
            },
            "crack": {
                "depth_mm": None if depth_mm is None else depth(depth_mm),
                "tilt": tilt,
                "wall_angle_deg": one_or_two(wall_angle_deg, "--wall-angle-deg"),
            },
            "path": {"volume_ml": volume_ml},
        }
        _refuse_meshes(targets)
        given = [name for settings in tables.values() for name, value in settings.items() if value is not None]
        from sealtwin.photos.batch import are_several, digitise_many, plan

        if not are_several(targets) and targets[0].suffix.lower() == ".toml":
            if given:
                raise typer.BadParameter("options for a photo beside a trial file: put them into the trial file")
            command.run(targets[0], out, ("digitise",))
            return
        if not are_several(targets):
            if depth_mm is None:
                raise typer.BadParameter("a photo needs --depth-mm: a photo cannot show how deep a crack is")
            from sealtwin.trials.trial import photo_trial

            command.run_checked(photo_trial(targets[0], tables), targets[0].parent, out, ("digitise",))
            return
        of_one = {"ends_px", "via_px", "roi_px", "mask", "second_photo", "face_corners_px", "ruler_px"} & set(given)
        if of_one:
            raise typer.BadParameter(
                f"{', '.join(sorted(of_one))} for several photos: put it into a trial file beside the photo that it is "
                "of, with the photo's name and .toml; 'sealtwin trace' writes one"
            )
        if out is None:
            raise typer.BadParameter("several photos need --out, a folder for all of them")
        report = digitise_many(plan(targets, tables), out, command.progress(), jobs=jobs)
        command.answer(report.content, report.lines)
        if report.exit_code:
            raise typer.Exit(report.exit_code)


def _refuse_meshes(targets: list[Path]) -> None:
    from digitise.modelled.mesh_file import READERS

    meshes = [target for target in targets if target.suffix.lower() in READERS]
    if meshes:
        raise typer.BadParameter(f"{meshes[0]} is a mesh: 'sealtwin import-mesh {meshes[0]}' takes it")
