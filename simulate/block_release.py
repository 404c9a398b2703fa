"""A block of fluid that is let go: a dam break onto a plate or along a channel, or a block or cone on a plate."""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from pydantic import Field

from sealtwin.core.errors import InputError, NumericalError
from sealtwin.core.progress import Progress
from sealtwin.core.records import Floats
from sealtwin.core.settings import Settings
from sealtwin.core.shown import Shown
from simulate.device import start_warp
from simulate.hollow import Box, Hollow
from simulate.loose_fluid import LooseFluid, filled_box_mm, substep_s
from simulate.settings import LEVEL, Fluid, SampleSlope, Solver, particle_volume
from simulate.setup.rheology import Rheology, viscous_weight
from simulate.setup.signed_distance import CM
from simulate.setup_checks import solved_as

Onto = Literal["plate", "channel", "open"]

SETTLING_MM2_S, SETTLING_S = 300.0, 0.25
"""Kinematic viscosity and time of the packing behind the gate: enough to end all motion, and to find its level."""
SPRAY = 0.002  # Share of the particles that may be beyond the front
WALL_RADII = 4.0  # Thickness of the walls beside a block, in particle radii
HEADROOM = 1.25  # Height of the hollow over the block's
LEAST_ACROSS = 6  # Least number of particle diameters across the shortest side of the block
MOST_PARTICLES = 200_000


class Block(Settings):
    """A block of fluid at rest behind a gate, and where it flows. The gate is at x = 0, the block behind it."""

    length_mm: float = Field(gt=0, le=2000)
    """Length of the block, from the back wall to the gate."""
    width_mm: float = Field(gt=0, le=2000)
    """Width of the block, across the flow."""
    height_mm: float = Field(gt=0, le=2000)
    """Height of the block above the floor."""
    onto: Onto = "plate"
    """plate: walls at the back and beside the block end at the gate, and a level plate is ahead, as in a dam break.
    channel: the side walls continue, and the channel is closed at its end, as in an L-box or the LCPC box. open: all
    walls are lifted, and the block spreads to all sides."""
    ahead_mm: float | None = Field(default=None, gt=0, le=5000)
    """Length of the plate or channel ahead of the gate; if open, distance from the block to the plate's edge. Default:
    twice the block's length and height together."""
    duration_s: float = Field(gt=0, le=600)
    """Time that is computed; less if all comes to rest."""
    every_s: float = Field(default=0.05, gt=0)
    """Time between two figures."""

    @property
    def end_mm(self) -> float:
        """End of the plate or channel, x."""
        return 2 * (self.length_mm + self.height_mm) if self.ahead_mm is None else self.ahead_mm

    @property
    def box_mm(self) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        half = self.width_mm / 2
        return (-self.length_mm, -half, 0.0), (0.0, half, self.height_mm)

    def closed(self, radius_mm: float) -> Hollow:
        """Return the box behind the closed gate."""
        (x, y, z), (x1, y1, z1) = self.box_mm
        return Hollow(Box((x, y, z), (x1, y1, HEADROOM * z1 + 4 * radius_mm)))

    def opened(self, radius_mm: float) -> Hollow:
        """Return the hollow without the gate."""
        (x, y, _), (_, y1, _) = self.box_mm
        top = HEADROOM * self.height_mm + 4 * radius_mm
        if self.onto == "channel":
            return Hollow(Box((x, y, 0.0), (self.end_mm, y1, top)))
        around, wall = self.end_mm, WALL_RADII * radius_mm
        if self.onto == "open":
            return Hollow(Box((x - around, y - around, 0.0), (around, y1 + around, top)))
        behind = Box((x - wall, y - wall, 0.0), (x, y1 + wall, top))
        sides = Box((x, y - wall, 0.0), (0.0, y, top)), Box((x, y1, 0.0), (0.0, y1 + wall, top))
        # The back wall is the rim: fluid that flows round the ends of the walls has room beside them.
        return Hollow(Box((x - wall, y - around, 0.0), (around, y1 + around, top)), (behind, *sides))


@dataclass(frozen=True, kw_only=True, repr=False)
class BlockRelease(Shown):
    """A block of fluid from the moment at which its gate is gone."""

    t_s: Floats
    """Times from 0, (n,)."""
    front_mm: Floats
    """Distance of the front from the gate along x, (n,). A share of 0.002 of the fluid, spray, may be ahead of it."""
    height_mm: Floats
    """Height of the highest fluid above the floor, (n,)."""
    volume_ratio: Floats
    """Volume below the fluid's surface over the block's, (n,)."""
    position_mm: Floats
    """Particles at the end, (m, 3): x from the gate, y from the middle, z from the floor."""
    radius_mm: float
    """Radius of the particles."""
    at_rest: bool
    """True if no particle moves at the end."""

    @property
    def main_figures(self) -> dict[str, str]:
        state = "at rest" if self.at_rest else "moving"
        return {"front": f"{self.front_mm[-1]:.1f} mm", "after": f"{self.t_s[-1]:.3g} s, {state}"}


