"""Numbers with their units under one title, as a page and paper set them down."""

from dataclasses import dataclass

import numpy as np

NOT_RECORDED = "not recorded"


@dataclass(frozen=True)
class Table:
    """Labels and what they label, each number with its unit."""

    title: str
    rows: tuple[tuple[str, str], ...]


def millimetres(value: float | None) -> str:
    """In words, where there is one."""
    return NOT_RECORDED if value is None or np.isnan(value) else f"{value:.2f} mm"
