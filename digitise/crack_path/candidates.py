"""Find lines of a line map that may be cracks: dark and long lines that are not joints."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from scipy.spatial import KDTree
from skimage.filters import apply_hysteresis_threshold
from skimage.morphology import skeletonize

from digitise.crack_path import medial_axis
from digitise.crack_path.line_map import CLEARNESS_LIMIT, LineMap
from digitise.crack_path.profiles import finite_median, profiles_across, row_medians
from digitise.geometry.polyline import left_normals, resampled, unit
from digitise.image.raster import lightness, widened
from digitise.photo import Photo
from digitise.settings import MAX_RANKED
from sealtwin.core.records import Booleans, Floats, Integers

# Limits of a line. Lengths are in cells of the line map.
#
# Chosen on the 127 photos of the first five sets of benchmarks/real_roads. The 117 photos of three later sets checked
# them: with any of them a quarter smaller or a third larger, at most 3 of 81 first lines more are a crack, and with a
# smaller ``LIKELY`` 4 (benchmarks.line_constants). ``SURE`` was 5 then. It was chosen anew on the 117 photos, in which
# 90 first lines are cracks instead of 81, and checked on the 127: 84 instead of 83.
LIKELY, SURE = 3.0, 3.75  # Minimum clearness of a cell that continues a line, and of a cell that starts a line
# A cell is in the middle of a line if its clearness is at least this fraction of the largest in a window of this size
CREST, NEARBY = 0.3, 11
MIN_BONE = 25  # Minimum number of cells of a skeleton piece that is used as a line
MIN_LENGTH = 0.12  # Minimum distance between a line's ends, as a fraction of the diagonal. Shorter: pores
JOINTS = (0.4, 0.25)  # Minimum length of a certain joint and of a possible joint, as fractions of the diagonal
COVERED = 0.8  # Minimum fraction of a joint's length that must be dark
LARGEST_GAP = 0.05  # Longest interruption of a joint, for example by a chip, as a fraction of the diagonal
BESIDE_JOINT = 16.0  # Cells within this distance of a joint belong to it: its two rims are up to 14 cells apart
LONGEST_BRIDGE = 20.0  # Longest gap that a line may bridge, for example at a coarse grain or a stain
FADING = 0.5  # Fraction of a line's median worth. Ends with less worth have left the crack and are cut off
SAME_CELLS, SAME = 5.0, 0.5  # Two lines are the same if they are this close over at least this fraction of their length

BEHIND = 24  # Cells before a line's end that give the direction in which it is extended
# Lines whose sides differ by more than this, over the step from the line to the darker side, come last
MAX_UNLIKE = 0.3
SIDES, SIDES_PX = (0.9, 2.2), (2.0, 5.0)  # Range of distances from a line that is compared on both sides: widths + px


@dataclass(frozen=True)
class FoundCrack:
    """A line that may be a crack."""

    line_px: Floats  # (n, 2), px in the photo, from left to right
    width_px: float  # Typical width along the line
    score: float  # Sum of clearness times contrast along the line
    # Difference in lightness of the two sides, divided by the step from the line to the darker side. inf without a step
    unlike: float

    @property
    def middle_px(self) -> Floats:
        """Middle point of the line in px, (2,)."""
        return self.line_px[len(self.line_px) // 2]

    @property
    def outline_px(self) -> Floats:
        """Ring around the line, as wide as its typical width, in px, (m, 2)."""
        width_px = max(self.width_px, 2.0)
        # If a line was extended, neighbouring points may run back and forth.
        line_px = resampled(self.line_px, width_px)
        aside_px = width_px / 2 * left_normals(line_px)
        return np.concatenate([line_px + aside_px, (line_px - aside_px)[::-1]])


def candidates(photo: Photo, field: LineMap) -> tuple[list[FoundCrack], list[Floats]]:
    """Return the lines that may be cracks, best first, and the ends of straight lines that were left out, (2, 2).

    There are at most ``MAX_RANKED`` lines.
    Lines beside a joint are left out if there are other lines. A joint is so dark that fainter cracks beside it would
    not be found.
    """
    bones = _bones(field, field.allowed)
    surely, perhaps = (_straight_lines(bones, least) for least in JOINTS)
    ways = _ways(field, field.allowed & ~_beside(bones.shape, surely))
    if perhaps:
        ways += _ways(field, field.allowed & ~_beside(bones.shape, (*surely, *perhaps)))
    ways = ways or _ways(field, field.allowed)
    least_px = MIN_LENGTH * np.hypot(*photo.size_px)
    cracks = (_crack(photo, field, way) for way in ways)
    # The ends of the rim of a stain meet.
    cracks = (crack for crack in cracks if np.linalg.norm(crack.line_px[-1] - crack.line_px[0]) >= least_px)
    apart = []
    for crack in sorted(cracks, key=lambda crack: (crack.unlike > MAX_UNLIKE, -crack.score)):
        near_px = max(crack.width_px, SAME_CELLS / field.scale)
        if all(np.mean(KDTree(other.line_px).query(crack.line_px)[0] <= near_px) < SAME for other in apart):
            apart.append(crack)
    return apart[:MAX_RANKED], [field.to_photo(line) for line in surely]


def _bones(field: LineMap, allowed: Booleans) -> Booleans:
    """Return a mask of the skeleton of the clear cells, without short pieces."""
    clear = np.where(allowed, field.clear, 0).astype(np.float32)
    likely = apply_hysteresis_threshold(clear, LIKELY, SURE)
    crest = clear >= CREST * cv2.dilate(clear, np.ones((NEARBY, NEARBY), np.uint8))
    return medial_axis.larger_pieces(skeletonize(likely & crest), MIN_BONE)


def _ways(field: LineMap, allowed: Booleans) -> list[Integers]:
    """Return the strongest line of each skeleton piece in the allowed cells, (n, 2) as row and column."""
    lines = _linked(_bones(field, allowed))
    worth, ways = _worth(field), []
    label, area = medial_axis.pieces(lines)
    for piece in np.flatnonzero(area >= MIN_BONE):
        cells = np.argwhere(label == piece)
        weight = worth[tuple(cells.T)]
        tree = medial_axis.strongest_tree(medial_axis.linked(cells, weight), weight)
        walk, _ = medial_axis.longest_walk(tree, 0)
        strong = np.flatnonzero(weight[walk] >= FADING * np.median(weight[walk]))
        ways.append(_extended(cells[walk[strong[0] : strong[-1] + 1]], field, allowed))
    return ways


def _extended(way: Integers, field: LineMap, allowed: Booleans) -> Integers:
    """Return a line extended straight on at both ends, as far as the cells ahead are clear.

    The extension is at most one width long. It is needed because a skeleton ends half a width before a blunt end.
    """
    steps = np.arange(1, int(np.median(field.width[tuple(way.T)])) + 1)[:, None]
    least = max(LIKELY, FADING * float(np.median(field.clear[tuple(way.T)])))
    for _ in range(2):
        way = way[::-1]
        ahead = unit((way[-1] - way[-min(len(way), BEHIND)]).astype(float))
        onward = np.rint(way[-1] + steps * ahead).astype(np.int64)
        onward = onward[((onward >= 0) & (onward < field.clear.shape)).all(axis=1)]
        ends = ~allowed[tuple(onward.T)] | (field.clear[tuple(onward.T)] < least)
        way = np.concatenate([way, onward[: int(np.argmax(ends)) if ends.any() else len(onward)]])
    return way


def _worth(field: LineMap) -> Floats:
    return (np.clip(field.clear, 0, CLEARNESS_LIMIT) / CLEARNESS_LIMIT * field.contrast).astype(float) + 1e-3


def _linked(bones: Booleans) -> Booleans:
    """Return the skeleton, with close ends joined by straight lines, for example across a coarse grain."""
    around = cv2.filter2D(bones.astype(np.uint8), -1, np.ones((3, 3)), borderType=cv2.BORDER_CONSTANT)
    ends = np.argwhere(bones & (around == 2))
    linked = bones.astype(np.uint8)
    for first, second in KDTree(ends).query_pairs(LONGEST_BRIDGE) if len(ends) > 1 else ():
        cv2.line(linked, ends[first][::-1].tolist(), ends[second][::-1].tolist(), 1)
    return linked > 0


def _straight_lines(bones: Booleans, least: float) -> list[Floats]:
    """Return the two ends of each straight line in a skeleton, (2, 2), as column and row.

    ``least`` is the minimum length of a line, as a fraction of the map's diagonal.
    """
    diagonal, near = float(np.hypot(*bones.shape)), widened(bones, 1)
    segments = cv2.HoughLinesP(
        near.astype(np.uint8),
        rho=1,
        theta=np.pi / 720,
        threshold=int(COVERED * least * diagonal),
        minLineLength=least * diagonal,
        maxLineGap=LARGEST_GAP * diagonal,
    )
    lines = [] if segments is None else [line.reshape(2, 2).astype(float) for line in segments]
    # A joint leaves the photo at least at one end, and a straight crack may end inside.
    last, rim = np.array(bones.shape[::-1]) - 1, LARGEST_GAP * diagonal
    return [line for line in lines if np.minimum(line, last - line).min() < rim and _share_near(near, line) >= COVERED]


def _share_near(near: Booleans, line: Floats) -> float:
    count = round(float(np.linalg.norm(line[1] - line[0]))) + 1
    column, row = np.rint(np.linspace(line[0], line[1], count)).astype(int).T
    return float(np.mean(near[row, column]))


def _beside(shape: tuple[int, ...], lines: Sequence[Floats]) -> Booleans:
    """Return a mask of the cells beside straight lines. Each line is extended across the whole map, as a joint is."""
    mask, reach = np.zeros(shape, np.uint8), sum(shape)
    for line in lines:
        start, end = np.rint(line + reach * unit(line[1] - line[0]) * np.array([[-1], [1]])).astype(int).tolist()
        cv2.line(mask, start, end, 255, round(2 * BESIDE_JOINT) + 1)
    return mask > 0


def _crack(photo: Photo, field: LineMap, way: Integers) -> FoundCrack:
    along = tuple(way.T)
    line_px = field.to_photo(medial_axis.rightward(way)[:, ::-1])
    width_px = float(np.median(field.width[along])) / field.scale
    score = float(_worth(field)[along].sum()) / field.scale
    return FoundCrack(line_px, width_px, score, _unlike(photo, line_px, width_px))


def _unlike(photo: Photo, line_px: Floats, width_px: float) -> float:
    """Return how much a line's two sides differ.

    This is the difference of the sides' lightness, divided by the step from the line to the darker side.
    """
    near_px, far_px = (widths * width_px + px for widths, px in zip(SIDES, SIDES_PX, strict=True))
    profiles = profiles_across(photo, line_px, width_px, far_px)
    light, away_px = lightness(profiles.light).astype(float), profiles.away_px
    line = row_medians(light[:, away_px <= max(width_px / 4, 1.0)])
    left, right = (row_medians(light[:, (away_px >= near_px) & (side * profiles.offset_px > 0)]) for side in (1, -1))
    step, difference = finite_median(np.fmin(left, right) - line), abs(finite_median(left) - finite_median(right))
    return difference / step if step > 0 and np.isfinite(difference) else float("inf")
