"""Find all cracks on a search map: lines clearer than plain ground, extended to adjacent cells that are as dark."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median
from skimage.filters import apply_hysteresis_threshold
from skimage.morphology import skeletonize

from digitise.crack_path import medial_axis
from digitise.crack_path.darkness import DarkMap, inner
from digitise.crack_path.ridge_filter import support
from digitise.crack_path.step_costs import CLEAR, NOTHING, cost_of_thin, voted_lines
from digitise.geometry.polyline import unit
from digitise.image.raster import Map, blurred, widened
from sealtwin.core.arc_length import arc_length
from sealtwin.core.records import Floats, Integers

# Limits of a crack on the search map. Lengths are cells; support is in standard deviations of plain ground.
#
# Chosen on drawn photos and on four photos with masks, so that six photos of plain mortar show no line. A lower
# ``SURE``, ``LIKELY`` or ``LEAST_EVIDENCE`` finds fainter cracks and more rows of grains.
SURE = 3.5  # Support that starts a crack
LIKELY = 2.7  # Support that continues a crack
LEAST_BONE = 25  # Least length of a line that starts a crack: the support reaches as far to one side
LEAST_EVIDENCE = 150.0  # Least sum of support along a crack's lines; rows of grains have less
LEAST_SHARE = 0.07  # Least share of the strongest crack's evidence
RIM = 8.0  # Width of the shadow at the edge of the searched area
LONGEST_IN_RIM = 5.0  # Longest part of a crack in that shadow, in widths of the shadow
LEAST_WORTH = 1e-3  # Least worth of a cell of a line, so that bridges count for little but not for nothing
FADING = 0.5  # Share of a line's median worth; ends below it have left the crack
LEAST_SLENDERNESS = 5.0  # Least distance of the ends over the width; holes and rims of stains have less
LEAST_JOINT = 0.4  # Least length of a joint over the map's diagonal; a shorter crack may be straight
SHORT_JOINT = 0.25  # The same of a line that may be a crack as well
JOINT_COVERED = 0.8  # Least share of a joint with skeleton within one cell
LARGEST_GAP = 0.05  # Longest interruption of a joint, as by a chip, over the diagonal
BESIDE_JOINT = 16.0  # Distance from a joint that belongs to it: its two rims are up to 14 cells apart
GROWN_AT = 0.7  # Share of the darkness in the middle that is still crack; at 0.5 dark grain would be
ALONG = 3.0  # Sigma of the mean darkness along a line, so that no single grain decides the line's width
WIDEST = 40  # Largest distance between walls; wider regions are not cracks on a map of this size
SWELLING = 3.0  # Largest reach sideways in typical half widths; a stain or a pore begins beyond it
LEAST_HALF = 1.5  # Distance from a line that always belongs to it: its middle is not located better


@dataclass(frozen=True)
class FoundCrack:
    """A crack with the side cracks connected to it."""

    line_px: Floats  # Its main line, (n, 2), in the photo, from left to right
    outline_px: Floats  # Ring around all of it, (m, 2), on the cells of the search map
    width_px: float  # Typical width along it
    score: float  # Darkness times clearness as a line, summed along the main line, in pixels of the photo

    @property
    def middle_px(self) -> Floats:
        """Middle point of the main line."""
        return self.line_px[len(self.line_px) // 2]


@dataclass(frozen=True)
class CrackMap:
    """All cracks of a photo, if any."""

    mask: NDArray[np.bool_]  # Cells of the search map in a crack
    cracks: tuple[FoundCrack, ...]  # Best first
    straight_px: tuple[Floats, ...]  # Ends of lines too straight for a crack, (2, 2): joints, or the sample's edge
    short_px: tuple[Floats, ...]  # The same of shorter ones that were not left out


def cracks_on(field: DarkMap, joints_px: Sequence[Floats] | None = None) -> CrackMap:
    """Find the cracks on a search map, apart from joints. By default every line too straight for a crack is a joint."""
    allowed = field.allowed
    clear, likely = _clear(field, allowed)
    short = list[Floats]()
    if joints_px is None:
        bones = skeletonize(likely)
        straight, short = straight_lines(bones), straight_lines(bones, SHORT_JOINT)
    else:
        straight = [field.to_work(line) for line in joints_px]
    if straight:
        # A joint hides cracks next to it, and its strength would distort the statistics of plain ground.
        beside = beside_straight(likely.shape, straight)
        short = [line for line in short if not beside[tuple(np.rint(line.mean(axis=0)[::-1]).astype(int))]]
        allowed = allowed & ~beside
        clear, likely = _clear(field, allowed)
    bones = skeletonize(likely)
    cost = cost_of_thin(field, np.argwhere(bones))
    cost[field.allowed & ~allowed] = 1 / NOTHING
    lines = voted_lines(medial_axis.larger_pieces(bones, LEAST_BONE), likely, cost)
    # The edge of the searched area casts a shadow; no crack runs along it.
    at_edge = lines & (medial_axis.radius(field.allowed) <= RIM)
    lines = _with_evidence(lines & ~medial_axis.larger_pieces(at_edge, LONGEST_IN_RIM * RIM), clear)
    mask = grown(lines, field.dark, field.allowed)
    worth = (np.clip(field.ridge, 0, CLEAR) / CLEAR * field.dark).astype(float) + LEAST_WORTH
    # A wide crack has lines along both its walls, and one middle.
    half_width, bones, (label, area) = medial_axis.radius(mask), skeletonize(mask), medial_axis.pieces(mask)
    cracks = list[FoundCrack]()
    for piece in range(1, len(area)):
        line = _main_line(np.argwhere(bones & (label == piece)), worth, half_width)
        crack = _crack(line, worth, half_width, label == piece, field)
        breadth = area[piece] / max(arc_length(line.astype(float))[-1], 1.0)
        if np.linalg.norm(line[-1] - line[0]) < LEAST_SLENDERNESS * max(breadth, crack.width_px * field.scale):
            mask &= label != piece
        else:
            cracks.append(crack)
    return CrackMap(
        mask=mask,
        cracks=tuple(sorted(cracks, key=lambda crack: -crack.score)),
        straight_px=tuple(field.to_photo(line) for line in straight),
        short_px=tuple(field.to_photo(line) for line in short),
    )


def _clear(field: DarkMap, allowed: NDArray[np.bool_]) -> tuple[Map, NDArray[np.bool_]]:
    """Return the support of the allowed cells, and the cells likely to be on a crack."""
    clear = np.where(inner(allowed), support(field.even, allowed), 0).astype(np.float32)
    return clear, likely_cells(clear)


def likely_cells(clear: Map) -> NDArray[np.bool_]:
    """Return the cells likely to be on a line, from the support of each, which is 0 in cells that are not allowed."""
    return apply_hysteresis_threshold(clear, LIKELY, SURE)


def _with_evidence(lines: NDArray[np.bool_], clear: Map) -> NDArray[np.bool_]:
    """Return the lines without pieces that have too little support."""
    label, area = medial_axis.pieces(lines)
    evidence = np.bincount(label.ravel(), np.where(lines, np.clip(clear, 0, None), 0).ravel(), len(area))
    enough = evidence >= max(LEAST_EVIDENCE, LEAST_SHARE * evidence.max())
    return lines & enough[label]


def _main_line(cells: Integers, worth: Floats, half_width: Floats) -> Integers:
    """Return the line through a piece's skeleton that has the largest sum of ``worth``."""
    own = worth[tuple(cells.T)]
    walk, _ = medial_axis.longest_walk(medial_axis.strongest_tree(medial_axis.linked(cells, own), own), 0)
    strong = np.flatnonzero(own[walk] >= FADING * np.median(own[walk]))
    return medial_axis.without_hooks(cells[walk[strong[0] : strong[-1] + 1]], half_width)


