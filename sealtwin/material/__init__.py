"""Measure a paste from a spread or a flow curve. This file has the settings and results of all methods."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import date as day
from pathlib import Path
from typing import Any, Literal

from pydantic import Field

from sealtwin.core.settings import Settings, checked
from simulate.material_file import Material

DENSITY_ERROR = 0.01  # Relative standard uncertainty of a density from a weighed syringe
MEASURED = "A measured paste, written by 'sealtwin material'. Errors are standard uncertainties."
CALIBRATED = "A paste calibrated on the levels of trials by 'sealtwin calibrate'. Errors are standard uncertainties."
USE = "To use this file, give its name as material in [fluid] of a trial. not_for lists cases without validity."


class PasteSettings(Settings):
    """Settings of a paste that every method of measurement requires. Errors are standard uncertainties."""

    data: Literal["measured", "reconstructed", "synthetic"]
    """Origin of the photo or the table."""
    density_kg_m3: float = Field(ge=100, le=2e4)
    """Density of the paste, for example from a weighed syringe."""
    density_error_kg_m3: float | None = Field(default=None, gt=0, le=2e4)
    """Standard uncertainty of the density. Default: 1 % of the density."""
    date: day | None = None
    """Day of the measurement. Default: today."""

    @property
    def spread_of_density(self) -> float:
        """Standard uncertainty of the density in kg/m3, with its default."""
        return self.density_error_kg_m3 or DENSITY_ERROR * self.density_kg_m3


@dataclass(frozen=True)
class PasteValue:
    """A value with its standard uncertainty and its 95 % interval."""

    value: float
    error: float
    interval: tuple[float, float]


@dataclass(frozen=True)
class MeasuredPaste:
    """A measured paste, with further results of the measurement."""

    material: Material
    figures: dict[str, Any] = field(default_factory=dict)  # Further figures, which --json prints


def four_digits(value: float) -> float:
    return float(f"{value:.4g}")


def measured_material(path: Path, paste: PasteSettings, stress_pa: PasteValue, **measured: Any) -> Material:
    """Return a measured paste. ``measured`` contains further fields of the material file.

    Numbers and intervals are rounded to four digits. Raises InputError, whose message begins with ``path``, for a
    number out of range.
    """
    measured |= {
        "yield_stress_pa": stress_pa.value,
        "yield_stress_error_pa": stress_pa.error,
        "yield_stress_95_pa": stress_pa.interval,
    }
    for name, value in measured.items():
        match value:
            case float():
                measured[name] = four_digits(value)
            case (float(), *_):
                measured[name] = [*map(four_digits, value)]
    facts = {
        "date": (paste.date or day.today()).isoformat(),
        "data": paste.data,
        "density_kg_m3": paste.density_kg_m3,
        "density_error_kg_m3": paste.spread_of_density,
    }
    return checked(Material, path, facts | measured)


def by_source(parts_pa: Mapping[str, float]) -> str:
    """Return a sentence that lists the contribution of each source to the standard uncertainty of a yield stress."""
    return (
        f"standard uncertainty in Pa by source: {', '.join(f'{name} {value:.2g}' for name, value in parts_pa.items())}"
    )


def material_text(material: Material) -> str:
    import tomlkit
    from tomlkit.items import Array

    document = tomlkit.document()
    for line in (MEASURED if material.radius_mm is None else CALIBRATED, USE):
        document.add(tomlkit.comment(line))
    content = material.model_dump_json(exclude_none=True, exclude_defaults=True)
    for key, value in json.loads(content).items():
        item = tomlkit.item(value)
        if isinstance(item, Array) and key in ("basis", "not_for"):
            item.multiline(True)
        document.add(key, item)
    return tomlkit.dumps(document)
