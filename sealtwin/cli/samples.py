"""Commands that turn a photo, many photos or a mesh into a solid and a nozzle path."""

from pathlib import Path
from typing import Annotated, Any

import typer

from sealtwin.cli.answer import Command, answers
from sealtwin.cli.options import PHOTO, Given, Out, argument, count_option
from sealtwin.cli.trial_answer import run_trial


@answers("units", needs=("units",))
def import_mesh(
    command: Command,
    mesh: Annotated[Path, argument("MESH", "STL, PLY, OBJ, OFF, GLB or 3MF of a cracked block.")],
    settings: Given,
    out: Out = None,
) -> None:
    """Turn your own mesh of a cracked sample into a checked, watertight solid and a nozzle path.

    Example: sealtwin import-mesh scan.stl --units mm --set mesh.up=z --out scan
    """
    from sealtwin.trial.trial_file import sample_trial

    run_trial(command, mesh, out, ("digitise",), trial=sample_trial("mesh", mesh, settings))


@answers(*PHOTO)
def digitise(
    command: Command,
    targets: Annotated[
        list[Path],
        argument("TRIAL|PHOTO...", "A trial.toml, or a photo with the options below; several, or a folder."),
    ],
    settings: Given,
    out: Out = None,
    jobs: Annotated[int, count_option("Photos digitised at the same time.", 1, 64)] = 1,
) -> None:
    """Turn a photo into a watertight crack mesh and a nozzle path.

    Examples: sealtwin digitise photo.png --depth-mm 16 --mm-per-px 0.1 --ends 12,340 905,377 --out crack

    sealtwin digitise photos/*.jpg --depth-mm 16 --face-mm 160x40 --out photos-digitised
    """
    from sealtwin.core.mesh_file import READERS

    if meshes := [target for target in targets if target.suffix.lower() in READERS]:
        raise typer.BadParameter(f"{meshes[0]} is a mesh: 'sealtwin import-mesh {meshes[0]}' takes it")
    from sealtwin.study.photos import are_several, digitise_many, plan
    from sealtwin.trial.trial_file import sample_trial

    if not are_several(targets):
        photo = targets[0]
        if photo.suffix.lower() == ".toml":
            run_trial(command, photo, out, ("digitise",), settings)
            return
        require_depth(settings)
        run_trial(command, photo, out, ("digitise",), trial=sample_trial("photo", photo, settings))
        return
    if of_one := sorted(filter(_is_of_one_photo, settings)):
        raise typer.BadParameter(
            f"{', '.join(of_one)} for several photos: put it into a trial file beside the photo that it is of, "
            "with the photo's name and .toml; 'sealtwin trace' writes one"
        )
    if out is None:
        raise typer.BadParameter("several photos need --out, a folder for all of them")
    from sealtwin.cli.folder_answer import batch_answer

    command.reply(batch_answer(digitise_many(plan(targets, settings), out, command.progress(), jobs=jobs)))


def require_depth(given: dict[str, Any]) -> None:
    """Raise typer.BadParameter unless the settings of a photo have a depth or ask for a path alone."""
    if "crack.depth_mm" not in given and not given.get("photo.path_only"):
        raise typer.BadParameter(
            "a photo needs --depth-mm: a photo cannot show how deep a crack is; or --set photo.path_only=true"
        )


def _is_of_one_photo(name: str) -> bool:
    """Return True for places and pictures: those of another photo are other ones."""
    from sealtwin.core.settings import names_file
    from sealtwin.trial.trial_file import Trial

    table, _, key = name.partition(".")
    return (
        table == "photo" and (key.endswith("_px") or key == "crack" or names_file(Trial, name)) and key != "mm_per_px"
    )
