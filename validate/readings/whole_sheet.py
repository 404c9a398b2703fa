"""Checks of a whole sheet: sign, unit, datum and direction, judged by its numbers, the crack and the filling."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sealtwin.core.records import Floats, Outline, Profile, Solid
from validate.metrics.volumes import fill_volumes
from validate.readings.screens import Doubt, Kind, ReadCells, spread_mm


@dataclass(frozen=True)
class SheetLimits:
    """Limits of the checks of a whole sheet, in mm or as shares.

    They were set in the same way as ``screens.CellLimits``: planted mistakes are found, and at most 5 % of sound sheets
    are questioned. A stricter limit finds smaller mistakes and questions more sound sheets.
    """

    heap_mm: float = 2.6  # Height above the face that paste reaches in few places
    everywhere_mm: float = 1.0  # Mean height above the face if no station is below it
    of_depths_mm: float = 1.0  # Mean height above the face of readings that the sheet calls depths
    hollow_mm: float = 0.5  # Mean height above the face of a bed that is highest at its ends, where paste slumps
    hollow_rise_mm: float = 0.6  # Rise of that bed from its middle to its ends
    plateau_mm: float = 3.0  # Height above the face of the highest quarter of the stations
    below_floor_mm: float = 1.0  # Distance below the floor that a level may have
    floor_slack: float = 0.1  # Share of the depth by which a floor is uneven
    tenth: float = 0.13  # Share of the depth that contains all readings if centimetres were entered as millimetres
    steady_mm: float = 0.033  # Spread of repeats that is smaller than by hand, and usual in centimetres
    fine_mm: float = 0.001  # Last digit that a caliper shows in centimetres, and not in millimetres
    covered: float = 0.8  # Share of the crack's length between the outer stations from which on their volume counts
    volume_off: float = float(np.log(1.15))  # Logarithm of the ratio of volumes that raises a doubt
    volume_met: float = 1 / 3  # Part of that logarithm that an explanation may leave
    offset_mm: float = 2.5  # Smallest constant offset that a volume shows
    offset_share: float = 0.15  # Smallest such offset as a share of the depth
    stations_share: float = 0.15
    """Share of the crack that all stations cover if centimetres were entered as millimetres."""
    nearer: tuple[tuple[float, float], ...] = ((0.5, 0.6), (0.75, 1.2))
    """Two pairs: the share of the distance to the simulated level that a change may leave, and its least gain in mm."""
    least_counted: int = 3  # Smallest number of stations that may be numbers of places
    counted_share: float = 0.5  # Share of the crack up to which stations 1, 2, 3 may be numbers of places


LIMITS = SheetLimits()
ASK: dict[Kind, str] = {
    "sign": "Correct the header: level counts upward from the face, depth downward",
    "unit": "Correct the unit in the header",
    "datum": "Measure from the face, or declare [readings] datum and datum_level_mm",
    "direction": 'Set the end at which s is 0: [readings.columns] s_from = "second", or in pairing.csv',
}
TURNED: tuple[tuple[Kind, float, str], ...] = (
    ("sign", -1.0, "with the opposite sign"),
    ("unit", 10.0, "in centimetres"),
)
"""Mistakes that multiply all levels by one factor."""


@dataclass(frozen=True)
class Filling:
    """The crack, the dispensed volume, and the simulated level if there is one."""

    outline: Outline
    solid: Solid
    volume_mm3: float
    simulated: Profile | None = None

    def held_mm3(self, s_mm: Floats, level_mm: Floats) -> float:
        """Return the volume of sealant below a level. Beyond the outer stations the level is constant."""
        above_floor_mm = np.maximum(level_mm, -self.solid.depth_at_mm(s_mm))
        profile = Profile(s_mm, above_floor_mm)
        return fill_volumes(profile, self.outline, self.solid, 0.0, self.outline.length_mm)["sealant_mm3"]


def doubts_of_sheet(cells: ReadCells, depth_mm: float | None, filling: Filling | None) -> Iterator[Doubt]:
    """Yield doubts about the sheet as a whole, at most one of each kind."""
    measured = ~np.isnan(cells.levels_mm).all(axis=1)
    if measured.sum() < 3:
        return
    s_mm, level_mm = cells.s_mm[measured], np.nanmedian(cells.levels_mm[measured], axis=1)
    by_kind = dict(_by_numbers(cells, level_mm, depth_mm))
    if filling is not None:
        for screen in (_by_volume, _by_level):
            for kind, words in screen(s_mm, level_mm, filling):
                by_kind.setdefault(kind, words)
    for kind, words in by_kind.items():
        column = cells.station_column if kind == "direction" else int(cells.columns[0])
        yield Doubt(kind, cells.header_row, column, (kind,), words, ASK[kind])


def counted_stations(cells: ReadCells, length_mm: float | None) -> Iterator[Doubt]:
    """Yield a doubt if stations whose unit is only declared are 1, 2, 3 to n: they may be numbers of places."""
    unit_mm, s_mm = cells.declared_unit_mm, cells.s_mm
    if unit_mm is None or length_mm is None or len(s_mm) < LIMITS.least_counted:
        return
    if s_mm[-1] > LIMITS.counted_share * length_mm:
        return
    if not any(np.allclose(s_mm, unit_mm * np.arange(first, first + len(s_mm))) for first in (0, 1)):
        return
    first, last = f"{s_mm[0] / unit_mm:g}", f"{s_mm[-1] / unit_mm:g}"
    finding = (
        f"the stations are {first} to {last} in steps of one, and with readings.unit they reach only {s_mm[-1]:g} mm "
        f"of a crack of {length_mm:.3g} mm: they may be numbers of places."
    )
    remedy = "Write the distance of each place along the crack"
    yield Doubt("unit", cells.header_row, cells.station_column, ("unit",), finding, remedy)


def _by_numbers(cells: ReadCells, level_mm: Floats, depth_mm: float | None) -> Iterator[tuple[Kind, str]]:
    """Yield the doubts that follow from the numbers, and from the depth of the crack if it is given."""
    above_mm, below_mm = float(np.maximum(level_mm, 0).mean()), float(np.maximum(-level_mm, 0).mean())
    highest_mm = float(np.sort(level_mm)[-max(1, len(level_mm) // 4) :].mean())
    everywhere = level_mm.min() > -0.1 and level_mm.mean() > LIMITS.everywhere_mm
    heaped = np.sort(level_mm)[-2] > LIMITS.heap_mm and above_mm > below_mm
    middle = slice(len(level_mm) // 3, max(len(level_mm) // 3 + 1, 2 * len(level_mm) // 3))
    rise_mm = float(level_mm[[0, -1]].min() - np.median(level_mm[middle]))
    least_rise_mm = max(LIMITS.hollow_rise_mm, 2 * spread_mm(cells.readings_mm))
    hollow = above_mm > LIMITS.hollow_mm + below_mm and rise_mm > least_rise_mm
    # A mound descends to the face at both ends.
    mound = rise_mm < -LIMITS.hollow_rise_mm and level_mm[[0, -1]].max() < LIMITS.hollow_rise_mm
    of_depths = cells.is_depth and above_mm > LIMITS.of_depths_mm + below_mm and not mound
    if everywhere or heaped or of_depths or hollow:
        yield "sign", f"{_share(level_mm > 0)} of the stations are above the face, up to {level_mm.max():.3g} mm."
    if highest_mm > LIMITS.plateau_mm:
        yield "datum", f"the highest quarter of the stations is {highest_mm:.3g} mm above the face."
    if depth_mm is None:
        return
    if (deepest_mm := float(level_mm.min())) < -depth_mm - max(LIMITS.below_floor_mm, LIMITS.floor_slack * depth_mm):
        yield "datum", f"the deepest station is {-deepest_mm - depth_mm:.3g} mm below the crack's floor."
    if np.abs(level_mm).max() < LIMITS.tenth * depth_mm and np.abs(level_mm).max() > 0:
        digits_mm = cells.digits_mm[~np.isnan(cells.levels_mm)]
        fine = float(np.isclose(digits_mm, LIMITS.fine_mm).mean()) > 0.5
        several = (~np.isnan(cells.levels_mm)).sum(axis=1) > 1
        steady = several.sum() >= 4 and spread_mm(cells.readings_mm) < LIMITS.steady_mm
        if fine or steady:
            why = "have digits of 0.001 mm" if fine else "repeat to a few hundredths"
            within_mm = float(np.abs(level_mm).max())
            yield "unit", f"all readings are within {within_mm:.3g} mm of the face and {why}: they may be centimetres."


def _share(which: NDArray[np.bool_]) -> str:
    return f"{which.sum()} of {len(which)}" if not which.all() else "all"


def _by_volume(s_mm: Floats, level_mm: Floats, filling: Filling) -> Iterator[tuple[Kind, str]]:
    """Yield the change of sign, unit or datum with which the volume below the readings is the dispensed volume."""
    length_mm, depth_mm = filling.outline.length_mm, filling.solid.depth_mm
    if s_mm[-1] < LIMITS.stations_share * length_mm and LIMITS.covered < 10 * s_mm[-1] / length_mm < 1.05:
        yield "unit", f"all stations are in the first {s_mm[-1]:.3g} of {length_mm:.3g} mm: they may be centimetres."
    if s_mm[-1] - s_mm[0] < LIMITS.covered * length_mm or filling.volume_mm3 <= 0:
        return
    held_mm3 = filling.held_mm3(s_mm, level_mm)
    off = abs(np.log(max(held_mm3, 1.0) / filling.volume_mm3))
    if off < LIMITS.volume_off:
        return
    volumes = f"{held_mm3 / 1000:.2f} ml are below the readings, but {filling.volume_mm3 / 1000:.2f} ml were dispensed"
    for kind, factor, words in TURNED:
        other_mm3 = filling.held_mm3(s_mm, factor * level_mm)
        if (
            _is_possible(factor * level_mm, filling)
            and abs(np.log(max(other_mm3, 1.0) / filling.volume_mm3)) < LIMITS.volume_met * off
        ):
            yield kind, f"{volumes}; {words}, the readings would give {other_mm3 / 1000:.2f} ml."
            return
    offset_mm = _offset_mm(s_mm, level_mm, filling)
    if offset_mm is not None and abs(offset_mm) > max(LIMITS.offset_mm, LIMITS.offset_share * depth_mm):
        yield (
            "datum",
            f"{volumes}; the two volumes agree if all readings are {abs(offset_mm):.2g} mm "
            f"{'lower' if offset_mm < 0 else 'higher'}, or if path.volume_ml is wrong.",
        )


def _offset_mm(s_mm: Floats, level_mm: Floats, filling: Filling) -> float | None:
    """Return the offset with which the dispensed volume is below the readings; None beyond the crack's depth."""
    from scipy.optimize import root_scalar

    def excess_mm3(offset_mm: float) -> float:
        return filling.held_mm3(s_mm, level_mm + offset_mm) - filling.volume_mm3

    limit_mm = filling.solid.depth_mm
    if excess_mm3(-limit_mm) > 0 or excess_mm3(limit_mm) < 0:
        return None
    return root_scalar(excess_mm3, bracket=(-limit_mm, limit_mm), xtol=0.01).root


