"""Find the crack in a photo: as painted, the darkest path between given points, or the most crack-like line."""

from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from digitise.crack_path.crack_map import CrackMap, FoundCrack, cracks_on
from digitise.crack_path.hints import SNAP_PX, CrackPath, check_hints, listed
from digitise.crack_path.medial_axis import longest_line, radius, without_hooks
from digitise.crack_path.path_search import LiveWire
from digitise.crack_path.path_width import unlike_length_px
from digitise.crack_path.step_costs import cheapest, off_centre
from digitise.image.raster import shrunk
from digitise.photo import Photo
from digitise.scale.face_scale import see_face
from digitise.settings import Pixel
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats, Integers, arc_length

WORK_PX = 2000  # Longer side of the copy on which the middle of the paint is found
LEAST_COVERED = 0.25  # Least share of a cell of that copy under paint: a line of one pixel stays whole
PINHOLE = 0.5  # Share of the crack's width; smaller places without paint are slips of the brush
EDGES_FOUND = (
    "the crack was searched for inside the edges of the sample, which the photo shows; "
    "give face_mm, its size, to have the crack open where it meets them"
)
EDGE_WIDTHS, EDGE_SHARE = 3.0, 0.05  # A longer stretch with unlike sides is told: crack widths, and share of the line
LEAST_LENGTH = 0.12  # Share of the photo's diagonal; shorter lines are pores and scratches
LEAST_SLENDERNESS = 5.0  # Length over width of a crack
RUNNER_UP = 0.5  # A second line with more than this share of the first one's score makes the choice the user's


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


def painted_path(photo: Photo, ends_px: tuple[Pixel, Pixel] | None) -> CrackPath:
    """Middle of the painted crack: between the ends, or along the longest line of the largest piece, rightward.

    Raises InputError where an end is not on the paint, or the two lie on different pieces.
    """
    assert photo.drawn is not None, "nothing is painted"
    count, label, stats, _ = cv2.connectedComponentsWithStats(photo.drawn.astype(np.uint8), connectivity=8)
    if ends_px is None:
        chosen = 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))
    else:
        check_hints(photo, ends_px)
        chosen = _piece_of(photo, label, np.array(ends_px, dtype=float))
    left, top, width, height = (int(value) for value in stats[chosen, :4])
    piece = label[top : top + height, left : left + width] == chosen
    scale = min(1.0, WORK_PX / max(piece.shape))
    size = (max(1, round(width * scale)), max(1, round(height * scale)))
    region = _without_pinholes(shrunk(piece.astype(np.float32), size) > LEAST_COVERED)

    def to_photo(cells: Integers) -> Floats:
        return (cells[:, ::-1].astype(float) + 0.5) / scale - 0.5 + (left, top)

    if ends_px is None:
        way = without_hooks(longest_line(region), radius(region))
        way = way if way[0, 1] <= way[-1, 1] else way[::-1]
    else:
        way = _between(region, (np.array(ends_px) - (left, top) + 0.5) * scale - 0.5)
    width_px = (2 * float(np.median(radius(region)[tuple(way.T)])) - 1) / scale
    share = stats[chosen, cv2.CC_STAT_AREA] / stats[1:, cv2.CC_STAT_AREA].sum()
    others = (
        f"the mask has {count - 1} pieces; the one from {listed(to_photo(way)[[0, -1]])} px, {share:.0%} of the paint, "
        "was taken"
    )
    return CrackPath(to_photo(way), width_px, "mask", (others,) if count > 2 else ())


def _piece_of(photo: Photo, label: NDArray, ends_px: Floats) -> int:
    """Number of the piece on which both ends lie."""
    found = []
    for x, y in ends_px:
        left, top = max(int(x - SNAP_PX), 0), max(int(y - SNAP_PX), 0)
        near = label[top : int(y + SNAP_PX) + 2, left : int(x + SNAP_PX) + 2]
        rows, columns = np.nonzero(near)
        away_px = np.hypot(columns + left - x, rows + top - y)
        if away_px.min(initial=np.inf) > SNAP_PX:
            raise InputError(
                f"{photo.file}: the end ({x:g}, {y:g}) is not on the crack that the mask paints (at most "
                f"{SNAP_PX:g} px beside it); give a point inside the paint, or paint the crack up to there."
            )
        nearest = int(np.argmin(away_px))
        found.append(int(near[rows[nearest], columns[nearest]]))
    if found[0] != found[1]:
        raise InputError(
            f"{photo.file}: the two ends lie on different pieces of the mask; paint the gap between them, or give ends "
            "on one piece."
        )
    return found[0]


def _without_pinholes(region: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The region with its small holes filled."""
    # Over a strip, the distance from the rim is a quarter of the width in the median.
    hole = PINHOLE * 4 * float(np.median(radius(region)[region]))
    _, label, stats, _ = cv2.connectedComponentsWithStats((~region).astype(np.uint8), connectivity=4)
    small = np.flatnonzero(stats[:, cv2.CC_STAT_AREA] <= np.pi / 4 * hole**2)
    return region | (np.isin(label, small) & ~region)


def _between(region: NDArray[np.bool_], ends: Floats) -> Integers:
    cells = np.argwhere(region)
    start, end = (cells[int(np.argmin(np.sum((cells - point[::-1]) ** 2, axis=1)))] for point in ends)
    to_rim = radius(region)
    usual = max(2 * float(np.median(to_rim[region])), 1.0)
    cost = np.where(region, off_centre(to_rim, usual), np.inf)
    return cheapest(cost, start, end, margin=max(region.shape))


def automatic_path(photo: Photo, roi_px: tuple[Pixel, ...] | None = None) -> CrackPath:
    """Propose the one crack that stands out, from left to right; raise InputError where there is none, or two."""
    face_px = see_face(photo.brightness) if photo.face_px is None else None
    wire = LiveWire(photo, roi_px, face_px)
    warnings = [] if face_px is None else [EDGES_FOUND]
    found = cracks_on(wire.field)
    least_px = LEAST_LENGTH * float(np.hypot(*photo.size_px))
    long = _long(found, least_px)
    if found.straight_px:
        line = f"a line from {listed(found.straight_px[0])} px"
        if long:
            warnings.append(f"{line} was left out: it is as straight as a joint")
        else:
            long = _long(cracks_on(wire.field, straight_too=True), least_px)
            warnings.append(f"{line} is as straight as a joint, and there is no other")
    if not long:
        where = "" if face_px is None else " inside the edges of the sample"
        raise InputError(f"{photo.file}: no crack found{where}: nothing dark, thin and long stands out; give ends_px.")
    ends_px = long[0].line_px[[0, -1]]
    if len(long) > 1 and long[1].score > RUNNER_UP * long[0].score:
        first, second = long[:2]
        raise InputError(
            f"{photo.file}: two cracks compete, {listed(ends_px)} px with a score of {first.score:.0f} and "
            f"{listed(second.line_px[[0, -1]])} px with {second.score:.0f} ({second.score / first.score:.0%} of it); "
            "choose with ends_px."
        )
    path = _way_between(wire, ends_px, least_px, photo)
    unlike_px = unlike_length_px(photo, path.points_px, path.width_px)
    if unlike_px > max(EDGE_WIDTHS * path.width_px, EDGE_SHARE * float(arc_length(path.points_px)[-1])):
        warnings.append(
            f"along {unlike_px * photo.mm_per_px:.0f} mm of the line that was found, one side is far brighter than the "
            "other, as at the sample's edge, where no nozzle must go: look at overlay.png, and give ends_px or face_mm"
        )
    return replace(path, source="automatic", warnings=tuple(warnings))


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
