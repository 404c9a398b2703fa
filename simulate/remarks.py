"""Warnings before the first frame about effects that a run of particles cannot show for a fluid."""

import math
from collections.abc import Iterator

import numpy as np

from sealtwin.core.facts import Fact, doubt
from sealtwin.core.regime import standing_stress_pa
from sealtwin.core.run_figures import BRIDGES
from simulate.pour import Pour
from simulate.setup.release_schedule import Schedule, course_of
from simulate.setup.rheology import CM2_IN_M2, added_viscosity
from simulate.setup.signed_distance import CM
from simulate.setup_checks import carried, solved_as
from simulate.shear_law import FLOW_BETWEEN_PLATES, flow_between_plates

THIN = 0.1
"""Fraction of the fluid's viscosity that particles may add without a warning, the tolerance of the channel tests."""
SINKING_DEPTHS = 1.5
"""If sealant sinks under its own weight by less than this, divided by the crack's depth, there is a warning. In 24
pours between walls 2 and 3.1 mm apart, sealant that sank up to 1.4 depths left hollows of up to 71 % of its volume.
Sealant that sank 1.9 depths or more left hollows of at most 2.4 %."""

FED = 0.75
"""If the nozzle moves by less than this, divided by the crack's width, before paste is too stiff to sink, there is a
warning. In pours of thin paste that stiffens, hollows were 54 % of the volume or more with up to 0.62 widths, and at
most 3 % with 0.92 widths or more."""
AGES = 1000  # Number of ages at which viscosity and yield stress are evaluated
MIN_PA_S = 1e-6  # Viscosity that replaces 0 in a division


def remarks_on(pour: Pour, schedule: Schedule, *, finer: int = 1) -> Iterator[Fact]:
    """Yield warnings about effects that a run of particles with the pour's only fluid cannot show.

    ``schedule`` is the run's release schedule. The number of substeps is multiplied by ``finer``. The solver's radius
    must be a number. Raises InputError for a fluid that cannot be simulated.
    """
    fluid, solver, outline, solid = pour.fluid, pour.solver, pour.sample.outline, pour.sample.solid
    radius_mm, frame_s, width_mm = solver.size_mm, schedule.frame_s, outline.mean_width_mm
    if not carried(solid, outline, width_mm / 8):
        across = width_mm / radius_mm / 2
        text = (
            f"solver.radius_mm = {radius_mm:g}: four particles across a crack {width_mm:.3g} mm wide and "
            f"{outline.length_mm:.0f} mm long exceed the limits of a run. Here {across:.2g} particles are across it."
        )
        yield doubt("fluid.few-across", text, across)
    frames = course_of(schedule, fluid, solver.settle_s).frames
    paste, substeps = solved_as(fluid, solver, frame_s, frames)
    added_mm2_s = 1e6 * added_viscosity(radius_mm * CM, frame_s / (finer * substeps)) / CM2_IN_M2
    lasts_s, pours_s = frames * frame_s, len(schedule.released) * frame_s
    law = "" if fluid.curve else f"{fluid.given_by} is {getattr(fluid, str(fluid.given_by)):g}"
    viscosity_pa_s = paste.viscosity_pa_s
    viscosity_mm2_s = 1e6 * viscosity_pa_s / fluid.density_kg_m3
    if not fluid.yields and viscosity_mm2_s * THIN < added_mm2_s:
        text = (
            f"fluid.{law or 'curve begins thin'}: this is a viscosity of {viscosity_mm2_s:.3g} mm2/s. Particles of "
            f"solver.radius_mm = {radius_mm:g} add about {added_mm2_s:.2g} mm2/s (within a factor of two). The fluid "
            f"flows as if it had about {viscosity_mm2_s + added_mm2_s:.3g} mm2/s, but it does not come to rest: "
            "particles of a fluid as thin as water keep moving. Smaller particles add less."
        )
        yield doubt("fluid.particles-add", text, added_mm2_s, "mm2/s")
    elif fluid.U and not fluid.yields:
        until = " until it freezes" if fluid.freezes else ""
        text = (
            f"fluid.{law}: at any U, sealant levels like a thin liquid{until}. Viscous flow needs fluid.viscosity_pa_s."
        )
        yield doubt("fluid.levels-at-any-U", text)
    stands_pa = standing_stress_pa(fluid.density_kg_m3, width_mm)
    age_s = np.linspace(0.0, lasts_s, AGES)
    aged_pa_s, stress_pa = fluid.course.at_age(age_s)
    at_wall_pa = paste.wall_share * stress_pa
    if at_wall_pa[0] > stands_pa:
        text = (
            f"fluid.{'curve' if fluid.curve else 'yield_stress_pa'}: a yield stress of {stress_pa[0]:g} Pa supports "
            f"the paste between walls {width_mm:.3g} mm apart, since the paste's weight overcomes at most "
            f"{stands_pa:.2g} Pa there. Paste that the jet does not push down bridges the crack, with a hollow below."
        )
        yield doubt(BRIDGES, text, float(stress_pa[0]), "Pa")
        return
    stands = at_wall_pa > stands_pa
    stands_s = float(age_s[stands.argmax()]) if stands.any() else math.inf
    if paste.law not in FLOW_BETWEEN_PLATES:
        return
    # Speed at which paste of each age sinks between upright plates under its own weight.
    wall_pa_s = paste.wall_share * np.maximum(viscosity_pa_s if fluid.U is not None else aged_pa_s, MIN_PA_S)
    half_mm = width_mm / 2
    sinks = flow_between_plates(paste.law, at_wall_pa / half_mm, half_mm, wall_pa_s, paste.flow_index)
    sinks_mm_s, _ = sinks.flow_mm3_s(np.array(stands_pa / half_mm))
    sinks_mm = lasts_s * float(sinks_mm_s.mean())
    if stands_s < lasts_s:
        moves_mm = stands_s * outline.length_mm / pours_s
        if moves_mm < FED * width_mm or (fluid.D_cm is None and sinks_mm < SINKING_DEPTHS * solid.depth_mm):
            text = (
                f"fluid.{'curve' if fluid.curve else 'structuration_pa_per_s'}: from an age of {stands_s:.2g} s the "
                f"paste no longer sinks between walls {width_mm:.3g} mm apart, since its weight overcomes at most "
                f"{stands_pa:.2g} Pa there. The pour ends when the first paste is {pours_s:.3g} s old: later paste "
                "heaps up on it and leaves hollows below."
            )
            yield doubt("fluid.stops-sinking", text, stands_s, "s")
            return
    # With D_cm, the drag of walls is smaller than without slip. The paper's U always has a D_cm, and particles then
    # move before viscosity acts.
    if fluid.D_cm is None and viscosity_pa_s and sinks_mm < SINKING_DEPTHS * solid.depth_mm:
        text = (
            f"fluid.{law or 'curve is thick'}: between walls {width_mm:.3g} mm apart the sealant "
            f"sinks by its own weight at up to {sinks_mm_s.max():.2g} mm/s, which is {sinks_mm:.2g} mm in the "
            f"{lasts_s:.3g} s of this run, but the crack is {solid.depth_mm:.3g} mm deep. Sealant that the jet does "
            "not push down heaps up over hollows. Give a longer solver.settle_s to let it sink farther."
        )
        yield doubt("fluid.sinks-slowly", text, sinks_mm, "mm")
