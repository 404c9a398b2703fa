"""What the paper says of its 132 runs, and how each of it is measured on ours.

"Position-based fluid simulation for robotic injection sealing of pavement cracks", sections 4 and 5. What it says of
damping, freezing and time is in ``extra_claims``.
"""

import numpy as np

from reports.reproduction import influence
from reports.reproduction.judging import AnyClaim, Number, Shape, ShapeAtEach
from reports.reproduction.surface import START_MM, Surface
from validate.metrics.curve_distances import CLOSE_MM

STEP = 3.5
"""Between neighbouring values of a setting in the study: so far off is next to it."""
NEAREST, FARTHEST = (30.0, 3.0), (0.03, 1e-4)
"""The pairs of U, and D in cm, that came out nearest and farthest in the paper."""
CLOSE_BINS, LEAST_BIN, FIRST_BIN = slice(2, None), 5, 0
"""Pieces of 10 mm: from 20 mm on, from 50 to 60 mm, and the first."""
DROP = 1 / 2
"""Most that is left of the error of the first 10 mm where it has dropped at once."""
CHOSEN_PAIR = "chosen pair, U = 30, D = 0.3 cm"
IN_BINS = "mean error in pieces of 10 mm of the crack"
SECTION_4, SECTION_5 = "section 4", "section 5, Influence of parameters U and D"


def _next_to(pair: tuple[float, float], paper: tuple[float, float]) -> bool:
    return all(1 / STEP < ours / theirs < STEP for ours, theirs in zip(pair, paper, strict=True))


def _pair(pair: tuple[float, float]) -> str:
    return f"U = {pair[0]:g}, D = {pair[1]:g} cm"


def _signed(values: tuple[float, ...]) -> str:
    return ", ".join(f"{value:+.2f}" for value in values)


def _place(piece: int) -> str:
    return f"{10 * piece} to {10 * piece + 10} mm"


def _drops(surface: Surface) -> bool:
    """Whether the first piece is the worst, and the second one has at most half of it."""
    bins_mm = surface.chosen.bins_mm
    return int(np.argmax(bins_mm)) == FIRST_BIN and bins_mm[1] <= DROP * bins_mm[FIRST_BIN]


