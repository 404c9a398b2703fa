"""Fluid at rest: density and level of a column, the paper's f, what freezing keeps; and what must hold always."""

from collections.abc import Iterator, Sequence
from itertools import product
from math import pi, sqrt
from typing import Any
from unittest.mock import patch

import numpy as np
import warp as wp

from benchmarks.physics_findings import Finding, reported, within
from benchmarks.physics_tanks import GRAVITY_MM_S2, Pit, Tank, resolution, settled_mm, spacing_mm
from sealtwin.core.records import Floats
from simulate.fluid.viscosity import STABLE
from simulate.loose_fluid import filled_box_mm
from simulate.profile import volume_ratio
from simulate.settings import PACKING, PRESETS, Fluid, particle_volume
from tests.fluids import FRAME_S, path, pour, slot

COLUMN = Pit(6.0, 3.1, 24.0)
COLUMN_MM = 16.0
RADIUS_MM = 0.4
REST_S = 1.5
"""Four times the memory of what keeps a run's volume."""
AGE_S = 0.49
"""17 frames of seven particles."""
STEPS_OF_CHAOS, STEP_S = 10, FRAME_S / 4


def _column(substeps: int, pressure: str, preset: str) -> Tank:
    how = resolution(preset, RADIUS_MM, FRAME_S / substeps, COLUMN.width_mm)
    how |= {"pressure": pressure, "keeps_volume": True}
    fluid = settled_mm(COLUMN, height_mm=COLUMN_MM, **how)
    # Water: enough to end the sloshing, little against the weight.
    tank = Tank.of(COLUMN, fluid, viscosity_mm2_s=1.0, **how)
    tank.wait(REST_S)
    return tank


def pressure_at(compression: float, tank: Tank) -> float:
    """Pressure over the density, in mm2/s2, that local iterations hold where density over rest density is 1 more.

    In each of n iterations a particle moves by the gradient of C (1 + 1.5 C) over S, where the continuum has
    S = 1.98 factor / h^2 + epsilon; n of them bear what a substep's fall would move it by, grad p dt^2.
    """
    engine, support = tank.engine, 4 * tank.radius_mm
    factor = engine.scheme.volume_factor * float(engine.state.swelling.numpy()[0])
    # Volume times the integral of the squared gradient of the spiky kernel: 8100 / pi B(3, 5) / h^5.
    squares = factor * particle_volume(tank.radius_mm) * 8100 / pi / 105 / support**5
    stiff = squares + engine.settings.relaxation / support**2
    return engine.scheme.iterations * compression * (1 + 1.5 * compression) / stiff / tank.step_s**2


def hydrostatic(preset: str = "accurate") -> Iterator[Finding]:
    """A column of 16 mm under its weight, its volume kept as in a run: where its level is, and how dense its floor.

    Of the weight, local pressure's law may miss 15 %: walls bear up to 6 % by the particles' friction (``shear_wave``),
    and sums over a packing are 9 % off the integrals. Two levels promise 2 % (``solver.pressure``).
    """
    for substeps, pressure in ((4, "local"), (8, "local"), (4, "two-level")):
        tank = _column(substeps, pressure, preset)
        inside = tank.inside
        density, height = tank.engine.state.density.numpy()[inside], tank.place_mm[inside, 2]
        dense = float(density[(height > 1) & (height < 3)].mean() - 1)
        level_mm = float(np.median(tank.surface_mm()[:, 1]))
        # Of all particles: what splashed out, or leaked, is missing from the level.
        stands_mm = tank.engine.state.count * particle_volume(tank.radius_mm) / COLUMN.length_mm / COLUMN.width_mm
        name = f"column, {substeps} substeps, {pressure}"
        yield within(f"{name}: level", level_mm, "mm", stands_mm, RADIUS_MM, "volume put in, +- R", share=False)
        if pressure == "local":
            borne = pressure_at(dense, tank) / (GRAVITY_MM_S2 * (stands_mm - 2))
            yield within(f"{name}: floor's pressure over weight", borne, "", 1.0, 0.15, "law of Eqs 1 to 3")
            yield reported(f"{name}: floor compressed by", 100 * dense, "%", "0", "solver.pressure")
        else:
            yield Finding(f"{name}: floor compressed by", 100 * dense, "%", -2, 2, "0", "solver.pressure")


