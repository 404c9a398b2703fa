"""How far a number of a run hangs on its particles' size: three sizes, observed order, grid convergence index."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

SAFETY = 1.25
"""Roache's factor for three sizes, as in Celik et al. 2008."""
LEAST_ORDER, MOST_ORDER = 0.5, 2.0
"""Below the first the index grows without bound and no order is believed; a higher one than the second, which no part
of the scheme can have, is chance and counts as it (Oberkampf & Roy 2010, 8.6.4)."""
EXPANDED = 2.0
"""Coverage factor between a 95 % band, as the index is meant, and a standard uncertainty."""

Kind = Literal["converging", "no order", "oscillatory"]


@dataclass(frozen=True)
class Convergence:
    """Of one number over three particle sizes."""

    kind: Kind
    order: float | None
    """As observed; None where there is none."""
    band: float
    """95 %: the index times the value where the number converges, else the spread of all three."""

    @property
    def standard(self) -> float:
        return self.band / EXPANDED


def converge(fine: float, middle: float, coarse: float, finer: float, coarser: float) -> Convergence:
    """The doubt about the value of the middle size, which is the trial's own.

    ``finer`` is the middle size over the fine one, ``coarser`` the coarse over the middle. The order is that of Celik
    et al. 2008 (J. Fluids Eng. 130, 078001), for any two ratios. A number that swings, or whose order is none to
    believe, has no index: then the spread of the three is its band.
    """
    near, far = middle - fine, coarse - middle
    spread = max(fine, middle, coarse) - min(fine, middle, coarse)
    if near * far < 0:
        return Convergence("oscillatory", None, spread)
    order = _order(near, far, finer, coarser)
    if order is None or order < LEAST_ORDER:
        return Convergence("no order", order, spread)
    return Convergence("converging", order, SAFETY * abs(far) / (coarser ** min(order, MOST_ORDER) - 1))


def _order(near: float, far: float, finer: float, coarser: float) -> float | None:
    """Root of far / near = finer^p (coarser^p - 1) / (finer^p - 1), whose right side grows with p; None without one."""
    from scipy.optimize import root_scalar

    if near == 0 or far == 0:
        return None

    def excess(order: float) -> float:
        return np.log(far / near) - np.log(finer**order * (coarser**order - 1) / (finer**order - 1))

    least, most = 1e-3, 20.0
    if excess(least) * excess(most) > 0:
        return None
    return float(root_scalar(excess, bracket=(least, most)).root)
