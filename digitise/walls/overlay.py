"""Draw a traced crack over its photo for a visual check, and straighten the photo along the crack."""

from collections.abc import Sequence

import cv2
import numpy as np

from digitise.crack_path.candidates import FoundCrack
from digitise.crack_path.hints import CrackPath
from digitise.geometry.polyline import places_beside, resampled
from digitise.geometry.polyline import unit as toward
from digitise.photo import Photo
from digitise.walls.doubts import numbered_walls
from sealtwin.core.arc_length import arc_length, at_arc_length
from sealtwin.core.arrays import Pixels
from sealtwin.core.records import Floats, Outline, Trajectory

Colour = tuple[int, int, int]

# Colours as RGB. Walls and centreline differ in lightness as well as hue, for colour-blind readers.
LEFT, RIGHT, CENTRE = (0, 222, 160), (60, 170, 255), (250, 235, 60)
ENDS, INK, PAPER = (255, 90, 20), (24, 24, 24), (255, 255, 255)
NOZZLE = (200, 120, 255)
BEADS = 11.0  # Spacing of the dots of the nozzle's path, in thousandths of the picture's longer side
LONGER_SIDE_PX = 2400  # Longer side of the picture, unless the photo is enlarged by more than ``MAX_ENLARGED`` for it
MAX_ENLARGED = 4.0
ROUND_LENGTHS_MM = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)
SUBPIXEL_BITS = 4
STRAIGHT_AROUND = 1.5  # Half the height of the straightened picture, in mean widths of the crack
MAX_STRAIGHT_PX = 1400  # Largest length of the straightened picture. A report shows it with a length of 800 px
DASH = 5.0  # Length of a dash and of the gap after it, in thousandths of the picture's longer side
FONT = cv2.FONT_HERSHEY_SIMPLEX


class Canvas:
    """A copy of a photo to draw on, RGB. Positions are in its pixels, and sizes in thousandths of its longer side.

    If ``shown_px`` is given, only this box is copied, (2, 2). It is white outside the photo.
    """

    def __init__(self, photo: Photo, shown_px: Floats | None = None) -> None:
        box_px = np.array([(0, 0), photo.size_px] if shown_px is None else np.rint(shown_px), int)
        (left, top), (right, bottom) = self.corner_px, _ = box_px
        before, after = np.maximum(-box_px[0], 0), np.maximum(box_px[1] - photo.size_px, 0)
        part = photo.image[max(top, 0) : bottom, max(left, 0) : right]
        part = np.pad(part, (*zip(before[::-1], after[::-1], strict=True), (0, 0)), constant_values=255)
        self.scale: float = min(LONGER_SIDE_PX / max(part.shape), MAX_ENLARGED)
        interpolation = cv2.INTER_AREA if self.scale < 1 else cv2.INTER_CUBIC
        picture = cv2.resize(part, None, fx=self.scale, fy=self.scale, interpolation=interpolation)
        self.picture: Pixels = np.asarray(picture, np.uint8)
        self.unit: float = max(self.picture.shape[:2]) / 1000
        self.extent = np.array(self.picture.shape[1::-1])

    def to_copy_px(self, points_px: Floats) -> Floats:
        """Map pixels of the photo to pixels of the copy, (..., 2)."""
        return (points_px - self.corner_px + 0.5) * self.scale - 0.5

    def line(
        self, points_px: Floats, colour: Colour, size: float = 0.7, closed: bool = False, dashed: bool = False
    ) -> None:
        """Draw a line through points in pixels of the photo. A dashed line is as thin as possible."""
        lines = [self.to_copy_px(points_px)]
        if dashed:
            dashes, size = resampled(lines[0], DASH * self.unit), 0
            lines = [dashes[start : start + 2] for start in range(0, len(dashes) - 1, 2)]
        fixed, pen = [np.rint(line * 2**SUBPIXEL_BITS).astype(np.int32) for line in lines], round(size * self.unit)
        cv2.polylines(self.picture, fixed, closed, colour, max(1, pen), cv2.LINE_AA, SUBPIXEL_BITS)

    def dot(self, point: Floats, size: float, colour: Colour, rim: Colour) -> None:
        """Draw a disc with radius ``size`` on a slightly larger disc in the colour ``rim``."""
        for radius, shade in ((size + 0.8, rim), (size, colour)):
            cv2.circle(
                self.picture,
                np.rint(point).astype(int).tolist(),
                max(1, round(radius * self.unit)),
                shade,
                -1,
                cv2.LINE_AA,
            )

    def number(self, middle_px: Floats, number: int) -> None:
        """Draw a number on a disc, whose middle is in pixels of the photo."""
        middle, text = self.to_copy_px(middle_px), str(number)
        self.dot(middle, 15, INK, PAPER)
        self.text(middle + 2 * self.text_size(text) * (-0.5, 0.5), text, PAPER, 2)

    def panel(self, low: Floats, high: Floats, colour: Colour, opacity: float) -> None:
        (left, top), (right, bottom) = np.maximum(np.rint((low, high)), 0).astype(int)
        window = self.picture[top:bottom, left:right]
        window[:] = np.rint((1 - opacity) * window + opacity * np.array(colour)).astype(np.uint8)

    def text(self, base: Floats, text: str, colour: Colour, times: float = 1) -> None:
        size, pen = 0.4 * times * self.unit, max(1, round(0.5 * times * self.unit))
        cv2.putText(self.picture, text, np.rint(base).astype(int).tolist(), FONT, size, colour, pen, cv2.LINE_AA)

    def text_size(self, text: str) -> Floats:
        """Return width and height of a text, (2,), with 4 % added to OpenCV's width, which is too small."""
        (width, height), _ = cv2.getTextSize(text, FONT, 0.4 * self.unit, 1)
        return np.array([1.04 * width, height])


