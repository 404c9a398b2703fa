"""Errors of caliper readings, by name: what the repeats show, what is declared, and what neither tells."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from sealtwin.core.records import Floats, Profile
from validate.settings import Readings, Uncertainty
from validate.uncertainty.budget import (
    FEW_STATIONS,
    UNDECLARED_MM,
    Budget,
    Component,
    Source,
    draws_for,
    hats,
    normals,
    uniforms,
)
from validate.uncertainty.contradictions import COARSE, refuse_contradicted, unused_repeatability
from validate.uncertainty.passes import coefficients, passes_error, shapes_of_passes
from validate.uncertainty.scatter import possible_scatter_mm, rounded_errors_mm
from validate.units import counted

OUTLIER = 6.0  # Distance of an outlier in robust standard deviations
STEPS_MM = (10.0, 5.0, 2.0, 1.0, 0.5, 0.25, 0.2, 0.1, 0.05, 0.02)
INCHES = (1 / 4, 1 / 8, 1 / 16, 1 / 32, 1 / 64, 0.01, 0.005)
FEWEST_LEVELS = 5
"""Different levels that show a step: by chance as many end in a multiple of 0.05 mm once in 600 sheets."""
BENT = 2.4
"""Largest arch between two stations, over that of the parabola whose curvature they show; the least is 0. A corner has
none at a station, twice that in a gap's middle, and on average once."""
ALIKE_MM = 15.0
"""Length over which an error that all repeats share is taken for alike: that over which a bed rises and falls."""


def budget_of(measured: Profile, settings: Readings, declared: Uncertainty, mouth_mm: Floats) -> Budget:
    """Return the budget of a set of readings; ``mouth_mm`` is the crack's width at the face at each station, (n,).

    Raises InputError for a declared error that the readings contradict.
    """
    refuse_contradicted(measured, settings, declared)
    s_mm, stations = measured.s_mm, len(measured.s_mm)
    draws = draws_for(stations)
    repeats_mm = measured.repeats_mm if measured.repeats_mm is not None else measured.level_mm[:, None]
    count = (~np.isnan(repeats_mm)).sum(axis=1).astype(np.float64)
    residual_mm = repeats_mm - np.nanmean(repeats_mm, axis=1, keepdims=True)
    resolution_mm = max(settings.resolution_mm, resolution_of(repeats_mm))
    seen: Source = "detected" if resolution_mm > settings.resolution_mm else "declared"
    shapes = np.zeros((stations, 0)) if declared.pass_mm == 0 else shapes_of_passes(s_mm)
    per_pass = coefficients(residual_mm, shapes)
    own_mm = residual_mm - shapes @ per_pass
    own_mm -= np.nanmean(own_mm, axis=1, keepdims=True)
    far, robust_mm = _far(own_mm, count, resolution_mm)
    unused = unused_repeatability(measured, declared, resolution_mm)
    notes = list(_outliers(s_mm[far.any(axis=1)].tolist(), robust_mm))
    # Of two readings nothing tells which one is far.
    alone = far & (count > 2)[:, None]
    kept_mm, count = np.where(alone, np.nan, own_mm), count - alone.sum(axis=1)
    middle_mm = np.nanmean(kept_mm, axis=1)
    freedom = (count - 1) * (1 - shapes.shape[1] / stations)
    squares_mm2 = np.nansum((kept_mm - middle_mm[:, None]) ** 2, axis=1)
    components: list[Component] = []
    known = bool(freedom.sum()) or declared.repeatability_mm is not None
    pooled_mm = declared.repeatability_mm or 0.0
    if freedom.sum():
        pooled_mm = float(np.sqrt(squares_mm2.sum() / freedom.sum()))
    last_digit = f"last digit, {resolution_mm:g} mm"
    if known and resolution_mm > COARSE * pooled_mm and count.max() > 1:
        draws_mm = rounded_errors_mm(np.where(alone, np.nan, repeats_mm), resolution_mm, draws) - middle_mm
        components.append(Component(f"scatter and {last_digit}", seen, draws_mm))
    else:
        if freedom.sum():
            rounded_mm2 = squares_mm2 + freedom * resolution_mm**2 / 12
            sets_mm = possible_scatter_mm(rounded_mm2, freedom, draws) / np.sqrt(count)
            draws_mm = sets_mm * normals("scatter", stations, draws) - middle_mm
            components.append(Component("scatter of the repeats", "repeats", draws_mm))
        elif known:
            draws_mm = pooled_mm * normals("scatter", stations, draws)
            components.append(
                Component("scatter of the readings", "declared", draws_mm, setting="uncertainty.repeatability_mm")
            )
        rounding_mm = resolution_mm * (uniforms("digit", stations, draws) - 0.5) / np.sqrt(count)
        components.append(Component(last_digit, seen, rounding_mm, setting="readings.resolution_mm"))
    if shapes.shape[1]:
        noise_mm2 = (pooled_mm**2 + resolution_mm**2 / 12) / (shapes**2).sum(axis=0)
        components.append(passes_error(declared.pass_mm, per_pass, noise_mm2, shapes, ~np.isnan(repeats_mm)))
    slope = _steeper_slope(s_mm, measured.level_mm)
    told = {
        "readings.datum_error_mm": settings.datum_error_mm,
        "readings.probe_mm": settings.probe_mm,
        **{f"uncertainty.{name}": getattr(declared, name) for name in ("station_mm", "station_each_mm", "common_mm")},
    }
    errors = {
        name: _declared(name, UNDECLARED_MM if value is None else value, s_mm, slope) for name, value in told.items()
    }
    limit_mm = settings.limit_mm * np.ones(stations) * (2 * uniforms("limit", 1, draws) - 1)
    components += [
        Component("limit of error of the caliper", "declared", limit_mm, shared=True, setting="readings.limit_mm"),
        *(errors[name] for name, value in told.items() if value is not None),
        _arches(s_mm, measured.level_mm),
    ]
    if settings.probe_mm is not None:
        notes += _touching(s_mm[mouth_mm <= settings.probe_mm].tolist(), settings.probe_mm)
    return Budget(
        stations=stations,
        components=tuple(components),
        missing=tuple(errors[name] for name, value in told.items() if value is None),
        scatter_known=known,
        notes=tuple(notes),
        unused=unused,
    )