def packing() -> Iterator[Finding]:
    """The paper's f, of volume = N 4 sqrt(2) f^3 R^3, that preset paper takes: Eq. 6 has 0.97 wherever it is."""
    for name, pit in (("cuboid, 10 mm", Pit(10.0, 10.0, 14.0)), ("slot, 3.1 mm", COLUMN)):
        fluid = settled_mm(pit, RADIUS_MM, FRAME_S / 4, 9.0, preset="paper")
        volume_mm3 = pit.length_mm * pit.width_mm * _level_mm(fluid)
        f = float(np.cbrt(volume_mm3 / len(fluid) / (4 * sqrt(2) * RADIUS_MM**3)))
        yield reported(f"f, {name}, preset paper", f, "", f"{PACKING:g}", "the paper; its walls push")


def _level_mm(place_mm: Floats) -> float:
    """Half a spacing above the topmost centres of columns a spacing wide, their mean."""
    side = spacing_mm(RADIUS_MM)
    cell = np.floor(place_mm[:, :2] / (1.5 * side)).astype(int)
    _, which = np.unique(cell, axis=0, return_inverse=True)
    top = np.full(which.max() + 1, -np.inf)
    np.maximum.at(top, which.ravel(), place_mm[:, 2])
    return float(np.median(top)) + side / 2


def freezing() -> Iterator[Finding]:
    """A slow pour of 690 particles, 120 of them moving: a bed that freezes keeps its volume, as every run should."""
    crack = slot()
    fluid = Fluid(viscosity_pa_s=0.01, freeze_after_s=AGE_S)
    kept = {}
    for answer in (1.0, 0.0):
        with patch.dict(PRESETS, accurate=PRESETS["accurate"]._replace(frozen_answer=answer)):
            run = pour(crack, path(crack[1], 0.228, speed_mm_s=0.7), fluid, radius_mm=RADIUS_MM, settle_s=0.5)
        kept[answer] = volume_ratio(run, crack[0])
    yield Finding("frozen bed: volume kept", kept[1.0], "", 0.99, 1.01, "1", "decision 0113")
    yield reported("frozen bed, lambda as in the paper: kept", kept[0.0], "", "1", "decision 0113")


def momentum() -> Iterator[Finding]:
    """A cube in chaos falls freely: nothing in it pushes it as a whole, and its mirror image does as it does."""
    for name, viscosity_mm2_s in (("pressure alone", 0.0), ("pressure and viscosity", 32.2)):
        moved, drift, apart = _chaos(viscosity_mm2_s)
        yield reported(f"chaos, {name}: mean path", moved, "mm", "some R", "something did happen")
        # Positions of 20 mm are rounded to 1e-6 mm in some fifty moves.
        yield Finding(f"momentum, {name}: drift", drift, "mm", 0, 1e-4, "0", "action is reaction")
        # Chaos doubles float32's 1e-6 in each substep or so.
        yield Finding(f"mirror image, {name}", apart, "mm", 0, 1e-6 * 2**STEPS_OF_CHAOS, "0", "symmetry")


def _chaos(viscosity_mm2_s: float) -> tuple[float, float, float]:
    """A particle's path relative to the fall, the whole's drift, and how far particles are from their mirror images."""
    fluid = filled_box_mm((0.0, -3.0, 14.0), (6.0, 3.0, 20.0), RADIUS_MM)
    speed = np.random.default_rng(0).normal(0, 100, fluid.shape)
    places = []
    for sign in (1.0, -1.0):
        flip = np.array([1.0, sign, 1.0])
        how: dict[str, Any] = {"radius_mm": RADIUS_MM, "step_s": STEP_S, "viscosity_mm2_s": viscosity_mm2_s}
        tank = Tank.of(Pit(6.0, 6.0, 4.0), fluid * flip, falls=True, **how)
        tank.set_velocity(speed * flip)
        tank.wait(STEPS_OF_CHAOS * STEP_S)
        places.append(tank.place_mm * flip)
    count = STEPS_OF_CHAOS
    fall = np.array([0, 0, -GRAVITY_MM_S2 * STEP_S**2 * count * (count + 1) / 2])
    drift = (places[0] - fluid - speed * count * STEP_S - fall).mean(axis=0)
    path_mm = np.linalg.norm(places[0] - fluid - fall, axis=1).mean()
    return float(path_mm), float(np.abs(drift).max()), float(np.abs(places[0] - places[1]).max())


