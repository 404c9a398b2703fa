"""From a mesh that somebody has modelled or scanned to a sample and a path."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from sealtwin.answering import Json, Out, Quiet, answering


def import_mesh(
    mesh: Annotated[Path, typer.Argument(metavar="MESH", help="STL, PLY, OBJ, OFF, GLB or 3MF of a cracked block.")],
    units: Annotated[
        Literal["mm", "cm", "m", "inch"], typer.Option(help="Of its numbers: most formats do not say, none is guessed.")
    ],
    out: Out = None,
    up: Annotated[
        Literal["z", "y", "x", "-z", "-y", "-x"] | None,
        typer.Option(help="The file's axis that points out of the cracked face; default: z."),
    ] = None,
    path: Annotated[
        Path | None,
        typer.Option(
            metavar="CSV|TXT", help="Centreline as x y in mm a line; left out, it is the middle of the crack's mouth."
        ),
    ] = None,
    data: Annotated[
        Literal["measured", "reconstructed", "synthetic"] | None,
        typer.Option(help="Where the mesh comes from, as every report says; default: measured."),
    ] = None,
    base_mm: Annotated[
        float | None, typer.Option(help="A scan that is open below gets a flat underside this far below its face.")
    ] = None,
    dam_height_mm: Annotated[
        float | None, typer.Option(help="Of the dams where the crack leaves the block, above its face; default: 10.")
    ] = None,
    volume_ml: Annotated[
        float | None, typer.Option(help="Sealant to give; default: what fills the crack to its face.")
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """From your own mesh of a cracked sample to a checked, watertight solid and a nozzle path.

    Example: sealtwin import-mesh scan.stl --units mm --up z --out scan
    """
    with answering("cpu", as_json, quiet) as command:
        from sealtwin.trials.trial import mesh_trial

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
        command.run_checked(mesh_trial(mesh, tables), mesh.parent, out, ("digitise",))
