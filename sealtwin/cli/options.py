"""Make the options of the command line from the fields of settings models, and read their values.

To add an option to a command, add a field with docstring and bounds to the command's model. If the value is not a
single number, text or file, add its format to ``FORMS``. Everyday settings of a trial have options of their own; all
other settings of a trial are given with --set.
"""

import inspect
import re
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from sealtwin.core.errors import InputError, SettingsFaults, present
from sealtwin.core.plain_files import read_columns

if TYPE_CHECKING:
    from sealtwin.core.settings import Settings

Given = dict[str, Any]
"""Settings of a trial by dotted name. They replace the values in the trial file."""


def option(help: str, metavar: str, *names: str) -> Any:
    """Return the description of an option. Default of ``names``: the name of the parameter."""
    return typer.Option(*names, help=help, metavar=metavar)


def flag(name: str, help: str) -> Any:
    """Return the description of an option without a value. Because of the name, there is no option "--no-..."."""
    return typer.Option(name, help=help)


def argument(metavar: str, help: str) -> Any:
    return typer.Argument(metavar=metavar, help=help)


File = Path | None
Out = Annotated[
    File,
    option(
        "Run folder. Default: reports/NAME, with the name of the trial, of the file, or of the "
        "folder of photo.* and trial.toml. A trial.toml in a run folder is run there.",
        "DIR",
    ),
]


WRITTEN = re.compile(r"(?![+-]?[1-9]\d*,\d{3}$)[+-]?(\d+[.,]?\d*|[.,]\d+)([eE][+-]?\d+)?", re.ASCII)
"""Pattern of a number, but not of 1,000, which may be two numbers.

Python's float() would also accept 1_0, nan and digits of other scripts."""
BETWEEN = re.compile("[x:,]")
"""Pattern of the character between the parts of a format, such as the x in "WxH"."""
INDEX = re.compile(r"\.\d+(?=\.|$)")
"""Pattern of the number of a list's element in a dotted name."""
SENTENCE = re.compile(r"(?<=\.)\s+(?=[A-Z])")


def read_value(text: str, *, comma: bool = True) -> int | float | str:
    """Return a text as a number. If ``comma`` is False, a comma separates numbers.

    Returns a text that is no number, or whose comma is ambiguous. The check of the settings refuses it.
    """
    written = text.strip()
    if not WRITTEN.fullmatch(written) or ("," in written and not comma):
        return text
    number = float(written.replace(",", "."))
    return int(number) if number.is_integer() else number


LONGEST_MM = 10_000.0  # Largest arc length s that is allowed, as in a trial


def along(text: str, column: str) -> Any:
    """Read a number, or rows of a CSV with the columns s_mm and ``column``.

    Raises InputError for a file that cannot be used.
    """
    path = Path(text)
    if path.suffix.lower() not in {".csv", ".txt"}:
        return read_value(text)
    from digitise.settings import DEEPEST_MM, MAX_STATIONS

    bounds = {"s_mm": (0.0, LONGEST_MM), column: (0.0, DEEPEST_MM)}
    columns = read_columns(path, bounds, [*bounds], (1, MAX_STATIONS), ["s_mm"])
    return [[s_mm, value_mm] for s_mm, value_mm in zip(columns["s_mm"], columns[column], strict=True)]


def board(path: str, _: str) -> dict[str, Any]:
    """Return the table [photo.markers] of a TOML file that 'sealtwin markers' wrote.

    Raises InputError if the file or the table is missing.
    """
    from digitise.settings import MarkerBoard
    from sealtwin.core.settings import Settings, read_settings

    class PhotoOptions(Settings):
        markers: MarkerBoard

    class MarkerFile(Settings):
        photo: PhotoOptions

    read = read_settings(MarkerFile, Path(path), name="file of markers", starter="'sealtwin markers' writes one")
    return read.photo.markers.model_dump(mode="json", exclude_none=True)


