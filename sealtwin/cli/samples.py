"""Commands that turn a photo, many photos or a mesh into a solid and a nozzle path."""

from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from sealtwin.cli.answer import File, Json, Number, Out, Quiet, Text, answering, argument, flag, option
from sealtwin.cli.numbers import count_option, number_option, read_number
from sealtwin.cli.option_names import in_options, options_named
from sealtwin.cli.trial_answer import run_trial
from sealtwin.core.errors import InputError

Data = Annotated[
    Literal["measured", "reconstructed", "synthetic"] | None,
    option("Origin of the photo, mesh or drawing; left out, every result says that it is not declared."),
]
VolumeMl = Annotated[Number, number_option("Sealant to give; default: what fills the crack to its face.")]


def import_mesh(
    mesh: Annotated[Path, argument("MESH", "STL, PLY, OBJ, OFF, GLB or 3MF of a cracked block.")],
    units: Annotated[
        Literal["mm", "cm", "m", "inch"],
        option("Unit of the file's numbers: most formats do not name it, and it is not guessed."),
    ],
    out: Out = None,
    up: Annotated[
        Literal["z", "y", "x", "-z", "-y", "-x"] | None,
        option("The file's axis that points out of the cracked face; default: z."),
    ] = None,
    path: Annotated[
        File,
        option("Centreline, a line x y in mm for each point; default: the middle of the crack's mouth.", "CSV|TXT"),
    ] = None,
    data: Data = None,
    base_mm: Annotated[
        Number, number_option("Depth below the face at which a scan that is open below is closed by a flat underside.")
    ] = None,
    dam_height_mm: Annotated[
        Number, number_option("Height above the face of the dams where the crack leaves the block; default: 10.")
    ] = None,
    volume_ml: VolumeMl = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Turn your own mesh of a cracked sample into a checked, watertight solid and a nozzle path.

    Example: sealtwin import-mesh scan.stl --units mm --up z --out scan
    """
    with answering("cpu", as_json, quiet) as command:
        from sealtwin.trial.trial_file import sample_trial

        tables = {
            "mesh": {
                "units": units,
                "up": up,
                "path": None if path is None else path.resolve(),
                "data": data,
                "base_mm": base_mm,
                "dam_height_mm": dam_height_mm,
            },
            "path": {"volume_ml": volume_ml},
        }
        with options_named():
            trial = sample_trial("mesh", mesh, tables)
        run_trial(command, mesh, out, ("digitise",), trial=trial)


def digitise(
    targets: Annotated[
        list[Path],
        argument("TRIAL|PHOTO...", "A trial.toml, or a photo with the options below; several, or a folder."),
    ],
    out: Out = None,
    depth_mm: Annotated[Text, option("Measured depth, or a CSV of s_mm,depth_mm along the crack.", "MM|CSV")] = None,
    data: Data = None,
    mm_per_px: Annotated[Number, number_option("Scale.")] = None,
    assumed: Annotated[bool, flag("--assumed", "Mark that scale as assumed in every output.")] = False,
    markers: Annotated[File, option("Markers in the photo, as 'sealtwin markers' writes them.", "TOML")] = None,
    face_mm: Annotated[Text, option("Size of the sample's face; without markers it gives the scale.", "WxH")] = None,
    face_corners: Annotated[
        Text, option("Its corners in pixels: lower left, lower right, upper right, upper left.", "'X,Y ...'")
    ] = None,
    ruler: Annotated[Text, option("Two points on a ruler in the plane of the face, in pixels.", "'X,Y X,Y'")] = None,
    ruler_mm: Annotated[Number, number_option("Their distance on the ruler.")] = None,
    ends: Annotated[
        tuple[str, str] | None,
        option("The crack's two ends in pixels; the nozzle starts at the first.", "X,Y X,Y"),
    ] = None,
    crack: Annotated[
        int | None,
        count_option("Which of the cracks found without --ends, as refused.png numbers them.", 1),
    ] = None,
    via: Annotated[Text, option("Points between the ends that the crack passes, in order.", "'X,Y ...'")] = None,
    roi: Annotated[Text, option("Search only in this box (two corners) or polygon, in pixels.", "'X,Y ...'")] = None,
    mask: Annotated[File, option("The crack painted white on black; nothing is searched for.", "PICTURE")] = None,
    second_photo: Annotated[File, option("From the same camera, lit from the other side.", "PHOTO")] = None,
    width_mm: Annotated[
        Text,
        option("The crack's width by a gauge, in place of the photo's; or a CSV of s_mm,width_mm along it.", "MM|CSV"),
    ] = None,
    path_only: Annotated[
        bool, flag("--path-only", "Only the nozzle path, no walls and no solid; needs no depth.")
    ] = False,
    edge_fraction: Annotated[
        Number, number_option("Share of the contrast that marks a wall; default 0.5, 0.7 for lit walls.")
    ] = None,
    keep_branches: Annotated[bool, flag("--keep-branches", "Include side cracks in the solid.")] = False,
    tilt: Annotated[
        Literal["lean", "flare", "funnel", "undercut", "vertical"] | None, option("Tilt of the walls; default: lean.")
    ] = None,
    wall_angle_deg: Annotated[
        Text, option("Each wall's angle from vertical, or left and right; default: 11.", "DEG|L,R")
    ] = None,
    volume_ml: VolumeMl = None,
    jobs: Annotated[int, count_option("Photos digitised at the same time.", 1, 64)] = 1,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Turn a photo into a watertight crack mesh and a nozzle path.

    Examples: sealtwin digitise photo.png --depth-mm 16 --mm-per-px 0.1 --ends 12,340 905,377 --out crack

    sealtwin digitise photos/*.jpg --depth-mm 16 --face-mm 160x40 --out photos-digitised
    """
    with answering("cpu", as_json, quiet) as command:
        from sealtwin.core.mesh_file import READERS

        tables = {
            "photo": {
                "data": data,
                "mm_per_px": mm_per_px,
                "scale_is": "assumed" if assumed else None,
                "markers": board(markers),
                "face_mm": None if face_mm is None else two_numbers(face_mm, "x", "--face-mm"),
                "face_corners_px": points(face_corners, "--face-corners"),
                "ruler_px": points(ruler, "--ruler"),
                "ruler_mm": ruler_mm,
                "ends_px": None if ends is None else [two_numbers(end, ",", "--ends") for end in ends],
                "crack": crack,
                "via_px": points(via, "--via"),
                "roi_px": points(roi, "--roi"),
                # From here; a trial file's are looked for from its own folder.
                "mask": mask and mask.absolute(),
                "second_photo": second_photo and second_photo.absolute(),
                "width_mm": None if width_mm is None else along(width_mm, "--width-mm", "width_mm"),
                "path_only": path_only or None,
                "edge_fraction": edge_fraction,
                "branches": "keep" if keep_branches else None,
            },
            "crack": {
                "depth_mm": None if depth_mm is None else along(depth_mm, "--depth-mm", "depth_mm"),
                "tilt": tilt,
                "wall_angle_deg": one_or_two(wall_angle_deg, "--wall-angle-deg"),
            },
            "path": {"volume_ml": volume_ml},
        }
        if path_only:
            del tables["crack"]
        if meshes := [target for target in targets if target.suffix.lower() in READERS]:
            raise typer.BadParameter(f"{meshes[0]} is a mesh: 'sealtwin import-mesh {meshes[0]}' takes it")
        given = [name for settings in tables.values() for name, value in settings.items() if value is not None]
        from sealtwin.study.photos import are_several, digitise_many, plan
        from sealtwin.trial.trial_file import sample_trial

        if not are_several(targets):
            trial = None
            if targets[0].suffix.lower() != ".toml":
                if depth_mm is None and not path_only:
                    raise typer.BadParameter(
                        "a photo needs --depth-mm: a photo cannot show how deep a crack is; or --path-only"
                    )
                with options_named():
                    trial = sample_trial("photo", targets[0], tables)
            elif given:
                raise typer.BadParameter("options for a photo beside a trial file: put them into the trial file")
            run_trial(command, targets[0], out, ("digitise",), trial=trial)
            return
        of_one = {"ends_px", "crack", "via_px", "roi_px", "mask", "second_photo", "face_corners_px", "ruler_px"} & set(
            given
        )
        if of_one:
            named = ", ".join(sorted(in_options(f"photo.{name}") for name in of_one))
            raise typer.BadParameter(
                f"{named} for several photos: put it into a trial file beside the photo that it is of, with the "
                "photo's name and .toml; 'sealtwin trace' writes one"
            )
        if out is None:
            raise typer.BadParameter("several photos need --out, a folder for all of them")
        from sealtwin.cli.folder_answer import batch_answer

        command.reply(batch_answer(digitise_many(plan(targets, tables), out, command.progress(), jobs=jobs)))


def points(text: str | None, option: str) -> list[tuple[float, float]] | None:
    """``"x,y x,y"`` in pixels. Raises typer.BadParameter, naming the option."""
    return None if text is None else [two_numbers(pair, ",", option) for pair in text.split()]


def two_numbers(text: str, separator: str, option: str) -> tuple[float, float]:
    """Raises typer.BadParameter, naming the option."""
    try:
        first, second = (read_number(part, comma=separator != ",") for part in text.split(separator))
    except ValueError:
        raise typer.BadParameter(f"{option} {text}: expected two numbers, as in 12{separator}340") from None
    return first, second


def one_or_two(text: str | None, option: str) -> float | tuple[float, float] | None:
    """``"11"``, or ``"11,8"`` for left and right. Raises typer.BadParameter, naming the option."""
    if text is None:
        return None
    if "," in text:
        return two_numbers(text, ",", option)
    return _number(text, option, "a number with a decimal point, or two with a comma between")


def along(text: str, option: str, column: str) -> float | list[list[float]]:
    """A number, or the rows of a CSV with the columns s_mm and ``column``.

    Raises typer.BadParameter where it is neither, InputError where the file cannot be used.
    """
    path = Path(text)
    if path.suffix.lower() not in {".csv", ".txt"}:
        return _number(text, option, f"millimetres, or a CSV with the columns s_mm and {column}")
    from pydantic import create_model

    from digitise.settings import MOST_STATIONS, Depth, Station, Width
    from sealtwin.core.settings import Settings, checked
    from validate.readings.samples import named_cells, read_table
    from validate.readings.text_table import number

    values: dict[str, Any] = {"s_mm": (Station, ...), column: ({"depth_mm": Depth, "width_mm": Width}[column], ...)}
    bounds = create_model("Row", __base__=Settings, **values)
    table = read_table(path, f"{option} takes a number, or a CSV with the columns s_mm and {column}")
    # Between commas a decimal comma may as well set thousands apart.
    mark = "point" if table.separator == "," else None
    rows = []
    for place, cells in named_cells(table, ("s_mm", column)):
        row = [value for text in cells.values() if (value := number(text, mark)) is not None]
        if len(row) < len(cells):
            raise InputError(f"{place}: {list(cells.values())!r:.80}; s_mm and {column} must both be numbers, in mm.")
        checked(bounds, path, dict(zip(cells, row, strict=True)), lambda _, place=place: str(place))
        if rows and row[0] <= rows[-1][0]:
            raise InputError(f"{place}: s_mm = {row[0]:g} after {rows[-1][0]:g}; list the rows by increasing s_mm.")
        rows.append(row)
    if not rows:
        raise InputError(f"{path}: no rows below its header; give s_mm and {column} in each, in mm.")
    if len(rows) > MOST_STATIONS:
        raise InputError(f"{path}: {len(rows)} rows below its header; at most {MOST_STATIONS} are read.")
    return rows


def board(path: Path | None) -> dict[str, Any] | None:
    """The [photo.markers] of a TOML file, as 'sealtwin markers' writes it. Raises InputError where it has none."""
    if path is None:
        return None
    from digitise.settings import MarkerBoard
    from sealtwin.core.settings import Settings, read_settings

    class PhotoOptions(Settings):
        markers: MarkerBoard

    class MarkerFile(Settings):
        photo: PhotoOptions

    read = read_settings(MarkerFile, path, name="file of markers", starter="'sealtwin markers' writes one")
    return read.photo.markers.model_dump(mode="json")


def _number(text: str, option: str, expected: str) -> float:
    try:
        return read_number(text)
    except ValueError as fault:
        raise typer.BadParameter(f"{option} {text}: expected {expected}; {fault}") from None
