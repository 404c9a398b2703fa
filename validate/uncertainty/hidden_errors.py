"""Errors of the readings that no repeat shows: each has a size only if it is declared."""

import numpy as np

from sealtwin.core.records import Floats, Profile
from validate.settings import OF_THE_READINGS, Readings, Uncertainty
from validate.uncertainty.budget import FEW_STATIONS, UNDECLARED_MM, Component, draws_for, hats, normals, uniforms
from validate.uncertainty.meniscus import Mouth

ALIKE_MM = 15.0
"""Correlation length of an error that all repeats share: the length over which a bed rises and falls."""
UNSURE = 0.8
"""Standard deviation of the slope at a station, over its mean change there and at both neighbours. Chosen so that bands
of tips of 2 to 4 mm contain 94 to 99 % of stations."""
USUAL = {"readings.probe_mm": 2.0, "readings.limit_mm": 0.02}
"""Sizes of undeclared errors: width of a tip, and a gauge's error of scale, relative."""
OF_READINGS = ("datum_error_mm", "probe_mm")
ROUNDING = "readings.rounding"


def hidden_errors(
    measured: Profile, settings: Readings, declared: Uncertainty, mouth: Mouth, step_mm: float
) -> tuple[list[Component], tuple[Component, ...]]:
    """Return the declared errors, and the undeclared ones with a size of ``UNDECLARED_MM`` or that in their names.

    ``step_mm`` is the last digit of the readings.
    """
    sizes_mm = {
        **{f"readings.{name}": getattr(settings, name) for name in OF_READINGS},
        **{f"uncertainty.{name}": getattr(declared, name) for name in OF_THE_READINGS},
    }
    if "limit_mm" not in settings.model_fields_set:
        sizes_mm["readings.limit_mm"] = None
    height_mm, stations = measured.level_mm - (settings.datum_level_mm or 0.0), len(measured.s_mm)
    present, missing = list[Component](), list[Component]()
    for name, value in sizes_mm.items():
        size_mm = USUAL.get(name, UNDECLARED_MM) if value is None else value
        (missing if value is None else present).append(_error(name, size_mm, measured.s_mm, height_mm))
    if settings.rounding != "nearest":
        # The error of the last digit is the rest of the rounding. Toward zero, a level at the datum stays.
        toward = {"down": 1.0 if measured.is_depth else -1.0, "toward_zero": -np.sign(height_mm)}
        shift_mm = step_mm / 2 * toward[settings.rounding] if settings.rounding else UNDECLARED_MM
        draws_mm = shift_mm * np.ones((draws_for(stations), stations))
        one = Component("one-sided rounding", "declared", draws_mm, shared=True, setting=ROUNDING)
        (missing if settings.rounding is None else present).append(one)
    tension_n_m = declared.surface_tension_n_m
    if (meniscus := mouth.meniscus(measured.s_mm, measured.level_mm, tension_n_m, "readings")) is not None:
        (missing if tension_n_m is None else present).append(meniscus)
    return present, tuple(missing)


def _slopes(s_mm: Floats, level_mm: Floats) -> tuple[Floats, Floats, Floats]:
    """Return at each station the slope on the steeper side, the mean of both sides, and the change of slope, (n,) each.

    The last is a mean over the station and its neighbours.
    """
    slope = np.diff(level_mm) / np.diff(s_mm)
    sides = np.array([np.append(slope[0], slope), np.append(slope, slope[-1])])
    turn = np.abs(np.diff(np.pad(slope, 2, mode="reflect")))
    steeper = sides[np.abs(sides).argmax(axis=0), np.arange(len(s_mm))]
    return steeper, sides.mean(axis=0), np.convolve(turn, np.full(3, 1 / 3), "valid")


def _error(name: str, size_mm: float, s_mm: Floats, height_mm: Floats) -> Component:
    """Return draws of an error of the size ``size_mm``. ``height_mm`` is that of the level above the datum."""
    slope, mean_slope, turn = _slopes(s_mm, height_mm)
    stations, ones, draws = len(s_mm), np.ones(len(s_mm)), draws_for(len(s_mm))
    common, own = normals(name, 1, draws), normals(f"{name}, each", stations, draws)
    shared = name not in ("uncertainty.station_each_mm", "uncertainty.common_mm")
    if name == "readings.datum_error_mm":
        label, draws_mm = "height of the datum", size_mm * common * ones
    elif name == "readings.limit_mm":
        label, draws_mm = f"scale of a gauge that is {size_mm:.0%} off", size_mm * common * height_mm
    elif name == "readings.probe_mm":
        # A probe reads the highest point below it. Its half meets slopes that stations do not show.
        label = f"width of a probe of {size_mm:g} mm on a slope"
        draws_mm = size_mm / 2 * np.abs(mean_slope + UNSURE * turn * own)
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
        label, place = "tilted datum or bowed face", (s_mm - s_mm[0]) / np.ptp(s_mm)
        zero = np.round(uniforms(f"{name}, zero", 1, draws))
        draws_mm = size_mm * common * (place - zero)
    else:
        label, draws_mm = "sinking probe", -size_mm * np.abs(common) * ones
    return Component(label, "declared", draws_mm, shared=shared, setting=name)
