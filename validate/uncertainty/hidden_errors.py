"""Errors of the readings that no repeat shows: each has a size only if it is declared."""

from collections.abc import Iterator

import numpy as np

from sealtwin.core.records import Floats, Profile
from validate.settings import OF_THE_READINGS, Readings, Uncertainty
from validate.uncertainty.budget import FEW_STATIONS, UNDECLARED_MM, Component, draws_for, hats, normals, uniforms
from validate.uncertainty.meniscus import Mouth

ALIKE_MM = 15.0
"""Correlation length of an error that all repeats share: the length over which a bed rises and falls."""
OF_READINGS = ("datum_error_mm", "probe_mm")
ROUNDING = "readings.rounding"


def hidden_errors(
    measured: Profile, settings: Readings, declared: Uncertainty, mouth: Mouth, step_mm: float
) -> tuple[list[Component], tuple[Component, ...]]:
    """Return the declared errors, and the undeclared ones with a size of ``UNDECLARED_MM``, the meniscus with its own.

    ``step_mm`` is the last digit of the readings.
    """
    sizes_mm = {
        **{f"readings.{name}": getattr(settings, name) for name in OF_READINGS},
        **{f"uncertainty.{name}": getattr(declared, name) for name in OF_THE_READINGS},
    }
    slope = _steeper_slope(measured.s_mm, measured.level_mm)
    errors = {
        name: _error(name, UNDECLARED_MM if value is None else value, measured.s_mm, slope)
        for name, value in sizes_mm.items()
    }
    present = [errors[name] for name, value in sizes_mm.items() if value is not None]
    missing = [errors[name] for name, value in sizes_mm.items() if value is None]
    if settings.rounding is None:
        missing.append(_rounded(np.full(len(slope), UNDECLARED_MM)))
    elif settings.rounding != "nearest":
        present.append(_rounded(step_mm / 2 * _raised(measured, settings)))
    tension_n_m = declared.surface_tension_n_m
    if (meniscus := mouth.meniscus(measured.s_mm, measured.level_mm, tension_n_m, "readings")) is not None:
        (missing if tension_n_m is None else present).append(meniscus)
    return present, tuple(missing)


def rounding_note(measured: Profile, settings: Readings, step_mm: float) -> Iterator[str]:
    """Yield a sentence on the direction of rounding to one side, if it is declared."""
    if settings.rounding in (None, "nearest"):
        return
    ways = {1.0: "below", -1.0: "above"}
    raised = {ways[sign] for sign in _raised(measured, settings).tolist() if sign}
    way = f"{raised.pop()} them" if len(raised) == 1 else "farther from the datum than they are"
    yield (
        f'The readings are rounded to one side (readings.rounding = "{settings.rounding}"): the sealant is up to '
        f"{step_mm:g} mm {way}. The intervals include it; the measured level is not corrected."
    )


def _raised(measured: Profile, settings: Readings) -> Floats:
    """Return 1 for a level that declared rounding raises, -1 for one that it lowers, and 0 for one at the datum."""
    if settings.rounding == "down":
        return np.full(len(measured.s_mm), 1.0 if measured.is_depth else -1.0)
    return -np.sign(measured.level_mm - (settings.datum_level_mm or 0.0))


def _rounded(shift_mm: Floats) -> Component:
    """Return the shift of the levels by half a step; the error of the last digit is the rest of the rounding."""
    draws_mm = np.tile(shift_mm, (draws_for(len(shift_mm)), 1))
    return Component("one-sided rounding", "declared", draws_mm, shared=True, setting=ROUNDING)


def _steeper_slope(s_mm: Floats, level_mm: Floats) -> Floats:
    """Return the slope on the steeper side of each station, (n,)."""
    slope = np.diff(level_mm) / np.diff(s_mm)
    sides = np.array([np.append(slope[0], slope), np.append(slope, slope[-1])])
    return sides[np.abs(sides).argmax(axis=0), np.arange(len(s_mm))]


def _error(name: str, size_mm: float, s_mm: Floats, slope: Floats) -> Component:
    """Return draws of an error of the size ``size_mm``."""
    stations, ones, draws = len(s_mm), np.ones(len(s_mm)), draws_for(len(s_mm))
    common, own = normals(name, 1, draws), normals(f"{name}, each", stations, draws)
    shared = name not in ("uncertainty.station_each_mm", "uncertainty.common_mm")
    if name == "readings.datum_error_mm":
        label, draws_mm = "height of the datum", size_mm * common * ones
    elif name == "readings.probe_mm":
        # A probe reads the highest point below it: too high by up to the slope times half its width.
        label = "width of the probe on a slope"
        draws_mm = np.abs(slope) * size_mm / 2 * uniforms(name, 1, draws)
    elif name == "uncertainty.station_mm":
        label, draws_mm = "common shift of the stations", slope * size_mm * common
    elif name == "uncertainty.station_each_mm":
        # The slope itself is uncertain, by stations out of place.
        label = "place of each station"
        unsure = 1 + np.sqrt(2) * size_mm / np.gradient(s_mm) * normals(f"{name}, slope", stations, draws)
        draws_mm = slope * unsure * size_mm * own
    elif name == "uncertainty.common_mm":
        label = "error that all repeats of a station share"
        # A scan has many stations: the error is interpolated between some of them.
        place_mm = s_mm if stations <= FEW_STATIONS else np.linspace(s_mm[0], s_mm[-1], FEW_STATIONS)
        alike = np.exp(-(((place_mm[:, None] - place_mm) / ALIKE_MM) ** 2) / 2)
        root = np.linalg.cholesky(alike + 1e-9 * np.eye(len(place_mm)))
        draws_mm = size_mm * own[:, : len(place_mm)] @ root.T @ hats(s_mm, place_mm).T
    elif name == "uncertainty.operator_mm":
        label, draws_mm = "operator's offset", size_mm * common * ones
    elif name == "uncertainty.datum_tilt_mm":
        # The caliper was set to zero at either end. A zero between them gives smaller errors.
        label, place = "tilted datum", (s_mm - s_mm[0]) / np.ptp(s_mm)
        zero = np.round(uniforms(f"{name}, zero", 1, draws))
        draws_mm = size_mm * common * (place - zero)
    else:
        label, draws_mm = "sinking probe", -size_mm * np.abs(common) * ones
    return Component(label, "declared", draws_mm, shared=shared, setting=name)
