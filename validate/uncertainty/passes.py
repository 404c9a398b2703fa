"""Whole passes over all stations, or operators: the error that they leave, and the test of a declared ``pass_mm``."""

import numpy as np

from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats
from validate.settings import PASS_MM
from validate.uncertainty.budget import Component, Source, draws_for, normals, uniforms

FREEDOM_OF_PASSES = 4.0  # Degrees of freedom of the half-t prior of that deviation, so that the repeats may show more
FALSE_ALARM = 0.01  # Probability that a true declaration is refused
ORDERS = 2_000  # Random orders of each station's repeats, which know a share of 0.3 % to 0.12 %
NUMBERS = 1_000_000  # Readings that are put into another order at a time
WAYS = ("{off} off the mean of all", "tilted by {off} (rms along the crack)", "bent by {off} (rms along the crack)")


def shapes_of_passes(s_mm: Floats) -> Floats:
    """Return an offset, a tilt and a bend along the crack, (n, k), orthogonal and each 1 on average (rms).

    Few stations have no room for all of them.
    """
    most = min(3, max(1, len(s_mm) // 2))
    place = (s_mm - s_mm.mean()) / np.ptp(s_mm)
    orthogonal, _ = np.linalg.qr(np.vander(place, most, increasing=True))
    return orthogonal * np.sqrt(len(s_mm))


def coefficients(residual_mm: Floats, shapes: Floats) -> Floats:
    """Return what each repeat has of each shape, (k, repeats), about the mean of all repeats."""
    columns: list[Floats] = []
    for one in residual_mm.T:
        read = ~np.isnan(one)
        columns.append(np.linalg.lstsq(shapes[read], one[read])[0] if shapes.shape[1] else np.zeros(0))
    found = np.array(columns).T
    return found - found.mean(axis=1, keepdims=True)


def passes_error(
    declared_mm: float | None, found: Floats, noise_mm2: Floats, shapes: Floats, read: Floats
) -> Component:
    """Draw what passes over all stations, or operators, leave in the mean of the repeats.

    Each shape has its own standard deviation t among passes. Its posterior has a half-t prior of the declared scale
    and the spread of the coefficients, whose variance is t² and that of the scatter. The passes of the mean are drawn
    with it: of their own mean the repeats tell nothing.
    """
    scale_mm = PASS_MM if declared_mm is None else declared_mm
    passes = read.shape[1]
    share = read / read.sum(axis=1, keepdims=True)
    draws = draws_for(len(read))
    total_mm = np.zeros((draws, len(read)))
    for number, (noise, shape) in enumerate(zip(noise_mm2, shapes.T, strict=True)):
        squares = float((found[number] ** 2).sum())
        t_mm = np.geomspace(1e-3 * scale_mm, 30 * (scale_mm + np.sqrt(squares)), 400)
        prior = -(FREEDOM_OF_PASSES + 1) / 2 * np.log1p((t_mm / scale_mm) ** 2 / FREEDOM_OF_PASSES)
        spread = noise + t_mm**2
        # Even steps of ln t: the density of t times t.
        chance = prior - (passes - 1) / 2 * np.log(spread) - squares / (2 * spread) + np.log(t_mm)
        below = np.cumsum(np.exp(chance - chance.max()))
        drawn_mm = np.interp(uniforms(f"pass {number}", 1, draws)[:, 0], below / below[-1], t_mm)
        each = normals(f"passes {number}", passes, draws) * drawn_mm[:, None]
        total_mm += (each @ share.T) * shape
    source: Source = "allowed for" if declared_mm is None else "declared"
    return Component("passes or operators", source, total_mm, shared=True, setting="uncertainty.pass_mm")


def require_pass_mm(residual_mm: Floats, s_mm: Floats, pass_mm: float, source: str) -> None:
    """Refuse a declared ``pass_mm`` that the columns of repeats, (n, r) about their station's mean, contradict.

    Repeats that are no passes may stand in any order within their station (a permutation test), and passes add their
    own offset, tilt and bend. Columns that differ as far in at most ``FALSE_ALARM`` of all such sheets contradict the
    declaration; each shape gets its share of that. Columns that differ less contradict nothing: passes may lack any of
    the three. Raises InputError.
    """
    shapes, read = shapes_of_passes(s_mm), ~np.isnan(residual_mm)
    (stations, passes), count = residual_mm.shape, shapes.shape[1]
    if passes < 2 or read.sum(axis=1).max() < 2:
        return
    # A column's coefficients are a sum over its readings, whatever their order.
    weight = np.zeros((passes, count, stations))
    for number in range(passes):
        weight[number][:, read[:, number]] = np.linalg.pinv(shapes[read[:, number]])

    def of_columns(values_mm: Floats) -> Floats:
        each_mm = np.einsum("ckn,...nc->...kc", weight, np.nan_to_num(values_mm))
        return each_mm - each_mm.mean(axis=-1, keepdims=True)

    random = np.random.default_rng(stations)
    # Readings that are there, before those that are missing.
    places = np.argsort(~read, axis=1, kind="stable")
    columns_mm, draws = of_columns(residual_mm), list[Floats]()
    for _ in range(0, ORDERS, step := max(1, min(ORDERS, NUMBERS // residual_mm.size))):
        keys = np.where(read, random.random((step, stations, passes)), np.inf)
        taken = np.take_along_axis(residual_mm[None], np.argsort(keys, axis=-1), axis=-1)
        again = np.empty_like(taken)
        np.put_along_axis(again, np.broadcast_to(places, taken.shape), taken, axis=-1)
        own_mm = pass_mm * random.standard_normal((step, count, passes))
        draws.append(of_columns(again) + own_mm - own_mm.mean(axis=-1, keepdims=True))
    drawn = np.concatenate(draws)
    squares, expected = (columns_mm**2).sum(axis=1), (drawn**2).sum(axis=2)
    more = (1 + (expected >= squares - 1e-12).sum(axis=0)) / (1 + len(drawn))
    if more.min() > FALSE_ALARM / count:
        return
    shape = int(more.argmin())
    column = int(np.abs(columns_mm[shape]).argmax())
    # Upward at the crack's end: QR leaves the signs of the shapes open.
    off_mm = columns_mm[shape, column] * np.sign(shapes[-1, shape])
    off = f"{off_mm:+.2f} ± {1.96 * drawn[:, shape, column].std():.2f} mm"
    raise InputError(
        f"{source}: uncertainty.pass_mm = {pass_mm:g}: the columns of repeats contradict it. Repeat {column + 1} is "
        f"{WAYS[shape].format(off=off)} (95 % by chance), and columns differ so far in fewer than "
        f"1 of 100 sheets with such passes. Leave pass_mm out, or declare by how much passes differ."
    )
