"""Find the crack in a photo: as painted, the darkest path between given points, or the most crack-like of all lines."""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median
from scipy.spatial import KDTree
from skimage.filters import apply_hysteresis_threshold
from skimage.morphology import skeletonize

from digitise.crack_path import medial_axis, step_costs
from digitise.crack_path.darkness import DarkMap, inner
from digitise.crack_path.hints import CrackPath, listed
from digitise.crack_path.painted_path import painted_path
from digitise.crack_path.path_search import LiveWire
from digitise.crack_path.path_width import unlike_length_px
from digitise.crack_path.ridge_filter import support
from digitise.crack_path.step_costs import CLEAR, NOTHING, cost_of_thin, voted_lines
from digitise.image.raster import Map, blurred, widened
from digitise.photo import Photo
from digitise.scale.face_scale import see_face
from digitise.settings import Pixel
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats, Integers, arc_length

EDGES_FOUND = (
    "the crack was searched for inside the edges of the sample, which the photo shows; "
    "give face_mm, its size, to have the crack open where it meets them"
)
EDGE_WIDTHS, EDGE_SHARE = 3.0, 0.05  # A longer stretch with unlike sides is told: crack widths, and share of the line
LEAST_LENGTH = 0.12  # Share of the photo's diagonal; shorter lines are pores and scratches
LEAST_SLENDERNESS = 5.0  # Length over width of a crack
MOST_RANKED = 5  # More would be no choice
RUNNER_UP = 0.5  # A second line with more than this share of the first one's score makes the choice the user's
LEAST_JOINT_LENGTH = 0.4  # Share of the picture's diagonal. Over a shorter length a crack is sometimes straight
COVERED = 0.8  # Share of the line with skeleton that close
LARGEST_GAP = 0.05  # Share of the diagonal that a chip or a crossing crack may interrupt
BESIDE_PX = 12.0  # Cells from the line that belong to a joint, whose two rims are lines as well, 14 apart where wide
GROWN_AT = 0.7  # Share of the darkness in the middle, more than half because grain is dark too
ALONG_PX = 3.0  # Sigma in cells of the mean darkness along a line, so that no single grain decides how wide the line is
WIDEST_PX = 40  # Cells from wall to wall; wider regions are no cracks on a copy of this size
SWELLING = 3.0  # Most that a crack reaches sideways, in its typical half widths: beyond begins a stain or a pore
LEAST_HALF_PX = 1.5  # Cells to either side of a line that always belong to it: its middle is not known better
SURE, LIKELY = 4.0, 2.7  # Support, in standard deviations of plain ground, that starts and that continues a crack
LEAST_BONE_PX = 25  # Least length of a line that starts a crack, in cells: as far as the support reaches to one side
LEAST_EVIDENCE = 100.0  # Least support summed along a crack's lines: shorter or fainter ones are rows of grains
LEAST_SHARE = 0.07  # Share of the strongest crack's evidence: weaker pieces are rarely cracks beside it
LEAST_WORTH = 1e-3  # Least worth of a cell of a line, so that bridges count for little but not for nothing
RIM_PX, LONGEST_ACROSS = 8.0, 5.0  # Cells of shadow at the searched area's edge, and times that a crack may run in it
FADING = 0.5  # Share of a line's own median worth: ends below it have left the crack


@dataclass(frozen=True)
class FoundCrack:
    """A crack with the side cracks connected to it."""

    line_px: Floats  # Its main line, (n, 2), in the photo, from left to right
    width_px: float  # Typical width along it
    score: float  # Darkness times clearness as a line, summed along the main line, in pixels of the photo


@dataclass(frozen=True)
class CrackMap:
    """All cracks of a photo; there may be none."""

    mask: NDArray[np.bool_]  # Cells of the search map in a crack
    cracks: tuple[FoundCrack, ...]  # Best first
    straight_px: tuple[Floats, ...]  # Ends of lines too straight for a crack, (2, 2): joints, or the sample's edge


