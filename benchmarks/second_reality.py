"""Closed forms, limits and orders of convergence of the second reality, which is no part of sealtwin.

    python -m benchmarks.second_reality

Nothing here is compared with sealtwin. Its targets were committed before its figures were computed.
"""

import statistics
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from math import pi, radians, tan

import numpy as np
from scipy.integrate import quad, solve_ivp
from scipy.optimize import root_scalar

from benchmarks.heap_limit import holding_pa
from benchmarks.reality.along import Fluid, Slot, Source, State, run
from benchmarks.reality.inputs import Cavity, Numerics, Paste, Pour, Poured
from benchmarks.reality.law import LAWS, Law, closed_law, flow_of, resolved_law
from benchmarks.reality.pour import normal_stress, poured
from benchmarks.reality.section import Floats, Section, Solid, flows
from benchmarks.reality.surface import capillary_curve_m
from benchmarks.reality.worlds import late
from benchmarks.reality.yielding import yield_gradient
from benchmarks.table import Row, run_benchmark

Figures = Iterator[tuple[str, float]]

TARGETS: dict[str, tuple[str, float, float]] = {
    "Bingham plates, mean speed at 0.3 of yield": ("ratio", 0.99, 1.01),
    "Bingham plates, mean speed at 0.6 of yield": ("ratio", 0.99, 1.01),
    "Herschel-Bulkley plates, n = 0.5, at 0.5 of yield": ("ratio", 0.99, 1.01),
    "flow 2 % below the yield gradient, over Newtonian": ("ratio", 0.0, 1e-3),
    "Newtonian duct, depth 0.25 of width, to the series": ("ratio", 0.99, 1.01),
    "Newtonian duct, depth 0.5 of width, to the series": ("ratio", 0.99, 1.01),
    "Newtonian duct, depth of the width, to the series": ("ratio", 0.99, 1.01),
    "Newtonian duct, depth twice the width, to the series": ("ratio", 0.99, 1.01),
    "yield gradient of a rectangle, to its Cheeger set": ("ratio", 0.98, 1.02),
    "yield gradient of a trapezoid, to its Cheeger set": ("ratio", 0.98, 1.02),
    "Bingham plates with slip, mean speed": ("ratio", 0.99, 1.01),
    "slip with 10,000 times the friction, to no slip": ("ratio", 0.99, 1.01),
    "order of the section's mesh, ratio of errors": ("ratio", 3.0, 5.0),
    "table between its nodes, worst error of a flow": ("ratio", 0.0, 0.03),
    "spreading front in a slot, height to Barenblatt": ("ratio", 0.98, 1.02),
    "spreading front in a slot, length to Barenblatt": ("ratio", 0.98, 1.02),
    "spreading sheet, height to Huppert": ("ratio", 0.97, 1.03),
    "bank between walls at rest, slope to 2 tau / w": ("ratio", 0.98, 1.02),
    "bank between walls and floor, RMS to its curve": ("mm", 0.0, 0.1),
    "slump with normal stresses, height to Dubash": ("ratio", 0.95, 1.05),
    "bank at rest, stress that limit analysis needs to hold it": ("ratio", 0.9, 1.1),
    "thin liquid on a tilted sample, slope to level": ("ratio", 0.99, 1.01),
    "meniscus, weight to the pull of both walls": ("ratio", 0.999, 1.001),
    "meniscus near 90 degrees, rise to the linear one": ("ratio", 0.99, 1.01),
    "volume, poured less in the crack and over the face": ("ratio", 0.0, 1e-12),
    "volume of a late pump, missing over flow x delay": ("ratio", 0.999, 1.001),
    "symmetric pour, left less right": ("mm", 0.0, 1e-9),
    "frozen at once, paste beyond the nozzle": ("mm3", 0.0, 1e-9),
    "rise of the yield stress over rate x rest": ("ratio", 0.95, 1.05),
    "cells 1 to 0.5 mm over 0.5 to 0.25 mm, change of level": ("ratio", 1.6, 6.0),
    "cells 0.5 to 0.25 mm, RMS change of level": ("mm", 0.0, 0.1),
    "steps halved, RMS change of level": ("mm", 0.0, 0.01),
    "yield strain halved, RMS change of level": ("mm", 0.0, 0.1),
    "one pour, median time": ("s", 0.0, 5.0),
}
"""Unit and bounds of each figure."""

