"""All cracks of a search map: lines that stand out from plain ground, grown to what is as dark around them."""

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

LEAST_SLENDERNESS = 5.0  # Distance of a crack's ends over its width; a hole, and the rim of a stain, have less
LEAST_JOINT_LENGTH = 0.4  # Share of the picture's diagonal. Over a shorter length a crack is sometimes straight
COVERED = 0.8  # Share of the line with skeleton that close
LARGEST_GAP = 0.05  # Share of the diagonal that a chip or a crossing crack may interrupt
BESIDE_PX = 16.0  # Cells from the line that belong to a joint, whose two rims are lines as well, 14 apart where wide
GROWN_AT = 0.7  # Share of the darkness in the middle, more than half because grain is dark too
ALONG_PX = 3.0  # Sigma in cells of the mean darkness along a line, so that no single grain decides how wide the line is
WIDEST_PX = 40  # Cells from wall to wall; wider regions are no cracks on a copy of this size
SWELLING = 3.0  # Most that a crack reaches sideways, in its typical half widths: beyond begins a stain or a pore
LEAST_HALF_PX = 1.5  # Cells to either side of a line that always belong to it: its middle is not known better
SURE, LIKELY = 3.5, 2.7  # Support, in standard deviations of plain ground, that starts and that continues a crack
LEAST_BONE_PX = 25  # Least length of a line that starts a crack, in cells: as far as the support reaches to one side
LEAST_EVIDENCE = 150.0  # Least support summed along a crack's lines: shorter or fainter ones are rows of grains
LEAST_SHARE = 0.07  # Share of the strongest crack's evidence: weaker pieces are rarely cracks beside it
LEAST_WORTH = 1e-3  # Least worth of a cell of a line, so that bridges count for little but not for nothing
RIM_PX, LONGEST_ACROSS = 8.0, 5.0  # Cells of shadow at the searched area's edge, and times that a crack may run in it
FADING = 0.5  # Share of a line's own median worth: ends below it have left the crack


@dataclass(frozen=True)
class FoundCrack:
    """A crack with the side cracks connected to it."""

    line_px: Floats  # Its main line, (n, 2), in the photo, from left to right
    outline_px: Floats  # Ring round all of it, (m, 2), on the search map's cells
    width_px: float  # Typical width along it
    score: float  # Darkness times clearness as a line, summed along the main line, in pixels of the photo

    @property
    def middle_px(self) -> Floats:
        """The place in the middle of its main line."""
        return self.line_px[len(self.line_px) // 2]


@dataclass(frozen=True)
class CrackMap:
    """All cracks of a photo; there may be none."""

    mask: NDArray[np.bool_]  # Cells of the search map in a crack
    cracks: tuple[FoundCrack, ...]  # Best first
    straight_px: tuple[Floats, ...]  # Ends of lines too straight for a crack, (2, 2): joints, or the sample's edge


def cracks_on(field: DarkMap, joints_px: Sequence[Floats] | None = None) -> CrackMap:
    """Look for cracks on a search map beside the given joints, or beside all lines too straight for a crack."""
    allowed = field.allowed
    clear, likely = _clear(field, allowed)
    straight = straight_lines(skeletonize(likely)) if joints_px is None else [field.to_work(line) for line in joints_px]
    if straight:
        # Beside a joint no crack is clear, and its strength is that of no plain ground.
        allowed = allowed & ~beside_straight(likely.shape, straight)
        clear, likely = _clear(field, allowed)
    bones = skeletonize(likely)
    cost = cost_of_thin(field, np.argwhere(bones))
    cost[field.allowed & ~allowed] = 1 / NOTHING
    lines = voted_lines(medial_axis.larger_pieces(bones, LEAST_BONE_PX), likely, cost)
    # The edge of the searched area throws a shadow, along which no crack runs.
    at_edge = lines & (medial_axis.radius(field.allowed) <= RIM_PX)
    lines = _with_evidence(lines & ~medial_axis.larger_pieces(at_edge, LONGEST_ACROSS * RIM_PX), clear)
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
    )


def _clear(field: DarkMap, allowed: NDArray[np.bool_]) -> tuple[Map, NDArray[np.bool_]]:
    """Support of the allowed cells, and those likely to be on a crack."""
    clear = np.where(inner(allowed), support(field.even, allowed), 0).astype(np.float32)
    return clear, apply_hysteresis_threshold(clear, LIKELY, SURE)