def draw_overlay(photo: Photo, outline: Outline, trajectory: Trajectory | None = None) -> Pixels:
    """Return the photo around the crack with walls, centreline, ends and nozzle path, (height, width, 3) RGB.

    A strip below the photo has the legend and a scale bar.
    """
    canvas = Canvas(photo, outline.shown_px)
    if photo.face_ring_px is not None:
        canvas.line(photo.face_ring_px, PAPER, closed=True)
    # The ring comes first. Walls cover it except at the ends, where it shows how the crack was closed.
    for ring_px in (outline.outline_px, *map(photo.to_px, outline.islands_mm)):
        canvas.line(ring_px, ENDS, closed=True)
    for line_mm in outline.branches_mm:
        canvas.line(photo.to_px(line_mm), CENTRE, dashed=not outline.branches_kept)
    for ring_mm in outline.bands_mm:
        canvas.line(photo.to_px(np.vstack([ring_mm, ring_mm[:1]])), ENDS, dashed=True)
    canvas.line(outline.left_wall_px, LEFT)
    canvas.line(outline.right_wall_px, RIGHT)
    canvas.line(outline.centreline_px, CENTRE)
    if trajectory is not None:
        nozzle = canvas.to_copy_px(photo.to_px(trajectory.position_mm[:, :2]))
        # The dots are small, so that the centreline is visible between them.
        path_px = nozzle[trajectory.giving]
        for bead in resampled(path_px, BEADS * canvas.unit) if len(path_px) > 1 else ():
            canvas.dot(bead, 1.6, NOZZLE, INK)
    for number, wall_mm in enumerate(numbered_walls(outline), 1):
        canvas.number(photo.to_px(wall_mm[len(wall_mm) // 3]), number)
    _mark_ends(canvas, outline)
    _add_legend(canvas, outline, trajectory)
    return canvas.picture


def draw_way(photo: Photo, path: CrackPath) -> Pixels:
    """Return the photo with a path without walls, in the overlay's size, (height, width, 3) RGB."""
    canvas = Canvas(photo)
    canvas.line(path.points_px, CENTRE, 1.5)
    for point in canvas.to_copy_px(path.points_px[[0, -1]]):
        canvas.dot(point, 3, ENDS, PAPER)
    return canvas.picture


def draw_cracks(photo: Photo, cracks: Sequence[FoundCrack], refused_px: Floats | None = None) -> Pixels:
    """Return the photo with the competing cracks outlined and numbered, in the overlay's size, as RGB.

    ``refused_px`` is a path between clicked ends that was refused, (n, 2).
    """
    canvas = Canvas(photo)
    if refused_px is not None:
        canvas.line(refused_px, CENTRE, 1.5)
    for crack in cracks:
        canvas.line(crack.outline_px, ENDS, 1.5, closed=True)
    for number, crack in enumerate(cracks, 1):
        canvas.number(crack.middle_px, number)
    return canvas.picture


def _mark_ends(canvas: Canvas, outline: Outline) -> None:
    """Draw a dot on each end of the crack, and a label beyond the dot."""
    unit, centreline = canvas.unit, canvas.to_copy_px(outline.centreline_px)
    first = f"start, s = 0 ({outline.ends[0]} end)"
    last = f"s = {outline.length_mm:.1f} mm ({outline.ends[1]} end)"
    for way, text in ((centreline, first), (centreline[::-1], last)):
        canvas.dot(way[0], 3, ENDS, PAPER)
        half = 0.5 * canvas.text_size(text)
        behind = at_arc_length(way, arc_length(way), np.array([30 * unit]))[0]
        corner = way[0] + toward(way[0] - behind) * (14 * unit + half) - half
        canvas.panel(corner - 4 * unit, corner + 2 * half + 4 * unit, INK, 0.65)
        canvas.text(corner + half * (0, 2), text, PAPER)


def _add_legend(canvas: Canvas, outline: Outline, trajectory: Trajectory | None) -> None:
    """Add a strip with the legend below the picture."""
    unit = canvas.unit
    pad, row, swatch = 8 * unit, 17 * unit, 60 * unit
    mm = canvas.scale / outline.mm_per_px
    length_mm = max((step for step in ROUND_LENGTHS_MM if step * mm < swatch - pad), default=ROUND_LENGTHS_MM[0])
    lines: list[tuple[Colour | None, str]] = [
        (None, f"{outline.length_mm:.1f} mm long, mean width {outline.main_figures['mean width']}"),
        (None, f"scale: {outline.scale_source}"),
        (INK, f"{length_mm} mm"),
        (CENTRE, "centreline"),
    ]
    if outline.width_source != "none":
        lines += [(LEFT, "left wall"), (RIGHT, "right wall"), (ENDS, "rest of the rim")]
    if outline.bands_mm:
        lines.append((ENDS, "dashed: crack or ground, photo.wall = 1 or 2"))
    if trajectory is not None and len(pour_s_mm := trajectory.s_mm[trajectory.giving]):
        lines.append((NOZZLE, f"nozzle, from s = {pour_s_mm[0]:.1f} to {pour_s_mm[-1]:.1f} mm"))
    canvas.picture = np.pad(canvas.picture, ((0, round(row * len(lines) + pad)), (0, 0), (0, 0)), constant_values=255)
    x, y = pad, canvas.extent[1] + row
    for colour, text in lines:
        width = canvas.text_size(text)[0] + (swatch if colour else 0)
        if x + width > canvas.extent[0]:
            x, y = pad, y + row
        base = np.array([x, y])
        x += width + 3 * pad
        if colour is not None:
            bar = length_mm * mm if colour == INK else swatch - pad
            canvas.panel(base - (0, 7 * unit), np.add(base, (bar, -3 * unit)), colour, 1)
            base[0] += swatch
        canvas.text(base, text, INK)
    canvas.picture = canvas.picture[: round(y + pad)]


def straight_view(photo: Photo, outline: Outline) -> Pixels:
    """Return the photo straightened along the crack, (height, width, 3) RGB.

    s increases to the right, from 0 in the first column to the crack's length in the last column. The centreline is at
    half height, and the left side of the crack is up. A pixel has the same size along and across. Areas outside the
    photo are white.
    """
    mm_per_px = max(photo.mm_per_px, outline.length_mm / (MAX_STRAIGHT_PX - 1))
    columns = max(2, 1 + round(outline.length_mm / mm_per_px))
    s_mm = np.linspace(0.0, outline.length_mm, columns)
    half_px = max(1, round(STRAIGHT_AROUND * outline.mean_width_mm / mm_per_px))
    across_mm = np.arange(half_px, -half_px - 1, -1) * (s_mm[1] - s_mm[0])
    places_mm = places_beside(at_arc_length(outline.centreline_mm, outline.s_mm, s_mm), across_mm)
    x, y = np.moveaxis(photo.to_px(places_mm).astype(np.float32), 2, 0)
    straight = cv2.remap(photo.image, x.T, y.T, cv2.INTER_LINEAR, None, cv2.BORDER_CONSTANT, (255,) * 3)
    return np.asarray(straight, np.uint8)
