"""Draw a traced crack over its photo for a check by eye."""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray
from skimage.measure import points_in_poly

from digitise.crack_path.crack_map import FoundCrack
from digitise.crack_path.hints import CrackPath
from digitise.geometry.polyline import at_arc_length, depth_inside, resampled
from digitise.geometry.polyline import unit as toward
from digitise.photo import Photo
from sealtwin.core.arc_length import arc_length
from sealtwin.core.records import Floats, Outline, PathSource, Trajectory

Picture = NDArray[np.uint8]
Colour = tuple[int, int, int]

# RGB. Walls and centreline differ in lightness as well as hue, for colour-blind readers
LEFT, RIGHT, CENTRE = (0, 222, 160), (60, 170, 255), (250, 235, 60)
ENDS, INK, PAPER = (255, 90, 20), (24, 24, 24), (255, 255, 255)
NOZZLE = PAPER
BEADS = 11.0  # Spacing of beads of the nozzle's path, in thousandths of the picture's longer side
LONGER_SIDE_PX = 2400  # Longer side of the picture, to which photos are scaled, enlarged by ``MOST_ENLARGED`` at most
MOST_ENLARGED = 4.0
ROUND_LENGTHS_MM = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)
SUBPIXEL_BITS = 4
DASH = 5.0  # Length of a dash and of the gap after it, in thousandths of the picture's longer side
KEPT = 0.9  # Least share of a kept side crack's line in the outline; one left out only begins there
FOUND: dict[PathSource, str] = {
    "ends": "between the given ends",
    "via": "between the given ends, by the given points",
    "automatic": "AUTOMATIC, look whether it is right",
    "choice": "by its number among those found",
    "mask": "as painted",
    "mesh": "along the mouth in the mesh",
    "line": "along the given line",
}
FONT = cv2.FONT_HERSHEY_SIMPLEX


def draw_overlay(photo: Photo, outline: Outline, trajectory: Trajectory | None = None) -> Picture:
    """The photo with walls, centreline, ends, legend, scale bar and nozzle path, (height, width, 3) RGB."""
    picture, scale, unit = _enlarged(photo)

    def placed(points_px: Floats) -> Floats:
        return (points_px + 0.5) * scale - 0.5

    thin = max(1, round(0.7 * unit))
    if photo.face_ring_px is not None:
        _line(picture, placed(photo.face_ring_px), PAPER, thin, closed=True)
    # The ring comes first: where no wall covers it, it shows how the crack was closed at its ends.
    _line(picture, placed(outline.outline_px), ENDS, thin, closed=True)
    for ring_mm in outline.islands_mm:
        _line(picture, placed(photo.to_px(ring_mm)), ENDS, thin, closed=True)
    for line_mm in outline.branches_mm:
        branch = placed(photo.to_px(line_mm))
        kept = np.mean(points_in_poly(line_mm, outline.outline_mm)) > KEPT
        _line(picture, branch, CENTRE, thin) if kept else _dashed(picture, branch, CENTRE, unit)
    for wall_px, colour in ((outline.left_wall_px, LEFT), (outline.right_wall_px, RIGHT)):
        _line(picture, placed(_on_face(photo, wall_px)), colour, thin)
    centreline = placed(outline.centreline_px)
    _line(picture, centreline, CENTRE, thin)
    if trajectory is not None:
        nozzle = placed(photo.to_px(trajectory.position_mm[:, :2]))
        _beads(picture, nozzle[trajectory.giving], unit)
        _arrow(picture, nozzle, outline.mean_width_mm / outline.mm_per_px * scale, unit)
    _mark_ends(picture, centreline, outline, unit)
    taken, shown = placed(outline.outline_px), placed(outline.shown_px)
    _legend(picture, outline, trajectory, taken, shown, unit)
    _scale_bar(picture, outline.mm_per_px / scale, taken, shown, unit)
    return picture


def draw_way(photo: Photo, path: CrackPath) -> Picture:
    """The photo, as large as the overlay, with a path along which no walls could be measured."""
    picture, scale, unit = _enlarged(photo)
    way = (path.points_px + 0.5) * scale - 0.5
    _line(picture, way, CENTRE, max(1, round(1.5 * unit)))
    for point in way[[0, -1]]:
        _dot(picture, point, 3 * unit, ENDS, 4 * unit, PAPER)
    return picture


def draw_cracks(photo: Photo, cracks: Sequence[FoundCrack]) -> Picture:
    """The photo, as large as the overlay, with the cracks among which a choice is due, outlined and numbered."""
    picture, scale, unit = _enlarged(photo)
    for crack in cracks:
        _line(picture, (crack.outline_px + 0.5) * scale - 0.5, ENDS, max(1, round(1.5 * unit)), closed=True)
    for number, crack in enumerate(cracks, 1):
        place = (crack.middle_px + 0.5) * scale - 0.5
        _dot(picture, place, 15 * unit, INK, 17 * unit, PAPER)
        size = 2 * _text_size(str(number), unit)
        _text(picture, place + size * (-0.5, 0.5), str(number), 2 * unit, PAPER)
    return picture


