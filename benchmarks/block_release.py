"""Simulate the release of a block of fluid: a dam break onto a plate."""

import math
from dataclasses import astuple, dataclass

import numpy as np
from pydantic import Field

from benchmarks.hollow import Box, Hollow
from benchmarks.loose_fluid import LooseFluid, all_at_once, filled_box_mm, substep_s
from sealtwin.core.arrays import Floats, HasSummary, ReadOnly
from sealtwin.core.errors import InputError, NumericalError
from sealtwin.core.settings import Settings
from simulate.device import start_warp
from simulate.injection import ComputeOptions
from simulate.settings import LEVEL, Fluid, SampleSlope, Solver, particle_volume
from simulate.setup.rheology import Rheology, viscous_weight
from simulate.setup.signed_distance import CM
from simulate.setup_checks import solved_as

SETTLING_MM2_S, SETTLING_S = 300.0, 0.25
"""Kinematic viscosity and duration of the settling behind the closed gate. Both are chosen so that the block comes to
rest with a level surface."""
SPRAY = 0.002  # Fraction of the particles that may be ahead of the front
WALL_RADII = 4.0  # Thickness of the walls beside a block, in particle radii
HEADROOM = 1.25  # Height of the hollow, as a multiple of the block's height
NOT_READ = ("model", "damping_per_s", "settle_s")  # Solver settings that do not apply to a block
MIN_ACROSS = 6  # Smallest allowed number of particle diameters across the shortest side of the block
MAX_PARTICLES = 200_000


class FluidBlock(Settings):
    """A block of fluid at rest behind a gate.

    The gate is at x = 0, and the block is behind it. The walls behind and beside the block end at the gate, and a level
    plate is ahead, as in a dam break.
    """

    length_mm: float = Field(gt=0, le=2000)
    """Length of the block, from the back wall to the gate."""
    width_mm: float = Field(gt=0, le=2000)
    """Width of the block, across the flow."""
    height_mm: float = Field(gt=0, le=2000)
    """Height of the block above the floor."""
    ahead_mm: float | None = Field(default=None, gt=0, le=5000)
    """Length of the plate ahead of the gate. Default: twice the sum of the block's length and height."""
    duration_s: float = Field(gt=0, le=600)
    """Simulated time in s. The run ends earlier if everything comes to rest."""
    every_s: float = Field(default=0.05, gt=0)
    """Time in s between two rows of the result."""

    @property
    def end_mm(self) -> float:
        """Position x of the end of the plate."""
        return 2 * (self.length_mm + self.height_mm) if self.ahead_mm is None else self.ahead_mm


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class BlockRelease(ReadOnly, HasSummary):
    """Flow of a block of fluid after its gate is removed."""

    t_s: Floats
    """Times since the gate was removed, (n,)."""
    front_mm: Floats
    """Distance of the front from the gate along x, (n,). Up to 0.2 % of the fluid, as spray, may be ahead of it."""
    height_mm: Floats
    """Height of the highest fluid above the floor, (n,)."""
    volume_ratio: Floats
    """Volume below the fluid's surface, divided by the volume of the block, (n,)."""
    position_mm: Floats
    """Positions of the particles at the end, (m, 3): x from the gate, y from the middle, z from the floor."""
    radius_mm: float
    """Radius of the particles."""
    at_rest: bool
    """True if all particles are at rest at the end."""

    @property
    def main_figures(self) -> dict[str, str]:
        state = "at rest" if self.at_rest else "moving"
        return {"front": f"{self.front_mm[-1]:.1f} mm", "after": f"{self.t_s[-1]:.3g} s, {state}"}


def _box(block: FluidBlock) -> Box:
    half = block.width_mm / 2
    return Box((-block.length_mm, -half, 0.0), (0.0, half, block.height_mm))


def _top_mm(block: FluidBlock, radius_mm: float) -> float:
    return HEADROOM * block.height_mm + 4 * radius_mm


def closed(block: FluidBlock, radius_mm: float) -> Hollow:
    """Return the space behind the closed gate."""
    low, (x, y, _) = astuple(_box(block))
    return Hollow(Box(low, (x, y, _top_mm(block, radius_mm))))


def opened(block: FluidBlock, radius_mm: float) -> Hollow:
    """Return the space in which the fluid can flow once the gate is removed."""
    (back, right, _), (_, left, _) = astuple(_box(block))
    top, end, wall = _top_mm(block, radius_mm), block.end_mm, WALL_RADII * radius_mm
    # The plate extends beside the walls, for fluid that flows around their ends.
    walls = (
        Box((back - wall, right - wall, 0.0), (back, left + wall, top)),
        Box((back, right - wall, 0.0), (0.0, right, top)),
        Box((back, left, 0.0), (0.0, left + wall, top)),
    )
    return Hollow(Box((back - wall, right - end, 0.0), (end, left + end, top)), walls)


