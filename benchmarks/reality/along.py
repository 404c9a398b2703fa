"""Paste along a slot: conservative finite volumes, driven by the slope of the surface. Metres, seconds, pascals."""

from math import sqrt
from typing import NamedTuple

import numpy as np
from numba import njit

from benchmarks.reality.law import Law, flow_of
from benchmarks.reality.section import Floats
from benchmarks.reality.surface import area_beside, roof_after, roof_height, share_of_disc

LONGEST_STEP_S = 2e-3
SAFETY = 0.8
"""Of the longest step that an explicit step of diffusion allows."""
AT_REST_M_S = 1e-7
"""A bed whose level moves by less, 6 micrometres in a minute, rests: a Bingham paste never quite stops."""
THINNEST_M = 2e-6
"""A film of less does not flow."""
BROKEN_BY_STRAIN = 1.0
"""Strain that takes 1/e off what a paste has stiffened at rest (Roussel 2006: rest builds, shear breaks)."""


class Slot(NamedTuple):
    """Cells of equal length along the slot."""

    cell: float
    width: Floats
    """At the face."""
    narrowing: Floats
    """Width lost per depth: the sum of both walls' tangents."""
    floor: Floats
    """Height of the floor, below 0."""
    rise: float
    """Tangent of the face's slope towards growing s."""


class Fluid(NamedTuple):
    law: Law
    weight: float
    """Density times gravity's part that is square to the face."""
    yield_stress: float
    consistency: float
    stiffening: float
    """Pa in a second of rest."""
    freezes_at: float
    wall_share: float
    normal_stress: float
    """Over the yield stress: the difference of normal stresses that a plug bears along the slot; 0: none."""
    yield_strain: float
    """Strain along the slot in which that difference builds up."""


class Source(NamedTuple):
    time: Floats
    place: Floats
    """Of the nozzle."""
    flow_time: Floats
    flow: Floats
    radius: float
    stops: float


class State(NamedTuple):
    """All by cell; changed in place."""

    area: Floats
    """Of paste in the slot and above its mouth."""
    beside: Floats
    """Area of paste on the face, on both sides of the mouth."""
    stretched: Floats
    """Difference of normal stresses, from -1 (pressed together along the slot) to 1 (pulled)."""
    roof: Floats
    """Shape across, from -1 (trough) to 1 (crown)."""
    rest: Floats
    """Area times seconds of rest."""
    age: Floats
    """Area times seconds since the nozzle."""


@njit(cache=True)
def depth_of(area: float, width: float, narrowing: float, floor: float) -> float:
    """Return the depth of paste in a trapezoid, or above its mouth between its edges."""
    bottom = width + narrowing * floor
    if narrowing == 0.0 or area <= 0.0:
        return max(area, 0.0) / width
    whole = -floor * 0.5 * (width + bottom)
    if area >= whole:
        return -floor + (area - whole) / width
    # The root without cancellation of narrowing h^2 / 2 + bottom h = area.
    return 2.0 * area / (bottom + sqrt(bottom * bottom + 2.0 * narrowing * area))


@njit(cache=True)
def area_of(depth: float, width: float, narrowing: float, floor: float) -> float:
    bottom = width + narrowing * floor
    inside = min(depth, -floor)
    return inside * (bottom + 0.5 * narrowing * inside) + max(depth + floor, 0.0) * width


@njit(cache=True)
def section_flow(
    fluid: Fluid, yield_pa: float, gradient: float, width: float, depth: float, bottom: float
) -> tuple[float, float]:
    """Return the flow (m3/s) along a gradient (Pa/m) and its derivative: sections of one shape are similar."""
    size = abs(gradient)
    if size == 0.0 or size * width <= yield_pa * 1e-3:
        return 0.0, 0.0
    one, power = flow_of(fluid.law, depth / width, 1.0 - bottom / width, yield_pa / (size * width))
    flow = one * width**3 * (size * width / fluid.consistency) ** (1.0 / fluid.law.exponent)
    return np.sign(gradient) * flow, power * flow / size


@njit(cache=True)
def poured_until(source: Source, time: float) -> float:
    """Return the volume that left the nozzle: the exact integral of a flow that is linear between its times."""
    volume, end = 0.0, min(time, source.stops)
    for i in range(len(source.flow) - 1):
        begin, stop = source.flow_time[i], source.flow_time[i + 1]
        if end <= begin or stop <= begin:
            continue
        last = min(end, stop)
        flow = source.flow[i] + (source.flow[i + 1] - source.flow[i]) * (last - begin) / (stop - begin)
        volume += 0.5 * (source.flow[i] + flow) * (last - begin)
    return volume


