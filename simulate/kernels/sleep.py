"""Device code of sleep below the yield stress: particles wake their neighbours, and fall asleep."""

import warp as wp

from simulate.kernels.conjugate_gradients import System
from simulate.kernels.neighbours import Neighbours
from simulate.kernels.run_module import run_kernel
from simulate.kernels.status import ASLEEP, MOVING, Particles, Span, bring_to_rest, end_of
from simulate.kernels.viscosity import Paste

wp.set_module_options({"enable_backward": False})


@run_kernel
def wake(
    rows: Span,
    particles: Particles,
    paste: Paste,
    fast: float,
    restless_s: float,
    rested_s: float,
    near: Neighbours,
    system: System,
):
    """Wake the sleeping neighbours of a particle that is fast, or that has flowed for ``restless_s``.

    A woken particle counts as quiet for ``rested_s``, until it flows. Several threads may write to the same neighbour;
    all of them write the same value.
    """
    for row in range(rows.begin + wp.tid(), end_of(rows, particles), rows.step):
        # Equal for most particles, which do not have a neighbour at rest.
        if system.restraint[row] == system.drag[row]:
            continue
        i = particles.mover[row]
        if paste.yields[i // particles.per_run] == 0:
            continue
        if wp.length(particles.velocity[i]) > fast or particles.quiet_s[i] < -restless_s:
            for slot in range(near.fluid_count[row]):
                j = near.fluid[near.fluid_at[row], slot]
                if particles.status[j] == ASLEEP:
                    particles.status[j] = MOVING
                    particles.quiet_s[j] = rested_s


@run_kernel
def fall_asleep(
    rows: Span,
    particles: Particles,
    paste: Paste,
    system: System,
    frame_s: float,
    patience_s: float,
    slowest_shear: float,
    slowest: float,
):
    """Bring to rest the particles that were quiet for ``patience_s``."""
    for row in range(rows.begin + wp.tid(), end_of(rows, particles), rows.step):
        i = particles.mover[row]
        if particles.status[i] != MOVING or paste.yields[i // particles.per_run] == 0:
            continue
        quiet = wp.min(particles.quiet_s[i], 0.0) - frame_s
        if system.shear[i] < slowest_shear and wp.length(particles.velocity[i]) < slowest:
            quiet = wp.max(particles.quiet_s[i], 0.0) + frame_s
        particles.quiet_s[i] = quiet
        if quiet >= patience_s:
            particles.status[i] = ASLEEP
            bring_to_rest(particles, i)
