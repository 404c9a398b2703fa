"""A scan of the sealed face as readings: its fit to the sample, levels, volumes, and heights along the crack."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from pydantic import with_config

from sealtwin.core.arrays import FROM_JSON, Floats, ReadOnly
from sealtwin.core.solid_figures import Span


@with_config(FROM_JSON)
@dataclass(frozen=True)
class ScanFigures:
    """Figures of a scan in the frame of the sample. Heights and volumes are relative to the plane of the face."""

    points: int
    """Number of points of the scan."""
    placed_by: Literal["points", "mouth"]
    """Basis of its position along the face: named points, or the crack's mouth."""
    residual_mm: float
    """RMS distance of the uncracked face from its plane."""
    coverage: float
    """Fraction of the uncracked face around the crack that was scanned."""
    tilt_deg: float
    """Angle by which the scan was tilted to make the face horizontal."""
    edges_agreeing: float | None
    """Fraction of the crack along which the edges in the scan agree with the mouth's. None if no crack is recognised.
    """
    points_off_mm: float | None
    """RMS distance of the named points from their places. None without named points."""
    along_sd_mm: float
    """Standard uncertainty of the position along the crack."""
    cell_mm: float
    """Side of the square cells in which heights are medians of points."""
    holes_mm: tuple[Span, ...]
    """Stretches of the crack without enough points for a level."""
    mean_level_mm: float
    """Mean of the level along the crack."""
    mean_level_95_mm: float
    """Half-width of the 95 % interval of the mean level."""
    over_face_mm3: float
    """Volume of sealant above the face, over the mouth and beside it."""
    over_face_95_mm3: float
    """Half-width of the 95 % interval of the volume above the face."""
    under_face_mm3: float
    """Volume in the mouth between the face and the scanned surface below it."""
    under_face_95_mm3: float
    """Half-width of the 95 % interval of the volume below the face."""
    sealant_mm3: float
    """Volume of the sealant, in the model's cavity and above the face."""
    sealant_95_mm3: float
    """Half-width of its 95 % interval, without the error of the cavity."""


@dataclass(frozen=True, eq=False)
class Scan(ReadOnly):
    """Heights of a scan along the crack, and the errors of its levels."""

    figures: ScanFigures
    s_mm: Floats  # Positions along the crack, (k,)
    across_mm: Floats  # Distances to the left of the centreline, (m,)
    height_mm: Floats  # Heights above the face, NaN in holes, (m, k)
    bottom_mm: Floats  # Height of the floor or the wall of the model there, 0 outside the mouth, (m, k)
    covariance_mm2: Floats  # Of the errors of the levels at the stations, (n, n)

    def deviation_mm(self, level_mm: Floats) -> Floats:
        """Return the height of a simulated bed minus the scanned height, NaN in holes, (m, k).

        ``level_mm``, (k,), is the simulated level at ``s_mm``. Walls above it and the face are as in the model.
        """
        return np.where(self.bottom_mm < 0, np.maximum(level_mm, self.bottom_mm), 0.0) - self.height_mm
