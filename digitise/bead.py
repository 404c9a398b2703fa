"""Measure a bead of paste on the printed marker sheet: length, width, and the distances of its paste from its edge."""

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from digitise.geometry.polyline import resampled, signed_area
from digitise.settings import PhotoInput
from digitise.spread import EDGE_PX, paste_edge
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats

SMOOTH = 5  # Rays over which the outline is averaged: its grain would shorten all distances to the edge
MIDDLE = 0.25  # Share of the length, around the middle, that shows what was laid: the ends do not
MOST_OF_IT = 0.7  # Share of the length over which the middle line must be straight
CELLS = 40  # Cells of the raster over half the width
SLANT = np.array([[0.94, -0.3412], [0.3412, 0.94]])  # Rotation by about 20 degrees
LEAST_LONG = 1.4  # Length over width below which there is no middle between the ends
MOST_UNEVEN = 0.12  # RMS of the middle's width over its mean: a bead that buckled or broke
BENT = 0.05  # Largest distance of its middle line from a straight one, over the length


@dataclass(frozen=True)
class BeadOutline:
    """A straight bead in plan view."""

    length_mm: float
    width_mm: float  # In the middle
    tips_mm: Floats  # (2, 2): its ends, on the sheet
    scale_error: float  # Relative standard uncertainty of all lengths
    edge_error_mm: float  # Standard uncertainty of the place of the edge, all around
    area_mm2: float
    inward_mm: Floats  # (n,): distance of its cells to the edge
    along_mm: Floats  # (n,): place of its cells along it, from its middle
    cell_mm2: float
    edge_mm: float  # Length of the edge
    warnings: tuple[str, ...]


def measure_bead(settings: PhotoInput, folder: Path) -> BeadOutline:
    """Find the bead inside the frame of markers and measure it. Raises InputError if there is no straight one."""
    photo, outline_px = paste_edge(settings, folder)
    outline_px = sum((np.roll(outline_px, shift, axis=0) for shift in range(SMOOTH)), np.zeros(1)) / SMOOTH
    error, edge_error_mm = photo.scale_uncertainty or 0.0, EDGE_PX * photo.mm_per_px
    return bead_of(photo.to_mm(outline_px), error, edge_error_mm, photo.warnings, photo.file)


def bead_of(
    outline_mm: Floats, scale_error: float, edge_error_mm: float, warnings: tuple[str, ...], file: Path
) -> BeadOutline:
    """Measure the bead inside an outline, (n, 2). Raises InputError if it is too short, bent or uneven."""
    area_mm2 = abs(signed_area(outline_mm))
    rough_mm = float(np.sqrt(area_mm2)) / 4
    cell_mm = rough_mm / CELLS
    dense_mm = resampled(np.vstack([outline_mm, outline_mm[:1]]), cell_mm / 4)
    place_mm, inward_mm = _cells(dense_mm, cell_mm)
    middle = place_mm.mean(axis=0)
    forth = np.linalg.eigh(np.cov((place_mm - middle).T))[1][:, 1]
    aside = np.array([-forth[1], forth[0]])
    along_mm, across_mm = (place_mm - middle) @ forth, (place_mm - middle) @ aside
    ends = (outline_mm - middle) @ forth
    shift = (ends.max() + ends.min()) / 2
    length_mm, along_mm = float(np.ptp(ends)), along_mm - shift
    stations = np.linspace(-MOST_OF_IT, MOST_OF_IT, 41) / 2 * length_mm
    slab = np.abs(along_mm[:, None] - stations) < cell_mm
    widths = slab.sum(axis=0) * cell_mm / 2
    inner = np.abs(stations) <= MIDDLE / 2 * length_mm
    width_mm = float(widths[inner].mean())
    line_mm = np.array([float(across_mm[column].mean()) for column in slab.T])
    if length_mm < LEAST_LONG * width_mm:
        raise InputError(
            f"{file}: the bead is {length_mm:.1f} mm long and {width_mm:.1f} mm wide; it must be at least "
            f"{LEAST_LONG:g} times as long as wide. Lay a longer bead, or less paste per mm. For a round spread of "
            "paste, use 'sealtwin material spread'."
        )
    uneven, bent = float(widths[inner].std()) / width_mm, float(np.ptp(line_mm)) / length_mm
    if uneven > MOST_UNEVEN or bent > BENT:
        raise InputError(
            f"{file}: the bead is not straight and even: its width varies by {uneven:.0%} in the middle "
            f"(limit {MOST_UNEVEN:.0%}), and it bends by {bent:.0%} of its length (limit {BENT:.0%}). Level the plate, "
            "lower the nozzle, and lay another bead."
        )
    tips = middle + forth * (shift + np.array([-0.5, 0.5])[:, None] * length_mm)
    side = np.roll(outline_mm, -1, axis=0) - outline_mm
    return BeadOutline(
        length_mm,
        width_mm,
        tips,
        scale_error,
        edge_error_mm,
        area_mm2,
        inward_mm,
        along_mm,
        area_mm2 / len(inward_mm),
        float(np.linalg.norm(side, axis=1).sum()),
        warnings,
    )


def _cells(outline_mm: Floats, cell_mm: float) -> tuple[Floats, Floats]:
    """Return the centres of raster cells inside an outline, (n, 2), and their distances to it, (n,)."""
    from scipy.spatial import KDTree

    # Oblique to the bead: along its sides, whole rows would be inside or outside.
    axes = np.linalg.eigh(np.cov(outline_mm.T))[1] @ SLANT
    outline_mm = outline_mm @ axes
    low, high = outline_mm.min(axis=0), outline_mm.max(axis=0)
    count = np.ceil((high - low) / cell_mm).astype(int)
    # Drawn ten times finer than a cell, whose centre then is inside or outside.
    ring = np.round((outline_mm - low) / cell_mm * 10 - 0.5).astype(np.int32)
    mask = np.zeros((10 * int(count[1]), 10 * int(count[0])), np.uint8)
    cv2.fillPoly(mask, [ring], 1)
    rows, columns = np.nonzero(mask[5::10, 5::10])
    place_mm = low + (np.column_stack([columns, rows]) + 0.5) * cell_mm
    return place_mm @ axes.T, np.asarray(KDTree(outline_mm).query(place_mm)[0], dtype=float)
