"""Answers of the commands: results on stdout, narration on stderr, an exit code, and one message for each fault."""

import functools
import inspect
import io
import itertools
import json
import os
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, TextIO

import typer
from typer.core import TyperCommand, TyperGroup, TyperOption

from sealtwin.cli.options import (
    everyday_parameters,
    flag,
    model_parameters,
    option,
    parameter,
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
JSON = flag("--json", "Print one JSON object on stdout, everything else on stderr.")
QUIET = flag("--quiet", "On stderr, print only warnings: no narration and no progress.")
VERBOSE = flag("--verbose", "Also print the figures and sentences that the short answer leaves out.")


@dataclass(frozen=True)
class Answer:
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

    def reply(self, answer: Answer) -> None:
        """Print the result; end the command if its exit code is not 0."""
        content = {"version": 1, **answer.content}
        text = json.dumps(content, ensure_ascii=False) if self.as_json else "\n".join(answer.lines)
        with naming(Path("standard output")):
            print(text, file=self.stdout, flush=True)
        if answer.exit_code:
            raise typer.Exit(answer.exit_code)

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

        return QuietProgress() if self.quiet else progress_for_stderr(quiet=False)


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
    """Command that refuses an option that is given twice: Click would silently use the last value.

    Options that take a list may be repeated. Options of settings are made when they are first needed, since settings
    load pydantic, and reach the command's function together, as the parameter in whose place they are.
    """

    @property
    def params(self) -> list[Any]:  # pyright: ignore[reportIncompatibleVariableOverride]
        sources, self._sources = self._sources, {}
        for name, source in sources.items():
            made = _with_signature(lambda **_: None, source())
            alone = typer.Typer(add_completion=False)
            alone.command()(made)
            options = typer.main.get_command(alone).params
            place = [each.name for each in self._params].index(name)
            self._params[place : place + 1] = options
            self._parts[name] = [each.name for each in options]
        return self._params

    @params.setter
    def params(self, params: list[Any]) -> None:  # pyright: ignore[reportIncompatibleVariableOverride]
        self._params, self._parts = list(params), dict[str, list[Any]]()
        self._sources = vars(self.callback)["sources"]

    def invoke(self, ctx: Any) -> Any:
        for name, options in self._parts.items():
            ctx.params[name] = {each: ctx.params.pop(each) for each in options}
        return super().invoke(ctx)

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        _, _, given = self.make_parser(ctx).parse_args(args=list(args))
        for each in given:
            one = isinstance(each, TyperOption) and not (each.multiple or each.is_flag)
            if one and given.count(each) > 1:
                ctx.fail(f"{each.opts[0]} is given {given.count(each)} times; give it once")
        return super().parse_args(ctx, args)


def answers(
    *names: str,
    needs: Sequence[str] = (),
    model: str = "",
    device: bool = False,
    verbose: bool = False,
    quiet: bool = True,
    as_json: bool = True,
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Turn a function of a ``Command`` into a command: add options for output and device, turn faults into exit codes.

    The function's parameter ``settings`` becomes --set and the everyday options in ``names``, of which those in
    ``needs`` are required. Its parameter ``options`` becomes an option for each field of the settings ``model``,
    "module:Class".
    """
    ends = [("device", str, DEVICE, "auto")] if device else []
    ends += [("as_json", bool, JSON, False)] if as_json else []
    ends += [("quiet", bool, QUIET, False)] if quiet else []
    ends += [("verbose", bool, VERBOSE, False)] if verbose else []
    sources = {"settings": lambda: everyday_parameters(names, needs), "options": lambda: model_parameters(model)}

    def decorated(function: Callable[..., None]) -> Callable[..., None]:
        @functools.wraps(function)
        def command(**given: Any) -> None:
            answer = Command(**{name: given.pop(name) for name, *_ in ends})
            with ending(answer):
                if (everyday := given.get("settings")) is not None:
                    given["settings"] = settings_of(everyday, everyday.pop("set") or ())
                if model:
                    given["options"] = read_model(model, given["options"])
                function(answer, **given)

        own = [
            parameter(each.name, str | None, typer.Option(), None)
            if each.name in sources
            else each.replace(kind=inspect.Parameter.KEYWORD_ONLY)
            for each in [*inspect.signature(function).parameters.values()][1:]
        ]
        vars(command)["sources"] = {each.name: sources[each.name] for each in own if each.name in sources}
        return _with_signature(command, [*own, *itertools.starmap(parameter, ends)])

    return decorated


def _with_signature(function: Callable[..., None], parameters: Iterable[inspect.Parameter]) -> Callable[..., None]:
    signature = inspect.Signature([*parameters])
    function.__signature__ = signature  # pyright: ignore[reportFunctionMemberAccess]
    function.__annotations__ = {each.name: each.annotation for each in signature.parameters.values()}
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
