"""Paste with a yield stress: banks in a slot, what the feedback and sleep are for, and the trial of the paper."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from math import cos, radians, sqrt, tan
from unittest.mock import patch

import numpy as np

from benchmarks import stiffening
from benchmarks.physics_findings import Finding, within
from benchmarks.physics_tanks import CUBE_RADIUS_MM, GRAVITY_MM_S2, Pit, Tank, block_mm, cube_mm, raised

DENSITY_KG_M3 = 1690.0
VISCOSITY_MM2_S, DRAG_MM_S = 32.2, 3.0 / 7.23e-3
"""U = 30 and D = 0.3 cm of the paper's frame."""
CUBE_MM = 9.0
"""More than two supports from its middle to its sides."""
WIDTH_MM, HEAP_MM = 3.1, (12.0, 24.0)
WALL_DEG = 5.5
"""Of each wall of the paper's trial, which opens upwards."""
SUBSTEP_S = {0.5: 14.1e-3 / 6, 0.4: 7.23e-3 / 4}
"""The prototype's, by radius in mm."""


def bank(stress_pa: float, seconds: float, radius_mm: float = 0.5, sleep: bool = True, feedback: bool = True) -> Tank:
    """A heap against the end of a slot, let go; as it lies after that time, or as soon as all of it sleeps."""
    pit = Pit(60.0, WIDTH_MM, 26.0)
    heap = block_mm((0.0, -WIDTH_MM / 2, 0.0), (HEAP_MM[0], WIDTH_MM / 2, HEAP_MM[1]), radius_mm)
    step_s = SUBSTEP_S[radius_mm]
    tank = Tank.of(
        pit,
        heap,
        radius_mm=radius_mm,
        step_s=step_s,
        viscosity_mm2_s=VISCOSITY_MM2_S,
        drag_mm=DRAG_MM_S * step_s,
        yield_mm2_s2=stress_pa / DENSITY_KG_M3 * 1e6,
        sleep=sleep,
    )
    if feedback:
        tank.wait(seconds)
    else:
        with patch.object(tank.engine, "_move_as_solved"):
            tank.wait(seconds)
    return tank


def slope(tank: Tank) -> tuple[float, float]:
    """Tan of the surface over 25 to 90 % of its height, and the mean depth there in mm."""
    x, level = tank.surface_mm().T
    top = level.max()
    front = x[level > 0.25 * top].max()
    crest = x[level > 0.9 * top].max()
    part = (x <= front) & (x > crest)
    return -float(np.polyfit(x[part], level[part], 1)[0]), float(level[part].mean())


def stability_number(stress_pa: float, depth_mm: float) -> float:
    """S = (tau / rho g) (2 / w + 1 / d): the slope at which the walls and the floor of a slot still hold the paste."""
    return _held_mm(stress_pa) * (2 / WIDTH_MM + 1 / depth_mm)


def steepest(stress_pa: float, depth_mm: float) -> float:
    """Tan of a heap that its slot just holds: S is the sine of it in a slot deeper than wide, not the tangent.

    At 5, 9 and 15 Pa that is 1.03, 1.09 and 1.32 times S; and a finite heap holds 1 / (1 - 2 tau / (rho g d)) more.
    """
    s = stability_number(stress_pa, depth_mm)
    return s / sqrt(1 - s**2) / (1 - 2 * _held_mm(stress_pa) / depth_mm)


def _held_mm(stress_pa: float) -> float:
    """Tau over rho g: the height of paste that a wall's stress carries on its own area."""
    return stress_pa / DENSITY_KG_M3 / GRAVITY_MM_S2 * 1e6