def _with_evidence(lines: NDArray[np.bool_], clear: Map) -> NDArray[np.bool_]:
    """The lines less the pieces with too little support."""
    label, area = medial_axis.pieces(lines)
    evidence = np.bincount(label.ravel(), np.where(lines, np.clip(clear, 0, None), 0).ravel(), len(area))
    enough = evidence >= max(LEAST_EVIDENCE, LEAST_SHARE * evidence.max())
    return lines & enough[label]


def _main_line(cells: Integers, worth: Floats, half_width: Floats) -> Integers:
    """The line through a piece's skeleton along which most worth adds up."""
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


def straight_lines(bones: NDArray[np.bool_]) -> list[Floats]:
    """Ends (column, row) of each straight line among the cells of a skeleton, (2, 2) each."""
    diagonal = float(np.hypot(*bones.shape))
    # A joint strays by a cell to either side; cracks in four photos strayed by 3 to 8, RMS.
    near = widened(bones, 1)
    segments = cv2.HoughLinesP(
        near.astype(np.uint8),
        rho=1,
        theta=np.pi / 720,
        threshold=int(COVERED * LEAST_JOINT_LENGTH * diagonal),
        minLineLength=LEAST_JOINT_LENGTH * diagonal,
        maxLineGap=LARGEST_GAP * diagonal,
    )
    if segments is None:
        return []
    lines = [line.reshape(2, 2).astype(float) for line in segments]
    return [line for line in lines if _share_near(near, line) >= COVERED]


def beside_straight(shape: tuple[int, ...], lines: list[Floats]) -> NDArray[np.bool_]:
    """Cells beside straight lines, which a joint follows beyond what is seen of it."""
    mask, reach = np.zeros(shape, dtype=np.uint8), sum(shape)
    for line in lines:
        start, end = np.rint(line + reach * unit(line[1] - line[0]) * np.array([[-1], [1]])).astype(int).tolist()
        cv2.line(mask, start, end, 255, 2 * round(BESIDE_PX) + 1)
    return mask > 0


def _share_near(near: NDArray[np.bool_], line: Floats) -> float:
    count = round(float(np.linalg.norm(line[1] - line[0]))) + 1
    column, row = np.rint(np.linspace(line[0], line[1], count)).astype(int).T
    return float(np.mean(near[row, column]))


def grown(lines: NDArray[np.bool_], dark: Map, allowed: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Cells connected to a line and nearly as dark as the nearest part of it."""
    if not lines.any():
        return lines
    away, nearest = cv2.distanceTransformWithLabels(
        (~lines).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_5, labelType=cv2.DIST_LABEL_PIXEL
    )
    nearest = nearest.astype(np.int64)
    near_line = away <= LEAST_HALF_PX
    dark_enough = dark > GROWN_AT * _of_nearest(_middle(lines, dark), lines, nearest)
    crack = (dark_enough & (away <= WIDEST_PX / 2) | near_line) & allowed
    number, area = medial_axis.pieces(lines)
    half_px = median(medial_axis.radius(crack), number, np.arange(len(area))) - 0.5
    reach_px = SWELLING * np.maximum(half_px[number], LEAST_HALF_PX)
    crack &= away <= _of_nearest(reach_px, lines, nearest)
    piece, area = medial_axis.pieces(crack)
    kept = np.zeros(len(area), dtype=bool)
    kept[piece[lines]] = True
    return crack & kept[piece]


def _middle(lines: NDArray[np.bool_], dark: Map) -> Map:
    """Darkness of the lines, some of which run a cell beside the darkest place."""
    darkest = np.asarray(cv2.dilate(dark, np.ones((3, 3), np.uint8)), dtype=np.float32)
    weight = blurred(lines.astype(np.float32), ALONG_PX)
    total = blurred(np.where(lines, darkest, 0).astype(np.float32), ALONG_PX)
    return (total / np.maximum(weight, 1e-6)).astype(np.float32)


def _of_nearest(value: Map, lines: NDArray[np.bool_], nearest: NDArray[np.int64]) -> Map:
    """Value at the nearest cell of a line, for each cell."""
    by_line = np.zeros(int(nearest.max()) + 1, dtype=np.float32)
    by_line[nearest[lines]] = value[lines]
    return by_line[nearest]