@njit(cache=True)
def dispense(state: State, slot: Slot, source: Source, time: float, volume: float) -> None:
    """Add paste under the nozzle's disc, all of it to the slot, even where the disc reaches past an end."""
    cells = len(slot.width)
    place = np.interp(time, source.time, source.place)
    whole = share_of_disc((cells * slot.cell - place) / source.radius) - share_of_disc(-place / source.radius)
    first = max(int((place - source.radius) / slot.cell), 0)
    last = min(int((place + source.radius) / slot.cell), cells - 1)
    for i in range(first, last + 1):
        right, left = (i + 1) * slot.cell - place, i * slot.cell - place
        part = share_of_disc(right / source.radius) - share_of_disc(left / source.radius)
        fresh = volume * part / whole / slot.cell
        state.area[i] += fresh
        if fresh > 0.0:
            state.stretched[i] *= 1.0 - fresh / state.area[i]


@njit(cache=True)
def spill(state: State, slot: Slot, fluid: Fluid, i: int, yield_pa: float) -> None:
    """Let paste above the mouth flow onto the face beside it; its yield stress keeps it from coming back."""
    depth = depth_of(state.area[i], slot.width[i], slot.narrowing[i], slot.floor[i])
    level = depth + slot.floor[i]
    if level <= 0.0:
        return
    width = slot.width[i]
    roof = roof_height(yield_pa, fluid.wall_share, fluid.weight, width, depth) * max(state.roof[i], 0.0)
    if area_beside(level, roof, yield_pa, fluid.weight) <= state.beside[i]:
        return
    above, low, high = level * width + state.beside[i], 0.0, level
    for _ in range(60):
        level = 0.5 * (low + high)
        if level * width + area_beside(level, roof, yield_pa, fluid.weight) > above:
            high = level
        else:
            low = level
    moved = max(above - level * width - state.beside[i], 0.0)
    kept = 1.0 - moved / state.area[i]
    state.area[i] -= moved
    state.age[i] *= kept
    state.rest[i] *= kept
    state.beside[i] += moved


