"""Sentences on where along the crack a simulated level leaves the readings."""

from itertools import groupby

import numpy as np

from sealtwin.core.records import Floats
from validate.comparison import StationError, StationErrors
from validate.result import Comparison

NAMED = 3  # Stretches that a sentence names, the largest errors first
AT_A_STATION_MM = 0.05  # Distance from a station within which an error is that station's, as s is written


def where_off(comparison: Comparison) -> tuple[str, ...]:
    """Return where the level leaves the band that holds at all stations together, and how far it can be checked."""
    if (uncertainty := comparison.uncertainty) is None:
        return ()
    return (*stretches_off(uncertainty.stations), *between_stations(uncertainty.levels.s_mm, comparison.worst_at_mm))


def worst_at_a_station(stations: StationErrors, worst_at_mm: float) -> StationError | None:
    """Return the worst error at a station; None if the worst of all is at one, or there is no station."""
    if not len(stations.s_mm) or np.abs(stations.s_mm - worst_at_mm).min() < AT_A_STATION_MM:
        return None
    worst = int(np.argmax(np.abs(stations.error_mm)))
    return StationError(abs(float(stations.error_mm[worst])), float(stations.s_mm[worst]))


def stretches_off(stations: StationErrors) -> tuple[str, ...]:
    """Stretches of neighbouring stations that are off to one side, the largest error first."""
    sides = np.where(stations.off, np.sign(stations.error_mm), 0).astype(int)
    found: list[tuple[float, str]] = []
    for side, group in groupby(range(len(sides)), key=lambda station: int(sides[station])):
        if side:
            part = list(group)
            worst = max(part, key=lambda station: abs(stations.error_mm[station]))
            off_mm = abs(float(stations.error_mm[worst]))
            first, last, at = (f"{stations.s_mm[station]:g}" for station in (part[0], part[-1], worst))
            place = f"from {first} to {last} mm (by up to {off_mm:.1f} mm, at {at} mm)"
            if len(part) == 1:
                place = f"at {at} mm (by {off_mm:.1f} mm)"
            found.append((off_mm, f"too {'high' if side > 0 else 'low'} {place}"))
    if not found:
        return ()
    named = [told for _, told in sorted(found, key=lambda stretch: -stretch[0])]
    others = len(named) - NAMED
    more = f"; in {others} other {'stretch' if others == 1 else 'stretches'} by less" if others > 0 else ""
    return (
        "Along s, outside the band that holds at all stations together, the simulated level is "
        f"{', '.join(named[:NAMED])}{more}.",
    )


def between_stations(stations_mm: Floats, worst_at_mm: float) -> tuple[str, ...]:
    """A reader looks for the worst error among the stations, where it may not be."""
    if np.abs(stations_mm - worst_at_mm).min() < AT_A_STATION_MM:
        return ()
    return (
        f"The worst error of all, at {worst_at_mm:.1f} mm, lies between stations, where the readings are taken to "
        "follow a straight line.",
    )
