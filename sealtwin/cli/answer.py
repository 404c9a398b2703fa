"""Output of the commands: the result on stdout, progress on stderr, an exit code, and one message for each fault."""

import errno
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
    naming_options,
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
DEVICE = option("Device of the fluid run. The command fails if the named device does not exist.", "auto|cpu|cuda:0")
FLAGS = {
    "as_json": flag("--json", "Print one JSON object on stdout, and everything else on stderr."),
    "quiet": flag("--quiet", "Print only warnings on stderr, without notes and progress."),
}
ENDS = {"device": parameter("device", str, DEVICE, "auto")}
ENDS |= {name: parameter(name, bool, shown, False) for name, shown in FLAGS.items()}
"""Options that many commands have, by the field of ``Command``. The help lists them last."""

Function = Callable[..., None]


class Answer(NamedTuple):
    content: dict[str, Any]  # JSON object that is printed with --json
    lines: Sequence[str]  # Lines that are printed without --json
    exit_code: int = 0


@dataclass(frozen=True)
class Command:
    """Options of a running command: the format of its output, and the device of its fluid run."""

    device: str = "cpu"
    as_json: bool = False
    quiet: bool = False
    stdout: TextIO = field(default_factory=lambda: sys.stdout)
    """Standard output, which receives only the result. Output of libraries goes to stderr."""

    def say(self, text: str) -> None:
        if not self.quiet:
            print(text, file=sys.stderr)

    def warn(self, text: str) -> None:
        """Print a warning, even with --quiet."""
        print(f"note: {text}", file=sys.stderr)

    def reply(self, content: dict[str, Any], lines: Sequence[str], exit_code: int = 0) -> None:
        """Print the result. If ``exit_code`` is not 0, end the command."""
        text = json.dumps({"version": 1, **content}, ensure_ascii=False) if self.as_json else "\n".join(lines)
        with naming(Path("standard output")):
            print(text, file=self.stdout, flush=True)
        if exit_code:
            raise typer.Exit(exit_code)

    def write_example(self, example: Path, source: object, write: Callable[[Path], None]) -> None:
        """Write an example of a file for --example. Raises typer.BadParameter if a ``source`` is given too."""
        if source is not None:
            raise typer.BadParameter("--example only writes an example of a file; give no input with it")
        write(example)
        self.reply({"file": example.as_posix()}, [str(example)])

    def fail(self, message: str, exit_code: int) -> NoReturn:
        print(f"sealtwin: {message}", file=sys.stderr)
        if self.as_json:
            print(_as_error(message, exit_code), file=self.stdout)
        raise typer.Exit(exit_code)

    def interrupted(self, message: str) -> NoReturn:
        # If an interrupt arrives while exec() runs a text, as in dataclasses, CPython sets a flag. It then ends
        # "python -m" with the signal instead of the exit code, even if the interrupt was handled. exec() clears it.
        exec("")
        self.fail(f"interrupted; {message}", INTERRUPTED)

    def device_and_jobs(self, jobs: int | None) -> tuple[str, int]:
        """Print and return the device of a study's runs. Also return the number of processes."""
        from sealtwin.core.workers import cores
        from simulate.device import choose_device, describe_device

        device = choose_device(self.device)
        self.say(f"Device: {describe_device(device)}")
        return device, jobs or (cores() if device == "cpu" else 1)

    def progress(self) -> "Progress":
        from sealtwin.core.progress import QuietProgress, progress_for_stderr

        return QuietProgress() if self.quiet else progress_for_stderr()


class PlainFlags:
    """Base class of commands whose help shows no type of a flag. Typer would show "<bool>"."""

    def get_params(self, ctx: Any) -> list[Any]:
        params: list[Any] = super().get_params(ctx)  # pyright: ignore[reportAttributeAccessIssue]
        for param in params:
            if isinstance(param, TyperOption) and param.is_flag:
                param.metavar = ""
        return params


class Commands(PlainFlags, TyperGroup):
    """Group of commands. With --json, the group of all commands prints usage errors as JSON objects too."""

    def invoke(self, ctx: Any) -> Any:
        as_json = ctx.parent is None and "--json" in ctx.args
        try:
            return super().invoke(ctx)
        except typer.TyperException as fault:
            if as_json:
                print(_as_error(fault.format_message(), fault.exit_code))
            raise


