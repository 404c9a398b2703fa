"""Options of the command line: numbers with a decimal point or comma, everyday settings, and --set."""

import inspect
import math
import re
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import typer

from sealtwin.core.errors import InputError, present

Given = dict[str, Any]
"""Settings of a trial by dotted name. They replace those of the trial's file."""


def option(help: str, metavar: str | None = None, *names: str) -> Any:
    """Describe an option; its name is that of its parameter unless ``names`` are given."""
    return typer.Option(*names, help=help, metavar=metavar)


def flag(name: str, help: str) -> Any:
    """Describe an option without a value. Giving its name avoids a second option "--no-..."."""
    return typer.Option(name, help=help)


def argument(metavar: str, help: str | None = None) -> Any:
    return typer.Argument(metavar=metavar, help=help)


Text = str | None
Number = float | None
File = Path | None
Accurate = Annotated[
    bool,
    flag("--accurate", "Compute with the trial's own solver settings, which takes three times as long as drafts."),
]
Out = Annotated[File, option("Run folder; default: reports/<trial name> under the current folder.", "DIR")]


WRITTEN = re.compile(r"[+-]?(\d+[.,]?\d*|[.,]\d+)([eE][+-]?\d+)?", re.ASCII)
"""A number as people write it: float() would also accept 1_0, nan and digits of other scripts."""
THOUSANDS = re.compile(r"[+-]?[1-9]\d*,\d{3}", re.ASCII)


def read_number(text: str, *, comma: bool = True) -> float:
    """Return a finite number; ``comma`` is False if commas separate numbers. Raises ValueError."""
    text = text.strip()
    if not WRITTEN.fullmatch(text) or ("," in text and not comma):
        raise ValueError("expected a number such as 0.1" + (" or 0,1" if comma else ""))
    if THOUSANDS.fullmatch(text):
        raise ValueError(f"the comma is ambiguous: give {text.replace(',', '.')} or {text.replace(',', '')}")
    value = float(text.replace(",", "."))
    if not math.isfinite(value):
        raise ValueError("expected a finite number")
    return value


def number_option(help: str, low: float | None = None, high: float | None = None) -> Any:
    """Describe an option with one number, from ``low`` to ``high`` if they are given."""
    return typer.Option(help=help, metavar=_metavar("NUMBER", low, high), parser=_reader(float, low, high))


def count_option(help: str, low: int, high: int) -> Any:
    """Describe an option with a whole number from ``low`` to ``high``."""
    return typer.Option(help=help, metavar=_metavar("COUNT", low, high), parser=_reader(int, low, high))


def _metavar(word: str, low: float | None, high: float | None) -> str:
    return word if low is None else f"{word}, {low} to {high}"


def _reader(kind: type[int] | type[float], low: float | None, high: float | None) -> Callable[[Any], float]:
    def read(given: Any) -> float:
        # A default is a number already.
        try:
            value = read_number(given) if isinstance(given, str) else given
        except ValueError as fault:
            raise typer.BadParameter(f"{given}: {fault}") from None
        if kind is int and value != int(value):
            raise typer.BadParameter(f"{given}: expected a whole number")
        if not (-math.inf if low is None else low) <= value <= (math.inf if high is None else high):
            raise typer.BadParameter(f"{given}: expected {_metavar('', low, high).lstrip(', ')}")
        return kind(value)

    return read


def two_numbers(text: str, separator: str, option: str) -> tuple[float, float]:
    """Read two numbers. Raises typer.BadParameter, naming the option."""
    try:
        first, second = (read_number(part, comma=separator != ",") for part in text.split(separator))
    except ValueError:
        raise typer.BadParameter(f"{option} {text}: expected two numbers, as in 12{separator}340") from None
    return first, second


def points(text: str | Sequence[str], option: str) -> list[tuple[float, float]]:
    """Read ``"x,y x,y"`` in pixels. Raises typer.BadParameter, naming the option."""
    return [two_numbers(pair, ",", option) for pair in (text.split() if isinstance(text, str) else text)]


LONGEST_MM = 10_000.0  # Limit on s, as in a trial