def _by_level(s_mm: Floats, level_mm: Floats, filling: Filling) -> Iterator[tuple[Kind, str]]:
    """Yield the change of direction, sign or unit that brings the readings much closer to the simulated level."""
    if (run := filling.simulated) is None:
        return
    mirrored_mm = filling.outline.length_mm - s_mm
    both = np.logical_and.reduce([(at >= run.s_mm[0]) & (at <= run.s_mm[-1]) for at in (s_mm, mirrored_mm)])
    if both.sum() < 4:
        return
    there_mm, mirrored_there_mm = (np.interp(at_mm[both], run.s_mm, run.level_mm) for at_mm in (s_mm, mirrored_mm))
    level_mm = level_mm[both]
    # A constant offset contains no information on the direction.
    shape_mm, mirrored_shape_mm = (
        _distance_mm(at_mm - level_mm, shape=True) for at_mm in (there_mm, mirrored_there_mm)
    )
    candidates: list[tuple[float, float, Kind, str]] = [
        (mirrored_shape_mm, shape_mm, "direction", "with s from the crack's other end, apart from a constant")
    ]
    for kind, factor, words in TURNED:
        if _is_possible(factor * level_mm, filling):
            candidates.append(
                (_distance_mm(there_mm - factor * level_mm), _distance_mm(there_mm - level_mm), kind, words)
            )
    other_mm, own_mm, kind, words = min(candidates, key=lambda one: one[0] / max(one[1], 1e-9))
    if any(other_mm < share * own_mm and own_mm - other_mm > gain_mm for share, gain_mm in LIMITS.nearer):
        yield (
            kind,
            f"the readings are {own_mm:.2g} mm from the simulated level on average, but {other_mm:.2g} mm {words}.",
        )


def _distance_mm(error_mm: Floats, *, shape: bool = False) -> float:
    return float(np.abs(error_mm - (np.median(error_mm) if shape else 0.0)).mean())


def _is_possible(level_mm: Floats, filling: Filling) -> bool:
    """Return whether a level is between the floor and the highest heap that paste forms."""
    lowest_mm = -1.1 * filling.solid.depth_mm - LIMITS.below_floor_mm
    highest_mm = max(LIMITS.plateau_mm, LIMITS.heap_mm)
    return bool(lowest_mm <= level_mm.min() and level_mm.max() <= highest_mm)