def mirror() -> Iterator[Finding]:
    """A column let go in the middle of a pit spreads alike to both sides, walls of particles and all."""
    length_mm, high_mm = 60.0, 16.0
    fluid = settled_mm(Pit(12.0, 3.1, 24.0), RADIUS_MM, FRAME_S / 4, high_mm)
    fluid[:, 0] += (length_mm - 12.0) / 2
    tank = Tank.of(Pit(length_mm, 3.1, 24.0), fluid, radius_mm=RADIUS_MM, step_s=FRAME_S / 4, viscosity_mm2_s=32.2)
    tank.wait(0.5)
    x, level = tank.surface_mm(column_mm=2.0).T
    off = float(np.abs(level - np.interp(length_mm - x, x, level)).mean())
    # One layer of particles more or less is all that a count of particles in a column can say.
    yield Finding("mirror: levels left and right, mean apart", off, "mm", 0, RADIUS_MM, "0", "half a diameter")


def passes() -> Iterator[Finding]:
    """The rule behind q: the largest eigenvalue of A over its largest diagonal, by power iteration."""
    fluid = settled_mm(COLUMN, RADIUS_MM, STEP_S, 10.0)
    how: dict[str, Any] = {"viscosity_mm2_s": 32.2, "drag_mm": 3.0 / 4, "viscosity_solve": "explicit"}
    tank = Tank.of(COLUMN, fluid, radius_mm=RADIUS_MM, step_s=STEP_S, **how)
    engine = tank.engine
    engine.find_neighbours()
    engine.pressure.measure_density(engine.rows)
    engine.viscosity.pass_explicit(engine.rows)
    diagonal = float(engine.viscosity.system.restraint.numpy().max())
    before, after = (wp.zeros(len(fluid) + 2, dtype=wp.vec3, device="cpu")[: len(fluid)] for _ in range(2))
    before.assign(np.random.default_rng(0).normal(0, 1, (len(fluid), 3)).astype(np.float32))
    growth = 0.0
    # With q of a hundredth of the diagonal the pass is -A v, nearly.
    q = diagonal / 100
    for _ in range(300):
        engine.viscosity.pass_once(before, after, q, engine.rows)
        size = float(np.linalg.norm(after.numpy()))
        growth = size / float(np.linalg.norm(before.numpy()))
        before.assign(after.numpy() / size)
    largest = (growth + 1) * q
    name = "explicit passes: largest eigenvalue over diagonal"
    # A pass takes STABLE of a velocity at most: up to its inverse no wave overshoots. Nor is it less than the diagonal,
    # but for what the iteration leaves.
    yield Finding(name, largest / diagonal, "", 0.99, 1 / STABLE, "1", "no overshoot")


CORNERS = tuple(product((1e-2, 1e4), (1e-4, 3.0)))


def corners() -> Iterator[Finding]:
    """Both presets at the corners of the paper's range of U and D: none in the walls, all numbers finite."""
    crack = slot(12.0)
    for preset in PRESETS:
        lost = 0
        for u, d in CORNERS:
            fluid = Fluid(U=u, D_cm=d, freeze_after_s=0.3)
            run = pour(crack, path(crack[1], 0.3, speed_mm_s=8.0), fluid, preset=preset, settle_s=0.2)
            lost += run.escaped_particles + int((~np.isfinite(run.position_mm).all(axis=1)).sum())
        yield Finding(f"corners of (U, D), preset {preset}: lost particles", lost, "", 0, 0, "0", "no leak")


CASES: Sequence[str] = ("hydrostatic", "packing", "freezing", "momentum", "mirror", "passes", "corners")
