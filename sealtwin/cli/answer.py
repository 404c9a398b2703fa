"""Answers of the commands: results on stdout, narration on stderr, an exit code, and one message for each fault."""

import functools
import inspect
import io
import itertools
import json
import os
import re
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, NoReturn, TextIO

import typer
from typer.core import TyperCommand, TyperGroup, TyperOption

from sealtwin.cli.options import (
    everyday_parameters,
    flag,
    model_parameters,
    option,
    parameter,
    parameter_of,
    read_model,
    settings_of,
)
from sealtwin.core.errors import SealtwinError, naming

if TYPE_CHECKING:
    from sealtwin.core.progress import Progress

BUG = 1
BAD_INPUT = 3
GATE_FAILED = 5
SOME_FAILED = 6
INTERRUPTED = 130
NO_MEMORY = re.compile("failed to map segment|cannot allocate memory", re.IGNORECASE)
DEVICE = option("Device of the fluid run; it is an error if the named device does not exist.", "auto|cpu|cuda:0")
FLAGS = {
    "as_json": flag("--json", "Print one JSON object on stdout, everything else on stderr."),
    "quiet": flag("--quiet", "On stderr, print only warnings: no narration and no progress."),
    "verbose": flag("--verbose", "Also print the figures and sentences that the short answer leaves out."),
}
ENDS = {"device": parameter("device", str, DEVICE, "auto")}
ENDS |= {name: parameter(name, bool, shown, False) for name, shown in FLAGS.items()}
"""Options of many commands, by the field of ``Command``. They are last in the help."""

Function = Callable[..., None]


class Answer(NamedTuple):
    content: dict[str, Any]  # Printed with --json, after the version of its form
    lines: Sequence[str]  # Printed without --json
    exit_code: int = 0


@dataclass(frozen=True)
class Command:
    """Options of a running command: form of its output, and device of its fluid run."""

    device: str = "cpu"
    as_json: bool = False
    quiet: bool = False
    verbose: bool = False
    stdout: TextIO = field(default_factory=lambda: sys.stdout)
    """Standard output, which receives only the result. What libraries print goes to stderr."""

    def say(self, text: str) -> None:
        if not self.quiet:
            print(text, file=sys.stderr)

    def warn(self, text: str) -> None:
        """Print a warning, even with --quiet."""
        print(f"note: {text}", file=sys.stderr)

    def reply(self, content: dict[str, Any], lines: Sequence[str], exit_code: int = 0) -> None:
        """Print the result; end the command if its exit code is not 0."""
        text = json.dumps({"version": 1, **content}, ensure_ascii=False) if self.as_json else "\n".join(lines)
        with naming(Path("standard output")):
            print(text, file=self.stdout, flush=True)
        if exit_code:
            raise typer.Exit(exit_code)

    def fail(self, message: str, exit_code: int) -> NoReturn:
        print(f"sealtwin: {message}", file=sys.stderr)
        if self.as_json:
            print(_as_error(message, exit_code), file=self.stdout)
        raise typer.Exit(exit_code)

    def interrupted(self, message: str) -> NoReturn:
        # If an interrupt arrives inside exec() of a text, as in dataclasses, CPython sets a flag and later ends
        # "python -m" by the signal instead of the exit code, even if it was handled. Another exec() clears the flag.
        exec("")
        self.fail(f"interrupted; {message}", INTERRUPTED)

    def device_and_jobs(self, jobs: int | None) -> tuple[str, int]:
        """Return the device of a study's runs, which is printed, and the number of processes."""
        from sealtwin.core.cluster import cores
        from simulate.device import choose_device, describe_device

        device = choose_device(self.device)
        self.say(f"Device: {describe_device(device)}")
        return device, jobs or (cores() if device == "cpu" else 1)

    def progress(self) -> "Progress":
        from sealtwin.core.progress import QuietProgress, progress_for_stderr

        return QuietProgress() if self.quiet else progress_for_stderr()


class Commands(TyperGroup):
    """Group of all commands: with --json, a usage error is printed as an object too."""

    def invoke(self, ctx: Any) -> Any:
        as_json = "--json" in ctx.args
        try:
            return super().invoke(ctx)
        except typer.TyperException as fault:
            if as_json:
                print(_as_error(fault.format_message(), fault.exit_code))
            raise


