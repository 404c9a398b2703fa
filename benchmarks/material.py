"""Sealant that changes as it ages: shear waves under a viscosity that grows in time, against their closed form.

    python benchmarks/material.py

A standing wave in an endless fluid, the viscous solve alone: its height falls as exp(-k^2 integral nu dt), where
nu follows a particle's age by a table over age, or by a table over temperature and a cooling.
"""

from functools import cache
from typing import Any

import numpy as np

from benchmarks.physics_endless import Endless, stirred_mm
from benchmarks.physics_viscous import BOX_MM, STEP_S, WAVE_MM_S, WAVE_RADIUS_MM
from benchmarks.table import Row, run_benchmark
from sealtwin.core.records import Floats
from simulate.settings import Fluid
from simulate.setup_checks import rheology_of

FRAME_S = 0.5e-3  # Short frames: backward Euler, and the age at a frame's beginning, are first order in them
MM2_IN_M2 = 1e6
FRAMES = 120
WITHIN = 5.0
TABLES: dict[str, dict[str, Any]] = {
    "grows tenfold in 60 ms": {"curve": {"age_s": (0.0, 0.06), "viscosity_pa_s": (0.02, 0.2)}},
    "doubles, then halves": {"curve": {"age_s": (0.0, 0.03, 0.06), "viscosity_pa_s": (0.1, 0.2, 0.1)}},
    "cools from 190 to 150 C": {
        "curve": {"temperature_c": (140.0, 170.0, 200.0), "viscosity_pa_s": (0.4, 0.08, 0.04)},
        "cooling": {"age_s": (0.0, 0.05), "temperature_c": (190.0, 150.0)},
    },
}


def main() -> list[Row]:
    rows = []
    for name, table in TABLES.items():
        decay, theory = wave_decay(Fluid.model_validate({**table, "freeze_after_s": "never"}), frames=FRAMES)
        rows.append(
            Row(f"shear wave, viscosity {name}: decay off", abs(100 * (decay / theory - 1)), "%", 0, WITHIN, "0")
        )
    return rows


def wave_decay(paste: Fluid, frames: int) -> tuple[float, float]:
    """Logarithm of the share that is lost of a wave, as found and by k^2 integral nu dt."""
    fluid = rheology_of(paste, 0.4 * WAVE_RADIUS_MM, FRAME_S)
    box = Endless(_even_mm(), BOX_MM, radius_mm=WAVE_RADIUS_MM, step_s=FRAME_S, fluid=fluid)
    k = 2 * np.pi / BOX_MM[2]
    wave = np.cos(k * box.place_mm[:, 2])
    box.set_velocity(np.outer(wave, [WAVE_MM_S, 0.0, 0.0]))
    box.solve_alone(frames)
    left = float(box.velocity_mm_s[:, 0] @ wave / (wave @ wave)) / WAVE_MM_S
    course = paste.course
    assert course is not None, "a fluid with a curve"
    fine_s = np.linspace(0, frames * FRAME_S, 10_001)
    viscosity, _ = course.at(fine_s)
    theory = k**2 * np.trapezoid(viscosity / paste.density_kg_m3 * MM2_IN_M2, fine_s)
    return -float(np.log(left)), float(theory)


@cache
def _even_mm() -> Floats:
    return stirred_mm(BOX_MM, 1.0, WAVE_RADIUS_MM, STEP_S)


if __name__ == "__main__":
    run_benchmark(main)
