"""Measure a bead of paste on the printed marker sheet: length, width, and the distances of its paste from its edge."""

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from scipy.ndimage import uniform_filter1d

from digitise.geometry.polyline import signed_area
from digitise.settings import PhotoInput
from digitise.spread import EDGE_PX, paste_edge
from sealtwin.core.errors import InputError
from sealtwin.core.facts import Fact
from sealtwin.core.records import Floats

SMOOTH = 5  # Rays over which the outline is averaged: its grain would shorten all distances to the edge
MIDDLE = 0.25  # Share of the length, around the middle, that shows what was laid: the ends do not
MOST_OF_IT = 0.7  # Share of the length over which the middle line must be straight
SLABS = 41  # Over that share
SLANT = np.array([[0.94, -0.3412], [0.3412, 0.94]])  # Rotation by about 20 degrees
CELLS = 800  # Cells of the raster over the root of the area
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
    warnings: tuple[Fact, ...]


def measure_bead(settings: PhotoInput, folder: Path) -> BeadOutline:
    """Find the bead inside the frame of markers and measure it. Raises InputError if there is no straight one."""
    photo, outline_px = paste_edge(settings, folder)
    outline_px = uniform_filter1d(outline_px, SMOOTH, axis=0, mode="wrap")
    error, edge_error_mm = photo.scale_uncertainty or 0.0, EDGE_PX * photo.mm_per_px
    return bead_of(photo.to_mm(outline_px), error, edge_error_mm, photo.warnings, photo.file)


def bead_of(
    outline_mm: Floats, scale_error: float, edge_error_mm: float, warnings: tuple[Fact, ...], file: Path
) -> BeadOutline:
    """Measure the bead inside an outline, (n, 2). Raises InputError if it is too short, bent or uneven."""
    area_mm2 = abs(signed_area(outline_mm))
    cell_mm = float(np.sqrt(area_mm2)) / CELLS
    place_mm, inward_mm = _cells(outline_mm, cell_mm)
    middle = place_mm.mean(axis=0)
    forth = np.linalg.eigh(np.cov(place_mm.T))[1][:, 1]
    along_mm, across_mm = (place_mm - middle) @ forth, (place_mm - middle) @ np.array([-forth[1], forth[0]])
    ends = (outline_mm - middle) @ forth
    shift = (ends.max() + ends.min()) / 2
    length_mm, along_mm = float(np.ptp(ends)), along_mm - shift
    # Slabs across the bead: their widths, and the middles of their paste.
    edges_mm = np.linspace(-MOST_OF_IT, MOST_OF_IT, SLABS + 1) / 2 * length_mm
    count, _ = np.histogram(along_mm, edges_mm)
    line_mm = np.histogram(along_mm, edges_mm, weights=across_mm)[0] / count
    widths = count * (area_mm2 / len(along_mm)) / np.diff(edges_mm)
    inner = np.abs(edges_mm[1:] + edges_mm[:-1]) <= MIDDLE * length_mm
    width_mm = float(widths[inner].mean())
    uneven, bent = float(widths[inner].std()) / width_mm, float(np.ptp(line_mm)) / length_mm
    if length_mm < LEAST_LONG * width_mm or uneven > MOST_UNEVEN or bent > BENT:
        raise InputError(
            f"{file}: the bead is {length_mm:.1f} mm long and {width_mm:.1f} mm wide, its width varies by {uneven:.0%} "
            f"in the middle, and it bends by {bent:.0%} of its length. It must be at least {LEAST_LONG:g} times as "
            f"long as wide, vary by at most {MOST_UNEVEN:.0%} and bend by at most {BENT:.0%}. Level the plate, lower "
            "the nozzle, and lay another bead, longer or with less paste per mm. For a round spread of paste, use "
            "'sealtwin material spread'."
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
    # Oblique to the bead: along its sides, whole rows would be inside or outside.
    axes = np.linalg.eigh(np.cov(outline_mm.T))[1] @ SLANT
    turned = outline_mm @ axes
    low = turned.min(axis=0) - 2 * cell_mm
    ring = np.round((turned - low) / cell_mm).astype(np.int32)
    mask = cv2.fillPoly(np.zeros(ring.max(axis=0)[::-1] + 3, np.uint8), [ring], 1)
    inward = cv2.distanceTransform(mask, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    rows, columns = np.nonzero(mask)
    # The outline is between the last cell inside and the first one outside.
    place_mm = low + cell_mm * np.column_stack([columns, rows])
    return place_mm @ axes.T, cell_mm * (inward[rows, columns].astype(float) - 0.5)
