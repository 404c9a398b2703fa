"""The paper's claims beside our figures, each with a rule of thumb that decides whether they agree."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.ndimage import label

from reports.reproduction.runs import CHOSEN, Results
from sealtwin.core.records import Floats

SAME_MM = 0.3  # Largest change of a mean error if the invented crack wanders more: no smaller difference decides
STEP = 3.5  # Factor between neighbouring values of U or D in the study, with a margin
LOW, HIGH = 1.0, 100.0  # U at which the paper's stages change
PLATEAU_CM, LARGE_CM = 0.001, 0.3  # D up to which the paper has a plateau, and from which we call D large
FLAT = "Thin fluids end the flattest, and how far off that is depends on the invented readings."
LEVEL, LITTLE = 1 / 3, 1 / 2  # Largest share of a slope that is level, and of a change that is little


@dataclass(frozen=True)
class Claim:
    """A claim, and what our runs make of it."""

    name: str
    paper: str
    here: str
    rule: str  # What agrees, to follow "it is" or "it is not"
    agrees: bool
    why: str = ""  # Reason of a disagreement, in sentences

    @property
    def sentence(self) -> str:
        return f"Agrees: it is {self.rule}." if self.agrees else f"**Disagrees**: it is not {self.rule}. {self.why}"


def claims_of(results: Results) -> list[Claim]:
    return [*_along_the_crack(results), *_over_pairs(results), *_influences(results), *_of_other_runs(results)]


def _error(name: str, paper_mm: float, here_mm: float, why: str = "") -> Claim:
    agrees = bool(abs(here_mm - paper_mm) <= SAME_MM)
    return Claim(name, f"{paper_mm:g} mm", f"{here_mm:.2f} mm", f"within {SAME_MM} mm of the paper's", agrees, why)


def _along_the_crack(results: Results) -> Iterator[Claim]:
    """Yield claims of section 4 about the pair that the paper chose, with Figs 7 and 9b."""
    chosen = results.chosen
    bins_mm: list[float] = chosen["bins_mm"]
    least = bins_mm.index(min(bins_mm))
    yield _error("mean error of the chosen pair, U = 30, D = 0.3 cm", 1.26, chosen["mean_error_mm"])
    yield Claim(
        "its mean level from 20 to 30 mm, and from 40 mm on",
        "-4 and 1 mm",
        "{level_20_to_30_mm:.1f} and {level_from_40_mm:.1f} mm".format(**chosen),
        "within 1 mm of the paper's",
        max(abs(chosen["level_20_to_30_mm"] + 4), abs(chosen["level_from_40_mm"] - 1)) <= 1,
    )
    yield Claim(
        "its largest error",
        "5 mm",
        f"{chosen['worst_error_mm']:.1f} mm",
        "within 1 mm of the paper's",
        abs(chosen["worst_error_mm"] - 5) <= 1,
    )
    yield Claim(
        "where its error is largest",
        "at the start",
        f"s = {chosen['worst_at_mm']:.0f} mm",
        "in the first 10 mm",
        chosen["worst_at_mm"] <= 10,
    )
    yield Claim(
        "drop of its error after the first 10 mm",
        "at once",
        f"from {bins_mm[0]:.2f} to {bins_mm[1]:.2f} mm",
        "largest in the first 10 mm, and at most half of that in the next",
        bins_mm[0] == max(bins_mm) and bins_mm[1] <= bins_mm[0] / 2,
    )
    yield Claim(
        "length with less than 1 mm of error",
        "75 %",
        f"{100 * chosen['share_under_1_mm']:.0f} %",
        "within 10 points of the paper's",
        abs(chosen["share_under_1_mm"] - 0.75) <= 0.1,
        "A piece with less than 1 mm in the mean has places with more.",
    )
    close = sum(each < 1 for each in bins_mm)
    yield Claim(
        "pieces of 10 mm with less than 1 mm",
        "6 of 8",
        f"{close} of 8",
        "within one of the paper's",
        abs(close - 6) <= 1,
    )
    yield Claim(
        "less than 1 mm all the way from 20 to 80 mm",
        "yes",
        f"at most {max(bins_mm[2:]):.2f} mm",
        "below 1 mm in each piece of 10 mm",
        max(bins_mm[2:]) < 1,
        "The bed rises more slowly than the readings, whose corner is at 40 mm.",
    )
    yield _error("least error of a piece", 0.1, bins_mm[least])
    yield Claim(
        "where its error is least",
        "50 to 60 mm",
        f"{10 * least} to {10 * least + 10} mm",
        "the same piece",
        least == 5,
        "The bed reaches its end level later, for the same reason.",
    )


def _over_pairs(results: Results) -> Iterator[Claim]:
    """Yield claims of section 4 about all pairs of U and D, with Fig. 8."""
    error_mm = np.array(results.error_mm)
    row, column = results.u.index(CHOSEN[0]), results.d_cm.index(CHOSEN[1])
    least_mm, most_mm = float(error_mm.min()), float(error_mm.max())
    given_away_mm = results.error_mm[row][column] - least_mm
    around_mm = error_mm[row - 1 : row + 2, column - 1 : column + 2]
    accurate_mm = least_mm + (most_mm - least_mm) / 3
    regions: Any = label(error_mm <= accurate_mm)
    # One pair alone is no region.
    sizes = sorted((int(size) for size in np.bincount(regions[0].ravel())[1:] if size > 1), reverse=True)
    nearer, thin_mm = int((error_mm < 1.24).sum()), error_mm[np.array(results.u) <= LOW]
    for u, d_cm, paper_mm, why in ((30.0, 3.0, 1.24, ""), (0.03, 1e-4, 3.45, FLAT)):
        pair_mm = error_mm[results.u.index(u), results.d_cm.index(d_cm)]
        yield _error(f"mean error of U = {u:g}, D = {d_cm:g} cm", paper_mm, pair_mm, why)
    yield _error("least mean error of all pairs", 1.24, least_mm, "It is at another pair.")
    why = f"{nearer} pairs err by less than the paper's 1.24 mm."
    yield _pair("nearest pair", (30, 3), results, int(error_mm.argmin()), why)
    yield Claim(
        "mean error of the chosen pair less that of the nearest",
        "0.02 mm",
        f"{given_away_mm:.2f} mm",
        "at most 0.1 mm, by which five seeds of the chosen pair differ",
        given_away_mm <= 0.1,
        "The nearest pair is another one.",
    )
    yield _error("largest mean error of all pairs", 3.45, most_mm, FLAT)
    why = f"All pairs with U up to 1 err by {thin_mm.min():.1f} to {thin_mm.max():.1f} mm."
    yield _pair("farthest pair", (0.03, 1e-4), results, int(error_mm.argmax()), why)
    yield Claim(
        "accurate regions of the map",
        "two",
        f"{len(sizes)}, of {' and '.join(map(str, sizes))} pairs",
        "two regions in the lower third of the errors",
        len(sizes) == 2,
        "All accurate pairs are neighbours.",
    )
    yield Claim(
        "the chosen pair is robust: mean errors a step around it",
        "robust",
        f"{around_mm.min():.2f} to {around_mm.max():.2f} mm",
        "in the lower third of the errors at each pair around it",
        bool(around_mm.max() <= accurate_mm),
        "The error falls steeply from U = 10 to 30.",
    )


def _pair(name: str, paper: tuple[float, float], results: Results, place: int, why: str) -> Claim:
    here = results.u[place // len(results.d_cm)], results.d_cm[place % len(results.d_cm)]
    alike = all(1 / STEP < one / other < STEP for one, other in zip(here, paper, strict=True))
    theirs, ours = (f"U = {u:g}, D = {d_cm:g} cm" for u, d_cm in (paper, here))
    return Claim(name, theirs, ours, "the same pair or its neighbour", alike, why)


def _influences(results: Results) -> Iterator[Claim]:
    """Yield claims of section 5 about the influence of U and of D on the mean error, with Fig. 10."""
    u, d_cm, error_mm = np.array(results.u), np.array(results.d_cm), np.array(results.error_mm)
    stages = [[_slope(u, each, *ends) for ends in ((0, LOW), (LOW, HIGH), (HIGH, np.inf))] for each in error_mm.T]
    three = [abs(level) < -LEVEL * falling and rising > 0 for level, falling, rising in stages]
    yield Claim(
        "U, at each D: level below 1, falling to 100, rising beyond",
        "yes",
        f"at {sum(three)} of {len(three)} D",
        "so at each D, if a third of the falling slope counts as level",
        all(three),
        f"Not at D = {', '.join(f'{value:g}' for value, is_so in zip(d_cm, three, strict=True) if not is_so)} cm.",
    )
    thin, middle, stiff = (error_mm[where] for where in (u < LOW, (u > LOW) & (u < HIGH), u > HIGH))
    reach_mm = [
        float(each[:, d_cm >= LARGE_CM].mean() - each[:, d_cm <= PLATEAU_CM].mean()) for each in (thin, middle, stiff)
    ]
    yield Claim(
        "a large D lowers the error: U below 1, from 1 to 100, above 100",
        "little, clearly, little",
        "{:+.2f}, {:+.2f}, {:+.2f} mm".format(*reach_mm),
        "lower from 1 to 100, with at most half the change elsewhere",
        reach_mm[1] < 0 and max(abs(reach_mm[0]), abs(reach_mm[2])) < -LITTLE * reach_mm[1],
        "Above U = 100 a large D raises the error.",
    )
    below, above = (_slope(d_cm, error_mm.mean(axis=0), *ends) for ends in ((0, PLATEAU_CM), (PLATEAU_CM, LARGE_CM)))
    yield Claim(
        "D, mean of all U: level to 0.001 cm, falling beyond",
        "yes",
        f"{below:+.2f}, {above:+.2f} mm a decade",
        "falling beyond 0.001 cm, with at most a third of that slope before",
        abs(below) < -LEVEL * above,
        "What D gains at U = 10 and 30 it loses above 100.",
    )
    wavers_mm = [_to_and_fro(each) for each in (middle, stiff)]
    yield Claim(
        "error fluctuates as D grows: U from 1 to 100, above 100",
        "more above 100",
        "by {:.2f} and {:.2f} mm".format(*wavers_mm),
        "more above 100",
        wavers_mm[1] > wavers_mm[0],
        "It fluctuates most at U = 10, from which on the error falls steeply.",
    )


def _slope(setting: Floats, error_mm: Floats, low: float, high: float) -> float:
    """Return the slope of the error over the logarithm of a setting between two of its values, in mm a decade."""
    inside = (setting >= low) & (setting <= high)
    return float(np.polyfit(np.log10(setting[inside]), error_mm[inside], 1)[0])


def _to_and_fro(error_mm: Floats) -> float:
    """Return the length of the way that errors go along each row, less the distance of its ends, as a mean in mm."""
    steps_mm = np.diff(error_mm, axis=1)
    return float((np.abs(steps_mm).sum(axis=1) - np.abs(steps_mm.sum(axis=1))).mean())


def _of_other_runs(results: Results) -> Iterator[Claim]:
    """Yield claims that need runs beside the study: damping, freezing, computing time and the printed scheme."""
    effect_mm = max(results.eta_error_mm) - min(results.eta_error_mm)
    yield Claim(
        "effect of eta from 0.02 to 2 per s on the mean error",
        "not significant",
        f"{effect_mm:.2f} mm",
        "less than a tenth of what U and D change",
        bool(effect_mm < np.ptp(results.error_mm) / 10),
    )
    yield Claim(
        "flatter with fewer particles fixed: standard deviation of the level, fixed after 2.58 s, after 5.16 s, never",
        "flatter",
        "{:.2f}, {:.2f}, {:.2f} mm".format(*results.freezing_sd_mm),
        "lower with each",
        results.freezing_sd_mm == sorted(results.freezing_sd_mm, reverse=True),
    )
    free_mm, flat_mm = results.freezing_error_mm[-1], results.baselines_mm["a flat line"]
    yield Claim(
        "the simulation fails if no particle is fixed: mean error",
        "fails",
        f"{free_mm:.2f} mm; a flat line {flat_mm:.2f} mm",
        f"nearer than a flat line by {SAME_MM} mm at most",
        free_mm > flat_mm - SAME_MM,
    )
    for way, words, why in (
        ("explicit", "with Eq. 5 in passes", ""),
        ("implicit", "with one solve, our default", "One solve takes as long at any D."),
    ):
        *below_s, above_s = (each["processor_s"] for each in results.times[way])
        times = float(above_s / np.mean(below_s))
        yield Claim(
            f"slower for D above 1 cm, {words}",
            "significantly",
            f"{times:.1f} times the time",
            "1.5 times at least",
            times >= 1.5,
            why,
        )
    yield Claim(
        "time of a frame over the number of particles, median of the runs",
        "almost linear",
        f"R² = {results.frame_r2:.2f}",
        "0.9 at least",
        results.frame_r2 >= 0.9,
    )
    wide, narrow = results.times["straight"]
    times = narrow["processor_s"] / wide["processor_s"]
    yield Claim(
        "time of a crack a third as wide",
        "9 times",
        f"{times:.0f} times",
        "between 6 and 13 times",
        6 <= times <= 13,
        f"The particles are {narrow['particles'] / wide['particles']:.0f} times as many, and so are the frames.",
    )
    once, twice = results.printed
    yield Claim(
        "the scheme as printed, one step of five iterations a frame, between leaning walls",
        "1.26 mm",
        once.get("reason", "it ends").partition(", particle")[0],
        "a run that ends",
        "reason" not in once,
        f"With two substeps it errs by {twice['mean_error_mm']:.2f} mm, compressed by "
        f"{100 * twice['density_error_p95']:.0f} %.",
    )
