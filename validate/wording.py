"""Numbers and the names of the code in words, each with its unit."""

from typing import Any

import numpy as np

UNITS = {
    "_pa_per_s": "Pa/s",
    "_pa_s": "Pa s",
    "_pa": "Pa",
    "_m2_s": "m²/s",
    "_kg_m3": "kg/m³",
    "_per_s": "1/s",
    "_mm_s": "mm/s",
    "_mm2": "mm²",
    "_mm3": "mm³",
    "_mm": "mm",
    "_cm": "cm",
    "_s": "s",
}


def counted(number: int, thing: str) -> str:
    """A number and its noun, in the plural where there are several."""
    return f"{number:,} {thing}{'' if number == 1 else 's'}"


def signed(number: float, decimals: int) -> str:
    """With its sign; what rounds to nothing is +0 and no less."""
    return f"{round(number, decimals) + 0.0:+.{decimals}f}"


def percent(share: float, decimals: int = 1) -> str:
    return f"{100 * share:.{decimals}f} %"


def words(key: str) -> str:
    """A name in the code as words, its unit in brackets: "frame_s" is "frame (s)"."""
    for ending, unit in UNITS.items():
        if key.endswith(ending):
            return f"{key.removesuffix(ending).replace('_', ' ')} ({unit})"
    return key.replace("_", " ")


def unit_of(key: str) -> str:
    """Of a name in the code; "1" for a pure number."""
    return next((unit for ending, unit in UNITS.items() if key.endswith(ending)), "1")


def plain(value: Any) -> str:
    if isinstance(value, bool | np.bool_):
        return "yes" if value else "no"
    return f"{value:.4g}" if isinstance(value, float | np.floating) else str(value)
