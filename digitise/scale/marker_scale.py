"""Find the scale of a photo from printed markers, and print a frame of markers with its table for a trial.

If the markers are above or below the face, the scale is off by that distance divided by the camera's distance.
"""

from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from digitise.geometry.polyline import Box, depth_inside, rectangle
from digitise.image.decoding import Pixels
from digitise.image.raster import Map
from digitise.scale.face_scale import FACE_MM, given_corners, refined_corners, side_lengths
from digitise.scale.view import CORNERS, MIDDLE, Scale, View, find_tilt, fit_markers, places_px
from digitise.settings import Dictionary, FaceSide, Marker, MarkerBoard, PhotoInput
from sealtwin.core.arrays import Floats, lengths, rms
from sealtwin.core.errors import InputError
from sealtwin.core.facts import Facts, doubt
from sealtwin.core.settings import Settings

# Limits of the scale from markers, of the search for markers, and of the check that they are level with the face. Each
# line says what its value is based on. Standard uncertainties are part of the scale's uncertainty. The other limits
# accept or refuse a photo. Stricter limits refuse good boards in coarse photos, and looser limits accept a wrong table.
RESIDUAL_MM = 0.1  # Largest RMS misfit of the markers, twenty times that of a flat board in a sharp photo
RESIDUAL_PX = 0.5  # Largest RMS misfit in coarse photos, whose corners are right to a fraction of a pixel
BOARD_MM = 0.1  # Standard uncertainty of the frame's ruler, or of the longest distance between its markers
PRINT = 0.02  # Standard uncertainty of a print that nothing checks: "fit to page" prints at 93 to 97 %
# Edges of the face are searched for within this fraction of the face's longest side. Markers are farther away
REACH = 0.03
CELL_REACH = 0.7  # Edges of markers are searched for within this many cells. A rough detection is off by less
BENT_MM = 0.5  # Largest deviation of the edges from a rectangle of the face's shape
SIGMAS = 3.0  # Smallest difference in level that is reported, in standard deviations
# Largest height of the markers above or below the face, divided by the camera's distance. A frame on the table beside
# a sample exceeds it
MAX_OFF = 0.05
USUAL_MM = 250.0  # Distance of the camera in a message if the distance is unknown
MIN_MARKERS = 4  # Smallest number of markers for a scale
SEARCH_PX = 1000  # Longer side of the first copy that is searched. Each further copy is twice as large
# Minimum distance of markers, divided by a square's circumference. OpenCV's 0.125 loses 44 of 296 markers
MIN_APART = 0.05
GLANCE_PX = 2000  # Longer side of the copy that is searched for markers without a table
MAX_NAMED = 12  # Largest number of missing markers that a message lists
# Default side of the markers that 'sealtwin markers' prints, and length of its ruler
PRINTED_MM, RULER_MM = 16.0, 100.0
DICTIONARY = {
    "4x4_50": cv2.aruco.DICT_4X4_50,
    "5x5_100": cv2.aruco.DICT_5X5_100,
    "6x6_250": cv2.aruco.DICT_6X6_250,
    "apriltag_36h11": cv2.aruco.DICT_APRILTAG_36H11,
}
# Constants of the printed frame.
PAPERS_MM = {"a4": (210.0, 297.0), "a3": (297.0, 420.0), "letter": (215.9, 279.4)}
UNPRINTED_MM = 6.0  # Margin along the edge of the paper that printers leave blank
WHITE = 0.375  # White margin of a marker as a fraction of its side. Detection needs 1/6, inexact cutting the rest
CUT_GREY, CUT_MM = 191, 0.1  # Line to cut along, too light to be detected as the edge of the face
RULER_THICK_MM, MARK_MM = 0.3, 4.0  # Thickness of the ruler's lines, and length of its marks, one every 10 mm
MIN_FACE_MM, MAX_FACE_MM = 5.0, 400.0  # Smallest and largest side of a frame's opening
LINE_MM = 4.5  # Distance between lines of text
CAPTION_MM = 12.0 + 5 * LINE_MM  # Height of the ruler and five lines of text below the frame
CAPTION_WIDTH_MM = 165.0
TEXT_PT = 8.5  # Height of the font