@dataclass(frozen=True)
class FieldOption:
    """Command-line option for a field of a settings model. The field defines its help text, bounds and default."""

    root: "type[Settings]"
    key: str  # Dotted name of the field in ``root``

    @property
    def form(self) -> str:
        """Format of the option's text. Empty for one number, word or file."""
        return FORMS.get(self.key, "")

    def takes(self, *kinds: Any) -> bool:
        from sealtwin.core.settings import takes

        return takes(self.root, self.key, *kinds)

    def parameter(self, needed: bool, *, brief: bool) -> inspect.Parameter:
        """Return the option as a parameter of a command.

        With ``brief``, the help text is the first sentence of the docstring and the name of the setting.
        """
        from sealtwin.core.settings import choices, table_of
        from sealtwin.core.settings_text import allowed, described

        table, name = present(table_of(self.root, self.key.split(".")), self.key), self.key.rpartition(".")[2]
        field, text, form = table.model_fields[name], described(table)[name], self.form
        is_flag, is_number, names = self.takes(bool), self.takes(int, float), choices(self.root, self.key)
        if brief:
            text, details = SENTENCE.split(text)[0], [self.key]
        else:
            details = [allowed(field)] if is_number and not form else [", ".join(names)] if names and form else []
            if isinstance(field.default, float | int | str) and not is_flag:
                details.append(f"default: {field.default}")
        text += f" ({'; '.join(details)})" if details else ""
        texts = 1 if form.startswith("'") else len(form.split())
        several: Any = list[str] if form.endswith(" ...") else tuple[(str,) * texts]
        kind = bool if is_flag else several if texts > 1 else str
        word = "NUMBER" if self.takes(float) else "COUNT" if is_number else "FILE" if self.takes(Path) else "TEXT"
        spelt = spelt_by(self.key)
        shown = typer.Option(
            f"{spelt}/--no-{spelt[2:]}" if field.default is True else spelt,
            metavar=None if is_flag else form or "|".join(names) or word,
            # Typer would read square brackets as markup.
            help=" ".join(text.translate({91: 40, 93: 41}).split()),
        )
        default = inspect.Parameter.empty if needed else field.default if is_flag else None
        return parameter(parameter_of(self.key), kind if needed or is_flag else kind | None, shown, default)

    def value(self, value: Any) -> Any:
        """Return the setting's value from the option's text. Parts that are no numbers remain texts."""
        form = self.form
        if isinstance(value, bool):
            return value
        if (read := READERS.get(form)) is not None:
            return read(value, self.key.rpartition(".")[2])
        if isinstance(value, str) and not form.startswith("'"):
            return self._part(form, value)
        first = form.strip("'").split()[0]
        values = [self._part(first, text) for text in (value.split() if isinstance(value, str) else value)]
        if not self.takes(dict):
            return values
        if twice := [key for number, (key, _) in enumerate(values) if key in dict(values[:number])]:
            raise typer.BadParameter(f"{spelt_by(self.key)} {twice[0]} is given twice; give it only once")
        return dict(values)

    def _part(self, form: str, text: str) -> Any:
        """Return a text, a number or a list of numbers. A format with an equals sign gives a pair (name, value)."""
        if "=" in form:
            name, _, value = text.partition("=")
            return name, self._part(form.partition("=")[2], value)
        if not self.takes(int, float):
            return text.split(",") if "," in form else text
        sign = BETWEEN.search(form)
        return [read_value(part, comma=sign[0] != ",") for part in text.split(sign[0])] if sign else read_value(text)