@njit(cache=True)
def run(
    state: State, slot: Slot, fluid: Fluid, source: Source, until: float, step_share: float
) -> tuple[float, float, bool, int]:
    """Pour and let settle; return the time of the end, the volume poured, whether all is at rest, and the steps."""
    cells = len(slot.width)
    depth, level, yields = np.zeros(cells), np.zeros(cells), np.full(cells, fluid.yield_stress)
    hydraulic = np.zeros(cells)
    flow, speed, before = np.zeros(cells + 1), np.zeros(cells + 1), np.zeros(cells)
    time, poured, steps = 0.0, 0.0, 0
    normal = fluid.normal_stress
    while True:
        for i in range(cells):
            depth[i] = depth_of(state.area[i], slot.width[i], slot.narrowing[i], slot.floor[i])
            level[i] = slot.floor[i] + depth[i]
            top = slot.width[i] + slot.narrowing[i] * min(level[i], 0.0)
            hydraulic[i] = state.area[i] / top
            if state.area[i] > 0.0:
                yields[i] = fluid.yield_stress + fluid.stiffening * state.rest[i] / state.area[i]
        step = LONGEST_STEP_S
        for i in range(1, cells):
            flow[i], speed[i] = 0.0, 0.0
            deep = 0.5 * (depth[i - 1] + depth[i])
            if deep < THINNEST_M:
                continue
            width = 0.5 * (slot.width[i - 1] + slot.width[i])
            narrowing = 0.5 * (slot.narrowing[i - 1] + slot.narrowing[i])
            floor = 0.5 * (slot.floor[i - 1] + slot.floor[i])
            bottom = width + narrowing * floor
            top = width + narrowing * min(floor + deep, 0.0)
            stress = 0.5 * (yields[i - 1] + yields[i])
            if min(depth[i - 1], depth[i]) < THINNEST_M:
                stress = yields[i - 1] if depth[i - 1] > depth[i] else yields[i]
            gradient = -fluid.weight * ((level[i] - level[i - 1]) / slot.cell + slot.rise)
            if normal > 0.0:
                pull = state.stretched[i] * hydraulic[i] - state.stretched[i - 1] * hydraulic[i - 1]
                gradient += normal * stress * pull / (slot.cell * 0.5 * (hydraulic[i] + hydraulic[i - 1]))
            donor = i - 1 if gradient > 0.0 else i
            if state.area[donor] <= 0.0 or state.age[donor] >= fluid.freezes_at * state.area[donor]:
                continue
            flow[i], mobility = section_flow(fluid, stress, gradient, top, deep, bottom)
            if flow[i] == 0.0:
                continue
            area = area_of(deep, width, narrowing, floor)
            speed[i] = flow[i] / area
            spreading = mobility * (fluid.weight / top + normal * stress / (fluid.yield_strain * area))
            step = min(step, SAFETY * slot.cell**2 / (2.0 * spreading), 0.3 * slot.cell / abs(speed[i]))
        fastest = 0.0
        for i in range(cells):
            fastest = max(fastest, abs(flow[i + 1] - flow[i]) / (slot.width[i] * slot.cell))
        if time >= source.stops and fastest < AT_REST_M_S:
            return time, poured, True, steps
        if time >= until:
            return time, poured, False, steps
        step *= step_share
        if time < source.stops:
            step = min(step, source.stops - time)
        step = min(step, until - time)
        for i in range(1, cells):
            donor = i - 1 if flow[i] > 0.0 else i
            most = 0.45 * state.area[donor] * slot.cell / step
            flow[i] = min(max(flow[i], -most), most)
        before[:] = level
        _carry(state, slot, flow, speed, step)
        volume = poured_until(source, time + step)
        if volume > poured:
            dispense(state, slot, source, time + 0.5 * step, volume - poured)
            poured = volume
        time += step
        # The last step may end short of the stop by rounding.
        if abs(time - source.stops) < 1e-12:
            time = source.stops
        steps += 1
        for i in range(cells):
            if state.area[i] <= 0.0:
                continue
            strain = _strain_rate(state, slot, speed, i) * step / fluid.yield_strain
            state.stretched[i] = (state.stretched[i] + strain) / (1.0 + abs(strain))
            spill(state, slot, fluid, i, yields[i])
            now = depth_of(state.area[i], slot.width[i], slot.narrowing[i], slot.floor[i])
            top = slot.width[i] + slot.narrowing[i] * min(slot.floor[i] + now, 0.0)
            height = roof_height(yields[i], fluid.wall_share, fluid.weight, top, now)
            state.roof[i] = roof_after(state.roof[i], slot.floor[i] + now - before[i], height)


@njit(cache=True)
def _carry(state: State, slot: Slot, flow: Floats, speed: Floats, step: float) -> None:
    """Move paste between cells with its age, rest and stress, from upstream; age it, and rest it unless it shears."""
    cells = len(slot.width)
    age, rest, stretched = np.zeros(cells + 1), np.zeros(cells + 1), np.zeros(cells + 1)
    for i in range(1, cells):
        donor = i - 1 if flow[i] > 0.0 else i
        if state.area[donor] > 0.0:
            age[i] = flow[i] * state.age[donor] / state.area[donor]
            rest[i] = flow[i] * state.rest[donor] / state.area[donor]
            stretched[i] = flow[i] * state.stretched[donor]
    share = step / slot.cell
    for i in range(cells):
        stretch = state.stretched[i] * state.area[i] - share * (stretched[i + 1] - stretched[i])
        state.area[i] -= share * (flow[i + 1] - flow[i])
        state.stretched[i] = stretch / state.area[i] if state.area[i] > 0.0 else 0.0
        state.age[i] += step * state.area[i] - share * (age[i + 1] - age[i])
        state.rest[i] -= share * (rest[i + 1] - rest[i])
        # Mean shear rate between two plates: 3 speeds over the width.
        strain = 1.5 * (abs(speed[i]) + abs(speed[i + 1])) / slot.width[i] * step / BROKEN_BY_STRAIN
        state.rest[i] = (state.rest[i] + step * state.area[i]) / (1.0 + strain)


@njit(cache=True)
def _strain_rate(state: State, slot: Slot, speed: Floats, i: int) -> float:
    """Return the rate at which paste is stretched along the slot; none in the cell of a front, which only moves on."""
    cells = len(slot.width)
    if (i > 0 and state.area[i - 1] <= 0.0) or (i < cells - 1 and state.area[i + 1] <= 0.0):
        return 0.0
    return (speed[i + 1] - speed[i]) / slot.cell