def release_block(
    block: Block,
    fluid: Fluid,
    solver: Solver,
    *,
    slope: SampleSlope = LEVEL,
    device: str = "cpu",
    progress: Progress | None = None,
) -> BlockRelease:
    """Compute a block of fluid from the moment at which its gate is gone. It sticks to floor and walls.

    Raises InputError if the block has too few or too many particles or the fluid is too stiff, and NumericalError if
    the front reaches the edge of the plate, or the computation fails.
    """
    radius_mm, progress = solver.size_mm, progress or Progress()
    sides = block.length_mm, block.width_mm, block.height_mm
    across, count = min(sides) / (2 * radius_mm), math.prod(sides) / particle_volume(radius_mm)
    if across < LEAST_ACROSS or count > MOST_PARTICLES:
        raise InputError(
            f"solver.radius_mm is {radius_mm:g}: the block would have {count:,.0f} particles, {across:.3g} across its "
            f"shortest side. Allowed are at most {MOST_PARTICLES:,}, and at least {LEAST_ACROSS} across."
        )
    start_warp()
    solver = solver.model_copy(update={"substeps": 1})
    frame_s = substep_s(radius_mm)
    paste, _ = solved_as(fluid, solver, frame_s, round(block.duration_s / frame_s) + 1)
    place_mm = _packed(block, solver, device)
    loose = LooseFluid.put(block.opened(radius_mm), place_mm, paste, solver, slope=slope, device=device)
    whole_mm3 = len(place_mm) * particle_volume(radius_mm)
    rows = [_figures(loose, 0.0, whole_mm3)]
    progress.start("Releasing the block", loose.frames_in(block.duration_s))
    for t_s in loose.run(block.duration_s, block.every_s):
        rows.append(_figures(loose, t_s, whole_mm3))
        if block.onto != "channel" and _outermost_mm(loose, block) > block.end_mm - 2 * radius_mm:
            raise NumericalError(
                f"ahead_mm is {block.end_mm:g}: fluid reaches the plate's edge after {t_s:.3g} s. Give a larger one."
            )
        progress.advance(loose.frames, f"front at {rows[-1][1]:.1f} mm")
    progress.close()
    if loose.escaped:
        raise NumericalError(f"{loose.escaped} particles went through a wall: a fault of the software.")
    t_s, front_mm, height_mm, ratio = np.array(rows).T
    return BlockRelease(
        t_s=t_s,
        front_mm=front_mm,
        height_mm=height_mm,
        volume_ratio=ratio,
        position_mm=loose.place_mm,
        radius_mm=radius_mm,
        at_rest=loose.engine.rows == 0,
    )


def _outermost_mm(loose: LooseFluid, block: Block) -> float:
    """Return how far the fluid is from the block towards the plate's edges."""
    x, y, _ = loose.place_mm.T
    beside = float(np.abs(y).max()) - block.width_mm / 2
    behind = -block.length_mm - float(x.min()) if block.onto == "open" else 0.0
    return max(float(x.max()), beside, behind)


def _figures(loose: LooseFluid, t_s: float, whole_mm3: float) -> tuple[float, float, float, float]:
    front = float(np.quantile(loose.place_mm[:, 0], 1 - SPRAY)) + loose.half_mm
    return t_s, front, loose.height_mm, loose.volume_mm3 / whole_mm3


def _packed(block: Block, solver: Solver, device: str) -> Floats:
    """Return the block's particles at rest behind the closed gate: a lattice bursts when its gate opens."""
    radius_mm, factor = solver.size_mm, solver.scheme.volume_factor
    support, frame_s = 4 * radius_mm * CM, substep_s(radius_mm)
    thick = Rheology(viscous_weight(SETTLING_MM2_S * CM**2, support, frame_s), 0.0, physical=True)
    low, (x, y, height) = block.box_mm
    # As many particles as have the block's volume.
    lattice = filled_box_mm(low, (x, y, height * factor), radius_mm, factor)
    loose = LooseFluid.put(block.closed(radius_mm), lattice, thick, solver, device=device)
    for _ in loose.run(SETTLING_S, SETTLING_S):
        pass
    return loose.place_mm
