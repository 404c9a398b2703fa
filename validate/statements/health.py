"""What the numbers that a run records of itself mean, for a reader who has not written the solver."""

from typing import Any

from validate.evidence import Evidence
from validate.statements.table import Table
from validate.wording import plain, words

MEANING = {
    "density_error_mean": ("compression above the rest density, mean", 100, "{:.2f} %"),
    "density_error_p95": ("compression that 95 % of the particles stay below", 100, "{:.2f} %"),
    "density_error_max": ("compression of the worst particle", 100, "{:.1f} %"),
    "most_neighbours": ("neighbours of one particle, most", 1, "{:,}"),
    "moving_mean": ("particles moving at a time, mean", 1, "{:,.0f}"),
    "moving_most": ("particles moving at a time, most", 1, "{:,}"),
    "viscosity_iterations_mean": ("iterations of the viscosity solve, mean", 1, "{:.1f} a substep"),
    "viscosity_iterations_most": ("iterations of the viscosity solve, most", 1, "{:,} a substep"),
    "frames": ("frames, each from one release to the next", 1, "{:,}"),
    "frame_s": ("simulated time of a frame", 1000, "{:.2f} ms"),
    "substeps": ("substeps", 1, "{:,} a frame"),
    "particles_a_release": ("particles released", 1, "{:,} a frame"),
    "wall_particles": ("fixed particles that line the walls", 1, "{:,}"),
    "particles_across": ("particles side by side between the walls, mean", 1, "{:.1f}"),
    "viscosity_m2_s": ("kinematic viscosity in effect", 1e6, "{:.3g} mm²/s"),
    "viscosity_pa_s": ("viscosity in effect", 1000, "{:.3g} mPa s"),
    "U": ("viscous weight U in effect", 1, "{:.4g}"),
    "yield_stress_pa": ("yield stress of fresh paste", 1, "{:.3g} Pa"),
    "reynolds": ("Reynolds number in the nozzle, inertia over viscosity", 1, "{:.2g}"),
    "bond": ("Bond number across the crack, gravity over surface tension (water's)", 1, "{:.2g}"),
    "bingham": ("Bingham number in the nozzle, yield stress over viscous stress", 1, "{:.2g}"),
    "kernels_a_frame": ("kernels launched in the last frame", 1, "{:,}"),
    "setup_s": ("computing time before the first frame", 1, "{:.1f} s"),
    "frames_s": ("computing time of all frames", 1, "{:.1f} s"),
    "volume_ratio": ("volume of the settled particles over dispensed", 1, "{:.3f}"),
}
"""By key: label, factor to the unit that is shown, and the number with that unit."""


def health_table(evidence: Evidence) -> Table:
    return Table("Numerical health", (("device", evidence.run.device), *health_rows(evidence.run.health)))


def health_rows(health: dict[str, Any]) -> list[tuple[str, str]]:
    """Every number that the run recorded, in its order; a key that nobody has put into words keeps its name."""
    rows = [_row(key, value) for key, value in health.items()]
    if health.get("frames") and "frames_s" in health:
        rows.append(("computing time of a frame", f"{1000 * health['frames_s'] / health['frames']:.1f} ms"))
    return rows


def _row(key: str, value: Any) -> tuple[str, str]:
    if key not in MEANING or isinstance(value, bool) or not isinstance(value, int | float):
        return words(key), plain(value)
    label, factor, shape = MEANING[key]
    return label, shape.format(factor * value)
