"""Remarks on a fluid that hold before the first frame."""

from collections.abc import Iterator

import numpy as np

from sealtwin.core.records import Floats, Outline, Solid
from sealtwin.core.regime import GRAVITY_M_S2, standing_stress_pa
from simulate.settings import Fluid

THIN = 0.1
"""Share of a viscosity that the particles may add to it without a remark: the bar of the channels' flow."""
SUNK = 0.5
"""Share of the depth that sealant must sink by its weight without a remark; the jet's momentum does the rest."""

AGES = 1000  # Ages at which a curve's viscosity is taken


def remarks_on(
    fluid: Fluid,
    outline: Outline,
    solid: Solid,
    *,
    viscosity_mm2_s: float,
    added_mm2_s: float,
    radius_mm: float,
    lasts_s: float,
) -> Iterator[str]:
    """Yield what a run cannot show of a fluid.

    ``viscosity_mm2_s`` is that of fresh sealant and ``added_mm2_s`` what particles add to it; the run ``lasts_s``.
    """
    keys = ("U", "viscosity_pa_s", "consistency_pa_s_n")
    given = [f"{key} is {value:g}" for key in keys if (value := getattr(fluid, key)) is not None]
    if not fluid.yields and viscosity_mm2_s * THIN < added_mm2_s:
        yield (
            f"fluid.{given[0] if given else 'curve begins thin'}: {viscosity_mm2_s:.3g} mm2/s, to which particles of "
            f"solver.radius_mm = {radius_mm:g} add about {added_mm2_s:.2g} of their own. The fluid "
            f"acts as one of {viscosity_mm2_s + added_mm2_s:.3g} mm2/s; smaller particles add less."
        )
    _, stress_pa = fluid.fresh
    width_mm = outline.mean_width_mm
    if stress_pa > (stands_pa := standing_stress_pa(fluid.density_kg_m3, width_mm)):
        yield (
            f"fluid.{'curve' if fluid.curve else 'yield_stress_pa'}: {stress_pa:g} Pa hold paste up between walls "
            f"{width_mm:.3g} mm apart, where its own weight overcomes {stands_pa:.2g} Pa: what the jet does not push "
            "down bridges the crack, over a hollow."
        )
        return
    # The mean speed between plates (Poiseuille), which a yield stress lowers further. A D_cm of the user's holds walls
    # less, and sealant of the paper's U, which has one, moves before its viscosity acts.
    if fluid.D_cm is None and fluid.flow_index in (None, 1) and viscosity_mm2_s:
        sinks_mm_s = 1e3 * GRAVITY_M_S2 * width_mm**2 / 12 / (viscosity_mm2_s * _thickening(fluid, lasts_s))
        sinks_mm = lasts_s * float(sinks_mm_s.mean())
        if sinks_mm < SUNK * solid.depth_mm:
            yield (
                f"fluid.{given[0] if given else 'curve is thick'}: between walls {width_mm:.3g} mm "
                f"apart it sinks by its own weight at {sinks_mm_s.max():.2g} mm/s at most, {sinks_mm:.2g} mm in "
                f"the {lasts_s:.3g} s of this run. The crack is {solid.depth_mm:.3g} mm deep: what the jet does not "
                "push down heaps up over hollows. A longer solver.settle_s lets it sink further."
            )


def _thickening(fluid: Fluid, lasts_s: float) -> Floats:
    """Viscosity over that of fresh sealant at even ages up to ``lasts_s``, (n,)."""
    if (course := fluid.course) is None:
        return np.ones(1)
    viscosity, _ = course.at(np.linspace(0.0, lasts_s, AGES))
    return viscosity / viscosity[0]
