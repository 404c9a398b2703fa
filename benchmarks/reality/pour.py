"""A pour in the second reality."""

from math import asin, atan, cos, degrees, radians, sqrt, tan

import numpy as np

from benchmarks.reality.along import Fluid, Slot, Source, State, run
from benchmarks.reality.inputs import Cavity, Numerics, Paste, Pour, Poured
from benchmarks.reality.law import Law, resolved_law
from benchmarks.reality.section import Floats
from benchmarks.reality.surface import meniscus_m, roof_height
from benchmarks.reality.worlds import World

GRAVITY_M_S2 = 9.81
MM = 1e-3


def poured(
    cavity: Cavity,
    paste: Paste,
    pour: Pour,
    world: World | None = None,
    numerics: Numerics | None = None,
    law: Law | None = None,
) -> Poured:
    """Pour into a cavity, in a world that changes the inputs, until paste rests or the time to settle is over.

    ``law``: another law than that of the resolved section. ``seconds`` count from the start of the path.
    """
    if world is not None:
        cavity, paste, pour = world(cavity, paste, pour)
    numerics = numerics or Numerics()
    law = law or resolved_law(paste.exponent, paste.wall_share, paste.wall_friction)
    s_mm, slot = _slot(cavity, numerics.cell_mm)
    fluid = _fluid(paste, cavity.rise_deg, law, numerics)
    source = _source(cavity, pour)
    state = State(*(np.zeros(len(s_mm)) for _ in State._fields))
    until = source.stops + numerics.settle_s
    seconds, volume, at_rest, steps = run(state, slot, fluid, source, until, numerics.step_share)
    return _poured(s_mm, slot, fluid, paste, state, volume, (seconds, at_rest, steps))


def _slot(cavity: Cavity, cell_mm: float) -> tuple[Floats, Slot]:
    begin, end = float(cavity.s_mm[0]), float(cavity.s_mm[-1])
    cells = max(round((end - begin) / cell_mm), 4)
    cell = (end - begin) / cells
    s_mm = begin + cell * (np.arange(float(cells)) + 0.5)
    width, narrowing, floor = (
        np.interp(s_mm, cavity.s_mm, one) for one in (cavity.width_mm, cavity.narrowing, cavity.floor_mm)
    )
    return s_mm, Slot(cell * MM, width * MM, narrowing, floor * MM, tan(radians(cavity.rise_deg)))


def _fluid(paste: Paste, rise_deg: float, law: Law, numerics: Numerics) -> Fluid:
    return Fluid(
        law=law,
        weight=paste.density_kg_m3 * GRAVITY_M_S2 * cos(radians(rise_deg)),
        yield_stress=paste.yield_stress_pa,
        consistency=paste.consistency_pa_sn,
        stiffening=paste.stiffening_pa_s,
        freezes_at=paste.freezes_at_s,
        wall_share=paste.wall_share,
        normal_stress=normal_stress(paste.wall_share),
        yield_strain=numerics.yield_strain,
    )


def normal_stress(wall_share: float) -> float:
    """Return the difference of normal stresses that paste bears along a slot, over its yield stress.

    At x of the way from the middle to the walls they take wall_share x of the yield stress; what is left of von
    Mises' circle, twice, is the mean of 2 sqrt(1 - (wall_share x)^2): pi/2 without slip, as on a floor (Dubash,
    Balmforth, Slim and Cochard 2009; Balmforth and Craster 1999 on plugs that yield along the flow).
    """
    return sqrt(1.0 - wall_share**2) + asin(wall_share) / wall_share


def _source(cavity: Cavity, pour: Pour) -> Source:
    begin = float(cavity.s_mm[0])
    return Source(
        time=np.asarray(pour.time_s, dtype=float),
        place=(np.asarray(pour.nozzle_s_mm, dtype=float) - begin) * MM,
        flow_time=np.asarray(pour.flow_time_s, dtype=float) + pour.delay_s,
        flow=np.asarray(pour.flow_mm3_s, dtype=float) * pour.kept * MM**3,
        radius=0.5 * pour.nozzle_mm * MM,
        stops=float(pour.time_s[-1]),
    )


def _poured(
    s_mm: Floats, slot: Slot, fluid: Fluid, paste: Paste, state: State, volume: float, end: tuple[float, bool, int]
) -> Poured:
    bottom = slot.width + slot.narrowing * slot.floor
    whole = -slot.floor * 0.5 * (slot.width + bottom)
    over_mouth = np.maximum(state.area - whole, 0.0)
    area = np.minimum(state.area, whole)
    depth = 2.0 * area / (bottom + np.sqrt(bottom**2 + 2.0 * slot.narrowing * area))
    level = slot.floor + depth + over_mouth / slot.width
    yields = fluid.yield_stress + fluid.stiffening * state.rest / np.maximum(state.area, 1e-300)
    cubic_mm = slot.cell / MM**3
    seconds, at_rest, steps = end
    return Poured(
        s_mm=s_mm,
        mean_mm=level / MM,
        middle_mm=_middle(slot, fluid, paste, state, level, yields) / MM,
        yield_stress_pa=yields,
        volume_mm3=volume / MM**3,
        in_slot_mm3=float(area.sum()) * cubic_mm,
        above_face_mm3=float((over_mouth + state.beside).sum()) * cubic_mm,
        beside_mouth_mm3=float(state.beside.sum()) * cubic_mm,
        at_rest=at_rest,
        seconds=seconds,
        steps=steps,
    )


def _middle(slot: Slot, fluid: Fluid, paste: Paste, state: State, level: Floats, yields: Floats) -> Floats:
    """Return the level in the middle: a roof has its ridge half of its height above its mean; a meniscus is lower."""
    middle = level.copy()
    capillary = sqrt(paste.surface_tension_n_m / fluid.weight)
    tops, depths = slot.width + slot.narrowing * np.minimum(level, 0.0), level - slot.floor
    heights = roof_height(yields, fluid.wall_share, fluid.weight, tops, np.maximum(depths, 1e-5))
    for i, (one, top, depth) in enumerate(zip(level, tops, depths, strict=True)):
        if depth <= 1e-5:
            continue
        middle[i] += (1.0 - paste.wetting) * 0.5 * heights[i] * state.roof[i]
        if paste.wetting > 0.0:
            lean = round(degrees(atan(0.5 * slot.narrowing[i])), 1)
            lower, climb = meniscus_m(round(top, 5), round(capillary, 7), paste.contact_deg, lean)
            # The mouth's edge pins a meniscus that would climb past it; a layer is not deeper than it is.
            pinned = min(max(-one, 0.0) / climb, 1.0) if climb > 0.0 else 1.0
            middle[i] -= paste.wetting * min(lower * pinned, depth)
    return middle
