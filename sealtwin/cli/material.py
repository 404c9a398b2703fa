"""Command that measures a paste: by its spread or a bead of it in a photo, or by a rheometer's table."""

from datetime import date as day
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from sealtwin.cli.answer import Answer, Command, Number, Text, answers, argument, option
from sealtwin.cli.numbers import number_option, read_number
from sealtwin.cli.settings_options import Given, two_numbers
from sealtwin.core.errors import InputError

if TYPE_CHECKING:
    from digitise.settings import PhotoInput

CONE = "38x19x57 for Kantro's mini-cone"


@answers("markers", "face_mm")
def material(
    command: Command,
    method: Annotated[Literal["spread", "bead", "rheometer"], argument("spread|bead|rheometer")],
    source: Annotated[
        Path, argument("PHOTO|CSV", "Photo of the paste on the plate, or a table of shear_rate_per_s,stress_pa.")
    ],
    density_kg_m3: Annotated[float, number_option("Density of the paste, as of a weighed syringe.", 100, 20_000)],
    data: Annotated[Literal["measured", "reconstructed", "synthetic"], option("Origin of the photo or table.")],
    settings: Given,
    out: Annotated[Path, option("The file to write, for fluid.material of a trial.", "FILE")] = Path("material.toml"),
    cone_mm: Annotated[
        Text, option(f"The cone's inner diameters below and above, and its height: {CONE}.", "AxBxH")
    ] = None,
    mass_g: Annotated[
        Number, number_option("Mass of the paste on the plate; default: the full cone's.", 0.001, 100_000)
    ] = None,
    mass_error_g: Annotated[
        Number, number_option("Its standard uncertainty; default: 0.1, of a bead 0.03.", 1e-6, 10_000)
    ] = None,
    density_error_kg_m3: Annotated[
        Number, number_option("Standard uncertainty of the density; default: 1 % of it.", 1e-6, 20_000)
    ] = None,
    edge_n_m: Annotated[
        Number, number_option("Surface tension's weight lambda; default: 0.005 N/m of cement paste.", 0, 0.1)
    ] = None,
    edge_error_n_m: Annotated[Number, number_option("Its standard uncertainty; default: 0.0015 N/m.", 0, 0.1)] = None,
    early: Annotated[
        list[str] | None,
        option(
            "A photo while the paste still spread, and its time after the cone was lifted, for the viscosity; may be "
            "repeated, needs --cone-mm.",
            "PHOTO@SECONDS",
        ),
    ] = None,
    asked_mm3_s: Annotated[Number, number_option("Flow that the program of a bead asked for.", 1e-3, 1e6)] = None,
    speed_mm_s: Annotated[Number, number_option("Speed of the nozzle that laid it.", 0.01, 5000)] = None,
    start_mm: Annotated[
        Text,
        option("Where that nozzle began, from the opening's lower left corner: shows the pump's delay.", "X,Y"),
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
    when = day_of(date)
    of_spread = {"--cone-mm": cone_mm, "--early": early}
    of_bead = {"--asked-mm3-s": asked_mm3_s, "--speed-mm-s": speed_mm_s, "--start-mm": start_mm}
    of_photo = {**settings, "--mass-g": mass_g, "--mass-error-g": mass_error_g}
    of_photo |= {"--edge-n-m": edge_n_m, "--edge-error-n-m": edge_error_n_m}
    others = {"spread": of_bead, "bead": of_spread, "rheometer": {**of_photo, **of_spread, **of_bead}}[method]
    if wrong := [name for name, value in others.items() if value is not None]:
        raise typer.BadParameter(f"{wrong[0]} is no option of {method}")
    known: dict[str, Any] = {
        "density_kg_m3": density_kg_m3,
        "density_error_kg_m3": density_error_kg_m3,
        "mass_g": mass_g,
        "mass_error_g": mass_error_g,
        "edge_n_m": edge_n_m,
        "edge_error_n_m": edge_error_n_m,
    }
    if method == "rheometer":
        from sealtwin.material.by_rheometer import material_of_table

        found = material_of_table(source, density_kg_m3, density_error_kg_m3, data, when)
        facts, extra = {}, []
    else:
        if not {"photo.markers", "photo.face_mm"} <= settings.keys():
            raise typer.BadParameter(f"a {method} needs --markers TOML and --face-mm WxH of the frame in the photo")
        if "photo.data" in settings:
            raise typer.BadParameter("--set photo.data beside --data: give one")
        seen = {**settings, "photo.data": data}
        if method == "spread":
            known["cone_mm"] = None if cone_mm is None else _three(cone_mm)
            photos = [_photo_and_time(text) for text in early or ()]
            found, facts, extra = _spread(source, seen, known, photos, when, command.say)
        else:
            if mass_g is None or asked_mm3_s is None or speed_mm_s is None:
                raise typer.BadParameter("a bead needs --mass-g, --asked-mm3-s and --speed-mm-s")
            known |= {"asked_mm3_s": asked_mm3_s, "speed_mm_s": speed_mm_s}
            known["start_mm"] = None if start_mm is None else two_numbers(start_mm, ",", "--start-mm")
            found, facts, extra = _bead(source, seen, known, when, command.say)
    from sealtwin.core.files import write_unless_other
    from sealtwin.material.paste import material_text

    write_unless_other({out: material_text(found).encode()})
    low, high = found.yield_stress_95_pa
    lines = [f"Yield stress {found.yield_stress_pa:.3g} Pa, 95 % {low:.3g} to {high:.3g} Pa ({found.method})."]
    if found.viscosity_pa_s is not None:
        doubt = f"standard uncertainty {found.viscosity_error_percent:.0f} %"
        lines.append(f"Viscosity {found.viscosity_pa_s:.3g} Pa s, {doubt}.")
    lines += [f"{text[0].upper()}{text[1:]}." for text in found.basis] + extra
    lines.append(f'{out}: in a trial, [fluid] material = "{out.name}".')
    command.reply(Answer({"version": 1, "file": out.as_posix(), **found.model_dump(mode="json"), **facts}, lines))


Found = tuple[Any, dict[str, Any], list[str]]
"""The material, what JSON says beside it, and further lines."""


def _spread(
    photo: Path,
    seen: dict[str, Any],
    known: dict[str, Any],
    early: list[tuple[Path, float]],
    when: day,
    say: Any,
) -> Found:
    from sealtwin.core.settings import checked
    from sealtwin.material.by_spread import Heap, material_of

    heap = checked(Heap, photo, {key: value for key, value in known.items() if value is not None})
    found, estimate, spread = material_of(_photo_input(photo, seen), Path(), heap, early, when, say)
    facts = {
        "spread_mm": 2 * spread.radius_mm,
        "spread_error_mm": 2 * spread.radius_error_mm,
        "unround": spread.unround,
        "height_to_radius": estimate.height_to_radius,
        "flat_formula_pa": estimate.flat_pa,
        "replayed": estimate.replayed,
        "parts_pa": estimate.parts,
    }
    return found, facts, []


def _bead(photo: Path, seen: dict[str, Any], known: dict[str, Any], when: day, say: Any) -> Found:
    from sealtwin.core.settings import checked
    from sealtwin.material.by_bead import LaidBead, material_of_bead

    laid = checked(LaidBead, photo, {key: value for key, value in known.items() if value is not None})
    found, estimate, bead = material_of_bead(_photo_input(photo, seen), Path(), laid, when)
    for warning in bead.warnings:
        say(f"note: {warning}")
    row, flow, delay = estimate.pump_row(laid), estimate.flow_mm3_s, estimate.delay_s
    low, high = (end / laid.asked_mm3_s for end in flow.interval)
    lines = [
        f"The pump gave {flow.value:.4g} mm³/s of {laid.asked_mm3_s:g} asked for, {flow.value / laid.asked_mm3_s:.3f} "
        f"of it, 95 % {low:.3f} to {high:.3f}."
    ]
    if delay is not None:
        lines.append(f"It began {delay.value:.2f} s late, 95 % {delay.interval[0]:.2f} to {delay.interval[1]:.2f} s.")
    lines.append(f"A row for pump.csv ({','.join(row)}): {','.join(f'{value:g}' for value in row.values())}")
    facts = {
        "bead_length_mm": bead.length_mm,
        "bead_width_mm": bead.width_mm,
        "section_mm2": estimate.section_mm2,
        "stiffness": estimate.stiffness,
        "parts_pa": estimate.parts_pa,
        "flow_mm3_s": flow.value,
        "flow_95_mm3_s": list(flow.interval),
        "delay_s": None if delay is None else delay.value,
        "delay_95_s": None if delay is None else list(delay.interval),
        "pump_row": row,
    }
    return found, facts, lines


def _photo_input(photo: Path, settings: dict[str, Any]) -> "PhotoInput":
    """Return the settings of the photo, which are checked as those of a trial are. Raises InputError."""
    from sealtwin.trial.trial_file import sample_trial

    if others := [name for name in settings if not name.startswith("photo.")]:
        raise InputError(f"--set {others[0]}: a photo of a paste has settings of [photo] only.")
    trial = sample_trial("photo", photo, {"photo.path_only": True, **settings})
    assert trial.photo is not None, "a trial of a photo"
    return trial.photo.model_copy(update={"file": photo.resolve(), "path_only": None})


def _photo_and_time(text: str) -> tuple[Path, float]:
    name, _, time = text.rpartition("@")
    try:
        seconds = read_number(time)
    except ValueError as fault:
        raise typer.BadParameter(f"--early {text}: {fault}; as photo.jpg@1.5") from None
    if not name or not 0.05 <= seconds <= 3600:
        raise typer.BadParameter(f"--early {text}: give a photo and 0.05 to 3600 seconds, as photo.jpg@1.5")
    return Path(name).resolve(), seconds


def _three(text: str) -> list[float]:
    try:
        sizes = [read_number(part, comma=False) for part in text.split("x")]
    except ValueError:
        sizes = []
    if len(sizes) != 3:
        raise typer.BadParameter(f"--cone-mm {text}: expected three sizes in mm with x between, {CONE}")
    if not all(0.5 <= size <= 1000 for size in sizes):
        raise typer.BadParameter(f"--cone-mm {text}: each size must be 0.5 to 1000 mm")
    if sizes[1] > sizes[0]:
        raise typer.BadParameter(
            f"--cone-mm {text}: the paste stands on the cone's larger end, so that {sizes[1]:g} comes before "
            f"{sizes[0]:g}: inner diameter below, inner diameter above, height, {CONE}"
        )
    return sizes


def day_of(text: str | None) -> day:
    if text is None:
        return day.today()
    try:
        return day.fromisoformat(text)
    except ValueError:
        raise InputError(f"--date {text:.40}: expected a day, as 2026-11-21.") from None