class CheckedCommand(TyperCommand):
    """Command that makes its options when they are first needed, since settings load pydantic.

    It refuses an option that is given twice, of which Click would silently use the last value. Options that take a list
    may be repeated.
    """

    @property
    def params(self) -> list[Any]:  # pyright: ignore[reportIncompatibleVariableOverride]
        if self._params is None:
            alone = typer.Typer(add_completion=False)
            alone.command()(vars(self.callback)["completed"]())
            made = typer.main.get_command(alone)
            self._params, self.callback = made.params, made.callback
        return self._params

    @params.setter
    def params(self, _: list[Any]) -> None:  # pyright: ignore[reportIncompatibleVariableOverride]
        self._params: list[Any] | None = None

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        _, _, params = self.make_parser(ctx).parse_args(args=list(args))
        for param in params:
            single = isinstance(param, TyperOption) and not (param.multiple or param.is_flag)
            if single and params.count(param) > 1:
                ctx.fail(f"{param.opts[0]} is given {params.count(param)} times; give it once")
        return super().parse_args(ctx, args)


def answers(
    *keys: str,
    needs: Sequence[str] = (),
    device: bool = False,
    verbose: bool = False,
    quiet: bool = True,
    as_json: bool = True,
    **models: str,
) -> Callable[[Function], Function]:
    """Turn a function of a ``Command`` into a command: add options for output and device, turn faults into exit codes.

    The function's parameter ``settings`` becomes --set and an option for each of the everyday settings ``keys``, of
    which those in ``needs`` are required. A parameter named in ``models`` becomes an option for each field of its
    settings model, "module:Class".
    """
    shown = {"device": device, "as_json": as_json, "quiet": quiet, "verbose": verbose}

    def decorated(function: Function) -> Function:
        _, *parameters = inspect.signature(function).parameters.values()

        @functools.wraps(function)
        def command(**arguments: Any) -> None:
            answer = Command(**{name: arguments.pop(name) for name in ENDS if name in arguments})
            with ending(answer):
                if "set" in arguments:
                    everyday = {key: arguments.pop(parameter_of(key)) for key in keys}
                    arguments["settings"] = settings_of(everyday, arguments.pop("set") or ())
                for name, model in models.items():
                    arguments[name] = read_model(model, arguments)
                function(answer, **arguments)

        def completed() -> Function:
            sources = {name: model_parameters(model) for name, model in models.items()}
            sources["settings"] = everyday_parameters(keys, needs)
            written = {each.name: [each.replace(kind=each.KEYWORD_ONLY)] for each in parameters}
            parts = itertools.chain.from_iterable((written | sources)[each.name] for each in parameters)
            return _with_signature(command, [*parts, *(option for name, option in ENDS.items() if shown[name])])

        vars(command)["completed"] = completed
        return _with_signature(command, ())

    return decorated


def _with_signature(function: Function, parameters: Sequence[inspect.Parameter]) -> Function:
    function.__signature__ = inspect.Signature(parameters)  # pyright: ignore[reportFunctionMemberAccess]
    function.__annotations__ = {each.name: each.annotation for each in parameters}
    return function


@contextmanager
def ending(command: Command) -> Iterator[None]:
    """Turn faults that the user can fix into a message and an exit code; bugs keep their traceback."""
    try:
        with redirect_stdout(sys.stderr):
            yield
    except SealtwinError as fault:
        command.fail(str(fault), fault.exit_code)
    except BrokenPipeError:
        # The reader of stdout has ended; without this the interpreter reports an error when it flushes.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        raise typer.Exit(BAD_INPUT) from None
    except OSError as fault:
        if fault.filename is None:
            raise
        command.fail(f"{fault.filename}: {fault.strerror}. Choose a place that can be read and written.", BAD_INPUT)
    except (MemoryError, ImportError) as fault:
        # If a library cannot be loaded for lack of memory, only the text of the ImportError shows it.
        if isinstance(fault, ImportError) and not NO_MEMORY.search(str(fault)):
            raise
        command.fail("not enough memory. Close other programs, or choose larger particles.", BAD_INPUT)
    except KeyboardInterrupt:
        command.interrupted(
            "repeat the command to continue from the last finished stage, or from a fluid run's checkpoint."
        )


def open_missing_streams() -> None:
    """Open streams that were closed at the start, for example by ``2>&-``.

    Otherwise the next file that is opened would receive their output.
    """
    while (spare := os.open(os.devnull, os.O_RDWR)) <= 2:
        pass
    os.close(spare)
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, os.fdopen(os.open(os.devnull, os.O_WRONLY), "w", encoding="utf-8"))


def take_any_name() -> None:
    """Print characters that the output encoding lacks as escapes, and JSON as UTF-8 on every machine."""
    as_json = "--json" in sys.argv
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            # On Windows, pipes and files have the encoding of the system.
            encoding = "utf-8" if as_json and stream is sys.stdout else None
            stream.reconfigure(encoding=encoding, errors="backslashreplace")
    # COLUMNS=0 means an unknown width, and would make help blank.
    if os.environ.get("COLUMNS", "").strip("0 ") == "":
        os.environ.pop("COLUMNS", None)


def _as_error(message: str, exit_code: int) -> str:
    return json.dumps({"version": 1, "error": message, "exit_code": exit_code}, ensure_ascii=False)
