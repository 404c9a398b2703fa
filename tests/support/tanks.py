"""Tanks and channels: blocks of fluid in pits hewn from a block, and how they are run.

Millimetres and seconds. A pit stands on z = 0 here: its floor is at z = 0, its mouth at its depth.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from benchmarks.hollow import Box, Hollow
from benchmarks.loose_fluid import all_at_once, filled_box_mm
from sealtwin.core.records import Floats, Outline, Solid
from simulate.fluid.cell_grid import MAX_ROOM
from simulate.fluid.solver import FluidSolver
from simulate.kernels.neighbours import Neighbours
from simulate.settings import Fluid, Solver, particle_volume
from simulate.setup.rheology import Rheology, viscous_weight
from simulate.setup_checks import rheology_of
from simulate.volume_control import VolumeControl
from tests.support.shapes import straight_slot
from tests.support.small_fluids import engine_with, positions_mm

GRAVITY_MM_S2 = 9810.0
SETTLING_MM2_S, SETTLING_S = 300.0, 0.25
"""Thick enough to end all motion in that time, thin enough to find its level."""

BEGINS_WITH = Solver().scheme.volume_factor
"""What a particle of a run counts for over its volume by Eq. 6, before the run finds its own factor."""

SPRAY = 0.005
"""Share of a fluid that runs ahead of its front, particle by particle."""

Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Pit:
    """A box from x = 0, with y = 0 in its middle."""

    length_mm: float
    width_mm: float
    depth_mm: float

    @property
    def crack(self) -> tuple[Solid, Outline]:
        return self.hollow.solid, straight_slot(self.length_mm, self.width_mm)

    @property
    def hollow(self) -> Hollow:
        return _hollow(self)


@cache
def _hollow(pit: Pit) -> Hollow:
    half = pit.width_mm / 2
    return Hollow(Box((0.0, -half, 0.0), (pit.length_mm, half, pit.depth_mm)))


def raised(place_mm: Floats, by_mm: float) -> Floats:
    """The same places, (n, 3), so much higher."""
    return place_mm + np.array([0.0, 0.0, by_mm])


def spacing_mm(radius_mm: float) -> float:
    """Side of the cube that a particle stands for."""
    return float(np.cbrt(particle_volume(radius_mm)))


def settled_mm(
    pit: Pit,
    radius_mm: float,
    step_s: float,
    height_mm: float | None = None,
    *,
    keeps_volume: bool = False,
    **solver: Any,
) -> Floats:
    """Particles at rest in a pit that they fill up to a height, (n, 3), as a gate holds them before it opens.

    A lattice put down in the open bursts: its layers are not where the pressure wants them. They are as many as fill
    it with what they count for; where the run keeps its volume, as many as have that volume.
    """
    half = pit.width_mm / 2
    factor = Solver.model_validate(solver).scheme.volume_factor
    top_mm = (pit.depth_mm if height_mm is None else height_mm) * (factor if keeps_volume else 1.0)
    fluid = filled_box_mm((0.0, -half, 0.0), (pit.length_mm, half, top_mm), radius_mm, factor)
    tank = Tank.of(
        pit,
        fluid,
        radius_mm=radius_mm,
        step_s=step_s,
        viscosity_mm2_s=SETTLING_MM2_S,
        keeps_volume=keeps_volume,
        **solver,
    )
    tank.wait(SETTLING_S)
    return tank.place_mm


CUBE_RADIUS_MM = 0.4


@cache
def cube_mm(side_mm: float) -> Floats:
    """A cube as packed as a liquid, (n, 3): lattices have a viscosity of their own, 24 % off along some axes."""
    return settled_mm(Pit(side_mm, side_mm, side_mm + 8), CUBE_RADIUS_MM, 0.5e-3, side_mm)


@dataclass
class Tank:
    """Fluid in a pit."""

    pit: Pit
    engine: FluidSolver
    radius_mm: float
    volume_control: VolumeControl | None = None
    steps: int = 0

    @classmethod
    def of(
        cls,
        pit: Pit,
        particles_mm: Floats,
        *,
        radius_mm: float,
        step_s: float,
        viscosity_mm2_s: float = 0.0,
        drag_mm: float = 0.0,
        yield_mm2_s2: float = 0.0,
        slips: Callable[[Floats], Mask] | None = None,
        falls: bool = False,
        fluid: Fluid | Rheology | None = None,
        keeps_volume: bool = False,
        **solver: Any,
    ) -> "Tank":
        """A frame is a substep of ``step_s``.

        Particles count for as much as those of a run when it begins; where it ``keeps_volume``, that changes as in a
        run, within some tenths of a second. ``slips`` says which places of walls, floor at z = 0, drag no fluid. What
        ``falls`` is high above the pit. ``fluid`` stands for viscosity, drag and yield stress, as a trial file gives
        them or in the solver's units.
        """
        support_cm = 0.4 * radius_mm
        rheology = Rheology(
            viscous_weight(viscosity_mm2_s / 100, support_cm, step_s),
            drag_mm / 10,
            yield_cm2_s2=yield_mm2_s2 / 100,
            physical=True,
        )
        if fluid is not None:
            rheology = fluid if isinstance(fluid, Rheology) else rheology_of(fluid, support_cm, step_s)
        place_mm = particles_mm - [0, 0, pit.depth_mm]
        engine = engine_with(
            place_mm,
            pit.crack,
            frame_s=step_s,
            fluid=rheology,
            radius_mm=radius_mm,
            # A tenth of a speed in half a second would count as viscosity.
            damping_per_s=0.0,
            reach_mm=None if falls else pit.hollow.reach_mm,
            substeps=1,
            **solver,
        )
        if slips is not None:
            _let_slip(engine, slips, pit.depth_mm)
        control = None
        if keeps_volume:
            schedule = all_at_once(place_mm, radius_mm, step_s)
            settings = Solver.model_validate({**solver, "radius_mm": radius_mm})
            control = VolumeControl(pit.crack[0], schedule, engine.state, engine.launcher, settings, [rheology])
        return cls(pit, engine, radius_mm, control)

    @property
    def step_s(self) -> float:
        return self.engine.step_s

    @property
    def place_mm(self) -> Floats:
        """(n, 3), floor at z = 0."""
        return positions_mm(self.engine) + np.array([0, 0, self.pit.depth_mm])

    @property
    def velocity_mm_s(self) -> Floats:
        return self.engine.state.velocity_mm_s()

    def set_velocity(self, velocity_mm_s: Floats) -> None:
        self.engine.state.velocity.assign((velocity_mm_s / 10).astype(np.float32))

    def run(self, seconds: float) -> Iterator[float]:
        """Substep after substep; the time after each, until all rest."""
        for number in range(1, round(seconds / self.step_s) + 1):
            if not self.step():
                return
            self.engine.rest()
            if self.volume_control:
                self.volume_control.after_frame(self.steps)
            yield number * self.step_s

    def step(self) -> bool:
        """Compute a substep, as a run's frame does; False if all rest."""
        self.engine.begin_frame(self.steps)
        if self.engine.rows == 0:
            return False
        self.engine.step()
        self.steps += 1
        return True

    def wait(self, seconds: float) -> None:
        for _ in self.run(seconds):
            pass

    @property
    def inside(self) -> Mask:
        """Particles that did not splash out of the pit."""
        x, y, _ = self.place_mm.T
        return (x > 0) & (x < self.pit.length_mm) & (np.abs(y) < self.pit.width_mm / 2)

    def leaked(self) -> int:
        """Particles inside the solid, or no numbers."""
        place = positions_mm(self.engine)
        sound = np.isfinite(place).all(axis=1)
        return int((~sound).sum() + (self.engine.barrier.exact_mm(place[sound]) < 0).sum())

    def surface_mm(self, column_mm: float = 1.0) -> Floats:
        """Level over x, (columns, 2): half a spacing above the topmost centre of each column that has any."""
        place = self.place_mm[self.inside]
        column = np.floor(place[:, 0] / column_mm).astype(int)
        top = np.full(column.max() + 1, -np.inf)
        np.maximum.at(top, column, place[:, 2])
        seen = np.flatnonzero(np.isfinite(top))
        middle_mm = (seen + 0.5).astype(np.float64) * column_mm
        return np.stack([middle_mm, top[seen] + spacing_mm(self.radius_mm) / 2], axis=1)

    def front_mm(self) -> float:
        """Where the fluid ends in x: half a spacing beyond all but its SPRAY."""
        return float(np.quantile(self.place_mm[:, 0], 1 - SPRAY)) + spacing_mm(self.radius_mm) / 2


def _let_slip(engine: FluidSolver, slips: Callable[[Floats], Mask], depth_mm: float) -> None:
    """Those wall particles keep their pressure and lose their drag: the viscosity reads walls of its own."""
    place = engine.walls.position_and_share.numpy().copy()
    place[slips(10 * place[:, :3].astype(float) + [0, 0, depth_mm]), 3] = 0.0
    spare = np.full((1, 4), 1e3)
    whole = wp.array(np.concatenate([place, spare]), dtype=wp.vec4, device=engine.state.device)
    # A copy cannot follow lists that are given more room.
    engine.make_room(MAX_ROOM)
    lists: Any = Neighbours()
    lists.assign(engine.lists)
    lists.wall_particle = whole[: len(place)]
    engine.viscosity.bind_weights(lists)