BECAUSE = {
    "cells 1 to 0.5 mm over 0.5 to 0.25 mm, change of level": "a front ends with a cell: from 0.25 to 0.125 mm the "
    "ratio is 1.64, so that 0.5 mm is about 0.05 mm from no cells",
}

STICKS, WEIGHT = Solid(), 1700 * 9.81
CAVITY = Cavity.even(40.0, 4.5, 10.0, wall_deg=5.0)
PASTE = Paste(density_kg_m3=1700.0, yield_stress_pa=7.5, consistency_pa_sn=3.0)
POUR = Pour.steady(0.0, 40.0, seconds=15.0, volume_mm3=1160.0)
"""Four fifths of the cavity."""


def second_reality() -> Sequence[Row]:
    figures = dict(of for part in (sections, fronts, banks, surfaces, balances, refinements) for of in part())
    return [
        Row(name, figures[name], unit, low, high, because=BECAUSE.get(name, ""))
        for name, (unit, low, high) in TARGETS.items()
    ]


def sections() -> Figures:
    for part in (0.3, 0.6):
        bingham = (1.0 - 1.5 * part + 0.5 * part**3) / 12.0
        yield f"Bingham plates, mean speed at {part:g} of yield", _plates(part, 1.0, STICKS) / bingham
    half = 0.5**3 * (1.0 + 0.5 / 3.0) / 32.0
    yield "Herschel-Bulkley plates, n = 0.5, at 0.5 of yield", _plates(0.5, 0.5, STICKS) / half
    rectangle, trapezoid = Section(1.0, 0.0, 32, 40), Section(2.0, 0.4, 32, 40)
    least = yield_gradient(1.0, 0.0, 1.0, 1.0)
    below = flows(rectangle, np.array([0.0, 1.02 / least]), 1.0, STICKS)
    yield "flow 2 % below the yield gradient, over Newtonian", abs(below[1]) / below[0]
    for depth, words in ((0.25, "depth 0.25 of width"), (0.5, "depth 0.5 of width"), (1.0, "depth of the width")):
        yield f"Newtonian duct, {words}, to the series", _newtonian(Section(depth, 0.0)) / duct(depth)
    yield "Newtonian duct, depth twice the width, to the series", _newtonian(Section(2.0, 0.0)) / duct(2.0)
    yield "yield gradient of a rectangle, to its Cheeger set", _yields_at(rectangle)
    yield "yield gradient of a trapezoid, to its Cheeger set", _yields_at(trapezoid)
    # Sliding speed (1/2 - 0.5 x 0.2) / (6 / 3), and the flow within.
    slipping = (0.5 - 0.1) / 2.0 + (1.0 - 1.5 * 0.4 + 0.5 * 0.4**3) / 12.0
    yield "Bingham plates with slip, mean speed", _plates(0.4, 1.0, Solid(0.5, 1.0 / 3.0)) / slipping
    one = Section(2.0, 0.2)
    both = [flows(one, np.array([0.1]), 1.0, solid)[0] for solid in (Solid(1.0, 1e4), STICKS)]
    yield "slip with 10,000 times the friction, to no slip", both[0] / both[1]
    errors = [abs(_newtonian(Section(1.0, 0.0, 8 * fine, 10 * fine)) / duct(1.0) - 1.0) for fine in (1, 2)]
    yield "order of the section's mesh, ratio of errors", errors[0] / errors[1]
    yield "table between its nodes, worst error of a flow", _worst_of_table()


def duct(depth: float) -> float:
    """Return the flow in the lower half of a duct of width 1: the series of White (2006, eq. 3-48)."""
    odd = np.arange(1, 200, 2)
    return depth / 12.0 * (1.0 - 96.0 / (pi**5 * depth) * float(np.sum(np.tanh(odd * pi * depth) / odd**5)))


def _newtonian(section: Section) -> float:
    return float(flows(section, np.zeros(1), 1.0, STICKS)[0])