INSTRUCTIONS = (
    'Print at 100 % ("actual size", not "fit to page"), on matt paper or card, and glue it flat.',
    "Measure the ruler, and add printed_ruler_mm = (its length) to [photo.markers].",
    "Cut out the opening, and lay the frame level with the cracked face, with this text upright in the photo.",
    "Each mm above or below the face changes every length by 1 mm / distance to the camera: 0.33 % at 300 mm.",
)


def scale_by_markers(pixels: Pixels, settings: PhotoInput, board: MarkerBoard, face_mm: Box | None) -> Scale:
    """Return the scale that fits the detected markers.

    Raises InputError if there are too few markers, if one is seen twice, or if they do not fit their positions.
    """
    size_px, file = pixels.size_px, pixels.file
    corners_px = find_markers(pixels, board.dictionary, {marker.id for marker in board.markers})
    markers = [marker for marker in board.markers if marker.id in corners_px]
    seen_px = np.concatenate([corners_px[marker.id] for marker in markers])
    centre_mm = np.mean([(marker.x_mm, marker.y_mm) for marker in board.markers], axis=0)
    share = (board.printed_ruler_mm or RULER_MM) / RULER_MM
    true_mm = centre_mm + share * (np.concatenate([corners_mm(board, marker) for marker in markers]) - centre_mm)
    fit = fit_markers(seen_px, true_mm, size_px, settings.lens == "auto")
    (left, low), (right, high) = true_mm.min(axis=0).tolist(), true_mm.max(axis=0).tolist()
    places = places_px(fit.view, face_mm or (left, low, right, high))
    mm_per_px = float(fit.view.mm_per_px_at(places)[MIDDLE])
    miss_mm = lengths(fit.view.to_mm(seen_px) - true_mm)
    residual_mm = rms(miss_mm)
    if residual_mm > max(RESIDUAL_MM, RESIDUAL_PX * mm_per_px):
        worst = markers[int(np.argmax(miss_mm)) // CORNERS].id
        raise InputError(
            f"{file}: the markers misfit by {residual_mm:.2f} mm (RMS), and marker {worst} misfits most. Check x_mm, "
            "y_mm and size_mm, that the photo is in focus, and that all markers are flat and level with the face. If "
            'lens is "none", set it to "auto".'
        )
    if depth_inside(places, (0, 0, *size_px))[MIDDLE] < 0:
        raise InputError(
            f"{file}: according to the markers, face_mm is outside the photo. Check the markers, and that width and "
            "height of face_mm are not exchanged."
        )
    distance_mm, tilt_deg = find_tilt(fit, places[MIDDLE], pixels.focal_px, settings.camera_distance_mm)
    given_px = given_corners(pixels, settings)
    excess, doubts = check_level(pixels.brightness, fit.view, face_mm, given_px, distance_mm, file)
    printed = PRINT if excess is None and board.printed_ruler_mm is None else 0.0
    if printed:
        unchecked = (
            f"the print of the markers was not checked, so the scale's standard uncertainty includes {PRINT:.0%} for "
            "it. Measure the ruler on the frame and give its length as photo.markers.printed_ruler_mm, even if it is "
            "100 mm"
        )
        doubts += (doubt("scale.print-unchecked", unchecked, PRINT),)
    if missing := [marker.id for marker in board.markers if marker not in markers]:
        doubts = (doubt("scale.markers-missing", f"markers not found: {missing}", len(missing)), *doubts)
    measured_mm = board.printed_ruler_mm or float(np.hypot(high - low, right - left))
    parts = (fit.spread_of_scale(places), BOARD_MM / measured_mm, excess or 0.0, printed)
    lens = ", lens fitted" if fit.view.lens else ""
    return Scale(
        view=fit.view,
        mm_per_px=mm_per_px,
        scale_source=f"{len(markers)} {board.dictionary} markers of {share * board.size_mm:g} mm{lens}",
        scale_residual_mm=residual_mm,
        scale_uncertainty=float(np.linalg.norm(parts)),
        camera_tilt_deg=tilt_deg,
        face_mm=face_mm,
        markers_px=tuple(corners_px[marker.id] for marker in markers),
        warnings=doubts,
    )


def check_level(
    brightness: Map,
    view: View,
    face_mm: Box | None,
    given_px: Floats | None,
    distance_mm: float | None,
    file: Path,
) -> tuple[float | None, Facts]:
    """Compare the size of the face according to the markers with face_mm.

    The edges of the face are detected, or given as corners. Returns by how much the face appears larger than face_mm,
    as a fraction, and warnings. The fraction is 0 if both sizes agree, and None if the edges are not visible. Raises
    InputError if the markers are too far above or below the face.
    """
    away_mm, corners_px = distance_mm or USUAL_MM, given_px
    if face_mm is not None:
        if corners_px is None:
            rough_px = view.to_px(rectangle(face_mm))
            corners_px, _ = refined_corners(brightness, rough_px, REACH * side_lengths(rough_px).max()) or (None, 0)
        if corners_px is not None:
            seen_mm, true_mm = side_lengths(view.to_mm(corners_px)), side_lengths(rectangle(face_mm))
            # The position of a corner is uncertain by a pixel.
            share, px_mm = seen_mm.sum() / true_mm.sum(), view.mm_per_px_at(corners_px).mean()
            if np.abs(seen_mm - share * true_mm).max() <= max(BENT_MM, px_mm) or given_px is not None:
                least = SIGMAS * np.hypot(FACE_MM, px_mm) / np.hypot(*face_mm[2:])
                return _of_size(share - 1, least, face_mm, away_mm, file)
    why = "face_mm is not given" if face_mm is None else "no edges of the face stand out between them"
    text = (
        f"it was not checked whether the markers are level with the face, since {why}. At {away_mm:.0f} mm from the "
        f"camera, each mm above or below the face changes every length by {1 / away_mm:.2%}"
    )
    return None, (doubt("scale.level-unchecked", text),)


def _of_size(grown: float, least: float, face_mm: Box, away_mm: float, file: Path) -> tuple[float, Facts]:
    """Check a face that appears larger than face_mm by the fraction ``grown``.

    Returns the fraction and warnings. A fraction up to ``least`` is measuring error, and 0 is returned. Raises
    InputError if the fraction is too large.
    """
    if abs(grown) <= least:
        return 0.0, ()
    width_mm, height_mm = face_mm[2:]
    comparison = (
        f"according to the markers, the face is {width_mm * (1 + grown):.1f} x {height_mm * (1 + grown):.1f} mm, but "
        f"face_mm is {width_mm:g} x {height_mm:g}, a difference of {abs(grown):.1%}. Possible causes: a print at "
        f"{1 / (1 + grown):.1%} (measure the frame's ruler, photo.markers.printed_ruler_mm), or markers "
        f"{abs(grown) * away_mm:.1f} mm {'below' if grown > 0 else 'above'} the face, {away_mm:.0f} mm from the "
        "camera"
    )
    if abs(grown) > MAX_OFF:
        raise InputError(f"{file}: {comparison}. Correct face_mm or size_mm, or lay the markers level with the face.")
    return grown, (doubt("scale.face-differs", comparison, grown),)


def find_markers(pixels: Pixels, dictionary: str, expected: set[int]) -> dict[int, Floats]:
    """Return the corners of each marker by its id, (4, 2) in px, clockwise from the upper left.

    Raises InputError if fewer than four are found, or if a marker is in the photo more than once.
    """
    clear = {
        number: edge[0]
        for number, quad in _search(pixels, dictionary, expected).items()
        if (edge := refined_corners(pixels.brightness, quad, CELL_REACH * _module_px(quad, dictionary))) is not None
    }
    if len(clear) < MIN_MARKERS:
        raise InputError(
            f"{pixels.file}: found {len(clear)} of {len(expected)} markers of {dictionary}, but at least "
            f"{MIN_MARKERS} are needed (missing: {sorted(expected - set(clear))[:MAX_NAMED]}). Take a sharp photo "
            "that shows the markers, each with white around it, and do not mirror the photo."
        )
    return clear


def seen_markers(pixels: Pixels) -> tuple[str, dict[int, Floats]]:
    """Return the dictionary and the corners, by id, of the markers in a photo without a marker table.

    Returns an empty text and dict if there are fewer than four.
    """
    for dictionary in DICTIONARY:
        numbers = set(dict(_detected(pixels.image, GLANCE_PX, dictionary)))
        if len(numbers) >= MIN_MARKERS:
            with suppress(InputError):
                return dictionary, find_markers(pixels, dictionary, numbers)
    return "", {}


def _detected(image: NDArray[np.uint8], side_px: int, dictionary: str) -> list[tuple[int, Floats]]:
    """Return the ids and rough corners of the markers in a copy of the photo.

    The copy's longer side is at most ``side_px``.
    """
    shrink = min(1.0, side_px / max(image.shape))
    grey = cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
    copy = cv2.resize(grey, None, fx=shrink, fy=shrink, interpolation=cv2.INTER_AREA)
    parameters = cv2.aruco.DetectorParameters()
    parameters.minMarkerDistanceRate = MIN_APART
    corners, ids, _ = cv2.aruco.ArucoDetector(_dictionary(dictionary), parameters).detectMarkers(copy)
    if ids is None:
        return []
    quads = (np.array(corners, float).reshape(-1, 4, 2) + 0.5) / shrink - 0.5
    return [(int(number), quad) for number, quad in zip(ids.ravel(), quads, strict=True)]


def _search(pixels: Pixels, dictionary: str, expected: set[int]) -> dict[int, Floats]:
    """Return the rough corners of the expected markers by id, (4, 2) each in px.

    Larger and larger copies of the photo are searched until all markers are found. Raises InputError if a marker is in
    a copy more than once.
    """
    corners_px: dict[int, Floats] = {}
    for side_px in (SEARCH_PX * 2**step for step in range(10)):
        markers = [marker for marker in _detected(pixels.image, side_px, dictionary) if marker[0] in expected]
        # Squares much smaller or larger than the median are false detections in grain.
        usual_px = np.median([_module_px(quad, dictionary) for _, quad in markers] or [1.0])
        alike = [marker for marker in markers if 0.5 < _module_px(marker[1], dictionary) / usual_px < 2]
        numbers = [number for number, _ in alike]
        if twice := {number for number in numbers if numbers.count(number) > 1}:
            raise InputError(
                f"{pixels.file}: marker {min(twice)} is in the photo more than once. Cover the copy, or remove that "
                "marker from [photo.markers]."
            )
        corners_px |= dict(alike)
        if set(corners_px) == expected or side_px >= max(pixels.size_px):
            break
    return corners_px


def corners_mm(board: MarkerBoard, marker: Marker) -> Floats:
    """Return a marker's corners on the face, (4, 2) in mm: upper left, upper right, lower right, lower left."""
    half = board.size_mm / 2
    return np.array([marker.x_mm, marker.y_mm]) + half * np.array([[-1, 1], [1, 1], [1, -1], [-1, -1]])


def black_modules(board: MarkerBoard, marker: Marker) -> tuple[Floats, list[Floats]]:
    """Return the outline of a marker's black square, and of each white cell inside it, as rings in mm."""
    cells = _dictionary(board.dictionary).markerSize + 2
    bits = cv2.aruco.generateImageMarker(_dictionary(board.dictionary), marker.id, cells)
    outer = corners_mm(board, marker)
    step = board.size_mm / cells
    cell = step * np.array([[0, 0], [1, 0], [1, -1], [0, -1]])
    return outer, [outer[0] + step * np.array([column, -row]) + cell for row, column in np.argwhere(bits > 0)]


def _dictionary(name: str) -> cv2.aruco.Dictionary:
    return cv2.aruco.getPredefinedDictionary(DICTIONARY[name])


def _module_px(quad: Floats, dictionary: str) -> float:
    """Return the side of one cell of a marker, in px. The marker's border is one cell wide."""
    return float(np.linalg.norm(quad[1] - quad[0])) / (_dictionary(dictionary).markerSize + 2)


if TYPE_CHECKING:
    from fpdf import FPDF


class MarkerFrame(Settings):
    """A frame of markers to print. The fields are options of 'sealtwin markers'."""

    face_mm: tuple[FaceSide, FaceSide]
    """Size of the sample's face, which is the opening of the frame."""
    size_mm: float = Field(default=16.0, ge=5, le=200)
    """Side of a marker's black square."""
    dictionary: Dictionary = "4x4_50"
    """Dictionary of the markers: cells across and number of markers, or an AprilTag family."""
    count: Literal["4", "8"] = "8"
    """Number of markers. 4: at the corners of the face. 8: also in the middle of its sides."""
    paper: Literal["a4", "a3", "letter"] = "a4"
    """Size of the paper, portrait or landscape."""


def frame_pdf(face_mm: tuple[float, float], board: MarkerBoard, paper: str) -> bytes:
    """Return the frame as a PDF on a paper of ``PAPERS_MM``, portrait or landscape.

    Raises InputError if the frame does not fit. The PDF is marked so that viewers print it unscaled (ISO 32000-1, 12.2:
    PrintScaling).
    """
    from fpdf import FPDF, ViewerPreferences

    band_mm = board.size_mm * (1 + 2 * WHITE)
    wide_mm, high_mm = np.add(face_mm, 2 * band_mm).tolist()
    needed_mm = np.array([max(wide_mm, CAPTION_WIDTH_MM), high_mm + CAPTION_MM]) + 2 * UNPRINTED_MM
    short_mm, long_mm = PAPERS_MM[paper]
    fitting_mm = [mm for mm in ((short_mm, long_mm), (long_mm, short_mm)) if np.all(needed_mm <= mm)]
    if not fitting_mm:
        raise InputError(
            f"the frame needs {needed_mm[0]:.0f} x {needed_mm[1]:.0f} mm with its ruler, text and unprinted edge, but "
            f"{paper} has {short_mm:g} x {long_mm:g} mm, portrait or landscape. Give a larger --paper or a smaller "
            "--size-mm."
        )
    page = FPDF(unit="mm", format=fitting_mm[0])
    # With a fixed date, the same frame always gives the same file.
    page.set_creation_date(datetime(2026, 1, 1, tzinfo=UTC))
    page.viewer_preferences = ViewerPreferences(print_scaling="None")
    page.add_page()
    page.set_font("Helvetica", size=TEXT_PT)
    # Page coordinates count right and down from the paper's upper left corner. The table counts up from the face's
    # lower left corner.
    left_mm, low_mm = (page.w - face_mm[0]) / 2, UNPRINTED_MM + band_mm + face_mm[1]
    page.set_draw_color(CUT_GREY)
    page.set_line_width(CUT_MM)
    # The line to cut along is just inside the opening, so that it is cut away.
    page.rect(left_mm + CUT_MM / 2, low_mm - face_mm[1] + CUT_MM / 2, face_mm[0] - CUT_MM, face_mm[1] - CUT_MM)
    for marker in board.markers:
        square, cells = black_modules(board, marker)
        for ring_mm, grey in ((square, 0), *((cell, 255) for cell in cells)):
            page.set_fill_color(grey)
            (x, y), (wide, high) = ring_mm[0].tolist(), np.ptp(ring_mm, axis=0).tolist()
            page.rect(left_mm + x, low_mm - y, wide, high, style="F")
    _draw_caption(page, low_mm + band_mm + 8, face_mm, board)
    return bytes(page.output())


def _draw_caption(page: "FPDF", top_mm: float, face_mm: tuple[float, float], board: MarkerBoard) -> None:
    """Draw the ruler and the text below the frame."""
    left_mm = (page.w - CAPTION_WIDTH_MM) / 2
    page.set_fill_color(0)
    page.rect(left_mm, top_mm - RULER_THICK_MM, RULER_MM, RULER_THICK_MM, style="F")
    # The ruler is 100 mm long from the outer edge of its first mark to the outer edge of its last mark.
    for x in np.clip(10.0 * np.arange(11) - RULER_THICK_MM / 2, 0, RULER_MM - RULER_THICK_MM).tolist():
        page.rect(left_mm + x, top_mm - MARK_MM, RULER_THICK_MM, MARK_MM, style="F")
    page.text(left_mm + RULER_MM + 4, top_mm, "This ruler must be 100.0 mm long.")
    title = (
        f"sealtwin markers: {len(board.markers)} of {board.dictionary}, {board.size_mm:g} mm, around a face of "
        f"{face_mm[0]:g} x {face_mm[1]:g} mm"
    )
    for row, text in enumerate((title, *INSTRUCTIONS), 1):
        page.text(left_mm, top_mm + 4 + LINE_MM * row, text)


def board_around(
    face_mm: tuple[float, float], size_mm: float, dictionary: Dictionary, count: int, ruler_mm: float | None = None
) -> MarkerBoard:
    """Return a board with markers at the corners of the face and, if ``count`` is 8, also in the middle of its sides.

    Raises InputError if the markers would touch, or for a face that is too small or too large.
    """
    width, height = face_mm
    off, needed_mm = size_mm * (0.5 + WHITE), size_mm * (1 + WHITE)
    columns, rows = ((-off, side / 2, side + off)[:: 1 if count == 8 else 2] for side in face_mm)
    apart_mm = min(columns[1] - columns[0], rows[1] - rows[0])
    if apart_mm < needed_mm or not all(MIN_FACE_MM <= side <= MAX_FACE_MM for side in face_mm):
        raise InputError(
            f"{count} markers of {size_mm:g} mm around a face of {width:g} x {height:g} mm would be {apart_mm:.1f} mm "
            f"apart. They must be at least {needed_mm:.1f} mm apart, and the sides of the face must be "
            f"{MIN_FACE_MM:g} to {MAX_FACE_MM:g} mm. Give --face-mm as width x height, a smaller --size-mm, or "
            "--count 4."
        )
    places = [(x, y) for y in rows for x in columns if (x, y) != (width / 2, height / 2)]
    markers = tuple(Marker(id=number, x_mm=x, y_mm=y) for number, (x, y) in enumerate(places))
    return MarkerBoard(dictionary=dictionary, size_mm=size_mm, markers=markers, printed_ruler_mm=ruler_mm)


def board_toml(face_mm: tuple[float, float], board: MarkerBoard) -> str:
    """Return the marker table for a trial file, with the size of the face in a comment."""
    rows = [f"  {{ id = {marker.id}, x_mm = {marker.x_mm}, y_mm = {marker.y_mm} }}," for marker in board.markers]
    head = f"# In [photo]: face_mm = {list(face_mm)}\n[photo.markers]"
    size = f'dictionary = "{board.dictionary}"\nsize_mm = {board.size_mm}\nmarkers = ['
    return "\n".join([head, size, *rows, "]", ""])