def _enlarged(photo: Photo) -> tuple[Picture, float, float]:
    """A copy to draw on, its scale, and the unit of all marks, a thousandth of its longer side."""
    scale = min(LONGER_SIDE_PX / max(photo.size_px), MOST_ENLARGED)
    how = cv2.INTER_AREA if scale < 1 else cv2.INTER_CUBIC
    picture = np.asarray(cv2.resize(photo.image, None, fx=scale, fy=scale, interpolation=how), dtype=np.uint8)
    return picture, scale, max(picture.shape[:2]) / 1000


def _on_face(photo: Photo, wall_px: Floats) -> Floats:
    """The part of a wall that lies on the face: stations at an open end may reach past it."""
    if photo.face_mm is None:
        return wall_px
    return wall_px[depth_inside(photo.to_mm(wall_px), photo.face_mm) >= 0]


def _mark_ends(picture: Picture, centreline: Floats, outline: Outline, unit: float) -> None:
    """Draw a dot on each end and its name beyond it."""
    first = f"start, s = 0 ({outline.ends[0]} end)"
    last = f"s = {outline.length_mm:.1f} mm ({outline.ends[1]} end)"
    for way, text in ((centreline, first), (centreline[::-1], last)):
        _dot(picture, way[0], 3 * unit, ENDS, 4 * unit, PAPER)
        size = _text_size(text, unit)
        beside = way[0] + toward(way[0] - _along(way, 30 * unit)) * (14 * unit + 0.5 * size)
        half = 0.5 * size + 8 * unit
        limit = np.array(picture.shape[1::-1]) - half
        corner = np.clip(beside, np.minimum(half, limit), limit) - 0.5 * size
        _panel(picture, corner - 4 * unit, corner + size + 4 * unit, INK, 0.65)
        _text(picture, corner + np.array([0, size[1]]), text, unit, PAPER)


def _beads(picture: Picture, given: Floats, unit: float) -> None:
    """Draw beads small enough to show the centreline between them, the first and the last one larger."""
    if len(given) < 2:
        return
    beads = resampled(given, BEADS * unit)
    for number, bead in enumerate(beads):
        size = 2.6 if number in (0, len(beads) - 1) else 1.3
        _dot(picture, bead, max(1, size * unit), NOZZLE, max(2, (size + 0.7) * unit), INK)


def _arrow(picture: Picture, nozzle: Floats, width_px: float, unit: float) -> None:
    """Draw the direction of travel, to the right of the crack near the path's start."""
    reach = 0.05 * float(arc_length(nozzle)[-1])
    tail, head = _along(nozzle, reach), _along(nozzle, reach + 60 * unit)
    step = toward(head - tail)
    aside = np.array([-step[1], step[0]]) * (width_px + 10 * unit)
    for colour, thickness in ((INK, 5 * unit), (PAPER, 2.4 * unit)):
        pen = max(1, round(thickness))
        cv2.arrowedLine(picture, _whole(tail + aside), _whole(head + aside), colour, pen, cv2.LINE_AA, tipLength=0.3)


def _legend(
    picture: Picture, outline: Outline, trajectory: Trajectory | None, taken: Floats, shown: Floats, unit: float
) -> None:
    """Draw the legend in the corner that hides least of the crack."""
    lines: list[tuple[Colour | None, str]] = [
        (None, f"{outline.length_mm:.1f} mm long, {_width(outline)}"),
        (None, f"scale: {outline.scale_source}"),
        (None, f"crack: {FOUND[outline.path_source]}"),
        (CENTRE, "centreline"),
    ]
    if outline.width_source != "none":
        lines += [(LEFT, "left wall"), (RIGHT, "right wall"), (ENDS, "rest of the rim")]
    if trajectory is not None and len(given := trajectory.s_mm[trajectory.giving]):
        verb = "gives" if trajectory.dispensed_mm3 > 0 else "runs"
        lines.append((NOZZLE, f"nozzle, {verb} from s = {given[0]:.1f} to {given[-1]:.1f} mm"))
    pad, row, swatch = 8 * unit, 17 * unit, 30 * unit
    width = max(_text_size(text, unit)[0] + (swatch if colour else 0) for colour, text in lines) + 2 * pad
    size = np.array([width, row * len(lines) + pad])
    low = _free_corner(picture, size, taken, shown, ((0, 0), (1, 0), (0, 1), (1, 1)))
    _panel(picture, low, low + size, PAPER, 0.8)
    for number, (colour, text) in enumerate(lines):
        base = low + np.array([pad, pad / 2 + row * (number + 0.75)])
        if colour is not None:
            start, end = _whole(base, 0, -5 * unit), _whole(base, swatch - 8 * unit, -5 * unit)
            for shade, thickness in ((INK, 4.5 * unit), (colour, 3 * unit)):
                cv2.line(picture, start, end, shade, max(1, round(thickness)), cv2.LINE_AA)
            base = base + np.array([swatch, 0])
        _text(picture, base, text, unit, INK)