PHOTO = (
    *("crack.depth_mm", "photo.mm_per_px", "photo.face_mm", "photo.markers", "photo.ends_px", "photo.via_px"),
    *("photo.roi_px", "photo.mask", "photo.width_mm"),
)
SAMPLE = (*PHOTO, "mesh.units", "drawing.line", "drawing.walls")
FLUID = ("solver.preset", "seed", "seeds")
"""Everyday settings of a trial. Each has its own option, as each setting in ``PHOTO`` and ``SAMPLE`` has."""
FORMS = {
    "crack.depth_mm": "MM|CSV",
    "photo.width_mm": "MM|CSV",
    "photo.face_mm": "WxH",
    "photo.markers": "TOML",
    "photo.ends_px": "X,Y X,Y",
    "photo.via_px": "'X,Y ...'",
    "photo.roi_px": "'X,Y ...'",
    "photo.mask": "PICTURE",
    "cone_mm": "AxBxH",
    "face_mm": "WxH",
    "shear_rates": "LOW:HIGH",
    "date": "YYYY-MM-DD",
    "free": "SETTING=LOW:HIGH ...",
    "hold_out": "TRIAL ...",
    "drawing.walls": "LAYER LAYER",
    "drawing.line": "LAYER",
    "formats": "A,B",
    "caliper": "SHEET",
    "readings.file": "SHEET",
    "scheduler": "tls://HOST:PORT",
}
"""Format of an option's text, by the key of the field, if the value is not a single number, word or file.

A format in quotes is one text with several parts. A format with blanks is several texts. If a format ends in "...", the
option may be repeated.
"""
READERS: dict[str, Callable[[str, str], Any]] = {"MM|CSV": along, "TOML": board}
"""Function that reads the texts of a format. Its arguments are the text and the last part of the field's key."""
NAMES = {
    "photo.ends_px": "ends",
    "photo.via_px": "via",
    "photo.roi_px": "roi",
    "formats": "format",
    "readings.file": "caliper",
}
"""Names of the options that are not named after their field, by the key of the field."""
SETTING = re.compile(r"\s*(\w+(?:\.\w+){0,3})\s*=(.*)", re.ASCII | re.DOTALL)
SET = typer.Option(
    "--set",
    metavar="TABLE.KEY=VALUE",
    help="Any setting of a trial file. Its value is TOML or a word without quotes, and replaces the file's value for "
    'this call. May be repeated: --set crack.tilt=flare --set "photo.ruler_px=[[0,0],[100,0]]"',
)


def parameter_of(key: str) -> str:
    """Return the name of a setting's parameter in a command's function."""
    return key.replace(".", "_")


def spelt_by(key: str) -> str:
    """Return the name of a setting's option, such as "--depth-mm"."""
    name = NAMES.get(key, key.rpartition(".")[2])
    return f"--{name.replace('_', '-')}"


def everyday_parameters(keys: Sequence[str], needs: Sequence[str]) -> Iterator[inspect.Parameter]:
    """Yield the parameters for everyday settings and for --set. The settings in ``needs`` are required."""
    for key in keys:
        yield FieldOption(trial_model(), key).parameter(key in needs, brief=True)
    yield parameter("set", list[str] | None, SET, None)


def model_parameters(model: str) -> Iterator[inspect.Parameter]:
    """Yield a parameter for each field of the settings model "module:Class"."""
    for name, field in model_of(model).model_fields.items():
        yield FieldOption(model_of(model), name).parameter(field.is_required(), brief=False)


def parameter(name: str, kind: Any, shown: Any, default: Any) -> inspect.Parameter:
    """Return an option as a keyword parameter of a command's function. ``shown`` is the description of the option."""
    annotation = Annotated[kind, shown]
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)


def read_model(model: str, arguments: dict[str, Any]) -> Any:
    """Return the settings model "module:Class" with the values of its options, and remove them from ``arguments``.

    Raises InputError with the name of the option for a value that is not allowed.
    """
    from sealtwin.core.settings import checked

    kind, values = model_of(model), dict[str, Any]()
    for name, field in kind.model_fields.items():
        # Absent options stay unset. The model can then distinguish absent options from options given with the default
        # value.
        if (text := arguments.pop(name)) is not None and text is not field.default:
            values[name] = FieldOption(kind, name).value(text)
    with naming_options(values):
        return checked(kind, Path("options"), values)