def _plates(part: float, exponent: float, solid: Solid) -> float:
    """Return the mean speed far above the floor: what a deeper slot carries more, over its further depth."""
    deep, deeper = (
        flows(Section(depth, 0.0, 24, 60), np.array([part / 2.0]), exponent, solid)[0] for depth in (8.0, 12.0)
    )
    return float(deeper - deep) / 4.0


def _yields_at(section: Section) -> float:
    """Return yield gradient over gradient where the flow of the finite elements ends, by a parabola in its root."""
    least = yield_gradient(section.depth, section.narrowing, 1.0, 1.0)
    parts = np.array([0.0, 0.6, 0.7, 0.8, 0.9])
    flow = flows(section, parts / least, 1.0, STICKS)
    curve = np.polynomial.Polynomial.fit(parts[1:], np.sqrt(flow[1:] / flow[0]), 2)
    return 1.0 / min((root.real for root in curve.roots() if root.real > 0.9), key=lambda root: abs(root - 1.0))


def _worst_of_table() -> float:
    """Return the largest error of a flow over that of the same section without yield stress, off the tables' nodes."""
    worst, parts = 0.0, np.array([0.0, 0.25, 0.6, 0.8])
    for exponent, share, friction in LAWS:
        law = resolved_law(exponent, share, friction)
        for depth, narrowing in (
            (0.1, 0.0),
            (0.5, 0.25),
            (1.2, -0.25),
            (1.6, 0.5),
            (3.0, 0.25),
            (3.0, 0.7),
            (2.0, 0.9),
        ):
            yields = parts / yield_gradient(depth, narrowing, share, share)
            flow = flows(Section(depth, narrowing), yields, exponent, Solid(share, friction))
            table = [flow_of(law, depth, narrowing, one)[0] for one in yields]
            worst = max(worst, float(np.abs(table - flow).max() / flow[0]))
    return worst


def fronts() -> Figures:
    # In units of 4 mm and its own time, h = t^-1/3 (1 - x^2 / (6 t^2/3)) solves h_t = (h h_x)_x (Barenblatt 1952).
    size, width = 4e-3, 4e-3
    own_s = 12.0 / (width**2 * WEIGHT * size) * size**2
    x, before, after = _spread(closed_law(walls=True, floor=False), width, lambda x: 1.0 - x**2 / 6.0, size, own_s)
    yield "spreading front in a slot, height to Barenblatt", after.max() / size * 8.0 ** (1 / 3)
    length = np.sqrt((after * x**2).sum() / after.sum()) / np.sqrt((before * x**2).sum() / before.sum())
    yield "spreading front in a slot, length to Barenblatt", length / 8.0 ** (1 / 3)
    # h = t^-1/5 (1 - 3/10 x^2 / t^2/5)^1/3 solves h_t = (h^3 h_x)_x (Huppert 1982).
    own_s = 3.0 / (WEIGHT * size**3) * size**2
    law = closed_law(walls=False, floor=True)
    x, before, after = _spread(law, width, lambda x: np.maximum(1.0 - 0.3 * x**2, 0.0) ** (1 / 3), size, own_s)
    yield "spreading sheet, height to Huppert", after.max() / size * 8.0 ** (1 / 5)


def _spread(law: Law, width: float, shape, size: float, own_s: float) -> tuple[Floats, Floats, Floats]:
    """Let a liquid of viscosity 1 spread from its time 1 to 8; return places, and depths before and after."""
    x = (np.arange(400.0) + 0.5 - 200) * 0.03
    slot = Slot(0.03 * size, np.full(400, width), np.zeros(400), np.full(400, -10 * size), 0.0)
    before = np.maximum(shape(x), 0.0) * size
    return x, before, _settled(slot, _fluid(law, 0.0, 1.0), before, 7.0 * own_s)