class CheckedCommand(PlainFlags, TyperCommand):
    """Command that makes its options only when they are needed, because settings import pydantic.

    The command refuses an option that is given twice. Click would silently use the last value. Options that take a
    list may be repeated.
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
        _, extra, params = self.make_parser(ctx).parse_args(args=list(args))
        if extra and (forms := [f"{param.opts[0]} {param.metavar}" for param in params if param.nargs > 1]):
            ctx.fail(f"unexpected: {' '.join(map(str, extra))}. Write {', '.join(forms)}")
        for param in params:
            single = isinstance(param, TyperOption) and not (param.multiple or param.is_flag)
            if single and params.count(param) > 1:
                ctx.fail(f"{param.opts[0]} is given {params.count(param)} times; give it only once")
        return super().parse_args(ctx, args)


def answers(
    *keys: str,
    needs: Sequence[str] = (),
    device: bool = False,
    **models: str,
) -> Callable[[Function], Function]:
    """Return a decorator that turns a function into a command with options, and its exceptions into exit codes.

    The function's first parameter is a ``Command``, made from the options for output and device. The parameter
    ``settings`` becomes the option --set and one option for each everyday setting in ``keys``. The options in ``needs``
    are required. ``models`` gives a settings model "module:Class" for some of the parameters. Such a parameter becomes
    one option for each field of its model.
    """

    def decorated(function: Function) -> Function:
        _, *parameters = inspect.signature(function).parameters.values()
        # Rich would keep the docstring's line breaks.
        function.__doc__ = re.sub(r"(?<=\S)\n(?=\S)", " ", inspect.cleandoc(function.__doc__ or ""))

        @functools.wraps(function)
        def command(**arguments: Any) -> None:
            answer = Command(**{name: arguments.pop(name) for name in ENDS if name in arguments})
            with ending(answer):
                everyday = {key: text for key in keys if (text := arguments.pop(parameter_of(key))) is not None}
                if "set" in arguments:
                    arguments["settings"] = settings_of(everyday, arguments.pop("set") or ())
                for name, model in models.items():
                    arguments[name] = read_model(model, arguments)
                with naming_options(everyday, arguments.get("settings", ())):
                    function(answer, **arguments)

        def completed() -> Function:
            sources = {name: model_parameters(model) for name, model in models.items()}
            sources["settings"] = everyday_parameters(keys, needs)
            written = {parameter.name: [parameter.replace(kind=parameter.KEYWORD_ONLY)] for parameter in parameters}
            parts = itertools.chain.from_iterable((written | sources)[parameter.name] for parameter in parameters)
            return _with_signature(
                command, [*parts, *(option for name, option in ENDS.items() if device or name != "device")]
            )

        vars(command)["completed"] = completed
        return _with_signature(command, ())

    return decorated


def _with_signature(function: Function, parameters: Sequence[inspect.Parameter]) -> Function:
    function.__signature__ = inspect.Signature(parameters)  # pyright: ignore[reportFunctionMemberAccess]
    function.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return function


@contextmanager
def ending(command: Command) -> Iterator[None]:
    """Turn faults that the user can correct into a message and an exit code. Bugs keep their traceback."""
    try:
        with redirect_stdout(sys.stderr):
            yield
    except SealtwinError as fault:
        command.fail(str(fault), fault.exit_code)
    except BrokenPipeError:
        # The program that reads stdout has ended. Without this, the interpreter reports an error when it flushes
        # stdout.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        raise typer.Exit(BAD_INPUT) from None
    except OSError as fault:
        if fault.filename is None:
            raise
        remedy = "Free some space" if fault.errno == errno.ENOSPC else "Choose a folder that can be read and written"
        command.fail(f"{fault.filename}: {fault.strerror}. {remedy}.", BAD_INPUT)
    except (MemoryError, ImportError) as fault:
        # If there is too little memory to load a library, only the text of the ImportError shows it.
        if isinstance(fault, ImportError) and not NO_MEMORY.search(str(fault)):
            raise
        command.fail("not enough memory. Close other programs, or choose larger particles.", BAD_INPUT)
    except KeyboardInterrupt:
        command.interrupted(
            "repeat the command to continue from the last finished stage, or from a fluid run's checkpoint."
        )


def open_missing_streams() -> None:
    """Open stdout and stderr on the null device if they were closed at the start, for example by ``2>&-``.

    Otherwise the next file that is opened would receive their output.
    """
    while (spare := os.open(os.devnull, os.O_RDWR)) <= 2:
        pass
    os.close(spare)
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, os.fdopen(os.open(os.devnull, os.O_WRONLY), "w", encoding="utf-8"))


def take_any_name() -> None:
    """Set the encoding of the output: JSON is always UTF-8, and other characters that cannot be encoded are escaped."""
    as_json = "--json" in sys.argv
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            # On Windows, pipes and files have the encoding of the system, which may not be UTF-8.
            encoding = "utf-8" if as_json and stream is sys.stdout else None
            stream.reconfigure(encoding=encoding, errors="backslashreplace")
    # COLUMNS=0 means an unknown width, and would make the help text empty.
    if os.environ.get("COLUMNS", "").strip("0 ") == "":
        os.environ.pop("COLUMNS", None)


def _as_error(message: str, exit_code: int) -> str:
    return json.dumps({"version": 1, "error": message, "exit_code": exit_code}, ensure_ascii=False)
