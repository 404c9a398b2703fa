"""Paste with a yield stress: banks in a slot, what the feedback and sleep are for, and the trial of the paper."""

from collections.abc import Sequence
from unittest.mock import patch

import numpy as np

from benchmarks import stiffening
from benchmarks.physics_findings import Finding, within
from benchmarks.physics_tanks import CUBE_RADIUS_MM, GRAVITY_MM_S2, Pit, Tank, block_mm, cube_mm, raised
from simulate.solver import FluidSolver

DENSITY_KG_M3 = 1690.0
VISCOSITY_MM2_S, DRAG_MM_S = 32.2, 3.0 / 7.23e-3
"""U = 30 and D = 0.3 cm of the paper's frame."""
CUBE_MM = 9.0
"""More than two supports from its middle to its sides."""
WIDTH_MM, HEAP_MM = 3.1, (12.0, 24.0)
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
        with patch.object(FluidSolver, "go_as_solved"):
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
    length_mm = stress_pa / DENSITY_KG_M3 / GRAVITY_MM_S2 * 1e6
    return length_mm * (2 / WIDTH_MM + 1 / depth_mm)


def banks() -> list[Finding]:
    """Tan of the slope over S: in proportion to the stress, and at any radius.

    A heap of finite depth holds about 1 / (1 - 2 tau / (rho g d)) more, from 1.09 at 5 Pa to 1.15 at 15 Pa; and at
    15 Pa its front keeps a kink where the block stood.
    """
    found, ratios = [], []
    for stress_pa, radius_mm, low, high in (
        (5.0, 0.5, 1.14, 1.44),
        (9.0, 0.5, 1.14, 1.44),
        (15.0, 0.5, 1.14, 1.44),
        (9.0, 0.4, 1.15, 1.55),
    ):
        tan, depth_mm = slope(bank(stress_pa, 6.0, radius_mm))
        ratio = tan / stability_number(stress_pa, depth_mm)
        name = f"bank of {stress_pa:g} Pa, R {radius_mm:g} mm: tan / S"
        found.append(Finding(name, ratio, "", "1.29" if radius_mm == 0.5 else "1.44", "simulate-yield.md", low, high))
        if radius_mm == 0.5:
            ratios.append(ratio)
    spread = 100 * (max(ratios) / min(ratios) - 1)
    return [*found, Finding("banks: spread of tan / S between stresses", spread, "%", "0", "simulate-yield.md", 0, 10)]


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
            volume = engine.state.bulk.numpy()[:, 0]
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
    tank.engine.measure_density()
    return tank


def paper_trial() -> list[Finding]:
    """The paper's trial with 12 Pa in place of freezing, R = 0.5 mm, against the reconstructed readings."""
    bed = stiffening.pour(stiffening.trace(), stiffening.WAYS["yield"], 0.5)
    source = "simulate-yield.md; fixture"
    return [
        Finding("paper's trial, 12 Pa: mean error, nozzle off", bed.errors_mm[0], "mm", "1.2", source, 1.0, 1.4),
        Finding("the same, settled for 12 s", bed.errors_mm[2], "mm", "1.19", source, 1.0, 1.4),
        Finding("its drift in the last 10 s", bed.drift_mm, "mm", "0", source, 0, 0),
        Finding("its particles in the walls", bed.escaped, "", "0", "no leak", 0, 0),
    ]


CASES: Sequence[str] = ("banks", "feedback", "drift", "energy", "paper_trial")
