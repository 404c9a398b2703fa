"""Command that measures a paste: from a photo of its spread or of a bead, or from a table."""

from collections.abc import Callable
from datetime import date as day
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from sealtwin.cli.answer import Answer, Command, answers
from sealtwin.cli.options import (
    Given,
    Number,
    Text,
    argument,
    number_option,
    option,
    read_number,
    spelt,
    two_numbers,
)
from sealtwin.core.errors import InputError, present

if TYPE_CHECKING:
    from sealtwin.core.records import DataKind
    from sealtwin.material.paste import MeasuredPaste
    from simulate.material_file import Material

CONE = "38x19x57 for Kantro's mini-cone"
OF_PASTE, OF_PHOTO = ("spread", "bead", "rheometer"), ("spread", "bead")
METHODS = {
    **dict.fromkeys(("density_kg_m3", "density_error_kg_m3"), OF_PASTE),
    **dict.fromkeys(("mass_g", "mass_error_g", "edge_n_m", "edge_error_n_m"), OF_PHOTO),
    "cone_mm": ("spread",),
    **dict.fromkeys(("asked_mm3_s", "speed_mm_s", "start_mm"), ("bead",)),
    **dict.fromkeys(("nozzle_mm", "flow_mm3_s", "width_mm", "shear_rates", "rows"), ("rheometer",)),
}
"""Methods that take each option. Each option of a photo is a field of the method's table."""
OF_POUR = ("nozzle_mm", "flow_mm3_s", "width_mm")


@answers("markers", "face_mm")
def material(
    command: Command,
    method: Annotated[Literal["spread", "bead", "rheometer"], argument("spread|bead|rheometer")],
    source: Annotated[
        Path,
        argument(
            "PHOTO|CSV",
            "Photo of the paste on the plate, or a rheometer's flow curve with the columns shear_rate_per_s,stress_pa.",
        ),
    ],
    data: Annotated[Literal["measured", "reconstructed", "synthetic"], option("Origin of the photo or table.")],
    settings: Given,
    density_kg_m3: Annotated[
        float, number_option("Density of the paste, for example from a weighed syringe.", 100, 20_000)
    ],
    out: Annotated[Path, option("The file to write, for fluid.material of a trial.", "FILE")] = Path("material.toml"),
    cone_mm: Annotated[
        Text, option(f"The cone's inner diameters below and above, and its height: {CONE}.", "AxBxH")
    ] = None,
    mass_g: Annotated[
        Number, number_option("Mass of the paste on the plate; default: the mass of the full cone.", 0.001, 100_000)
    ] = None,
    mass_error_g: Annotated[
        Number,
        number_option("Standard uncertainty of the mass; default: 0.1 g, 0.03 g for a bead.", 1e-6, 10_000),
    ] = None,
    density_error_kg_m3: Annotated[
        Number, number_option("Standard uncertainty of the density; default: 1 % of the density.", 1e-6, 20_000)
    ] = None,
    edge_n_m: Annotated[
        Number, number_option("Coefficient lambda of surface tension; default: 0.005 N/m, for cement paste.", 0, 0.1)
    ] = None,
    edge_error_n_m: Annotated[
        Number, number_option("Standard uncertainty of lambda; default: 0.0015 N/m.", 0, 0.1)
    ] = None,
    asked_mm3_s: Annotated[Number, number_option("Flow in the program that laid the bead.", 1e-3, 1e6)] = None,
    speed_mm_s: Annotated[Number, number_option("Speed of the nozzle that laid the bead.", 0.01, 5000)] = None,
    start_mm: Annotated[
        Text,
        option(
            "Start of the nozzle's path, in mm from the lower left corner of the frame's opening, to measure the "
            "pump's delay.",
            "X,Y",
        ),
    ] = None,
    nozzle_mm: Annotated[
        Number,
        number_option("Inner diameter of the nozzle, for the shear rates; default: 2.4.", 0.01, 100),
    ] = None,
    flow_mm3_s: Annotated[Number, number_option("Flow of the fill; default: 160.", 1e-3, 1e6)] = None,
    width_mm: Annotated[Number, number_option("Width of the crack; default: 3.1.", 0.01, 1000)] = None,
    shear_rates: Annotated[
        Text,
        option(
            "Smallest and largest shear rate in 1/s that the fit uses; default: those of nozzle, flow and crack, 1:100 "
            "for their defaults.",
            "LOW:HIGH",
        ),
    ] = None,
    rows: Annotated[
        Text, option("First and last row that are used, of one sweep among several; row 1 is the header.", "FIRST:LAST")
    ] = None,
    date: Annotated[Text, option("Day of the measurement; default: today.", "YYYY-MM-DD")] = None,
) -> None:
    """Measure a paste, and write material.toml for trials.

    Examples: sealtwin material spread photo.jpg --markers frame.toml --face-mm 150x150 --cone-mm 38x19x57
    --density-kg-m3 1690 --data measured

    sealtwin material bead bead.jpg --markers frame.toml --face-mm 90x60 --mass-g 4.36 --density-kg-m3 1690
    --asked-mm3-s 320 --speed-mm-s 5 --data measured

    sealtwin material rheometer curve.csv --density-kg-m3 1690 --data measured
    """
    given = locals()
    when = day_of(date)
    paste = {name: given[name] for name in METHODS if given[name] is not None}
    others = [spelt(name) for name in paste if method not in METHODS[name]]
    if method not in OF_PHOTO:
        others = [*settings, *others]
    if others:
        raise typer.BadParameter(f"{others[0]} is not an option of {method}")
    if method == "rheometer":
        measured = _of_curve(source, paste, data, when)
    else:
        if "photo.data" in settings:
            raise typer.BadParameter("--set photo.data and --data are both given; give one of them")
        measured = _of_photo(method, source, {**settings, "photo.data": data}, paste, when, command.say)
    from sealtwin.core.files import write_unless_other
    from sealtwin.material.paste import material_text

    identified = measured.material
    write_unless_other({out: material_text(identified).encode()})
    low, high = identified.yield_stress_95_pa
    lines = [
        f"Yield stress {identified.yield_stress_pa:.3g} Pa, 95 % {low:.3g} to {high:.3g} Pa ({identified.method})."
    ]
    if identified.thickness is not None:
        lines.append(_in_words(identified))
    lines += [f"{text[0].upper()}{text[1:]}." for text in identified.basis] + [*measured.sentences]
    lines.append(f'{out}: to use it, write [fluid] material = "{out.name}" in a trial.')
    content = {"version": 1, "file": out.as_posix(), **identified.model_dump(mode="json"), **measured.figures}
    command.reply(Answer(content, lines))