def find_path(
    photo: Photo,
    ends_px: tuple[Pixel, Pixel] | None,
    via_px: tuple[Pixel, ...] = (),
    roi_px: tuple[Pixel, ...] | None = None,
) -> CrackPath:
    """Find the path between the given ends, past the via points in their order, inside ``roi_px`` only.

    Without ends it runs along the one crack that stands out, from left to right, or along the middle of the paint.
    Raises InputError where a point is outside the photo or on no crack, where no crack is found or two compete.
    """
    if photo.drawn is not None:
        return painted_path(photo, ends_px)
    if ends_px is None:
        return automatic_path(photo, roi_px)
    return LiveWire(photo, roi_px).path(ends_px, via_px)


def automatic_path(photo: Photo, roi_px: tuple[Pixel, ...] | None = None) -> CrackPath:
    """Propose the one crack that stands out, from left to right; raise InputError where there is none, or several."""
    face_px = see_face(photo.brightness) if photo.face_px is None else None
    wire = LiveWire(photo, roi_px, face_px)
    ranked, warnings = _ranked(wire, photo)
    if face_px is not None:
        warnings.insert(0, EDGES_FOUND)
    if not ranked:
        where = "" if face_px is None else " inside the edges of the sample"
        raise InputError(f"{photo.file}: no crack found{where}: nothing dark, thin and long stands out; give ends_px.")
    rivals = [crack for crack in ranked if crack.score > RUNNER_UP * ranked[0].score]
    if len(rivals) > 1:
        told = (
            f"{rank}. {listed(crack.line_px[[0, -1]])} px, {crack.score / ranked[0].score:.0%}"
            for rank, crack in enumerate(rivals, 1)
        )
        number = {2: "two", 3: "three", 4: "four", 5: "five"}[len(rivals)]
        raise InputError(
            f"{photo.file}: {number} cracks compete, best first, with their share of the best one's score: "
            f"{'; '.join(told)}; choose with ends_px."
        )
    path = _way_between(wire, ranked[0].line_px[[0, -1]], _least_px(photo), photo)
    unlike_px = unlike_length_px(photo, path.points_px, path.width_px)
    if unlike_px > max(EDGE_WIDTHS * path.width_px, EDGE_SHARE * float(arc_length(path.points_px)[-1])):
        warnings.append(
            f"along {unlike_px * photo.mm_per_px:.0f} mm of the line that was found, one side is far brighter than the "
            "other, as at the sample's edge, where no nozzle must go: look at overlay.png, and give ends_px or face_mm"
        )
    return replace(path, source="automatic", warnings=tuple(warnings))


def ranked_cracks(photo: Photo, roi_px: tuple[Pixel, ...] | None = None) -> list[FoundCrack]:
    """Find up to five lines that are likely to be the crack, best first; none where nothing is likely."""
    face_px = see_face(photo.brightness) if photo.face_px is None else None
    return _ranked(LiveWire(photo, roi_px, face_px), photo)[0]


def _ranked(wire: LiveWire, photo: Photo) -> tuple[list[FoundCrack], list[str]]:
    """The same, and warnings about lines too straight for a crack."""
    least_px, warnings = _least_px(photo), list[str]()
    found = cracks_on(wire.field)
    # A wide crack is two lines on the fine map, along its walls.
    wide_px = step_costs.THIN_PX / wire.coarse.scale
    wide = [crack for crack in _long(cracks_on(wire.coarse), least_px) if crack.width_px >= wide_px]
    fine = [crack for crack in _long(found, least_px) if not any(_in(crack, other) for other in wide)]
    if found.straight_px:
        line = f"a line from {listed(found.straight_px[0])} px"
        if wide or fine:
            warnings.append(f"{line} was left out: it is as straight as a joint")
        else:
            fine = _long(cracks_on(wire.field, straight_too=True), least_px)
            warnings.append(f"{line} is as straight as a joint, and there is no other")
    return sorted([*wide, *fine], key=lambda crack: -crack.score)[:MOST_RANKED], warnings


