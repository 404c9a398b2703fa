"""Commands that measure a paste and write material.toml, one for each method."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sealtwin.cli.answer import CheckedCommand, Command, Commands, answers
from sealtwin.cli.options import Given, argument, option
from sealtwin.core.errors import InputError, present

if TYPE_CHECKING:
    from digitise.settings import PhotoInput
    from sealtwin.material import MeasuredPaste, PasteSettings
    from sealtwin.material.by_rheometer import FlowCurve
    from sealtwin.material.by_spread import Heap
    from simulate.material_file import Material

FRAME = ("photo.markers", "photo.face_mm")
PastePhoto = Annotated[Path, argument("PHOTO", "Photo of the paste on a plate, inside a frame of markers.")]
MaterialFile = Annotated[Path, option("Material file to write. A trial uses it with fluid.material.", "FILE")]
MATERIAL = Path("material.toml")


@answers(*FRAME, needs=FRAME, options="sealtwin.material.by_spread:Heap")
def spread(command: Command, photo: PastePhoto, options: "Heap", settings: Given, out: MaterialFile = MATERIAL) -> None:
    """Measure the yield stress of a paste from its spread on a plate.

    Example: sealtwin material spread photo.jpg --markers frame.toml --face-mm 150x150 --cone-mm 38x19x57
    --density-kg-m3 1690 --data measured
    """
    from sealtwin.material.by_spread import material_of

    _reply(command, out, material_of(_photo(photo, options, settings), options, command.warn))


@answers(options="sealtwin.material.by_rheometer:FlowCurve")
def rheometer(
    command: Command,
    curve: Annotated[Path, argument("CSV", "Flow curve with the columns shear_rate_per_s,stress_pa.")],
    options: "FlowCurve",
    out: MaterialFile = MATERIAL,
) -> None:
    """Fit a paste's yield stress, and its viscosity or consistency and flow index, to a rheometer's flow curve.

    Example: sealtwin material rheometer curve.csv --density-kg-m3 1690 --data measured
    """
    from sealtwin.material.by_rheometer import material_of_table

    _reply(command, out, material_of_table(curve, options))


methods = typer.Typer(
    name="material", cls=Commands, help="Measure a paste, and write material.toml for trials.", no_args_is_help=True
)
for method in (spread, rheometer):
    methods.command(cls=CheckedCommand)(method)


def _photo(file: Path, paste: "PasteSettings", settings: Given) -> "PhotoInput":
    """Return the photo settings for a photo of a paste, checked as in a trial."""
    from sealtwin.trial.starter_files import begin_trial

    if others := [name for name in settings if not name.startswith("photo.") or name == "photo.data"]:
        raise InputError(
            f"--set {others[0]}: only settings of the table photo are allowed here; give photo.data with --data."
        )
    trial = begin_trial(file, {"photo.path_only": True, **settings, "photo.data": paste.data})
    return present(trial.photo, "photo").model_copy(update={"file": file.resolve(), "path_only": None})


def _reply(command: Command, out: Path, measured: "MeasuredPaste") -> None:
    """Write the material file of a measured paste, and print the result."""
    from sealtwin.core.files import write_unless_other
    from sealtwin.material import material_text

    paste = measured.material
    write_unless_other({out: material_text(paste).encode()})
    low, high = paste.yield_stress_95_pa
    lines = [
        f"Yield stress {paste.yield_stress_pa:.3g} Pa, 95 % {low:.3g} to {high:.3g} Pa ({paste.method}).",
        *([] if paste.thickness is None else [_in_words(paste)]),
        *(f"{text[0].upper()}{text[1:]}." for text in paste.basis),
        *paste.doubts,
        f'{out}: to use this file, write material = "{out.name}" in the table [fluid] of a trial.',
    ]
    content = {"file": out.as_posix(), **paste.model_dump(mode="json"), **measured.figures}
    command.reply(content, lines)


def _in_words(paste: "Material") -> str:
    """Return a sentence about the viscosity, or about the consistency and the flow index."""
    if paste.viscosity_pa_s is not None:
        return f"Viscosity {paste.viscosity_pa_s:.3g} Pa s, standard uncertainty {paste.viscosity_error_percent:.0f} %."
    k_95, n_95 = (
        "not stated" if ends is None else f"95 % {ends[0]:.3g} to {ends[1]:.3g}"
        for ends in (paste.consistency_95_pa_s_n, paste.flow_index_95)
    )
    return f"Consistency K {paste.consistency_pa_s_n:.3g} Pa s^n, {k_95}; flow index n {paste.flow_index:.3g}, {n_95}."
