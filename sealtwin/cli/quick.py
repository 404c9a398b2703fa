"""Command from a photo to a report, without a trial file to write first."""

from pathlib import Path
from shlex import quote
from typing import Annotated

from sealtwin.cli.answer import Command, answers
from sealtwin.cli.options import FLUID, PHOTO, File, Given, argument, option
from sealtwin.cli.samples import require_depth
from sealtwin.cli.trial_answer import run_trial
from sealtwin.cli.trials import ALL_STAGES


@answers(*PHOTO, *FLUID, device=True)
def quick(
    command: Command,
    photo: Annotated[Path, argument("PHOTO", "A photo of the crack from above.")],
    settings: Given,
    caliper: Annotated[File, option("Readings taken after sealing, CSV or XLSX.", "SHEET")] = None,
    out: Annotated[File, option("Folder for trial.toml and run/; default: reports/<photo name>-quick.", "DIR")] = None,
) -> None:
    """Go from a photo and a depth to mesh, path, fluid run and report, by the starter's fluid and nozzle.

    Whatever was not given is assumed: it is said, marked in DIR/trial.toml and named in the report. Correct it there;
    'sealtwin run' goes on.

    Example: sealtwin quick photo.jpg --depth-mm 16 --mm-per-px 0.1 --ends 12,340 905,377 --caliper caliper.csv
    """
    from sealtwin.trial.quick_trial import quick_trial, write_quick_trial

    require_depth(settings)
    folder = out or Path("reports", f"{photo.stem}-quick")
    trial = folder / "trial.toml"
    text, assumed = quick_trial(photo, folder, settings, caliper)
    write_quick_trial(trial, text)
    run = folder / "run"
    command.warn(f"Assumed, since not given: {', '.join(assumed)}.")
    command.say(f"Correct it in {trial}, then: sealtwin run {quote(str(trial))} --out {quote(str(run))}")
    run_trial(command, trial, run, ALL_STAGES)