def banks() -> Figures:
    # A column of 8 mm by 12 mm slumps in a slot of 4 mm.
    width, cell, yield_pa = 4e-3, 0.25e-3, 7.5
    x = (np.arange(320.0) + 0.5 - 160) * cell
    slot = Slot(cell, np.full(320, width), np.zeros(320), np.full(320, -0.1), 0.0)
    column = np.where(np.abs(x) < 4e-3, 12e-3, 0.0)
    depth = _settled(slot, _fluid(closed_law(walls=True, floor=False), yield_pa, 0.3), column, 400.0)
    flank = (x > 2e-3) & (depth > 1e-3)
    slope = -np.polyfit(x[flank], depth[flank], 1)[0]
    yield "bank between walls at rest, slope to 2 tau / w", slope / (2.0 * yield_pa / (width * WEIGHT))
    depth = _settled(slot, _fluid(resolved_law(), yield_pa, 0.3), column, 400.0)
    curve = _bank_with_floor(x, width, yield_pa, column.sum() * cell)
    yield "bank between walls and floor, RMS to its curve", _rms(depth - curve) * 1e3
    sheet = _fluid(closed_law(walls=False, floor=True), yield_pa, 0.3)
    stressed = sheet._replace(normal_stress=normal_stress(1.0))
    depth = _settled(slot, stressed, column, 400.0)
    yield "slump with normal stresses, height to Dubash", depth.max() / _slump_height(yield_pa, column.sum() * cell)
    # The limit analysis moves paste between the walls as a plug, which bears a difference of twice the yield stress.
    plug = _fluid(resolved_law(), yield_pa, 0.3)._replace(normal_stress=2.0)
    half = Slot(cell, slot.width[160:], slot.narrowing[160:], slot.floor[160:], 0.0)
    depth = _settled(half, plug, np.where(x[160:] < 12e-3, 12e-3, 0.0), 400.0)
    holds = holding_pa(x[160:] * 1e3, depth * 1e3, width * 1e3, WEIGHT)
    yield "bank at rest, stress that limit analysis needs to hold it", holds / yield_pa


def _bank_with_floor(x: Floats, width: float, yield_pa: float, area: float) -> Floats:
    """Return depths of a symmetric bank whose slope is the yield gradient of its depth, and whose area is given."""

    def flank(top: float) -> Floats:
        def fall(_, depth):
            gradient = yield_gradient(max(depth[0], 1e-6) / width, 0.0, 1.0, 1.0) * yield_pa / width
            return [-gradient / WEIGHT]

        places = np.append(0.0, np.sort(np.abs(x[x > 0])))
        solved = solve_ivp(fall, (0.0, places[-1]), [top], t_eval=places, rtol=1e-8, max_step=1e-4)
        return np.interp(np.abs(x), places, np.maximum(solved.y[0], 0.0))

    step = x[1] - x[0]
    return flank(root_scalar(lambda top: flank(top).sum() * step - area, bracket=(1e-3, 20e-3), xtol=1e-6).root)


def _slump_height(yield_pa: float, area: float) -> float:
    """Return h in the middle: h^2 / 2 - (pi / 2) l h = l (X - x), l = tau / weight (Dubash et al. 2009)."""
    length = yield_pa / WEIGHT
    half = lambda top: quad(lambda h: h * (h / length - pi / 2), pi * length, top)[0]  # noqa: E731
    return root_scalar(lambda top: 2.0 * half(top) - area, bracket=(pi * length, 30e-3)).root


def surfaces() -> Figures:
    thin = replace(PASTE, yield_stress_pa=0.0, consistency_pa_sn=0.3)
    law = closed_law(walls=True, floor=True)
    tilted = poured(Cavity.even(40, 4.5, 10, rise_deg=2.0), thin, POUR, numerics=Numerics(settle_s=200.0), law=law)
    yield "thin liquid on a tilted sample, slope to level", _slope(tilted) / -tan(radians(2.0))
    width, capillary = 4.5e-3, 1.9e-3
    middle, _, _ = capillary_curve_m(width, capillary, 30.0)
    across = np.linspace(0.0, 0.5 * width / capillary, 4001)
    curve = solve_ivp(
        lambda _, z: [z[1], z[0] * (1.0 + z[1] ** 2) ** 1.5], (0.0, across[-1]), [middle / capillary, 0.0],
        t_eval=across, rtol=1e-9, atol=1e-12,
    )  # fmt: skip
    yield "meniscus, weight to the pull of both walls", np.trapezoid(curve.y[0], across) / np.sin(radians(60.0))
    middle, mean, _ = capillary_curve_m(width, capillary, 88.0)
    half = 0.5 * width / capillary
    linear = tan(radians(2.0)) / np.sinh(half) * (np.sinh(half) / half - 1.0) * capillary
    yield "meniscus near 90 degrees, rise to the linear one", (mean - middle) / linear


