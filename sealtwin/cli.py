"""The command line: parse, call, print. Results go to stdout, narration to stderr."""

import json
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, NoReturn, TextIO

import typer

from sealtwin.errors import SealtwinError

if TYPE_CHECKING:
    from sealtwin.job import Job, StageName
    from sealtwin.progress import Progress
    from sealtwin.trial import Trial

ALL_STAGES: "tuple[StageName, ...]" = ("digitise", "simulate", "validate")
BAD_INPUT = 3
GATE_FAILED = 5
INTERRUPTED = 130

app = typer.Typer(
    name="sealtwin",
    help="From a photo of a cracked pavement sample and a measured depth to a validated digital twin of its sealing.",
    epilog=(
        "Exit codes: 0 ok, 1 a bug of ours, 2 usage, 3 bad input, 4 numerical failure, "
        "5 the trial's gate failed (the report is complete), 130 interrupted."
    ),
    no_args_is_help=True,
    add_completion=False,
    # Locals would put the user's paths and data into a bug report.
    pretty_exceptions_enable=False,
)

Out = Annotated[
    Path | None,
    typer.Option("--out", metavar="DIR", help="Run folder; default: reports/<trial name> under the current folder."),
]
Device = Annotated[
    str,
    typer.Option(
        "--device", metavar="auto|cpu|cuda:0", help="Where the fluid runs; a named device that is absent is an error."
    ),
]
Json = Annotated[bool, typer.Option("--json", help="One JSON object on stdout, everything else on stderr.")]
Quiet = Annotated[bool, typer.Option("--quiet", help="No narration and no progress.")]
TrialFile = Annotated[Path, typer.Argument(metavar="TRIAL", help="A trial.toml; 'sealtwin init DIR' writes one.")]
RunFolderPath = Annotated[Path, typer.Argument(metavar="RUN", help="A run folder.")]


DemoOut = Annotated[
    Path | None, typer.Option("--out", metavar="DIR", help="Gets trial/ and run/; default: reports/demo.")
]


@app.callback(invoke_without_command=True)
def common(
    version: Annotated[bool, typer.Option("--version", help="Show the version and exit.")] = False,
) -> None:
    if version:
        from importlib.metadata import version as installed

        print(installed("sealtwin"))
        raise typer.Exit


@app.command()
def demo(out: DemoOut = None, device: Device = "auto", as_json: Json = False, quiet: Quiet = False) -> None:
    """Run the paper's trial, reconstructed: write its photo, readings and trial, then run all stages."""
    with _command(device, as_json, quiet) as command:
        from sealtwin.reconstruction import place_paper_trial

        folder = out or Path("reports", "demo")
        place_paper_trial(folder / "trial")
        command.say(f"The trial that runs: {folder / 'trial' / 'trial.toml'}")
        command.run(folder / "trial" / "trial.toml", folder / "run", ALL_STAGES)


@app.command()
def run(
    trial: TrialFile, out: Out = None, device: Device = "auto", as_json: Json = False, quiet: Quiet = False
) -> None:
    """Bring a whole trial up to date: digitise, simulate, validate, report."""
    with _command(device, as_json, quiet) as command:
        command.run(trial, out, ALL_STAGES)


