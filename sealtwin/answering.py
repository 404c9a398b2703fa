"""How a command answers: results on stdout, narration on stderr, one sentence and an exit code for what went wrong."""

import json
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn, TextIO

import typer
from typer.core import TyperGroup

from sealtwin.errors import SealtwinError

if TYPE_CHECKING:
    from sealtwin.progress import Progress
    from sealtwin.trials.job import Job, StageName
    from sealtwin.trials.trial import Trial

BAD_INPUT = 3
GATE_FAILED = 5
SOME_FAILED = 6
INTERRUPTED = 130

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


@dataclass(frozen=True)
class Command:
    """How the user wants to be answered, and where the fluid is to run."""

    device: str
    as_json: bool
    quiet: bool
    stdout: TextIO
    """Kept, since whatever a library prints is sent to stderr: stdout is for the answer alone."""

    def run(
        self,
        trial_path: Path,
        out: Path | None,
        stages: "Sequence[StageName]",
        *,
        frames_every_s: float | None = None,
        threads: int = 1,
    ) -> None:
        """``frames_every_s`` in place of the trial's own, where it is given."""
        from sealtwin.trials.trial import load_trial, showing

        self.run_checked(showing(load_trial(trial_path), frames_every_s), trial_path.parent, out, stages, threads)

    def run_checked(
        self, trial: "Trial", source: Path, out: Path | None, stages: "Sequence[StageName]", threads: int = 1
    ) -> None:
        from sealtwin.store.folder import open_folder
        from sealtwin.trials.job import require_sample, start_job

        require_sample(trial, source)
        with (
            open_folder(out or Path("reports", trial.folder_name), create=True) as folder,
            self.progress() as progress,
        ):
            job = start_job(trial, source, folder, self.device, progress)
            self._finish(replace(job, threads=threads), stages)

    def resume(
        self,
        path: Path,
        stages: "Sequence[StageName]",
        *,
        frames_every_s: float | None = None,
        threads: int = 1,
        uncertainty: bool = False,
    ) -> None:
        """``frames_every_s`` in place of the trial's own, where it is given; extra runs first for ``uncertainty``."""
        from sealtwin.store.folder import open_folder
        from sealtwin.trials.job import resume_job
        from sealtwin.trials.trial import showing

        with open_folder(path, create=False) as folder, self.progress() as progress:
            job = resume_job(folder, self.device, progress)
            if uncertainty:
                from sealtwin.study.uncertainty import vary

                vary(job)
            self._finish(replace(job, trial=showing(job.trial, frames_every_s), threads=threads), stages)

    def say(self, text: str) -> None:
        if not self.quiet:
            print(text, file=sys.stderr)

    def answer(self, content: dict[str, Any], lines: Sequence[str]) -> None:
        print(json.dumps(content, ensure_ascii=False) if self.as_json else "\n".join(lines), file=self.stdout)

    def fail(self, message: str, exit_code: int) -> NoReturn:
        print(f"sealtwin: {message}", file=sys.stderr)
        if self.as_json:
            print(_as_error(message, exit_code), file=self.stdout)
        raise typer.Exit(exit_code)

    def _finish(self, job: "Job", stages: "Sequence[StageName]") -> None:
        from sealtwin.trials.pipeline import run_stages
        from sealtwin.trials.result import headline

        outcome = run_stages(job, stages)
        job.progress.close()
        self.answer(outcome.result, headline(outcome.result, stages[-1]))
        if "validate" in stages and outcome.gate_passed is False:
            raise typer.Exit(GATE_FAILED)

    def progress(self) -> "Progress":
        from sealtwin.progress import progress_for_stderr

        return progress_for_stderr(self.quiet)


class Commands(TyperGroup):
    """All commands: with --json, a command line that cannot be understood is answered by an object as well."""

    def invoke(self, ctx: Any) -> Any:
        as_json = "--json" in ctx.args
        try:
            return super().invoke(ctx)
        except typer.TyperException as fault:
            if as_json:
                print(_as_error(fault.format_message(), fault.exit_code))
            raise


@contextmanager
def answering(device: str, as_json: bool, quiet: bool) -> Iterator[Command]:
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
        command.fail(
            "interrupted; the same command goes on from the last finished stage, or a fluid run's checkpoint.",
            INTERRUPTED,
        )


def _as_error(message: str, exit_code: int) -> str:
    return json.dumps({"version": 1, "error": message, "exit_code": exit_code}, ensure_ascii=False)
