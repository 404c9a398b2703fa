"""Remarks on a fluid that hold before the first frame."""

from collections.abc import Iterator

from sealtwin.core.records import Outline, Solid
from sealtwin.core.regime import GRAVITY_M_S2
from simulate.settings import Fluid

THIN = 0.1
"""Share of a viscosity that the particles may add to it without a remark: the bar of the channels' flow."""
SUNK = 0.5
"""Share of the depth that sealant must sink by its weight without a remark; the jet's momentum does the rest."""


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
    # The mean speed between plates (Poiseuille), which a yield stress lowers further. Sealant of the paper's U moves
    # before its viscosity acts.
    if fluid.U is None and fluid.flow_index in (None, 1) and viscosity_mm2_s:
        sinks_mm_s = 1e3 * GRAVITY_M_S2 * outline.mean_width_mm**2 / (12 * viscosity_mm2_s)
        if sinks_mm_s * lasts_s < SUNK * solid.depth_mm:
            yield (
                f"fluid.{given[0] if given else 'curve begins thick'}: between walls {outline.mean_width_mm:.3g} mm "
                f"apart it sinks by its own weight at {sinks_mm_s:.2g} mm/s at most, {sinks_mm_s * lasts_s:.2g} mm in "
                f"the {lasts_s:.3g} s of this run. The crack is {solid.depth_mm:.3g} mm deep: what the jet does not "
                "push down heaps up over hollows. A longer solver.settle_s lets it sink further."
            )