def along(text: str, option: str) -> float | list[list[float]]:
    """Read a number, or the rows of a CSV with s_mm and a column named after the option.

    Raises typer.BadParameter for other texts, InputError for a file that cannot be used.
    """
    path, column = Path(text), option.strip("-").replace("-", "_")
    if path.suffix.lower() not in {".csv", ".txt"}:
        return _number(text, option, f"millimetres, or a CSV with the columns s_mm and {column}")
    from digitise.settings import DEEPEST_MM, MOST_STATIONS
    from validate.readings.files import read_grid
    from validate.readings.words import number, unit_of

    grid = read_grid(path)
    head = grid.texts(next(iter(grid.rows), 0))
    if missing := [name for name in ("s_mm", column) if head.count(name) != 1]:
        raise InputError(f"{path}: no column {missing[0]}, or several; its first row must name s_mm and {column}.")
    # In a file with commas between columns, a comma in a number is ambiguous.
    mark = "point" if grid.separator == "," else None
    rows = list[list[float]]()
    for line in [*grid.rows][1:]:
        texts = [grid.cell(line, head.index(name)).text for name in ("s_mm", column)]
        s_mm, value_mm = (number(text, mark) for text in texts)
        if s_mm is None or value_mm is None or not (0 <= s_mm <= LONGEST_MM and 0 < value_mm <= DEEPEST_MM):
            limits = f"0 to {LONGEST_MM:g} and above 0 to {DEEPEST_MM:g} mm are allowed"
            raise InputError(f"{path}, row {line}: s_mm and {column} = {texts!r:.80}; {limits}.")
        if any(unit_of(cell.text) not in (None, "mm") for cell in grid.rows[line].values()):
            raise InputError(f"{path}, row {line}: has a unit beside numbers that must be in mm; convert them.")
        if rows and s_mm <= rows[-1][0]:
            place = f"{path}, row {line}: s_mm = {s_mm:g} follows {rows[-1][0]:g}"
            raise InputError(f"{place}; list the rows by increasing s_mm.")
        rows.append([s_mm, value_mm])
    if not 0 < len(rows) <= MOST_STATIONS:
        raise InputError(f"{path}: {len(rows)} rows below its header; 1 to {MOST_STATIONS} are read.")
    return rows


def board(path: str, _: str = "") -> dict[str, Any]:
    """Return the table [photo.markers] of a TOML file that 'sealtwin markers' wrote.

    Raises InputError if it is missing.
    """
    from digitise.settings import MarkerBoard
    from sealtwin.core.settings import Settings, read_settings

    class PhotoOptions(Settings):
        markers: MarkerBoard

    class MarkerFile(Settings):
        photo: PhotoOptions

    read = read_settings(MarkerFile, Path(path), name="file of markers", starter="'sealtwin markers' writes one")
    return read.photo.markers.model_dump(mode="json")


def _number(text: str, option: str, expected: str = "a number") -> float:
    try:
        return read_number(text)
    except ValueError as fault:
        raise typer.BadParameter(f"{option} {text}: expected {expected}; {fault}") from None


def _count(text: str, option: str) -> int:
    value = _number(text, option, "a whole number")
    if value != int(value):
        raise typer.BadParameter(f"{option} {text}: expected a whole number")
    return int(value)


def _size(text: str, option: str) -> list[float]:
    return list(two_numbers(text, "x", option))


class Everyday(NamedTuple):
    """An option of the command line that gives one setting of a trial."""

    key: str  # Dotted name of its setting; the setting's docstring is the help
    metavar: str | None  # None: the values that the setting allows
    read: Callable[[Any, str], Any] = lambda text, _: text  # Reads the text; the option's name is for messages
    kind: Any = str | None


OPTIONS = {
    "depth_mm": Everyday("crack.depth_mm", "MM|CSV", along),
    "mm_per_px": Everyday("photo.mm_per_px", "NUMBER", _number),
    "face_mm": Everyday("photo.face_mm", "WxH", _size),
    "markers": Everyday("photo.markers", "TOML", board),
    "ends": Everyday("photo.ends_px", "X,Y X,Y", points, tuple[str, str] | None),
    "via": Everyday("photo.via_px", "'X,Y ...'", points),
    "roi": Everyday("photo.roi_px", "'X,Y ...'", points),
    # Relative to the current folder; in a trial file it is relative to that file.
    "mask": Everyday("photo.mask", "PICTURE", lambda text, _: Path(text).absolute()),
    "width_mm": Everyday("photo.width_mm", "MM|CSV", along),
    "units": Everyday("mesh.units", None),
    "preset": Everyday("solver.preset", None),
    "seed": Everyday("seed", "COUNT", _count),
    "seeds": Everyday("seeds", "COUNT", _count),
}
"""Everyday options by the name of their parameter."""
PHOTO = ("depth_mm", "mm_per_px", "face_mm", "markers", "ends", "via", "roi", "mask", "width_mm")
FLUID = ("preset", "seed", "seeds")
SETTING = re.compile(r"\s*(\w+(?:\.\w+){0,3})\s*=(.*)", re.ASCII | re.DOTALL)
SET = typer.Option(
    "--set",
    metavar="TABLE.KEY=VALUE",
    help="Any setting of a trial file, with its value in TOML or as a bare word. It replaces the file's value for "
    'this call. May be repeated: --set crack.tilt=flare --set "photo.ruler_px=[[0,0],[100,0]]"',
)