def _crack(line: Integers, worth: Floats, half_width: Floats, cells: NDArray[np.bool_], field: DarkMap) -> FoundCrack:
    length = float(arc_length(line.astype(float))[-1])
    rings = cv2.findContours(cells.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)[0]
    return FoundCrack(
        line_px=field.to_photo((line if line[0, 1] <= line[-1, 1] else line[::-1])[:, ::-1]),
        outline_px=field.to_photo(np.asarray(max(rings, key=len), dtype=float)[:, 0]),
        width_px=(2 * float(np.median(half_width[tuple(line.T)])) - 1) / field.scale,
        score=length * float(np.mean(worth[tuple(line.T)])) / field.scale,
    )


def straight_lines(bones: NDArray[np.bool_], least: float = LEAST_JOINT) -> list[Floats]:
    """Return each straight line in a skeleton as its two ends, (2, 2). An end is (column, row).

    ``least`` is its least length over the map's diagonal.
    """
    diagonal = float(np.hypot(*bones.shape))
    # A joint strays by a cell to either side; cracks in four photos strayed by 3 to 8, RMS.
    near = widened(bones, 1)
    segments = cv2.HoughLinesP(
        near.astype(np.uint8),
        rho=1,
        theta=np.pi / 720,
        threshold=int(JOINT_COVERED * least * diagonal),
        minLineLength=least * diagonal,
        maxLineGap=LARGEST_GAP * diagonal,
    )
    if segments is None:
        return []
    lines = [line.reshape(2, 2).astype(float) for line in segments]
    return [line for line in lines if _share_near(near, line) >= JOINT_COVERED]