def _width(outline: Outline) -> str:
    """The mean width and where it is from."""
    if outline.width_source == "none":
        return "a path alone, without walls"
    said = {"walls": "on average", "fit": "by a fit of its profile", "gauge": "as given"}[outline.width_source]
    interval = "" if outline.width_95_mm is None else " (95 %: {:.2f} to {:.2f})".format(*outline.width_95_mm)
    return f"{outline.mean_width_mm:.2f} mm wide {said}{interval}"


def _scale_bar(picture: Picture, mm_per_px: float, taken: Floats, shown: Floats, unit: float) -> None:
    """Draw the longest round length of at most a fifth of the picture, half black and half white."""
    fitting = [step for step in ROUND_LENGTHS_MM if step <= 0.2 * picture.shape[1] * mm_per_px]
    length_mm = fitting[-1] if fitting else ROUND_LENGTHS_MM[0]
    length, pad, bar = length_mm / mm_per_px, 10 * unit, 5 * unit
    size = np.array([length + 2 * pad, 22 * unit + bar + pad])
    low = _free_corner(picture, size, taken, shown, ((1, 1), (0, 1), (1, 0)))
    _panel(picture, low, low + size, PAPER, 0.8)
    start = low + np.array([pad, size[1] - pad - bar])
    cv2.rectangle(picture, _whole(start), _whole(start, length, bar), INK, -1)
    cv2.rectangle(picture, _whole(start, length / 2, 1), _whole(start, length - 1, bar - 1), PAPER, -1)
    _text(picture, start - np.array([0, 6 * unit]), f"{length_mm} mm", unit, INK)


def _free_corner(
    picture: Picture, size: Floats, taken: Floats, shown: Floats, corners: Sequence[tuple[int, int]]
) -> Floats:
    """Upper left point of a box of that size in the corner of the picture that covers the fewest points.

    A report cuts the part ``shown`` out of the picture. A box of which it would show a piece moves into that part.
    """
    extent = np.array(picture.shape[1::-1])
    low, high = np.clip(shown, 0, extent)

    def hidden(box: Floats) -> int:
        return int(np.sum(np.all((taken >= box) & (taken <= box + size), axis=1)))

    def in_pieces(box: Floats) -> bool:
        whole = bool(np.all((box >= low) & (box + size <= high)))
        return bool(np.all((box < high) & (box + size > low))) and not whole

    boxes = [np.array(corner) * (extent - size) for corner in corners]
    best = min(boxes, key=lambda box: (hidden(box), in_pieces(box)))
    if in_pieces(best):
        inside = [low + np.array(corner) * (high - low - size) for corner in corners]
        best = min((best, *inside), key=lambda box: (hidden(box), in_pieces(box)))
    return best


def _panel(picture: Picture, low: Floats, high: Floats, colour: Colour, opacity: float) -> None:
    (left, top), (right, bottom) = np.maximum(np.rint((low, high)), 0).astype(int)
    window = picture[top:bottom, left:right]
    window[:] = np.rint((1 - opacity) * window + opacity * np.array(colour)).astype(np.uint8)


def _text_size(text: str, unit: float) -> Floats:
    """Width and height; a little more than OpenCV's, which leave out the last letter's overhang."""
    (width, height), _ = cv2.getTextSize(text, FONT, 0.4 * unit, 1)
    return np.array([1.04 * width, height])


def _text(picture: Picture, base: Floats, text: str, unit: float, colour: Colour) -> None:
    cv2.putText(picture, text, _whole(base), FONT, 0.4 * unit, colour, max(1, round(0.5 * unit)), cv2.LINE_AA)


def _line(picture: Picture, points: Floats, colour: Colour, thickness: int, closed: bool = False) -> None:
    fixed = np.rint(points * 2**SUBPIXEL_BITS).astype(np.int32)
    cv2.polylines(picture, [fixed], closed, colour, thickness, cv2.LINE_AA, SUBPIXEL_BITS)


def _dashed(picture: Picture, points: Floats, colour: Colour, unit: float) -> None:
    """Draw a line that is left out, dashed and as thin as possible."""
    dashes = resampled(points, DASH * unit)
    for start in range(0, len(dashes) - 1, 2):
        _line(picture, dashes[start : start + 2], colour, 1)


def _dot(picture: Picture, point: Floats, size: float, colour: Colour, rim: float, rim_colour: Colour) -> None:
    for radius, shade in ((rim, rim_colour), (size, colour)):
        cv2.circle(picture, _whole(point), round(radius), shade, -1, cv2.LINE_AA)


def _along(points: Floats, distance: float) -> Floats:
    s = arc_length(points)
    return at_arc_length(points, s, np.array([min(distance, s[-1])]))[0]


def _whole(point: Floats, right: float = 0, down: float = 0) -> tuple[int, int]:
    return round(float(point[0]) + right), round(float(point[1]) + down)