def parameters(names: Sequence[str], needs: Sequence[str]) -> Iterator[inspect.Parameter]:
    """Yield the parameters of everyday options and of --set. Those in ``needs`` have no default."""
    for name in names:
        option, needed = OPTIONS[name], name in needs
        shown = typer.Option(spelt(name), metavar=option.metavar, help=option.key)
        yield parameter(name, str if needed else option.kind, shown, inspect.Parameter.empty if needed else None)
    yield parameter("set", list[str] | None, SET, None)


def parameter(name: str, kind: Any, shown: Any, default: Any) -> inspect.Parameter:
    """Return the parameter of a command for an option."""
    annotation = Annotated[kind, shown]
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)


def settings_of(options: Mapping[str, Any], others: Sequence[str]) -> Given:
    """Return settings by dotted name, read from everyday options and from texts "table.key=value".

    ``options`` has their values by parameter. Names of files become absolute. Raises typer.BadParameter for unreadable
    texts and for a setting that is given twice, and InputError for a file that cannot be used.
    """
    given = {name: text for name, text in options.items() if text is not None}
    settings = {OPTIONS[name].key: OPTIONS[name].read(text, spelt(name)) for name, text in given.items()}
    for text in others:
        key, value = _setting(text)
        if twice := [name for name in settings if f"{name}.".startswith(f"{key}.") or key.startswith(f"{name}.")]:
            raise typer.BadParameter(f"--set {text}: {twice[0]} is given twice; give it once")
        settings[key] = value
    return settings


def describe(command: Any) -> None:
    """Fill in the help of a command's everyday options: first sentence of the setting's docstring, and its name."""
    for shown in command.params:
        if shown.name in OPTIONS and shown.help == OPTIONS[shown.name].key:
            text, values = _described(shown.help)
            shown.help = f"{text} ({shown.help})"
            shown.metavar = shown.metavar or values


def spelt(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def _setting(text: str) -> tuple[str, Any]:
    """Read table.key=value. Raises typer.BadParameter."""
    from sealtwin.core.settings import table_of, takes_list
    from sealtwin.trial.trial_file import Trial

    if not (parts := SETTING.fullmatch(text)):
        raise typer.BadParameter(f"--set {text:.80}: expected TABLE.KEY=VALUE, as in crack.tilt=flare")
    key, value = parts[1], parts[2].strip()
    # Commands check settings by their names, so a whole table is refused.
    if key in Trial.model_fields and table_of(Trial, (key, "")) is not None:
        raise typer.BadParameter(
            f"--set {text:.80}: {key} is a table; give its settings one by one, in the form {key}.KEY=VALUE"
        )
    if "," in value and WRITTEN.fullmatch(value) and takes_list(Trial, key):
        raise typer.BadParameter(
            f"--set {text:.80}: the comma is ambiguous: give {value.replace(',', '.')} or [{value}]"
        )
    return key, _with_whole_names(key, _value(value))


def _with_whole_names(key: str, value: Any) -> Any:
    """Return a setting's value, in which names of files become absolute, even inside a table."""
    from sealtwin.core.settings import names_file
    from sealtwin.trial.trial_file import Trial

    if isinstance(value, dict):
        return {name: _with_whole_names(f"{key}.{name}", inner) for name, inner in value.items()}
    return Path(value).absolute() if isinstance(value, str) and names_file(Trial, key) else value


def _value(text: str) -> Any:
    """Read a value in TOML, a number with a decimal comma, or a bare word."""
    try:
        content = tomllib.loads(f"value = {text}")
        if content.keys() == {"value"}:
            return content["value"]
    except (ValueError, RecursionError):
        pass
    try:
        return read_number(text)
    except ValueError:
        return text


def _described(name: str) -> tuple[str, str | None]:
    """Return the first sentence of a setting's docstring, and its allowed values if it is a choice."""
    from sealtwin.core.settings import described, table_of
    from sealtwin.trial.trial_file import Trial

    *_, key = parts = name.split(".")
    table = present(table_of(Trial, parts), name)
    values = getattr(table.model_fields[key].annotation, "__args__", ())
    # Square brackets would be read as markup.
    sentence = re.split(r"(?<=\.)\s+(?=[A-Z])", described(table)[key])[0].translate({91: 40, 93: 41})
    return " ".join(sentence.split()), "|".join(values) if all(isinstance(one, str) for one in values) else None
