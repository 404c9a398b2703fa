"""One radial term of a camera's lens: x_d = x_u (1 + bend |x_u|²), x counting from the photo's centre."""

from dataclasses import dataclass

import numpy as np

from sealtwin.records import Floats


@dataclass(frozen=True)
class Lens:
    """How a lens moves each point along its ray from the photo's centre."""

    centre_px: Floats
    """(2,)"""
    bend_px2: float
    """In px⁻²: k1 over the square of the focal length. Negative is the barrel of a wide lens."""

    def bent(self, straight_px: Floats) -> Floats:
        """Where a lens that bends nothing would put points to where this one does, (n, 2) to (n, 2)."""
        away_px = straight_px - self.centre_px
        return self.centre_px + away_px * (1 + self.bend_px2 * (away_px**2).sum(axis=1, keepdims=True))

    def straightened(self, seen_px: Floats) -> Floats:
        """The exact inverse of ``bent`` within ``reach_px`` of the centre, (n, 2) to (n, 2).

        The cubic r (1 + b r²) = d has its root where the triple-angle formula of sinh, or of sin where b is negative,
        puts it: r = d sinh(a / 3) / (x / 3), with x = sinh a = d sqrt(27 |b|) / 2.
        """
        away_px = seen_px - self.centre_px
        x = np.hypot(*away_px.T) * np.sqrt(27 * abs(self.bend_px2)) / 2
        x = np.maximum(x, 1e-9)  # In the very centre nothing moves, and 0 / 0 would not say so.
        third = np.sinh(np.arcsinh(x) / 3) if self.bend_px2 > 0 else np.sin(np.arcsin(np.minimum(x, 1)) / 3)
        return self.centre_px + away_px * (3 * third / x)[:, None]

    @property
    def reach_px(self) -> float:
        """Distance from the centre, in the photo, beyond which no place on the face is seen; a barrel folds there."""
        return np.inf if self.bend_px2 >= 0 else 2 / np.sqrt(-27 * self.bend_px2)