def beside_straight(
    shape: tuple[int, ...], lines: Sequence[Floats], width: float = 2 * BESIDE_JOINT
) -> NDArray[np.bool_]:
    """Return the cells on straight lines of a width, each extended across the whole map as a joint is."""
    mask, reach = np.zeros(shape, dtype=np.uint8), sum(shape)
    for line in lines:
        start, end = np.rint(line + reach * unit(line[1] - line[0]) * np.array([[-1], [1]])).astype(int).tolist()
        cv2.line(mask, start, end, 255, round(width) + 1)
    return mask > 0


def _share_near(near: NDArray[np.bool_], line: Floats) -> float:
    count = round(float(np.linalg.norm(line[1] - line[0]))) + 1
    column, row = np.rint(np.linspace(line[0], line[1], count)).astype(int).T
    return float(np.mean(near[row, column]))


def grown(lines: NDArray[np.bool_], dark: Map, allowed: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the cells that are connected to a line and nearly as dark as the nearest part of it."""
    if not lines.any():
        return lines
    away, nearest = cv2.distanceTransformWithLabels(
        (~lines).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_5, labelType=cv2.DIST_LABEL_PIXEL
    )
    nearest = nearest.astype(np.int64)
    near_line = away <= LEAST_HALF
    dark_enough = dark > GROWN_AT * _of_nearest(_middle(lines, dark), lines, nearest)
    crack = (dark_enough & (away <= WIDEST / 2) | near_line) & allowed
    number, area = medial_axis.pieces(lines)
    half_px = median(medial_axis.radius(crack), number, np.arange(len(area))) - 0.5
    reach_px = SWELLING * np.maximum(half_px[number], LEAST_HALF)
    crack &= away <= _of_nearest(reach_px, lines, nearest)
    piece, area = medial_axis.pieces(crack)
    on_line = np.zeros(len(area), dtype=bool)
    on_line[piece[lines]] = True
    return crack & on_line[piece]


def _middle(lines: NDArray[np.bool_], dark: Map) -> Map:
    """Return the mean darkness along the lines. A line may be one cell off the darkest place."""
    darkest = np.asarray(cv2.dilate(dark, np.ones((3, 3), np.uint8)), dtype=np.float32)
    weight = blurred(lines.astype(np.float32), ALONG)
    total = blurred(np.where(lines, darkest, 0).astype(np.float32), ALONG)
    return (total / np.maximum(weight, 1e-6)).astype(np.float32)


def _of_nearest(value: Map, lines: NDArray[np.bool_], nearest: NDArray[np.int64]) -> Map:
    """Return for each cell the value at the nearest cell of a line."""
    by_line = np.zeros(int(nearest.max()) + 1, dtype=np.float32)
    by_line[nearest[lines]] = value[lines]
    return by_line[nearest]
