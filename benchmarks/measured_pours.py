"""Fluids that others let out of a point source, computed with nothing fitted to a flow.

``measured/measured.toml`` has the cases, their sources and the targets, written before the first run.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.hollow import Box, Hollow
from benchmarks.loose_fluid import LooseFluid, substep_s
from benchmarks.table import Row
from sealtwin.core.records import Floats
from simulate.device import start_warp
from simulate.settings import Fluid, SampleSlope, Solver, particle_volume
from simulate.setup.release_schedule import Schedule, pack_disc, places_of_releases
from simulate.setup_checks import solved_as

TUBE_MM = 12.0  # Height of the tube's end above the plate: over the fluid's surface
BEYOND = 2e-4  # Share of the particles that may be beyond an extent
MARGIN = 1.35  # Size of the plate over the largest extent

EXTENTS: Mapping[str, Callable[[Floats, Floats], Floats]] = {
    "up_slope": lambda x, y: x,
    "down_slope": lambda x, y: -x,
    "half_width": lambda x, y: np.abs(y),
    "radius": np.hypot,
}
"""What is measured of places of particles. The plate rises towards +x."""


@dataclass(frozen=True)
class Pour:
    """A fluid from a point source: what is known of it, and the extents that were seen."""

    name: str
    table: Mapping[str, Any]

    @property
    def extents(self) -> list[tuple[float, str, float]]:
        """Time in s, kind and measured mm of each extent."""
        rows = self.table["extents_mm"]
        return [(row["t_s"], kind, mm) for row in rows for kind, mm in row.items() if kind != "t_s"]

    @property
    def hollow(self) -> Hollow:
        """The plate."""

        def reach_mm(*kinds: str) -> float:
            return MARGIN * max(mm for _, kind, mm in self.extents if kind in kinds)

        half_mm = reach_mm("half_width", "radius")
        top_mm = reach_mm("up_slope", "radius"), half_mm, 1.5 * TUBE_MM
        return Hollow(Box((-reach_mm("down_slope", "radius"), -half_mm, 0.0), top_mm))


def computed_mm(pour: Pour) -> Floats:
    """Return the extents of a pour in their order."""
    start_warp()
    radius_mm = pour.table["radius_mm"]
    times_s = sorted({t_s for t_s, _, _ in pour.extents})
    schedule = fed(
        pour.table["flow_mm3_s"],
        times_s[-1],
        radius_mm,
        height_mm=TUBE_MM,
        diameter_mm=pour.table["diameter_mm"],
    )
    fluid = Fluid.model_validate({"freeze_after_s": "never", **pour.table["fluid"]})
    solver = Solver(radius_mm=radius_mm, substeps=1)
    paste, _ = solved_as(fluid, solver, schedule.frame_s, len(schedule.released))
    slope = SampleSlope(gradient_deg=pour.table["slope_deg"])
    loose = LooseFluid.put(pour.hollow, schedule, paste, solver, slope=slope)
    extents_mm, so_far_s = list[float](), 0.0
    for t_s in times_s:
        for _ in loose.run(t_s - so_far_s, t_s):
            pass
        so_far_s = t_s
        extents_mm += [_extent_mm(loose, kind) for at_s, kind, _ in pour.extents if at_s == t_s]
    if loose.escaped:
        raise ValueError(f"{pour.name}: {loose.escaped} particles went through a wall")
    return np.array(extents_mm)


def _extent_mm(loose: LooseFluid, kind: str) -> float:
    x, y, _ = loose.place_mm.T
    return float(np.quantile(EXTENTS[kind](x, y), 1 - BEYOND)) + loose.half_mm


def rows_of(pours: Iterable[tuple[Pour, Floats]]) -> Iterator[Row]:
    for pour, extents_mm in pours:
        logs = list[float]()
        for (t_s, kind, seen_mm), mm in zip(pour.extents, extents_mm, strict=True):
            logs.append(float(np.log(mm / seen_mm)))
            yield Row(
                f"{pour.table['label']}, {kind.replace('_', ' ')} at {t_s:g} s: {seen_mm:g} mm, computed",
                float(mm),
                "mm",
            )
        of, targets = f"{pour.table['label']}: computed over measured", pour.table.get("targets", {})
        yield Row(f"{of}: bias", float(np.exp(np.mean(logs))), "", *targets.get("bias", ()))
        worst = 100 * float(np.abs(np.expm1(logs)).max())
        yield Row(f"{of}: worst", worst, "%", 0.0, targets.get("worst_percent", np.inf))


def fed(
    flow_mm3_s: float, duration_s: float, radius_mm: float, *, height_mm: float, diameter_mm: float, seed: int = 0
) -> Schedule:
    """Return the schedule of a steady flow that leaves a vertical tube over x = y = 0, ``height_mm`` above the floor.

    A release of several particles is spread evenly over the time in which the flow fills it.
    """
    disc_mm, frame_s = pack_disc(diameter_mm / 2, radius_mm), substep_s(radius_mm)
    release = len(disc_mm)
    count = round(flow_mm3_s * duration_s / particle_volume(radius_mm))
    frame_of = np.floor(np.arange(count) * particle_volume(radius_mm) / flow_mm3_s / frame_s).astype(np.int64)
    places_mm = places_of_releases(disc_mm, radius_mm, diameter_mm, seed, -(-count // release))
    across_mm = places_mm.reshape(-1, 2)[:count]
    down_mm_s = flow_mm3_s / (np.pi * (diameter_mm / 2) ** 2)
    return Schedule(
        position_mm=np.column_stack([across_mm, np.full(count, height_mm)]),
        velocity_mm_s=np.tile([0.0, 0.0, -down_mm_s], (count, 1)),
        frame_of=frame_of,
        released=np.searchsorted(frame_of, np.arange(round(duration_s / frame_s)), side="right"),
        frame_s=frame_s,
        release=release,
        dispensed_mm3=count * particle_volume(radius_mm),
    )