def banks() -> list[Finding]:
    """Tan of the slope over S: in proportion to the stress, and at any radius; and over what a heap can hold.

    S is a slope only while it is small: between 5 and 15 Pa the sine and the tangent part by 29 %, which is why tan
    over S grows. A longer heap turns the order round (24 mm long, 8 s: 1.31, 1.31 and 1.22), since at 15 Pa its back
    has not slumped at all.
    """
    found, ratios = [], []
    source = "simulate-yield.md"
    for stress_pa, radius_mm, low, high in (
        (5.0, 0.5, 1.14, 1.44),
        (9.0, 0.5, 1.14, 1.44),
        (15.0, 0.5, 1.14, 1.44),
        (9.0, 0.4, 1.15, 1.55),
    ):
        steep, depth_mm = slope(bank(stress_pa, 6.0, radius_mm))
        ratio = steep / stability_number(stress_pa, depth_mm)
        name = f"bank of {stress_pa:g} Pa, R {radius_mm:g} mm: tan"
        found.append(Finding(f"{name} / S", ratio, "", "1.29" if radius_mm == 0.5 else "1.44", source, low, high))
        # As far as two slopes of one bed agree on the stress that holds both.
        held = steep / steepest(stress_pa, depth_mm)
        found.append(within(f"{name} / a finite heap's", held, "", 1.0, 0.15, f"{source}, sine, heap"))
        if radius_mm == 0.5:
            ratios.append(ratio)
    spread = 100 * (max(ratios) / min(ratios) - 1)
    return [*found, Finding("banks: spread of tan / S between stresses", spread, "%", "0", source, 0, 10)]


def feedback() -> list[Finding]:
    """10 Pa, 2 s, no sleep: without the solved velocity in the positions a bank at rest slides in every substep."""
    source = "simulate-yield.md"
    return [
        Finding("10 Pa after 2 s: tan, velocity fed back", slope(bank(10, 2, sleep=False))[0], "", "0.60", source, 0.4),
        Finding(
            "the same, not fed back", slope(bank(10, 2, sleep=False, feedback=False))[0], "", "0.25", source, None, 0.3
        ),
    ]