ERROR_CLAIMS: tuple[AnyClaim[Surface], ...] = (
    Number(
        "least mean error",
        "the closest match achieved an error of 1.24 mm",
        SECTION_4,
        "least mean error of all runs, less the bias that the least of many noisy numbers has",
        1.24,
        "mm",
        2,
        lambda surface: surface.least_mm,
    ),
    Number(
        f"mean error of the {CHOSEN_PAIR}",
        "U = 30 and D = 0.3 cm (error = 1.26 mm) is chosen as the most suitable",
        SECTION_4,
        "area between simulated and read level over the covered length",
        1.26,
        "mm",
        2,
        lambda surface: surface.chosen.mean_mm,
    ),
    Number(
        "what the chosen pair gives away to the nearest",
        "error = 1.24 mm; error = 1.26 mm",
        SECTION_4,
        "mean error of the chosen pair less the least of all others, less the bias of that least",
        0.02,
        "mm",
        2,
        lambda surface: surface.given_away_mm,
    ),
    Number(
        "largest mean error",
        "the highest error was 3.45 mm, found with the most inviscid material",
        SECTION_4,
        "largest mean error of all runs, less the bias that the largest of many noisy numbers has",
        3.45,
        "mm",
        2,
        lambda surface: surface.most_mm,
    ),
    Number(
        "length with less than 1 mm of error, chosen pair",
        "the majority (20 - 80 mm range, 75% crack length) is simulated at a level of less than 1 mm error",
        SECTION_4,
        "share of the covered length where the levels differ by less than 1 mm",
        75,
        "%",
        0,
        lambda surface: 100 * surface.chosen.share_under_1_mm,
    ),
    Number(
        "the same by bins of 10 mm, as its Fig. 9b shows it",
        "the majority (20 - 80 mm range, 75% crack length) is simulated at a level of less than 1 mm error",
        "section 4, Fig. 9b",
        f"share of the bins whose {IN_BINS} is less than 1 mm",
        75,
        "%",
        0,
        lambda surface: 100 * surface.chosen.bins_under_1_mm,
    ),
    Shape(
        "less than 1 mm all the way from 20 to 80 mm, chosen pair",
        "the majority (20 - 80 mm range, 75% crack length) is simulated at a level of less than 1 mm error",
        "section 4, Fig. 9b",
        f"largest {IN_BINS} from 20 mm on: below 1 mm",
        "below 1 mm in every bin",
        lambda surface: f"up to {max(surface.chosen.bins_mm[CLOSE_BINS]):.2f} mm in a bin",
        lambda surface: max(surface.chosen.bins_mm[CLOSE_BINS]) < CLOSE_MM,
    ),
    Number(
        "least error of a bin, chosen pair",
        "with a minimal error of approximately 0.1 mm in the 50 - 60 mm range",
        "section 4, Fig. 9b",
        f"least {IN_BINS}",
        0.1,
        "mm",
        1,
        lambda surface: min(surface.chosen.bins_mm),
    ),
    Shape(
        "where that least is",
        "with a minimal error of approximately 0.1 mm in the 50 - 60 mm range",
        "section 4, Fig. 9b",
        f"place of the least {IN_BINS}",
        _place(LEAST_BIN),
        lambda surface: _place(int(np.argmin(surface.chosen.bins_mm))),
        lambda surface: int(np.argmin(surface.chosen.bins_mm)) == LEAST_BIN,
    ),
    Shape(
        "drop of the error after the first 10 mm, chosen pair",
        "the simulation error drops immediately once passing the first 10 mm range of the crack length",
        "section 4, Fig. 9b",
        f"{IN_BINS}: the first is the worst, and the second has at most half of it",
        "at once",
        lambda surface: f"{surface.chosen.bins_mm[0]:.2f}, then {surface.chosen.bins_mm[1]:.2f} mm",
        _drops,
    ),
    Number(
        "largest error along the crack, chosen pair",
        "the maximal error can reach approx. 5 mm",
        SECTION_4,
        "largest difference of the levels anywhere",
        5,
        "mm",
        0,
        lambda surface: surface.chosen.worst_mm,
    ),
    Shape(
        "where the chosen pair is worst",
        "but this only happens at/near the start location",
        SECTION_4,
        f"place of the largest difference: within {START_MM:g} mm of the start",
        "at the start",
        lambda surface: f"s = {surface.chosen.worst_at_mm:.1f} mm",
        lambda surface: surface.chosen.worst_at_mm <= START_MM,
    ),
)
MAP_CLAIMS: tuple[AnyClaim[Surface], ...] = (
    Shape(
        "nearest pair",
        "the closest match [...] highlighted by the bold green curve in Figure 7 (U = 30, D = 3 cm)",
        "section 4, Figs 7 and 8",
        f"pair of the least mean error: U and D within a factor of {STEP:g}, a step of the study",
        _pair(NEAREST),
        lambda surface: _pair(surface.pair(surface.best)),
        lambda surface: _next_to(surface.pair(surface.best), NEAREST),
    ),
    Shape(
        "farthest pair",
        "found with the most inviscid material (U = 0.03, D = 0.0001 cm)",
        SECTION_4,
        f"pair of the largest mean error: U and D within a factor of {STEP:g}",
        _pair(FARTHEST),
        lambda surface: _pair(surface.pair(surface.worst)),
        lambda surface: _next_to(surface.pair(surface.worst), FARTHEST),
    ),
    Shape(
        "accurate regions of the map",
        "two regions of higher accuracy (purple) and one region of lower accuracy (yellow-to-green)",
        "section 4, Fig. 8",
        f"regions of {influence.LEAST_PAIRS} or more neighbouring pairs in the lower third of the range of mean errors",
        "two",
        lambda surface: (
            f"{len(influence.accurate_regions(surface))}, of "
            f"{' and '.join(map(str, influence.accurate_regions(surface))) or 'no'} pairs"
        ),
        lambda surface: len(influence.accurate_regions(surface)) == 2,
    ),
    ShapeAtEach(
        "three stages of U",
        "a fixed-mode, varying influence [...] however strong or weak the interaction between the fluid and the wall "
        "is: the plateau stage for U < 1, the negative correlation stage for 1 < U < 100 and the positive correlation "
        "stage for U > 100",
        f"{SECTION_5}, Fig. 10b; section 6",
        "at each D: slope over log U below 1 has less than a third of the falling one from 1 to 100; rising above 100",
        "level, falling, rising at each D",
        influence.told_stages,
        influence.three_stages,
        "D",
    ),
    Shape(
        "reach of D, mm from D <= 0.001 to D >= 0.3 cm: U below 1, 1 to 100, above 100",
        "for the low-viscous fluids (U < 1), a limited negative influence is observed; while such negative influence "
        "becomes more obvious for medium-viscous fluids (1 < U < 100); [...] (U > 100), becomes limited again",
        f"{SECTION_5}, Fig. 10a; section 6",
        "mean error for D from 0.3 cm on less that for D up to 0.001 cm: negative between, and half as much elsewhere",
        "little, clearly down, little",
        lambda surface: _signed(influence.reach_of_drag(surface)),
        influence.drag_reaches_the_middle,
    ),
    Shape(
        "plateau of D, mm a power of ten: to 0.001 cm, and from there to 0.3 cm",
        "D (wall drag) generally has a negative influence (despite a plateau stage when D < 0.001 cm)",
        f"{SECTION_5}, Fig. 10a",
        "slope over log D, mean of all U: below 0.001 cm less than a third of the falling one above",
        "level, falling",
        lambda surface: _signed(influence.plateau_of_drag(surface)),
        influence.drag_begins_level,
    ),
    Shape(
        "fluctuation over D, mm: U from 1 to 100, above 100",
        "when the viscosity reaches a higher level (U > 100), the negative influence becomes limited again and also "
        "fluctuant",
        f"{SECTION_5}, Fig. 10a",
        "path of the mean error as D grows less its way, a mean over U: more above U = 100 than between 1 and 100",
        "more above 100",
        lambda surface: ", ".join(f"{value:.2f}" for value in influence.fluctuation(surface)),
        influence.fluctuates_above,
    ),
)
CLAIMS = (*ERROR_CLAIMS, *MAP_CLAIMS)
