"""The stages as commands: a whole trial, or one stage of it."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sealtwin.answering import Device, Json, Out, Quiet, RunFolderPath, TrialFile, answering

if TYPE_CHECKING:
    from sealtwin.trials.job import StageName

ALL_STAGES: "tuple[StageName, ...]" = ("digitise", "simulate", "validate")

DemoOut = Annotated[
    Path | None, typer.Option("--out", metavar="DIR", help="Gets trial/ and run/; default: reports/demo.")
]


FramesEveryS = Annotated[
    float | None,
    typer.Option(
        "--frames-every-s",
        metavar="S",
        help="Write the fluid to RUN/frames every S simulated seconds, for ParaView (fill.pvd) and 'sealtwin film'; "
        "in place of frames_every_s in the trial's table output.",
    ),
]

Threads = Annotated[
    int,
    typer.Option(
        "--threads",
        min=1,
        max=64,
        help="Threads of a CPU that share the fluid run, for runs of many particles; the result is the same.",
    ),
]


def demo(out: DemoOut = None, device: Device = "auto", as_json: Json = False, quiet: Quiet = False) -> None:
    """Run the paper's trial, reconstructed: write its photo, readings and trial, then run all stages."""
    with answering(device, as_json, quiet) as command:
        from sealtwin.trials.reconstruction import place_paper_trial

        folder = out or Path("reports", "demo")
        place_paper_trial(folder / "trial")
        command.say(f"The trial that runs: {folder / 'trial' / 'trial.toml'}")
        command.run(folder / "trial" / "trial.toml", folder / "run", ALL_STAGES)


def run(
    trial: TrialFile,
    out: Out = None,
    frames_every_s: FramesEveryS = None,
    threads: Threads = 1,
    device: Device = "auto",
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Bring a whole trial up to date: digitise, simulate, validate, report.

    While the fluid runs, RUN/progress.json says how far it is and health.csv how well it does; a checkpoint every ten
    seconds lets the same command go on after a kill. The trial's table output asks for snapshots and frames.
    """
    with answering(device, as_json, quiet) as command:
        command.run(trial, out, ALL_STAGES, frames_every_s=frames_every_s, threads=threads)


def simulate(
    folder: RunFolderPath,
    frames_every_s: FramesEveryS = None,
    threads: Threads = 1,
    device: Device = "auto",
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Inject the sealant into a digitised run folder; its settings are those of RUN/trial.toml."""
    with answering(device, as_json, quiet) as command:
        command.resume(folder, ("simulate",), frames_every_s=frames_every_s, threads=threads)


def validate(
    folder: RunFolderPath,
    uncertainty: Annotated[
        bool,
        typer.Option(
            "--uncertainty",
            help="First run the fluid with finer and with coarser particles, and with the inputs of the trial's table "
            "uncertainty moved by what it declares; once, into RUN/uncertainty. Takes 5 to 10 times as long as RUN.",
        ),
    ] = False,
    device: Device = "auto",
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Hold a simulated run folder against its readings and write the report."""
    with answering(device, as_json, quiet) as command:
        command.resume(folder, ("validate",), uncertainty=uncertainty)