def _in(crack: FoundCrack, other: FoundCrack) -> bool:
    """Report that most of a line runs inside another crack or along its walls."""
    return float(np.median(KDTree(other.line_px).query(crack.line_px)[0])) <= other.width_px


def _least_px(photo: Photo) -> float:
    return LEAST_LENGTH * float(np.hypot(*photo.size_px))


def _way_between(wire: LiveWire, ends_px: Floats, least_px: float, photo: Photo) -> CrackPath:
    """The crack's path between the ends of the line that was found; a refusal must not name these ends as given."""
    fault = "comes back to where it begins, as the rim of a stain does"
    (start_x, start_y), (end_x, end_y) = ends_px
    if np.hypot(end_x - start_x, end_y - start_y) >= least_px:
        try:
            return wire.path(((start_x, start_y), (end_x, end_y)))
        except InputError:
            fault = "is none all along"
    raise InputError(
        f"{photo.file}: no crack found: the most crack-like line, from {listed(ends_px)} px, {fault}; give ends_px."
    )


def _long(found: CrackMap, least_px: float) -> list[FoundCrack]:
    """The cracks of a map that are long enough for a sample's."""
    return [
        crack
        for crack in found.cracks
        if arc_length(crack.line_px)[-1] >= max(least_px, LEAST_SLENDERNESS * crack.width_px)
    ]


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
    mask = np.zeros(shape, dtype=np.uint8)
    for line in lines:
        start, end = np.rint(line).astype(int).tolist()
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
    half_px = median(medial_axis.radius(crack), number, np.arange(len(area)))
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


def cracks_on(field: DarkMap, straight_too: bool = False) -> CrackMap:
    """Look for cracks on a search map; lines too straight for one count only with ``straight_too``."""
    clear = np.where(inner(field.allowed), support(field.even, field.allowed), 0).astype(np.float32)
    likely = apply_hysteresis_threshold(clear, LIKELY, SURE)
    bones = skeletonize(likely)
    straight, cost = straight_lines(bones), cost_of_thin(field, np.argwhere(bones))
    if not straight_too:
        joint = beside_straight(likely.shape, straight)
        likely &= ~joint
        cost[joint & field.allowed] = 1 / NOTHING
    lines = voted_lines(medial_axis.larger_pieces(skeletonize(likely), LEAST_BONE_PX), likely, cost)
    # The edge of the searched area throws a shadow, along which no crack runs.
    at_edge = lines & (medial_axis.radius(field.allowed) <= RIM_PX)
    lines = _with_evidence(lines & ~medial_axis.larger_pieces(at_edge, LONGEST_ACROSS * RIM_PX), clear)
    mask = grown(lines, field.dark, field.allowed)
    worth = (np.clip(field.ridge, 0, CLEAR) / CLEAR * field.dark).astype(float) + LEAST_WORTH
    # A wide crack has lines along both its walls, and one middle.
    half_width, bones, (label, area) = medial_axis.radius(mask), skeletonize(mask), medial_axis.pieces(mask)
    skeletons = [np.argwhere(bones & (label == piece)) for piece in range(1, len(area))]
    main_lines = [_main_line(cells, worth, half_width) for cells in skeletons]
    cracks = [_crack(line, worth, half_width, field) for line in main_lines]
    return CrackMap(
        mask=mask,
        cracks=tuple(sorted(cracks, key=lambda crack: -crack.score)),
        straight_px=tuple(field.to_photo(line) for line in straight),
    )


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


def _crack(line: Integers, worth: Floats, half_width: Floats, field: DarkMap) -> FoundCrack:
    score = float(arc_length(line.astype(float))[-1] * np.mean(worth[tuple(line.T)]))
    return FoundCrack(
        line_px=field.to_photo((line if line[0, 1] <= line[-1, 1] else line[::-1])[:, ::-1]),
        width_px=(2 * float(np.median(half_width[tuple(line.T)])) - 1) / field.scale,
        score=score / field.scale,
    )
