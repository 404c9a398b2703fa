"""Command that measures a paste: by its spread in a photo, or by a rheometer's table."""

from datetime import date as day
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from sealtwin.cli.answer import Answer, File, Json, Number, Quiet, Text, answering, argument, option
from sealtwin.cli.numbers import number_option, read_number
from sealtwin.cli.option_names import options_named
from sealtwin.cli.samples import board, two_numbers
from sealtwin.core.errors import InputError

CONE = "38x19x57 for Kantro's mini-cone"


def material(
    method: Annotated[Literal["spread", "rheometer"], argument("spread|rheometer")],
    source: Annotated[
        Path, argument("PHOTO|CSV", "Photo of the spread paste, or a table of shear_rate_per_s,stress_pa.")
    ],
    density_kg_m3: Annotated[float, number_option("Density of the paste, as of a weighed syringe.", 100, 20_000)],
    out: Annotated[Path, option("The file to write, for fluid.material of a trial.", "FILE")] = Path("material.toml"),
    markers: Annotated[
        File, option("The printed markers, as 'sealtwin markers --toml' writes them; for spread.", "TOML")
    ] = None,
    face_mm: Annotated[Text, option("Opening of the printed frame; for spread.", "WxH")] = None,
    cone_mm: Annotated[
        Text, option(f"The cone's inner diameters below and above, and its height: {CONE}.", "AxBxH")
    ] = None,
    mass_g: Annotated[Number, number_option("Mass of the paste on the plate; default: the full cone's.", 0.001)] = None,
    mass_error_g: Annotated[Number, number_option("Its standard uncertainty; default: 0.1.", 1e-6)] = None,
    density_error_kg_m3: Annotated[
        Number, number_option("Standard uncertainty of the density; default: 1 % of it.", 1e-6)
    ] = None,
    edge_n_m: Annotated[
        Number, number_option("Surface tension's weight lambda; default: 0.005 N/m of cement paste.", 0, 0.1)
    ] = None,
    edge_error_n_m: Annotated[Number, number_option("Its standard uncertainty; default: 0.0015 N/m.", 0, 0.1)] = None,
    early: Annotated[
        File, option("A photo while the paste still spread, for its viscosity; needs --cone-mm.", "PHOTO")
    ] = None,
    early_s: Annotated[Number, number_option("Time of that photo after the cone was lifted.", 0.05, 3600)] = None,
    date: Annotated[Text, option("Day of the measurement; default: today.", "YYYY-MM-DD")] = None,
    data: Annotated[Literal["measured", "reconstructed", "synthetic"], option("Origin of the photo or table.")] = (
        "measured"
    ),
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Measure a paste, and write material.toml for trials.

    Examples: sealtwin material spread photo.jpg --markers frame.toml --face-mm 150x150 --cone-mm 38x19x57
    --density-kg-m3 1690

    sealtwin material rheometer curve.csv --density-kg-m3 1690
    """
    with answering("cpu", as_json, quiet) as command:
        when = day_of(date)
        if method == "rheometer":
            if not all(value is None for value in (markers, face_mm, cone_mm, mass_g, early, early_s)):
                raise typer.BadParameter("a rheometer's table takes no options but density, date, data and --out")
            from sealtwin.material.by_rheometer import material_of_table

            found, facts = material_of_table(source, density_kg_m3, density_error_kg_m3, data, when), {}
        else:
            if markers is None or face_mm is None:
                raise typer.BadParameter("a spread needs --markers TOML and --face-mm WxH of the frame in the photo")
            if (early is None) != (early_s is None):
                raise typer.BadParameter("--early and --early-s go together: a photo, and when it was taken")
            found, facts = _spread(
                source,
                {"markers": board(markers), "face_mm": two_numbers(face_mm, "x", "--face-mm"), "data": data},
                {
                    "density_kg_m3": density_kg_m3,
                    "density_error_kg_m3": density_error_kg_m3,
                    "mass_g": mass_g,
                    "mass_error_g": mass_error_g,
                    "cone_mm": None if cone_mm is None else _three(cone_mm),
                    "edge_n_m": edge_n_m,
                    "edge_error_n_m": edge_error_n_m,
                },
                None if early is None or early_s is None else (early, early_s),
                when,
                command.say,
            )
        from sealtwin.core.files import write_unless_other
        from sealtwin.material.material_text import material_text

        write_unless_other({out: material_text(found).encode()})
        low, high = found.yield_stress_95_pa
        lines = [f"Yield stress {found.yield_stress_pa:.3g} Pa, 95 % {low:.3g} to {high:.3g} Pa ({found.method})."]
        if found.viscosity_pa_s is not None:
            doubt = f"standard uncertainty {found.viscosity_error_percent:.0f} %"
            lines.append(f"Viscosity {found.viscosity_pa_s:.3g} Pa s, {doubt}.")
        lines += [f"{text[0].upper()}{text[1:]}." for text in found.basis]
        lines.append(f'{out}: in a trial, [fluid] material = "{out.name}".')
        command.reply(Answer({"version": 1, "file": out.as_posix(), **found.model_dump(mode="json"), **facts}, lines))


def _spread(
    photo: Path,
    seen: dict[str, Any],
    known: dict[str, Any],
    early: tuple[Path, float] | None,
    when: day,
    say: Any,
) -> tuple[Any, dict[str, Any]]:
    from digitise.settings import PhotoInput
    from sealtwin.core.settings import checked
    from sealtwin.material.by_spread import Heap, material_of

    heap = checked(Heap, photo, {key: value for key, value in known.items() if value is not None})
    with options_named():
        # Made as a trial's would be, so that its faults are the same.
        settings = checked(PhotoInput, photo, {"file": photo.resolve(), **seen})
        early_at = None if early is None else (early[0].resolve(), early[1])
        found, estimate, spread = material_of(settings, Path(), heap, early_at, when, say)
    facts = {
        "spread_mm": 2 * spread.radius_mm,
        "spread_error_mm": 2 * spread.radius_error_mm,
        "unround": spread.unround,
        "height_to_radius": estimate.height_to_radius,
        "flat_formula_pa": estimate.flat_pa,
        "replayed": estimate.replayed,
        "parts_pa": estimate.parts,
    }
    return found, facts


def _three(text: str) -> list[float]:
    try:
        sizes = [read_number(part, comma=False) for part in text.split("x")]
    except ValueError as fault:
        raise typer.BadParameter(f"--cone-mm {text}: {fault}") from None
    if len(sizes) != 3 or not all(0.5 <= size <= 1000 for size in sizes) or sizes[1] > sizes[0]:
        raise typer.BadParameter(f"--cone-mm {text}: give three sizes in mm, the larger end first, {CONE}")
    return sizes


def day_of(text: str | None) -> day:
    if text is None:
        return day.today()
    try:
        return day.fromisoformat(text)
    except ValueError:
        raise InputError(f"--date {text:.40}: expected a day, as 2026-11-21.") from None