def release(
    block: FluidBlock,
    fluid: Fluid,
    solver: Solver,
    *,
    options: ComputeOptions | None = None,
    slope: SampleSlope = LEVEL,
    seed: int = 0,
) -> BlockRelease:
    """Simulate a block of fluid from the moment its gate is removed. The fluid sticks to floor and walls.

    ``seed`` selects the small random offsets of the particles at the start. Raises InputError if ``solver`` has a
    setting that does not apply to a block, if the block has too few or too many particles, or if the fluid is too
    stiff. Raises NumericalError if the front reaches the edge of the plate or the computation fails.
    """
    if unread := [name for name in NOT_READ if name in solver.model_fields_set]:
        raise InputError(f"solver.{unread[0]} does not apply to the release of a block. Leave it out.")
    if solver.radius_mm == "auto":
        raise InputError('solver.radius_mm is "auto", which needs the width of a crack: give a number.')
    options = options or ComputeOptions()
    radius_mm, device, progress = solver.size_mm, options.device, options.progress
    sides = block.length_mm, block.width_mm, block.height_mm
    across, count = min(sides) / (2 * radius_mm), math.prod(sides) / particle_volume(radius_mm)
    if across < MIN_ACROSS or count > MAX_PARTICLES:
        raise InputError(
            f"solver.radius_mm is {radius_mm:g}: the block would have {count:,.0f} particles, {across:.3g} across its "
            f"shortest side. At most {MAX_PARTICLES:,} particles, and at least {MIN_ACROSS} across, are allowed."
        )
    start_warp()
    frame_s = substep_s(radius_mm) / (solver.substeps or 1)
    solver = solver.model_copy(update={"substeps": 1})
    paste, _ = solved_as(fluid, solver, frame_s, round(block.duration_s / frame_s) + 1)
    place_mm = _packed(block, solver, seed, device)
    loose = LooseFluid.put(
        opened(block, radius_mm),
        all_at_once(place_mm, radius_mm, frame_s),
        paste,
        solver,
        slope=slope,
        device=device,
        threads=options.cpu_threads,
    )
    whole_mm3 = len(place_mm) * particle_volume(radius_mm)
    rows = [_figures(loose, 0.0, whole_mm3)]
    progress.start("Releasing the block", loose.frames_in(block.duration_s))
    for t_s in loose.run(block.duration_s, block.every_s):
        rows.append(_figures(loose, t_s, whole_mm3))
        x, y, _ = loose.place_mm.T
        if max(x.max(), np.abs(y).max() - block.width_mm / 2) > block.end_mm - 2 * radius_mm:
            raise NumericalError(
                f"ahead_mm is {block.end_mm:g}: fluid reaches the plate's edge after {t_s:.3g} s. Increase ahead_mm."
            )
        progress.advance(loose.frames, f"front at {rows[-1][1]:.1f} mm")
    progress.close()
    if loose.escaped:
        raise NumericalError(f"{loose.escaped} particles went through a wall. This is an error of the software.")
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


def _figures(loose: LooseFluid, t_s: float, whole_mm3: float) -> tuple[float, float, float, float]:
    front = float(np.quantile(loose.place_mm[:, 0], 1 - SPRAY)) + loose.half_mm
    return t_s, front, loose.height_mm, loose.volume_mm3 / whole_mm3


def _packed(block: FluidBlock, solver: Solver, seed: int, device: str) -> Floats:
    """Return the positions of the block's particles at rest behind the closed gate, in mm, (n, 3).

    The particles must settle first, because a regular lattice would burst when the gate opens.
    """
    radius_mm, factor = solver.size_mm, solver.scheme.volume_factor
    support, frame_s = 4 * radius_mm * CM, substep_s(radius_mm)
    thick = Rheology(viscous_weight(SETTLING_MM2_S * CM**2, support, frame_s), 0.0, physical=True)
    low, (x, y, height) = astuple(_box(block))
    # The number of particles is the block's volume divided by the volume of a particle.
    lattice = filled_box_mm(low, (x, y, height * factor), radius_mm, factor, seed)
    loose = LooseFluid.put(closed(block, radius_mm), all_at_once(lattice, radius_mm), thick, solver, device=device)
    for _ in loose.run(SETTLING_S, SETTLING_S):
        pass
    return loose.place_mm