def _in_words(paste: "Material") -> str:
    """Return a sentence on viscosity, or on consistency and flow index."""
    if paste.viscosity_pa_s is not None:
        return f"Viscosity {paste.viscosity_pa_s:.3g} Pa s, standard uncertainty {paste.viscosity_error_percent:.0f} %."
    k_95, n_95 = (
        "not stated" if ends is None else f"95 % {ends[0]:.3g} to {ends[1]:.3g}"
        for ends in (paste.consistency_95_pa_s_n, paste.flow_index_95)
    )
    return f"Consistency K {paste.consistency_pa_s_n:.3g} Pa s^n, {k_95}; flow index n {paste.flow_index:.3g}, {n_95}."


def _of_curve(source: Path, given: dict[str, Any], data: "DataKind", when: day) -> "MeasuredPaste":
    from sealtwin.core.settings import checked
    from sealtwin.material.by_rheometer import Pour, material_of_table
    from sealtwin.material.paste import PasteOnPlate

    of_pour = {key: given.pop(key) for key in OF_POUR if key in given}
    rows = _range(given.pop("rows"), "--rows", "12:32") if "rows" in given else None
    rates = Pour(**of_pour).shear_rates_per_s
    if "shear_rates" in given:
        if of_pour:
            raise typer.BadParameter(f"--shear-rates and {spelt(next(iter(of_pour)))} are both given; give one of them")
        rates = _range(given.pop("shear_rates"), "--shear-rates", "1:100")
    whole = None if rows is None else (int(rows[0]), int(rows[1]))
    return material_of_table(source, checked(PasteOnPlate, source, given), data, when, rates, whole)


def _range(text: str, name: str, example: str) -> tuple[float, float]:
    low, high = two_numbers(text, ":", name)
    if not 0 < low < high:
        raise typer.BadParameter(f"{name} {text}: expected a smaller and a larger number above 0, such as {example}")
    return low, high


def _of_photo(
    method: str, source: Path, settings: Given, paste: dict[str, Any], when: day, say: Callable[[str], None]
) -> "MeasuredPaste":
    from sealtwin.core.settings import checked
    from sealtwin.material.by_bead import LaidBead, material_of_bead
    from sealtwin.material.by_spread import Heap, material_of
    from sealtwin.trial.trial_file import sample_trial

    if not {"photo.markers", "photo.face_mm"} <= settings.keys():
        raise typer.BadParameter(f"a {method} needs --markers TOML and --face-mm WxH of the frame in the photo")
    if others := [name for name in settings if not name.startswith("photo.")]:
        raise InputError(f"--set {others[0]}: for a photo of a paste only settings of [photo] are used.")
    # A trial checks the settings of the photo.
    trial = sample_trial("photo", source, {"photo.path_only": True, **settings})
    photo = present(trial.photo, "photo").model_copy(update={"file": source.resolve(), "path_only": None})
    if method == "spread":
        paste["cone_mm"] = _three(paste["cone_mm"]) if "cone_mm" in paste else None
        return material_of(photo, checked(Heap, source, paste), when, say)
    if not {"mass_g", "asked_mm3_s", "speed_mm_s"} <= paste.keys():
        raise typer.BadParameter("a bead needs --mass-g, --asked-mm3-s and --speed-mm-s")
    paste["start_mm"] = two_numbers(paste["start_mm"], ",", "--start-mm") if "start_mm" in paste else None
    return material_of_bead(photo, checked(LaidBead, source, paste), when, say)


def _three(text: str) -> list[float]:
    try:
        sizes = [read_number(part, comma=False) for part in text.split("x")]
    except ValueError:
        sizes = []
    if len(sizes) != 3:
        raise typer.BadParameter(f"--cone-mm {text}: expected three sizes in mm with x between them, such as {CONE}")
    if not all(0.5 <= size <= 1000 for size in sizes):
        raise typer.BadParameter(f"--cone-mm {text}: each size must be 0.5 to 1000 mm")
    if sizes[1] > sizes[0]:
        raise typer.BadParameter(
            f"--cone-mm {text}: the larger end of the cone is below, so {sizes[1]:g} comes before {sizes[0]:g}. Give "
            f"inner diameter below, inner diameter above and height, such as {CONE}"
        )
    return sizes


def day_of(text: str | None) -> day:
    if text is None:
        return day.today()
    try:
        return day.fromisoformat(text)
    except ValueError:
        raise InputError(f"--date {text:.40}: expected a day such as 2026-11-21.") from None
