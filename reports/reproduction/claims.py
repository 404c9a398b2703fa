"""What the paper says of its study, and how each of it is measured on ours.

"Position-based fluid simulation for robotic injection sealing of pavement cracks", sections 4 and 5. All are judged by
what redrawn readings make of ours, and by nothing that their table does not show: see ``Judgement``.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from reports.reproduction.surface import START_MM, Surface
from sealtwin.core.records import Floats

Judgement = Literal["agrees", "open", "disagrees"]
"""A shape agrees where it holds with the readings as they are and with at least 95 of 100 redrawn sets; it disagrees
where it holds with fewer than 5 of 100 and not with the readings as they are. A number disagrees where the paper's lies
outside the middle 95 of 100 of ours, all to the digits in which the paper gives it. All else is open: the readings, as
prose leaves them, do not decide it. So a number never agrees: that a wide range holds it proves little.
"""
SURE, RARE = 0.95, 0.05
STEP = 3.5
"""Between neighbouring values of a setting in the study: so far off is next to it."""
LOW, HIGH = 1.0, 100.0
"""U at which the paper's stages change."""


@dataclass(frozen=True)
class Number:
    """A claim about a number."""

    name: str
    paper: float
    unit: str
    digits: int
    """Behind the point, in which the paper gives it."""
    of: Callable[[Surface], float]


@dataclass(frozen=True)
class Shape:
    """A claim that holds or does not."""

    name: str
    paper: str
    said: Callable[[Surface], str]
    """What ours does, in figures."""
    holds: Callable[[Surface], bool]


@dataclass(frozen=True)
class Finding:
    """A claim against one study."""

    name: str
    paper: str
    ours: str
    redrawn: str
    """What redrawn readings make of it."""
    judgement: Judgement


def findings(surface: Surface, redrawn: Sequence[Surface]) -> list[Finding]:
    """Of every claim. ``redrawn`` are the same runs against redrawn readings."""
    return [_number(claim, surface, redrawn) for claim in NUMBERS] + [
        _shape(claim, surface, redrawn) for claim in SHAPES
    ]


def stages(surface: Surface) -> tuple[float, float, float]:
    """Slope of the mean error over U, mm a power of ten: up to U = 1, from 1 to 100, from 100 on."""
    u, error_mm = surface.by_u()
    return _slope(u, error_mm, 0.0, LOW), _slope(u, error_mm, LOW, HIGH), _slope(u, error_mm, HIGH, np.inf)


def reach_of_drag(surface: Surface) -> tuple[float, float, float]:
    """What D from 0.3 cm on does to the mean error against D up to 0.001 cm, mm: U below 1, between, above 100."""
    return _drag(surface, 0.0, LOW * 0.99), _drag(surface, LOW * 1.01, HIGH * 0.99), _drag(surface, HIGH * 1.01, np.inf)


def _drag(surface: Surface, low: float, high: float) -> float:
    return surface.mean_mm((low, high), (0.3, np.inf)) - surface.mean_mm((low, high), (0.0, 0.001))


def _slope(u: Floats, error_mm: Floats, low: float, high: float) -> float:
    inside = (u >= low) & (u <= high)
    return float(np.polyfit(np.log10(u[inside]), error_mm[inside], 1)[0])


def _next_to(pair: tuple[float, float], paper: tuple[float, float]) -> bool:
    return all(1 / STEP < ours / theirs < STEP for ours, theirs in zip(pair, paper, strict=True))


def _pair(pair: tuple[float, float]) -> str:
    return f"U = {pair[0]:g}, D = {pair[1]:g} cm"


def _three(values: tuple[float, float, float]) -> str:
    return ", ".join(f"{value:+.2f}" for value in values)


def _three_stages(surface: Surface) -> bool:
    """A plateau has less than a third of the slope that follows it; after that it rises."""
    first, second, third = stages(surface)
    return second < 0 and abs(first) < abs(second) / 3 and third > 0


def _drag_reaches_the_middle(surface: Surface) -> bool:
    """Little is less than half of what it does there."""
    low, middle, high = reach_of_drag(surface)
    return middle < 0 and max(abs(low), abs(high)) < abs(middle) / 2


NUMBERS = (
    Number("least mean error", 1.24, "mm", 2, lambda surface: float(surface.error_mm.min())),
    Number("mean error of the chosen pair, U = 30, D = 0.3 cm", 1.26, "mm", 2, lambda s: s.chosen.mean_mm),
    Number(
        "what the chosen pair gives away to the nearest",
        0.02,
        "mm",
        2,
        lambda surface: surface.chosen.mean_mm - float(surface.error_mm.min()),
    ),
    Number("largest mean error", 3.45, "mm", 2, lambda surface: float(surface.error_mm.max())),
    Number(
        "length with less than 1 mm of error, chosen pair",
        75,
        "%",
        0,
        lambda surface: 100 * surface.chosen.share_under_1_mm,
    ),
    Number(
        "the same by bins of 10 mm, as its Fig. 9b shows it",
        75,
        "%",
        0,
        lambda surface: 100 * surface.chosen.bins_under_1_mm,
    ),
    Number("largest error along the crack, chosen pair", 5, "mm", 0, lambda surface: surface.chosen.worst_mm),
)
SHAPES = (
    Shape(
        "nearest pair",
        _pair((30, 3)),
        lambda surface: _pair(surface.pair(surface.best)),
        lambda surface: _next_to(surface.pair(surface.best), (30, 3)),
    ),
    Shape(
        "farthest pair",
        _pair((0.03, 1e-4)),
        lambda surface: _pair(surface.pair(surface.worst)),
        lambda surface: _next_to(surface.pair(surface.worst), (0.03, 1e-4)),
    ),
    Shape(
        "where the chosen pair is worst",
        "at the start",
        lambda surface: f"s = {surface.chosen.worst_at_mm:.1f} mm",
        lambda surface: surface.chosen.worst_at_mm <= START_MM,
    ),
    Shape(
        "three stages of U, mm a power of ten: below 1, 1 to 100, above 100",
        "level, falling, rising",
        lambda surface: _three(stages(surface)),
        _three_stages,
    ),
    Shape(
        "reach of D, mm from D <= 0.001 to D >= 0.3 cm: U below 1, 1 to 100, above 100",
        "little, clearly down, little",
        lambda surface: _three(reach_of_drag(surface)),
        _drag_reaches_the_middle,
    ),
)


def _number(claim: Number, surface: Surface, redrawn: Sequence[Surface]) -> Finding:
    low, high = np.quantile([claim.of(each) for each in redrawn], (RARE / 2, 1 - RARE / 2))
    # As the table shows them, so that nobody needs to take the judgement on trust.
    ours, low, high = (f"{value:.{claim.digits}f}" for value in (claim.of(surface), low, high))
    within = float(low) <= claim.paper <= float(high)
    return Finding(
        claim.name,
        f"{claim.paper:.{claim.digits}f} {claim.unit}",
        f"{ours} {claim.unit}",
        f"{low} to {high} {claim.unit}",
        "open" if within else "disagrees",
    )


def _shape(claim: Shape, surface: Surface, redrawn: Sequence[Surface]) -> Finding:
    share, holds = float(np.mean([claim.holds(each) for each in redrawn])), claim.holds(surface)
    judgement: Judgement = "open"
    if holds and share >= SURE:
        judgement = "agrees"
    elif not holds and share < RARE:
        judgement = "disagrees"
    told = f"holds with {100 * share:.1f} %; as they are: {'yes' if holds else 'no'}"
    return Finding(claim.name, claim.paper, claim.said(surface), told, judgement)
