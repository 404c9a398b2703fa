"""Fluid without walls or surface, under pressure or none: a box that repeats itself in all three directions.

Millimetres and seconds. The solver knows no such box. Around it lie images of what is near its sides: particles that
rest, as far as the solver sees, and that are given the place, multiplier, volume and speed of their originals whenever
these have changed.
"""

from collections.abc import Callable
from itertools import product
from typing import Any

import numpy as np

from sealtwin.core.records import Floats
from simulate.settings import particle_volume
from simulate.setup.signed_distance import CM
from tests.support.small_fluids import lay_down
from tests.support.tanks import BEGINS_WITH, GRAVITY_MM_S2, Pit, Tank, spacing_mm

PIT_DEPTH_MM, HIGH_MM = 4.0, 30.0
"""The box hangs this high over the floor of a pit, far from any wall."""
REACH = 1.5
"""Of images around the box, over the support: what comes into a list while particles move."""
ROOM = 1.2
"""For images, over those of an even fluid."""
CHANGES = {"engine": ("predict", "update_velocity"), "pressure": ("measure_density", "correct")}
"""What a substep does to particles, up to its viscosity; what parts of the solver do it."""
STIR_MM_S, STIR_STEPS, CALM_STEPS = 200.0, 80, 240
"""Enough to lose a lattice, whose layers slide in steps; and to come to rest in a paste of the paper's U."""
CALMING_MM2_S = 32.2