def resolution_of(repeats_mm: Floats) -> float:
    """Return the largest usual step, in mm or in fractions of an inch, of which all readings are multiples; 0 if none.

    They are so up to a common height, as of a datum.
    """
    read_mm = np.unique(np.round(repeats_mm[~np.isnan(repeats_mm)], 6))
    if len(read_mm) < FEWEST_LEVELS:
        return 0.0
    steps_mm = np.array([*STEPS_MM, *(25.4 * part for part in INCHES)])
    times = (read_mm - read_mm[0])[:, None] / steps_mm
    whole = (np.abs(times - np.round(times)) * steps_mm < 1e-4).all(axis=0)
    return float(steps_mm[whole].max()) if whole.any() else 0.0


def _steeper_slope(s_mm: Floats, level_mm: Floats) -> Floats:
    """Return the slope on the steeper side of each station, (n,)."""
    slope = np.diff(level_mm) / np.diff(s_mm)
    sides = np.array([np.append(slope[0], slope), np.append(slope, slope[-1])])
    return sides[np.abs(sides).argmax(axis=0), np.arange(len(s_mm))]


def _declared(name: str, size_mm: float, s_mm: Floats, slope: Floats) -> Component:
    """Draw an error that repeats do not show, of a given size."""
    stations, ones, draws = len(s_mm), np.ones(len(s_mm)), draws_for(len(s_mm))
    common, own = normals(name, 1, draws), normals(f"{name}, each", stations, draws)
    if name == "readings.datum_error_mm":
        told, draws_mm, shared = "height of the datum", size_mm * common * ones, True
    elif name == "readings.probe_mm":
        # A probe reads the highest point that it covers: by up to the slope times half its width too high.
        told, shared = "width of the probe on a slope", True
        draws_mm = np.abs(slope) * size_mm / 2 * uniforms(name, 1, draws)
    elif name == "uncertainty.station_mm":
        told, draws_mm, shared = "common shift of the stations", slope * size_mm * common, True
    elif name == "uncertainty.station_each_mm":
        # The slope itself is known from stations that are off.
        told, shared = "place of each station", False
        unsure = 1 + np.sqrt(2) * size_mm / np.gradient(s_mm) * normals(f"{name}, slope", stations, draws)
        draws_mm = slope * unsure * size_mm * own
    else:
        told, shared = "error that all repeats of a station share", False
        # A scan's stations are so close that the error is straight between some of them.
        place_mm = s_mm if stations <= FEW_STATIONS else np.linspace(s_mm[0], s_mm[-1], FEW_STATIONS)
        alike = np.exp(-(((place_mm[:, None] - place_mm) / ALIKE_MM) ** 2) / 2)
        root = np.linalg.cholesky(alike + 1e-9 * np.eye(len(place_mm)))
        draws_mm = size_mm * own[:, : len(place_mm)] @ root.T @ hats(s_mm, place_mm).T
    return Component(told, "declared", draws_mm, shared=shared, setting=name)