def balances() -> Figures:
    over = poured(replace(CAVITY, rise_deg=1.5), PASTE, replace(POUR, flow_mm3_s=1.5 * POUR.flow_mm3_s))
    lost = over.volume_mm3 - over.in_slot_mm3 - over.above_face_mm3
    assert over.beside_mouth_mm3 > 10.0
    yield "volume, poured less in the crack and over the face", abs(lost) / over.volume_mm3
    on_time, too_late = poured(CAVITY, PASTE, POUR), poured(CAVITY, PASTE, POUR, late(1.0))
    missing = on_time.volume_mm3 - too_late.volume_mm3
    yield "volume of a late pump, missing over flow x delay", missing / (POUR.flow_mm3_s[0] * 0.4)
    ends_s = np.array([0.0, 5.0])
    still = Pour(ends_s, np.array([20.0, 20.0]), ends_s, flow_mm3_s=np.array([10.0, 10.0]))
    level = poured(CAVITY, PASTE, still).middle_mm
    yield "symmetric pour, left less right", float(np.abs(level - level[::-1]).max())
    frozen = poured(CAVITY, replace(PASTE, freezes_at_s=0.0, stiffening_pa_s=0.3), still)
    beyond = np.abs(frozen.s_mm - 20.0) > 1.2 + 0.25
    deep = (frozen.mean_mm - np.interp(frozen.s_mm, CAVITY.s_mm, CAVITY.floor_mm))[beyond]
    yield "frozen at once, paste beyond the nozzle", float(deep.sum()) * 0.5 * 4.5
    # Paste that came evenly in 5 s has rested for 2.5 s in the mean.
    rise = frozen.yield_stress_pa[np.argmax(frozen.mean_mm)] - PASTE.yield_stress_pa
    yield "rise of the yield stress over rate x rest", float(rise) / (0.3 * 2.5)


def refinements() -> Figures:
    stations = np.arange(1.0, 40.0)

    def level(**numerics: float) -> Floats:
        return poured(CAVITY, PASTE, POUR, numerics=Numerics(**numerics)).at(stations)

    coarse, own, fine = (level(cell_mm=cell) for cell in (1.0, 0.5, 0.25))
    yield "cells 1 to 0.5 mm over 0.5 to 0.25 mm, change of level", _rms(coarse - own) / _rms(own - fine)
    yield "cells 0.5 to 0.25 mm, RMS change of level", _rms(own - fine)
    yield "steps halved, RMS change of level", _rms(level(step_share=0.5) - own)
    yield "yield strain halved, RMS change of level", _rms(level(yield_strain=0.05) - own)
    took = []
    for _ in range(5):
        began = time.perf_counter()
        poured(CAVITY, PASTE, POUR)
        took.append(time.perf_counter() - began)
    yield "one pour, median time", statistics.median(took)


def _fluid(law: Law, yield_pa: float, consistency: float) -> Fluid:
    return Fluid(law, WEIGHT, yield_pa, consistency, 0.0, np.inf, 1.0, normal_stress=0.0, yield_strain=0.1)


def _settled(slot: Slot, fluid: Fluid, depth: Floats, seconds: float) -> Floats:
    """Return the depth of paste some time after it had another depth, in a slot with upright walls."""
    state = State(depth * slot.width, *(np.zeros(len(depth)) for _ in State._fields[1:]))
    nothing = Source(np.zeros(2), np.zeros(2), np.zeros(2), np.zeros(2), 1e-3, 0.0)
    run(state, slot, fluid, nothing, seconds, 1.0)
    return state.area / slot.width


def _slope(bed: Poured) -> float:
    wet = bed.mean_mm > -9.9
    return float(np.polyfit(bed.s_mm[wet], bed.mean_mm[wet], 1)[0])


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))


if __name__ == "__main__":
    run_benchmark(second_reality)