def drift() -> list[Finding]:
    """What a bank at rest does in ten seconds more: nothing where it sleeps, little where it creeps at 0.002 /s."""
    found = []
    for sleep, high in ((True, 0.0), (False, 0.5)):
        tank = bank(12.0, 6.0, sleep=sleep)
        before = tank.place_mm
        tank.wait(10.0)
        # Of 10 mm of the bank, as the notes measure: a particle that rolls is no slope that moves.
        bins = [
            np.array([place[(place[:, 0] // 10) == cell, 2].mean() for cell in range(3)])
            for place in (before, tank.place_mm)
        ]
        name = f"12 Pa, drift in 10 s, {'asleep' if sleep else 'awake'}"
        found.append(Finding(name, 2 * float(np.abs(bins[1] - bins[0]).max()), "mm", "0", "simulate-yield.md", 0, high))
    return found


def energy() -> list[Finding]:
    """However stiff the paste and long the step, the solve takes energy; and it sees the shear that there is."""
    worst = 0.0
    for step_s in (2.35e-3, 0.1, 10.0):
        for stress_pa in (12.0, 1e4):
            tank = _still_block(step_s, stress_pa)
            chaos = np.random.default_rng(1).normal(0, 50, tank.place_mm.shape)
            tank.set_velocity(chaos)
            engine = tank.engine
            engine.viscosity.measure_shear(engine.rows)
            engine.viscosity.solve_implicit(engine.rows)
            volume = engine.state.volume_and_viscosity.numpy()[:, 0]
            left = volume @ (tank.velocity_mm_s**2).sum(axis=1) / (volume @ (chaos**2).sum(axis=1))
            worst = max(worst, float(left)) if np.isfinite(left) else np.inf
    tank = _still_block(2.35e-3, 12.0)
    rate = 7.0
    place = tank.place_mm
    tank.set_velocity(np.column_stack([rate * place[:, 2], 0 * place[:, :2]]))
    tank.engine.viscosity.measure_shear(tank.engine.rows)
    inner = (np.abs(place - np.mean(place, axis=0)) < CUBE_MM / 2 - 3.2).all(axis=1)
    gamma = float(tank.engine.viscosity.shear.numpy()[inner].mean())
    return [
        Finding("solve: energy left of chaos, most, of six", worst, "", "below 1", "A is positive", 0, 1),
        within("simple shear of 7 /s: gamma", gamma, "1/s", rate, 0.05, "simulate-yield.md"),
    ]


def _still_block(step_s: float, stress_pa: float) -> Tank:
    tank = Tank.of(
        Pit(CUBE_MM, CUBE_MM, 4.0),
        raised(cube_mm(CUBE_MM), 30.0),
        radius_mm=CUBE_RADIUS_MM,
        step_s=step_s,
        viscosity_mm2_s=VISCOSITY_MM2_S,
        yield_mm2_s2=stress_pa / DENSITY_KG_M3 * 1e6,
        falls=True,
    )
    # A frame on: what is just released is taken to be sheared.
    tank.engine.begin_frame(1)
    tank.engine.find_neighbours()
    tank.engine.pressure.measure_density(tank.engine.rows)
    return tank


@cache
def _trial() -> stiffening.Sample:
    return stiffening.trace()


@cache
def _poured(stress_pa: float, radius_mm: float) -> stiffening.Bed:
    """The paper's trial with that yield stress in place of freezing."""
    way = replace(stiffening.WAYS["yield"], name=f"yield stress of {stress_pa:g} Pa", yield_stress_pa=stress_pa)
    return stiffening.pour(_trial(), way, radius_mm)


TRIAL_SOURCE = "simulate-yield.md; fixture"


def paper_trial() -> list[Finding]:
    """The paper's trial with 12 Pa in place of freezing, R = 0.5 mm, against the reconstructed readings."""
    bed = _poured(12.0, 0.5)
    return [
        Finding("paper's trial, 12 Pa: mean error, nozzle off", bed.errors_mm[0], "mm", "1.2", TRIAL_SOURCE, 0, 1.4),
        Finding("the same, settled for 12 s", bed.errors_mm[2], "mm", "1.19", TRIAL_SOURCE, 0, 1.4),
        Finding("its drift in the last 10 s", bed.drift_mm, "mm", "0", TRIAL_SOURCE, 0, 0),
        Finding("its particles in the walls", bed.escaped, "", "0", "no leak", 0, 0),
    ]


def two_radii() -> list[Finding]:
    """The same at R = 0.4 mm: the bed does not depend on the size of particles."""
    fine, coarse = _poured(12.0, 0.4), _poured(12.0, 0.5)
    apart_mm = float(np.abs(stiffening.bins_mm(fine.levels[0]) - stiffening.bins_mm(coarse.levels[0])).max())
    name = "paper's trial, 12 Pa, R 0.4 mm: mean error"
    return [
        Finding(name, fine.errors_mm[0], "mm", "1.2", TRIAL_SOURCE, 0, 1.4),
        Finding("its 10 mm bins off those of R 0.5 mm, most", apart_mm, "mm", "0", TRIAL_SOURCE, 0, 0.8),
    ]


def left_bank() -> list[Finding]:
    """The slope over the first 20 mm of the paper's trial, over S of its opening walls: in proportion to the stress."""
    found = []
    for stress_pa, was in ((6.0, 1.16), (12.0, 1.08), (20.0, 1.00)):
        first_mm, second_mm = stiffening.bins_mm(_poured(stress_pa, 0.5).levels[0])[:2]
        depth_mm = _trial().solid.depth_mm + (first_mm + second_mm) / 2
        steep = (second_mm - first_mm) / 10.0
        ratio = float(steep / (_held_mm(stress_pa) * _wetted_per_mm(depth_mm)))
        name = f"paper's trial, {stress_pa:g} Pa: left bank, tan / S"
        found.append(Finding(name, ratio, "", f"{was:g}", TRIAL_SOURCE, 0.95, 1.2))
    return found


def _wetted_per_mm(depth_mm: float) -> float:
    """Perimeter over area of the fluid's section: S over tau / (rho g)."""
    floor_mm = _trial().outline.mean_width_mm
    wall = radians(WALL_DEG)
    return (floor_mm + 2 * depth_mm / cos(wall)) / (depth_mm * (floor_mm + depth_mm * tan(wall)))


CASES: Sequence[str] = ("banks", "feedback", "drift", "energy", "paper_trial", "two_radii", "left_bank")