@app.command()
def digitise(
    target: Annotated[
        Path, typer.Argument(metavar="TRIAL|PHOTO", help="A trial.toml, or a photo with the options below.")
    ],
    out: Out = None,
    depth_mm: Annotated[float | None, typer.Option(help="Photo: measured depth of the crack.")] = None,
    mm_per_px: Annotated[float | None, typer.Option(help="Photo: scale.")] = None,
    face_mm: Annotated[
        str | None, typer.Option(metavar="WxH", help="Photo: size of the sample's face; gives the scale.")
    ] = None,
    assumed: Annotated[
        bool, typer.Option("--assumed", help="Photo: the scale is assumed; every output says so.")
    ] = False,
    ends: Annotated[
        tuple[str, str] | None,
        typer.Option(metavar="X,Y X,Y", help="Photo: the crack's two ends in pixels; the nozzle starts at the first."),
    ] = None,
    tilt: Annotated[
        Literal["lean", "flare", "funnel", "vertical"] | None,
        typer.Option(help="Photo: how the walls tilt; default: lean."),
    ] = None,
    wall_angle_deg: Annotated[
        float | None, typer.Option(help="Photo: each wall's angle from vertical; default: 11.")
    ] = None,
    volume_ml: Annotated[
        float | None, typer.Option(help="Photo: sealant to give; default: what fills the crack to its face.")
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """From a photo to a watertight crack mesh and a nozzle path.

    Example: sealtwin digitise photo.png --depth-mm 16 --mm-per-px 0.1 --ends 12,340 905,377 --out crack
    """
    with _command("cpu", as_json, quiet) as command:
        if target.suffix.lower() == ".toml":
            of_a_photo = (depth_mm, mm_per_px, face_mm, ends, tilt, wall_angle_deg, volume_ml)
            if assumed or any(value is not None for value in of_a_photo):
                raise typer.BadParameter("options for a photo beside a trial file: put them into the trial file")
            command.run(target, out, ("digitise",))
            return
        if depth_mm is None:
            raise typer.BadParameter("a photo needs --depth-mm: a photo cannot show how deep a crack is")
        from sealtwin.trial import photo_trial

        trial = photo_trial(
            target,
            depth_mm=depth_mm,
            mm_per_px=mm_per_px,
            face_mm=None if face_mm is None else _pair(face_mm, "x", "--face-mm"),
            assumed=assumed,
            ends_px=None if ends is None else (_pair(ends[0], ",", "--ends"), _pair(ends[1], ",", "--ends")),
            tilt=tilt,
            wall_angle_deg=wall_angle_deg,
            volume_ml=volume_ml,
        )
        command.run_checked(trial, target.parent, out, ("digitise",))


@app.command()
def simulate(folder: RunFolderPath, device: Device = "auto", as_json: Json = False, quiet: Quiet = False) -> None:
    """Inject the sealant into a digitised run folder; its settings are those of RUN/trial.toml."""
    with _command(device, as_json, quiet) as command:
        command.resume(folder, ("simulate",))


@app.command()
def validate(folder: RunFolderPath, as_json: Json = False, quiet: Quiet = False) -> None:
    """Hold a simulated run folder against its readings and write the report."""
    with _command("auto", as_json, quiet) as command:
        command.resume(folder, ("validate",))


@app.command()
def init(folder: Annotated[Path, typer.Argument(metavar="DIR", help="Where the trial is to lie.")]) -> None:
    """Write a commented trial and an empty sheet for readings to start from."""
    with _command("auto", as_json=False, quiet=False) as command:
        from sealtwin.starter import write_starter

        command.answer({}, [str(written) for written in write_starter(folder)])


@app.command()
def doctor(as_json: Json = False) -> None:
    """Versions, devices and a self-test of about a second."""
    with _command("auto", as_json, quiet=False) as command:
        from sealtwin.doctor import examine

        findings = examine()
        lines = [f"{name:<24} {found}" for name, found in {**findings["versions"], **findings["checks"]}.items()]
        command.answer(findings, lines)
        if not findings["healthy"]:
            raise typer.Exit(1)


def main() -> None:
    """The ``sealtwin`` command."""
    app()


@dataclass(frozen=True)
class Command:
    """How the user wants to be answered, and where the fluid is to run."""

    device: str
    as_json: bool
    quiet: bool
    stdout: TextIO
    """Kept, since whatever a library prints is sent to stderr: stdout is for the answer alone."""

    def run(self, trial_path: Path, out: Path | None, stages: "Sequence[StageName]") -> None:
        from sealtwin.trial import load_trial

        self.run_checked(load_trial(trial_path), trial_path.parent, out, stages)

    def run_checked(self, trial: "Trial", source: Path, out: Path | None, stages: "Sequence[StageName]") -> None:
        from sealtwin.folder import open_folder
        from sealtwin.job import start_job

        with (
            open_folder(out or Path("reports", trial.folder_name), create=True) as folder,
            self._progress() as progress,
        ):
            self._finish(start_job(trial, source, folder, self.device, progress), stages)

    def resume(self, path: Path, stages: "Sequence[StageName]") -> None:
        from sealtwin.folder import open_folder
        from sealtwin.job import resume_job

        with open_folder(path, create=False) as folder, self._progress() as progress:
            self._finish(resume_job(folder, self.device, progress), stages)

    def say(self, text: str) -> None:
        if not self.quiet:
            print(text, file=sys.stderr)

    def answer(self, content: dict[str, Any], lines: Sequence[str]) -> None:
        print(json.dumps(content, ensure_ascii=False) if self.as_json else "\n".join(lines), file=self.stdout)

    def fail(self, message: str, exit_code: int) -> NoReturn:
        print(f"sealtwin: {message}", file=sys.stderr)
        if self.as_json:
            self.answer({"version": 1, "error": message, "exit_code": exit_code}, ())
        raise typer.Exit(exit_code)

    def _finish(self, job: "Job", stages: "Sequence[StageName]") -> None:
        from sealtwin.pipeline import run_stages
        from sealtwin.result import headline

        outcome = run_stages(job, stages)
        job.progress.close()
        self.answer(outcome.result, headline(outcome.result, stages[-1]))
        if "validate" in stages and outcome.gate_passed is False:
            raise typer.Exit(GATE_FAILED)

    def _progress(self) -> "Progress":
        from sealtwin.progress import progress_for_stderr

        return progress_for_stderr(self.quiet)


@contextmanager
def _command(device: str, as_json: bool, quiet: bool) -> Iterator[Command]:
    """Turn what the user can mend into one message and an exit code; let bugs keep their traceback."""
    command = Command(device, as_json, quiet, sys.stdout)
    try:
        with redirect_stdout(sys.stderr):
            yield command
    except SealtwinError as fault:
        command.fail(str(fault), fault.exit_code)
    except BrokenPipeError:
        # Whoever read the answer has gone; without this the interpreter complains as it flushes.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        raise typer.Exit(BAD_INPUT) from None
    except OSError as fault:
        if fault.filename is None:
            raise
        command.fail(f"{fault.filename}: {fault.strerror}. Give a place that can be read and written.", BAD_INPUT)
    except KeyboardInterrupt:
        command.fail("interrupted; the same command goes on from the last finished stage.", INTERRUPTED)


def _pair(text: str, separator: str, option: str) -> tuple[float, float]:
    try:
        first, second = (float(part) for part in text.split(separator))
    except ValueError:
        raise typer.BadParameter(f"{option} {text}: expected two numbers, as in 12{separator}340") from None
    return first, second


if __name__ == "__main__":
    main()