def _arches(s_mm: Floats, level_mm: Floats) -> Component:
    """Draw the straight line's height above the bed in the middle between two stations.

    Each station shows a curvature; how much of it lies in the gaps beside it is drawn for each (``BENT``).
    """
    gap_mm = np.diff(s_mm)
    turn = np.diff(np.diff(level_mm) / gap_mm) / ((gap_mm[:-1] + gap_mm[1:]) / 2)
    curvature = np.pad(turn, 1, mode="edge") if len(turn) else np.zeros(len(s_mm))
    drawn = curvature * BENT * uniforms("arch", len(s_mm), draws_for(len(s_mm)))
    draws_mm = (drawn[:, :-1] + drawn[:, 1:]) / 2 * gap_mm**2 / 8
    return Component("the bed's shape between stations", "assumed", draws_mm, shared=True, between=True)


def _far(own_mm: Floats, count: Floats, resolution_mm: float) -> tuple[NDArray[np.bool_], float]:
    """Return which reading is far from the others of its station, and the robust standard deviation, in mm.

    At most one of a station is: two leave a scatter that is the station's own. Readings scatter by their last digit
    at least, where most repeats are the same.
    """
    again = count > 1
    scaled_mm = np.nan_to_num(np.abs(own_mm)) / np.sqrt(1 - 1 / np.maximum(count, 2))[:, None]
    read = ~np.isnan(own_mm[again])
    median_mm = float(np.median(scaled_mm[again][read])) if again.any() else 0.0
    robust_mm = max(1.4826 * median_mm, resolution_mm / np.sqrt(12))
    largest = np.arange(own_mm.shape[1]) == scaled_mm.argmax(axis=1)[:, None]
    return largest & (scaled_mm > OUTLIER * robust_mm) & (robust_mm > 0), robust_mm


def _outliers(places: list[float], robust_mm: float) -> Iterator[str]:
    if places:
        yield (
            f"At {counted(len(places), 'station')} (s = {_listed(places)} mm) a reading is more than {OUTLIER:g} "
            f"robust standard deviations ({robust_mm:.2g} mm) away from the others. The mean includes it; where there "
            "are three readings or more, the intervals take the true level for that of the others."
        )


def _touching(places: list[float], probe_mm: float) -> Iterator[str]:
    if places:
        yield (
            f"The probe, {probe_mm:g} mm wide, is no narrower than the crack at {counted(len(places), 'station')} "
            f"(s = {_listed(places)} mm): there it touches the walls, and reads too high by an unknown amount."
        )


def _listed(places: list[float]) -> str:
    return ", ".join(f"{s:g}" for s in places[:5]) + (" ..." if len(places) > 5 else "")
