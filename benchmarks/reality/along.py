"""Paste along a slot: conservative finite volumes, driven by the slope of the surface. Metres, seconds, pascals."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

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


def depth_of(area: Floats, slot: Slot) -> Floats:
    """Return the depth of paste in trapezoids, or above their mouths between their edges."""
    bottom = slot.width + slot.narrowing * slot.floor
    whole = -slot.floor * 0.5 * (slot.width + bottom)
    inside = np.minimum(area, whole)
    # The root without cancellation of narrowing h^2 / 2 + bottom h = area.
    root = 2.0 * inside / (bottom + np.sqrt(bottom * bottom + 2.0 * slot.narrowing * inside))
    return np.where(area < whole, root, -slot.floor + (area - whole) / slot.width)


def section_flow(
    fluid: Fluid, yield_pa: Floats, gradient: Floats, width: Floats, depth: Floats, bottom: Floats
) -> tuple[Floats, Floats]:
    """Return the flow (m3/s) along a gradient (Pa/m) and its derivative: sections of one shape are similar."""
    size = np.abs(gradient)
    one, power = flow_of(fluid.law, depth / width, 1.0 - bottom / width, yield_pa / (size * width))
    flow = one * width**3 * (size * width / fluid.consistency) ** (1.0 / fluid.law.exponent)
    return np.sign(gradient) * flow, power * flow / size


def poured_until(source: Source, time: float) -> float:
    """Return the volume that left the nozzle: the exact integral of a flow that is linear between its times."""
    begin, stop = source.flow_time[:-1], source.flow_time[1:]
    long = stop > begin
    begin, stop, first, after = begin[long], stop[long], source.flow[:-1][long], source.flow[1:][long]
    spent = np.clip(min(time, source.stops) - begin, 0.0, stop - begin)
    return float(np.sum((first + 0.5 * (after - first) * spent / (stop - begin)) * spent))


def dispense(state: State, slot: Slot, source: Source, time: float, volume: float) -> None:
    """Add paste under the nozzle's disc, all of it to the slot, even where the disc reaches past an end."""
    place = np.interp(time, source.time, source.place)
    left = share_of_disc((np.arange(len(slot.width) + 1.0) * slot.cell - place) / source.radius)
    fresh = volume * np.diff(left) / (left[-1] - left[0]) / slot.cell
    state.area[:] += fresh
    state.stretched[:] *= 1.0 - fresh / np.maximum(state.area, 1e-300)


def spill(state: State, slot: Slot, fluid: Fluid, yields: Floats) -> None:
    """Let paste above the mouth flow onto the face beside it; its yield stress keeps it from coming back."""
    depth = depth_of(state.area, slot)
    over = np.flatnonzero(depth + slot.floor > 0.0)
    if not len(over):
        return
    level, width, stress = (depth + slot.floor)[over], slot.width[over], yields[over]
    roof = roof_height(stress, fluid.wall_share, fluid.weight, width, depth[over]) * np.maximum(state.roof[over], 0.0)
    above, low, high = level * width + state.beside[over], np.zeros(len(over)), level
    spills = area_beside(level, roof, stress, fluid.weight) > state.beside[over]
    for _ in range(60 if spills.any() else 0):
        level = 0.5 * (low + high)
        too_high = level * width + area_beside(level, roof, stress, fluid.weight) > above
        low, high = np.where(too_high, low, level), np.where(too_high, level, high)
    moved = np.where(spills, np.maximum(above - level * width - state.beside[over], 0.0), 0.0)
    kept = 1.0 - moved / state.area[over]
    state.area[over] -= moved
    state.age[over] *= kept
    state.rest[over] *= kept
    state.beside[over] += moved


