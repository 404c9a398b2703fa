"""How a camera sees the plane of the face: the one mapping between pixels and millimetres, and what is known of it."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from digitise.geometry.polyline import Box, project
from digitise.scaling.lens import Lens
from sealtwin.records import Floats

MIDDLE = 12
"""Of the places of ``places_px``."""


@dataclass(frozen=True)
class View:
    """A homography, and a lens that bends what it shows."""

    mm_from_px: Floats
    """Homography, (3, 3), from where a lens that bends nothing would put a point."""
    lens: Lens | None = None

    def to_mm(self, points_px: Floats) -> Floats:
        """(n, 2) to (n, 2)."""
        return project(self.mm_from_px, points_px if self.lens is None else self.lens.straightened(points_px))

    def to_px(self, points_mm: Floats) -> Floats:
        """(n, 2) to (n, 2)."""
        straight_px = project(self.px_from_mm, points_mm)
        return straight_px if self.lens is None else self.lens.bent(straight_px)

    def mm_per_px_at(self, points_px: Floats) -> Floats:
        """Local scale at each point, the geometric mean of all directions, (n,)."""
        half_px = 0.5 * np.eye(2)
        along_x, along_y = (self.to_mm(points_px + step) - self.to_mm(points_px - step) for step in half_px)
        return np.sqrt(np.abs(along_x[:, 0] * along_y[:, 1] - along_x[:, 1] * along_y[:, 0]))

    @cached_property
    def px_from_mm(self) -> Floats:
        """Inverse of ``mm_from_px``."""
        return np.asarray(np.linalg.inv(self.mm_from_px), dtype=float)


@dataclass(frozen=True)
class Scale:
    """The mapping from photo to face, and what is known about it."""

    view: View
    mm_per_px: float
    """At the centre of the face, or of the photo where the face is not known."""
    source: str
    residual_mm: float | None = None
    uncertainty: float | None = None
    """Standard uncertainty of a length for the scale alone, over the length; None where nothing tells it."""
    camera_tilt_deg: float | None = None
    """Between the camera's axis and the normal of the face, where the photo shows it."""
    face_mm: Box | None = None
    markers_px: tuple[Floats, ...] = ()
    warnings: tuple[str, ...] = ()


def places_px(view: View, size_px: tuple[int, int], face_mm: Box | None) -> Floats:
    """Where a crack may lie, (25, 2), the middle of it at ``MIDDLE``: on the face, or the inner half of the photo."""
    fifths = np.stack(np.meshgrid(np.linspace(0, 1, 5), np.linspace(0, 1, 5)), axis=-1).reshape(-1, 2)
    if face_mm is not None:
        low, high = np.reshape(face_mm, (2, 2))
        return view.to_px(low + fifths * (high - low))
    return (np.array(size_px) - 1) * (0.25 + 0.5 * fifths)
