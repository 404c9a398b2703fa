"""Command from a photo to a report, without a trial file to write first."""

from pathlib import Path
from shlex import quote
from typing import Annotated

from sealtwin.cli.answer import Device, File, Json, Number, Quiet, Text, answering, argument, flag, option
from sealtwin.cli.numbers import number_option
from sealtwin.cli.option_names import options_named
from sealtwin.cli.samples import along, board, two_numbers
from sealtwin.cli.trial_answer import run_trial
from sealtwin.cli.trials import ALL_STAGES


def quick(
    photo: Annotated[Path, argument("PHOTO", "A photo of the crack from above.")],
    depth_mm: Annotated[str, option("Measured depth, or a CSV of s_mm,depth_mm along the crack.", "MM|CSV")],
    mm_per_px: Annotated[Number, number_option("Scale.")] = None,
    assumed: Annotated[bool, flag("--assumed", "Mark that scale as assumed in every output.")] = False,
    markers: Annotated[File, option("Markers in the photo, as 'sealtwin markers' writes them.", "TOML")] = None,
    face_mm: Annotated[Text, option("Size of the sample's face; without markers it gives the scale.", "WxH")] = None,
    ends: Annotated[
        tuple[str, str] | None,
        option("The crack's two ends in pixels; the nozzle starts at the first.", "X,Y X,Y"),
    ] = None,
    caliper: Annotated[File, option("Readings taken after sealing, CSV or XLSX.", "SHEET")] = None,
    out: Annotated[File, option("Folder for trial.toml and run/; default: reports/<photo name>-quick.", "DIR")] = None,
    device: Device = "auto",
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Go from a photo and a depth to mesh, path, fluid run and report, by the starter's fluid and nozzle.

    Whatever was not given is assumed: it is said, marked in DIR/trial.toml and named in the report. Correct it there;
    'sealtwin run' goes on.

    Example: sealtwin quick photo.jpg --depth-mm 16 --mm-per-px 0.1 --ends 12,340 905,377 --caliper caliper.csv
    """
    with answering(device, as_json, quiet) as command:
        from sealtwin.trial.quick_trial import quick_trial, write_quick_trial

        given = {
            "photo": {
                "mm_per_px": mm_per_px,
                "scale_is": "assumed" if assumed else None,
                "markers": board(markers),
                "face_mm": None if face_mm is None else list(two_numbers(face_mm, "x", "--face-mm")),
                "ends_px": None if ends is None else [list(two_numbers(end, ",", "--ends")) for end in ends],
            },
            "crack": {"depth_mm": along(depth_mm, "--depth-mm", "depth_mm")},
        }
        folder = out or Path("reports", f"{photo.stem}-quick")
        trial = folder / "trial.toml"
        with options_named():
            text, told = quick_trial(photo, folder, given, caliper)
        write_quick_trial(trial, text)
        run = folder / "run"
        command.warn(f"Assumed, since not given: {', '.join(told)}.")
        command.say(f"Correct it in {trial}, then: sealtwin run {quote(str(trial))} --out {quote(str(run))}")
        run_trial(command, trial, run, ALL_STAGES)