@contextmanager
def naming_options(options: Iterable[str], settings: Iterable[str] = ()) -> Iterator[None]:
    """Name settings in messages as this call gave them: "--depth-mm", or "--set crack.depth_mm"."""
    spelt = {key: f"--set {key}" for key in settings} | {key: spelt_by(key) for key in options}
    try:
        yield
    except SettingsFaults as fault:
        sentences = [*fault.sentences]
        for number, (where, text) in enumerate(fault.faults):
            for key in (key for key in spelt if f"{where}.".startswith(f"{key}.")):
                inner = INDEX.sub("", where.removeprefix(key)).replace(".", " ", 1)
                sentences[number] = f"{spelt[key]}{inner}{text.removeprefix(where)}"
                if spelt[key] == spelt_by(key) and BETWEEN.search(form := FORMS.get(key, "")):
                    sentences[number] += f" Write {spelt[key]} {form.rstrip(' .')}."
        raise InputError("\n".join(sentences)) from None


def settings_of(options: Mapping[str, Any], others: Sequence[str]) -> Given:
    """Return settings by dotted name, from everyday options and from texts "table.key=value".

    ``options`` contains the texts of the everyday options by dotted name. Names of files become absolute. Raises
    typer.BadParameter for a text without a name and for a setting that is given twice, and InputError for a file that
    cannot be used.
    """
    settings: Given = {}
    for key, text in options.items():
        settings[key] = _with_whole_names(key, FieldOption(trial_model(), key).value(text))
    for text in others:
        key, value = _setting(text)
        if twice := [name for name in settings if f"{name}.".startswith(f"{key}.") or key.startswith(f"{name}.")]:
            raise typer.BadParameter(f"--set {text}: {twice[0]} is given twice; give it only once")
        settings[key] = value
    return settings


def model_of(name: str) -> "type[Settings]":
    """Import and return the settings model "module:Class". It is imported only here, so that --help is fast."""
    module, _, kind = name.partition(":")
    return getattr(import_module(module), kind)


def trial_model() -> "type[Settings]":
    return model_of("sealtwin.trial.trial_file:Trial")


def _setting(text: str) -> tuple[str, Any]:
    """Return key and value of a text "table.key=value". Raises typer.BadParameter for any other text."""
    from sealtwin.core.settings import table_of, takes
    from sealtwin.trial.trial_file import Trial

    if not (parts := SETTING.fullmatch(text)):
        raise typer.BadParameter(f"--set {text:.80}: expected TABLE.KEY=VALUE, as in crack.tilt=flare")
    key, value = parts[1], parts[2].strip()
    # Commands check the names of single settings, so a whole table is refused.
    if key in Trial.model_fields and table_of(Trial, (key, "")) is not None:
        raise typer.BadParameter(
            f"--set {text:.80}: {key} is a table; give its settings one by one, as {key}.KEY=VALUE"
        )
    # In a setting that may be a list, 11,8 may be one number or two.
    return key, _with_whole_names(key, _value(value, comma=not takes(Trial, key, tuple)))


def _with_whole_names(key: str, value: Any) -> Any:
    """Return the value of a setting with absolute names of files, also inside a table."""
    from sealtwin.core.settings import names_file
    from sealtwin.trial.trial_file import Trial

    if isinstance(value, dict):
        return {name: _with_whole_names(f"{key}.{name}", inner) for name, inner in value.items()}
    return Path(value).absolute() if isinstance(value, str) and names_file(Trial, key) else value


def _value(text: str, *, comma: bool) -> Any:
    """Read a value in TOML, a number with a decimal comma if ``comma`` is True, or a word without quotes."""
    with suppress(ValueError, RecursionError):
        content = tomllib.loads(f"value = {text}")
        if content.keys() == {"value"}:
            return content["value"]
    return read_value(text, comma=comma)