def run(
    state: State, slot: Slot, fluid: Fluid, source: Source, until: float, step_share: float
) -> tuple[float, float, bool, int]:
    """Pour and let settle; return the time of the end, the volume poured, whether all is at rest, and the steps."""
    cells, normal = len(slot.width), fluid.normal_stress
    width, narrowing, floor = _mean(slot.width), _mean(slot.narrowing), _mean(slot.floor)
    bottom = width + narrowing * floor
    time, poured, steps = 0.0, 0.0, 0
    depth = depth_of(state.area, slot)
    while True:
        level = slot.floor + depth
        yields = fluid.yield_stress + fluid.stiffening * state.rest / np.maximum(state.area, 1e-300)
        hydraulic = state.area / (slot.width + slot.narrowing * np.minimum(level, 0.0))
        deep, stress = _mean(depth), _mean(yields)
        thin = np.minimum(depth[:-1], depth[1:]) < THINNEST_M
        stress = np.where(thin, _from(depth[:-1] > depth[1:], yields), stress)
        gradient = -fluid.weight * (np.diff(level) / slot.cell + slot.rise)
        if normal > 0.0:
            pull = np.diff(state.stretched * hydraulic)
            gradient += normal * stress * pull / (slot.cell * np.maximum(_mean(hydraulic), 1e-300))
        top = width + narrowing * np.minimum(floor + deep, 0.0)
        area = _from(gradient > 0.0, state.area)
        fresh = _from(gradient > 0.0, state.age / np.maximum(state.area, 1e-300)) < fluid.freezes_at
        steep = np.abs(gradient) * top > np.maximum(stress * 1e-3, 0.0)
        at = np.flatnonzero((deep >= THINNEST_M) & (area > 0.0) & fresh & steep)
        flow, speed, step = np.zeros(cells + 1), np.zeros(cells + 1), LONGEST_STEP_S
        if len(at):
            flow[at + 1], mobility = section_flow(fluid, stress[at], gradient[at], top[at], deep[at], bottom[at])
            inside = np.minimum(deep, -floor)
            area = (inside * (bottom + 0.5 * narrowing * inside) + np.maximum(deep + floor, 0.0) * width)[at]
            speed[at + 1] = flow[at + 1] / area
            spreading = mobility * (fluid.weight / top[at] + normal * stress[at] / (fluid.yield_strain * area))
            step = min(step, SAFETY * slot.cell**2 / max(2.0 * spreading.max(), 1e-300))
            step = min(step, 0.3 * slot.cell / max(np.abs(speed).max(), 1e-300))
        fastest = np.max(np.abs(np.diff(flow)) / (slot.width * slot.cell))
        if time >= source.stops and fastest < AT_REST_M_S:
            return time, poured, True, steps
        if time >= until:
            return time, poured, False, steps
        step *= step_share
        if time < source.stops:
            step = min(step, source.stops - time)
        step = min(step, until - time)
        most = 0.45 * _from(flow[1:-1] > 0.0, state.area) * slot.cell / step
        flow[1:-1] = np.clip(flow[1:-1], -most, most)
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
        strain = _strain_rate(state, slot, speed) * step / fluid.yield_strain
        state.stretched[:] = (state.stretched + strain) / (1.0 + np.abs(strain))
        spill(state, slot, fluid, yields)
        depth = depth_of(state.area, slot)
        mouth = slot.width + slot.narrowing * np.minimum(slot.floor + depth, 0.0)
        height = roof_height(yields, fluid.wall_share, fluid.weight, mouth, np.maximum(depth, 1e-300))
        state.roof[:] = roof_after(state.roof, slot.floor + depth - level, height)


def _mean(values: Floats) -> Floats:
    """Return the mean of both cells at each face between two cells."""
    return 0.5 * (values[:-1] + values[1:])


def _from(rightward: NDArray[np.bool_], values: Floats) -> Floats:
    """Return the value of the left cell at each face if ``rightward``, else that of the right cell."""
    return np.where(rightward, values[:-1], values[1:])


def _carry(state: State, slot: Slot, flow: Floats, speed: Floats, step: float) -> None:
    """Move paste between cells with its age, rest and stress, from upstream; age it, and rest it unless it shears."""
    area = np.maximum(state.area, 1e-300)
    moved = np.zeros((3, len(flow)))
    for row, part in zip(moved, (state.age / area, state.rest / area, state.stretched), strict=True):
        row[1:-1] = flow[1:-1] * _from(flow[1:-1] > 0.0, part)
    age, rest, stretched = step / slot.cell * np.diff(moved)
    stretch = state.stretched * state.area - stretched
    state.area[:] -= step / slot.cell * np.diff(flow)
    state.stretched[:] = stretch / np.maximum(state.area, 1e-300)
    state.age[:] += step * state.area - age
    # Mean shear rate between two plates: 3 speeds over the width.
    strain = 1.5 * (np.abs(speed[:-1]) + np.abs(speed[1:])) / slot.width * step / BROKEN_BY_STRAIN
    state.rest[:] = (state.rest - rest + step * state.area) / (1.0 + strain)


def _strain_rate(state: State, slot: Slot, speed: Floats) -> Floats:
    """Return the rate at which paste is stretched along the slot; none in the cell of a front, which only moves on."""
    filled = np.concatenate(([True], state.area > 0.0, [True]))
    return np.where(filled[:-2] & filled[1:-1] & filled[2:], np.diff(speed) / slot.cell, 0.0)