class Endless:
    """Fluid in a box of ``side_mm``, (3,), and in all the boxes beside it."""

    def __init__(
        self, place_mm: Floats, side_mm: Floats, *, radius_mm: float, walled: bool = False, **fluid: Any
    ) -> None:
        """Particles, (n, 3), at rest in a box whose low corner is the origin.

        ``walled``, it repeats along x and z alone, and plane walls are its sides in y. ``fluid`` is for ``Tank.of``.
        """
        self.side_mm, self.count = side_mm, len(place_mm)
        self._reach_mm = REACH * 4 * radius_mm
        self._turns = list(product((-1, 0, 1), (0,) if walled else (-1, 0, 1), (-1, 0, 1)))
        around = 2 * self._reach_mm * np.array([1, not walled, 1])
        count = int(ROOM * (np.prod(side_mm + around) / np.prod(side_mm) - 1) * self.count)
        if walled:
            # Images for which there is no original wait beyond the box's end, out of its reach.
            aside = side_mm[0] + 2 * self._reach_mm
            pit = Pit(float(2 * aside), float(side_mm[1]), float(side_mm[2] + 4 * self._reach_mm))
            self._low_mm = np.array([2 * self._reach_mm, -side_mm[1] / 2, 2 * self._reach_mm])
            waiting = side_mm / 2 + [aside, 0, 0]
        else:
            # They wait under the box.
            pit = Pit(float(side_mm[0]), float(side_mm[1]), PIT_DEPTH_MM)
            self._low_mm = np.array([0.0, 0.0, HIGH_MM])
            waiting = side_mm / 2 - [0, 0, HIGH_MM - PIT_DEPTH_MM - 2]
        everywhere = np.vstack([place_mm, np.tile(waiting, (count, 1))]) + self._low_mm
        self.tank = Tank.of(pit, everywhere, radius_mm=radius_mm, falls=not walled, **fluid)
        engine = self.tank.engine
        lay_down(engine, np.arange(engine.state.count) >= self.count)
        self._idle = self._of("position")[self.count :].copy()
        self._source, self._shift = np.zeros(0, dtype=np.int64), np.zeros((0, 3))
        # One by one, since images are moved between two launches.
        setattr(engine, "_launch", self._launched)  # noqa: B010
        self.push_mm_s2 = np.zeros(3)
        """Acceleration of all particles, in place of gravity."""
        engine.predict = self._pushed(engine.predict)
        parts = {"engine": engine, "pressure": engine.pressure}
        for part, name in [(parts[part], name) for part, names in CHANGES.items() for name in names]:
            setattr(part, name, self._then_followed(getattr(part, name)))
        # The viscosity's search changes its residuals between two products.
        for name in ("weigh_pairs", "apply_matrix"):
            setattr(engine.viscosity, name, self._followed_first(getattr(engine.viscosity, name)))

    def _launched(self, *parts: Callable[[int], object]) -> None:
        for part in parts:
            part(self.tank.engine.rows)

    @property
    def place_mm(self) -> Floats:
        return self.tank.place_mm[: self.count] - self._low_mm

    @property
    def velocity_mm_s(self) -> Floats:
        return self.tank.velocity_mm_s[: self.count]

    def moved_mm(self, from_mm: Floats) -> Floats:
        """Displacement from earlier places, (n, 3), less than half of the box."""
        moved_mm = self.place_mm - from_mm
        return moved_mm - self.side_mm * np.round(moved_mm / self.side_mm)

    def set_velocity(self, velocity_mm_s: Floats) -> None:
        self._of("velocity")[: self.count] = velocity_mm_s * CM

    def wait(self, steps: int) -> None:
        for _ in range(steps):
            self._wrap()
            self.tank.step()

    def solve_alone(self, times: int) -> None:
        """The viscosity of as many substeps, with all particles where they are; each is a frame older than the last."""
        engine = self.tank.engine
        self._wrap()
        engine.find_neighbours()
        engine.pressure.measure_density(engine.rows)
        for frame in range(times):
            if engine.needs_shear_rate:
                engine.state.frame.fill_(frame)
                engine.viscosity.measure_shear(engine.rows)
            self._follow()
            viscosity = engine.viscosity
            (viscosity.pass_explicit if viscosity.explicit else viscosity.solve_implicit)(engine.rows)

    def _wrap(self) -> None:
        """Who has left the box enters it on the other side; images are chosen anew."""
        place, side, reach = self._of("position"), self.side_mm * CM, self._reach_mm * CM
        low = (self._low_mm - [0, 0, self.tank.pit.depth_mm]) * CM
        inside = place[: self.count, :3].copy()
        for axis in {axis for turn in self._turns for axis in range(3) if turn[axis]}:
            inside[:, axis] = low[axis] + (inside[:, axis] - low[axis]) % side[axis]
        place[: self.count, :3] = inside
        place[self.count :] = self._idle
        shifts = [np.array(turn) * side for turn in self._turns if any(turn)]
        near = [((inside + s > low - reach) & (inside + s < low + side + reach)).all(axis=1) for s in shifts]
        self._source = np.concatenate([np.flatnonzero(which) for which in near])
        self._shift = np.repeat(shifts, [which.sum() for which in near], axis=0)
        self._follow()

    def _follow(self) -> None:
        image = slice(self.count, self.count + len(self._source))
        for name in ("position", "volume_and_viscosity", "velocity", "scaled_residual"):
            values = self._of(name)
            values[image] = values[self._source]
        self._of("position")[image, :3] += self._shift

    def _of(self, name: str) -> Floats:
        """An array of the state itself: on the CPU ``numpy`` gives no copy."""
        return getattr(self.tank.engine.state, name).numpy()

    def _pushed(self, predict: Callable[..., None]) -> Callable[..., None]:
        def predicts(*inputs: Any) -> None:
            # The solver's gravity, which it adds, is taken away again.
            velocity = self._of("velocity")[: self.count]
            before = velocity.copy()
            velocity += (self.push_mm_s2 + np.array([0, 0, GRAVITY_MM_S2])) * CM * self.tank.step_s
            predict(*inputs)
            velocity[:] = before

        return predicts

    def _then_followed(self, change: Callable[..., None]) -> Callable[..., None]:
        def changed(*inputs: Any, **options: Any) -> None:
            change(*inputs, **options)
            self._follow()

        return changed

    def _followed_first(self, read: Callable[..., None]) -> Callable[..., None]:
        def reads(*inputs: Any) -> None:
            self._follow()
            read(*inputs)

        return reads


def stirred_mm(
    side_mm: Floats, packed: float, radius_mm: float, step_s: float, *, walled: bool = False, seed: int = 0
) -> Floats:
    """Particles at rest in no order, (n, 3): ``packed`` times as many as the box holds at rest density."""
    packed /= BEGINS_WITH
    count = round(packed * float(side_mm.prod()) / particle_volume(radius_mm))
    along = np.ceil(side_mm / spacing_mm(radius_mm) * np.cbrt(packed)).astype(int) + 1
    axes = [(np.arange(n) + 0.5) / n * length for n, length in zip(along, side_mm, strict=True)]
    lattice = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    random = np.random.default_rng(seed)
    place = random.permutation(lattice)[:count]
    kick = random.normal(0, STIR_MM_S, place.shape)
    for viscosity_mm2_s, speed, steps in (
        (0.0, kick - kick.mean(axis=0), STIR_STEPS),
        (CALMING_MM2_S, 0 * kick, CALM_STEPS),
    ):
        box = Endless(
            place, side_mm, radius_mm=radius_mm, step_s=step_s, viscosity_mm2_s=viscosity_mm2_s, walled=walled
        )
        box.set_velocity(speed)
        box.wait(steps)
        place = box.place_mm
    return place
