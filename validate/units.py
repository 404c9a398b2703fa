"""Numbers and names in the code as text, each with its unit."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import files as resources
from typing import Any

import numpy as np
from pydantic import ConfigDict, with_config

from sealtwin.core.records import Floats

NOT_RECORDED = "not recorded"


@with_config(ConfigDict(extra="forbid"))
@dataclass(frozen=True)
class PageTable:
    """A table of the page. Each number is a text with its unit."""

    title: str
    """Title, as shown on the page."""
    rows: tuple[tuple[str, str], ...]
    """Label and value of each row."""


def millimetres(value: float | None) -> str:
    """Return a length with its unit, or ``NOT_RECORDED`` if it is None or NaN."""
    return NOT_RECORDED if value is None or np.isnan(value) else f"{value:.2f} mm"


LABELS = tomllib.loads(resources("validate").joinpath("labels.toml").read_text(encoding="utf-8"))
"""Words for names in the code: units, inputs, and the figures that a run records about itself."""
UNITS: dict[str, str] = LABELS["units"]
MODELS: dict[str, str] = LABELS["models"]


def counted(number: int, thing: str) -> str:
    """Return a number and its noun. The noun is in the plural unless the number is 1."""
    return f"{number:,} {thing}{'' if number == 1 else 's'}"


def signed(number: float, decimals: int) -> str:
    """Return a number with its sign. A number that rounds to 0 has a plus."""
    return f"{round(number, decimals) + 0.0:+.{decimals}f}"


def span(values: Floats, decimals: int) -> str:
    """Return the smallest and largest value as text, or one number if both are equal at the written digits."""
    least, most = (f"{value:.{decimals}f}" for value in (values.min(), values.max()))
    return least if least == most else f"{least} to {most}"


def percent(share: float, decimals: int = 1) -> str:
    return f"{100 * share:.{decimals}f} %"


def name_and_unit(key: str) -> tuple[str, str]:
    """Return a name in the code as words, and its unit: "frame_s" gives "frame" and "s". A pure number has no unit."""
    ending = next((ending for ending in UNITS if key.endswith(ending)), "")
    return key.removesuffix(ending).replace("_", " "), UNITS.get(ending, "")


def words(key: str) -> str:
    """Return a name in the code as words, with its unit in brackets: "frame_s" gives "frame (s)"."""
    name, unit = name_and_unit(key)
    return f"{name} ({unit})" if unit else name


def setting_name(setting: str) -> str:
    """Return the dotted name of a trial's setting in words without a unit, for example "yield stress"."""
    labels: dict[str, str] = LABELS["settings"]
    return labels.get(setting) or name_and_unit(setting.rpartition(".")[2])[0]


def assumed_words(settings: Mapping[str, Any]) -> tuple[str, ...]:
    """Return settings by dotted name, each with its value and unit: "speed of the nozzle 4 mm/s"."""
    return tuple(
        f"{setting_name(name)} {setting_words(value)} {'' if isinstance(value, str) else name_and_unit(name)[1]}".rstrip()
        for name, value in settings.items()
    )


LONGEST_VALUE = 120
"""Largest number of characters of a setting's value in a table. A board of markers has a thousand."""


def setting_words(value: Any) -> str:
    """Return the value of a setting as text. Returns "-" if it is not set."""
    match value:
        case None:
            text = "-"
        case bool() | np.bool_():
            text = "yes" if bool(value) else "no"
        case float():
            text = f"{value:.10g}"
        case dict():
            text = ", ".join(f"{words(key)} {setting_words(part)}" for key, part in value.items() if part is not None)
        case list() | tuple() if any(isinstance(part, dict | list | tuple) for part in value):
            text = f"{len(value)}: {' '.join(f'({setting_words(part)})' for part in value)}"
        case list() | tuple():
            text = ", ".join(map(setting_words, value))
        case _:
            text = str(value)
    return text if len(text) <= LONGEST_VALUE else f"{text[:LONGEST_VALUE]} ..."


def settings_words(settings: Mapping[str, Any]) -> str:
    return ", ".join(f"{name} = {setting_words(value)}" for name, value in settings.items())


def unit_of(key: str) -> str:
    """Return the unit that a name in the code ends with. Returns "1" for a pure number."""
    return name_and_unit(key)[1] or "1"
