"""Find printed markers in a photo, and the scale that they give.

If the markers are above or below the face, the scale is off by that distance divided by the camera's distance.
"""

from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from digitise.geometry.polyline import Box, depth_inside, rectangle
from digitise.image.decoding import Pixels
from digitise.image.raster import Map
from digitise.scale.corners import fit_line_to_most, light_across, quadrilateral, refined_corners
from digitise.scale.face_scale import FACE_MM, given_corners
from digitise.scale.view import MIDDLE, Fit, Scale, View, find_pose, fit_view, places_px
from digitise.settings import Marker, MarkerBoard, PhotoInput
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats


@dataclass(frozen=True)
class MarkerLimits:
    """Limits of the scale by markers, of the search for them, and of the check that they are level with the face.

    Each line states what its value rests on. Standard uncertainties are part of the scale's uncertainty. The other
    fields accept or refuse a photo: stricter ones refuse sound boards in coarse photos, looser ones accept a wrong
    table.
    """

    residual_mm: float = 0.1  # Largest RMS misfit of the markers, twenty times that of a flat board in a sharp photo
    residual_px: float = 0.5  # Largest RMS misfit in coarse photos, whose corners are good to a fraction of a pixel
    lens_sigmas: float = 2.0  # Smallest distortion of a lens that is fitted, in standard deviations (decision 0030)
    board_mm: float = 0.1  # Standard uncertainty of the longest distance between markers, by caliper on the frame
    corners: int = 4  # Corners of a marker
    reach: float = 0.04  # Range around their place by the markers in which the face's edges are searched, of its length
    least_reach_px: float = 10.0  # Least such range
    step_px: float = 0.5  # Spacing of samples across an edge
    rows: int = 200  # Samples along each edge, some of which a crack spoils
    unlike: float = 0.2  # Least relative difference in light beyond the edge: thrice the grain's, averaged along it
    steepest_px: float = 1.5  # Range beyond the first unlike sample in which light is steepest: a narrow shadow's width
    straight_px: float = 1.0  # Distance from an edge's line beyond which a point is an outlier
    bent_mm: float = 0.5  # Largest deviation of the edges from a rectangle of the face's shape
    edge_px: float = 1.0  # Standard uncertainty of a corner of the face in the photo
    sigmas: float = 3.0  # Smallest difference in level that is reported, in standard deviations
    most: float = 0.05  # Largest offset over the camera's distance; more is a frame on the table beside a sample
    min_markers: int = 4  # Fewest markers for a scale
    search_px: int = 1000  # Longer side of the first copy that is searched; each next one has twice that
    least_apart: float = 0.05  # Distance of markers over a square's circumference; OpenCV's 0.125 loses 44 of 296
    glance_px: int = 2000  # Longer side of the copy that is searched for markers of which no table is given
    printed_mm: float = 16.0  # Side of the markers that 'sealtwin markers' prints by default
    most_off: float = 0.01  # Largest difference of two scales that agree
    most_named: int = 12  # Most missing markers that a message lists


LIMITS = MarkerLimits()
DICTIONARY = {
    "4x4_50": cv2.aruco.DICT_4X4_50,
    "5x5_100": cv2.aruco.DICT_5X5_100,
    "6x6_250": cv2.aruco.DICT_6X6_250,
    "apriltag_36h11": cv2.aruco.DICT_APRILTAG_36H11,
}


def scale_by_markers(pixels: Pixels, settings: PhotoInput, board: MarkerBoard, face_mm: Box | None) -> Scale:
    """Fit the scale to the detected markers. Raises InputError if they are too few, double, or misplaced."""
    size_px, file = pixels.size_px, pixels.file
    corners_px = find_markers(pixels.image, pixels.brightness, board, file)
    markers = [marker for marker in board.markers if marker.id in corners_px]
    seen_px = np.concatenate([corners_px[marker.id] for marker in markers])
    true_mm = np.concatenate([corners_mm(board, marker) for marker in markers])
    fit, covariance = fit_markers(seen_px, true_mm, size_px, settings.lens == "auto")
    view = fit.view
    miss_mm = np.linalg.norm(view.to_mm(seen_px) - true_mm, axis=1)
    residual_mm = float(np.sqrt(np.mean(miss_mm**2)))
    places = places_px(view, size_px, face_mm)
    mm_per_px = float(view.mm_per_px_at(places)[MIDDLE])
    limit_mm = max(LIMITS.residual_mm, LIMITS.residual_px * mm_per_px)
    if residual_mm > limit_mm:
        worst = markers[int(np.argmax(miss_mm)) // LIMITS.corners].id
        raise InputError(
            f"{file}: markers misfit by {residual_mm:.2f} mm (limit {limit_mm:.2f}); worst: marker {worst}. "
            f"Check x_mm, y_mm and size_mm, and that all markers are flat and level with the face"
            f"{'; or set lens to auto' if settings.lens == 'none' else ''}."
        )
    if face_mm is not None and depth_inside(places, (0, 0, *size_px))[MIDDLE] < 0:
        raise InputError(f"{file}: according to the markers, face_mm is outside the photo: check them and face_mm.")
    middle_mm = view.to_mm(places)[MIDDLE]
    distance_mm, tilt_deg = find_pose(fit, covariance, middle_mm, pixels.focal_px, settings.camera_distance_mm)
    given_px = given_corners(pixels, settings)
    excess, doubts = check_level(pixels.brightness, view, face_mm, given_px, distance_mm, file)
    missing = [str(marker.id) for marker in board.markers if marker.id not in corners_px]
    lens = ", lens fitted" if view.lens else ""
    span_mm, spread = float(np.linalg.norm(np.ptp(true_mm, axis=0))), fit.spread_of_scale(places, covariance)
    return Scale(
        view=view,
        mm_per_px=mm_per_px,
        scale_source=f"{len(markers)} {board.dictionary} markers of {board.size_mm:g} mm{lens}",
        scale_residual_mm=residual_mm,
        scale_uncertainty=float(np.linalg.norm([spread, LIMITS.board_mm / span_mm, excess])),
        camera_tilt_deg=tilt_deg,
        face_mm=face_mm,
        markers_px=tuple(corners_px[marker.id] for marker in markers),
        warnings=((f"markers not found: {', '.join(missing)}",) if missing else ()) + doubts,
    )


def fit_markers(seen_px: Floats, true_mm: Floats, size_px: tuple[int, int], lens_wanted: bool) -> tuple[Fit, Floats]:
    """Fit a view to the corners of markers, with a lens if they show one. Return the fit and its covariance."""
    if lens_wanted:
        bent = fit_view(seen_px, true_mm, size_px, lens=True)
        covariance = bent.covariance_by_group(LIMITS.corners)
        lens = bent.view.lens
        folds_outside = lens is None or lens.reach_px > np.linalg.norm(size_px) / 2
        if folds_outside and abs(bent.parameters[-1]) > LIMITS.lens_sigmas * np.sqrt(covariance[-1, -1]):
            return bent, covariance
    plain = fit_view(seen_px, true_mm, size_px, lens=False)
    return plain, plain.covariance_by_group(LIMITS.corners)


def check_level(
    brightness: Map, view: View, face_mm: Box | None, given_px: Floats | None, distance_mm: float | None, file: Path
) -> tuple[float, tuple[str, ...]]:
    """Compare the face's edges, detected or given as corners, with their place according to the markers.

    Returns by what share the face, measured in the markers' plane, is larger than face_mm, and warnings. The share is 0
    if the edges are not visible or agree. Raises InputError if the markers are too far from level with the face.
    """
    corners_px = given_px
    if corners_px is None and face_mm is not None:
        corners_px = _face_near(brightness, view.to_px(rectangle(face_mm)))
    if corners_px is None or face_mm is None:
        return 0.0, (_rule(distance_mm, face_mm is None),)
    grown, bent_mm = _grown(view.to_mm(corners_px), rectangle(face_mm))
    px_mm = float(view.mm_per_px_at(corners_px).mean())
    if given_px is None and bent_mm > max(LIMITS.bent_mm, LIMITS.edge_px * px_mm):
        return 0.0, (_rule(distance_mm, False),)
    width_mm, height_mm = face_mm[2:]
    if abs(grown) <= LIMITS.sigmas * np.hypot(FACE_MM, LIMITS.edge_px * px_mm) / np.hypot(width_mm, height_mm):
        return 0.0, ()
    comparison = (
        f"according to the markers, the face is {width_mm * (1 + grown):.1f} x {height_mm * (1 + grown):.1f} mm, but "
        f"face_mm is {width_mm:g} x {height_mm:g}"
    )
    side = "below" if grown > 0 else "above"
    cause = f"markers {side} the face"
    if distance_mm is not None:
        cause = f"markers {abs(grown) * distance_mm:.1f} mm {side} the face, {distance_mm:.0f} mm from the camera,"
    if abs(grown) > LIMITS.most:
        raise InputError(
            f"{file}: {comparison}. Correct face_mm or size_mm, or lay the markers level with the face: {cause} "
            "would cause this."
        )
    return grown, (f"{comparison}, a difference of {abs(grown):.1%}: {cause} would cause this",)


def _rule(distance_mm: float | None, unmeasured: bool) -> str:
    cost = "0.4 % of every length at 250 mm from the camera"
    if distance_mm is not None:
        cost = f"{1 / distance_mm:.2%} of every length at {distance_mm:.0f} mm from the camera"
    why = "since face_mm is not given" if unmeasured else "since no edges stand out along the opening between them"
    return f"the markers' level was not checked, {why}: each mm above or below the measured face is an error of {cost}"


def _grown(seen_mm: Floats, true_mm: Floats) -> tuple[float, float]:
    """Fit a similarity: return its factor, less 1, and the largest distance of a corner from it, in mm."""
    measured, true = (points - points.mean(axis=0) for points in (seen_mm, true_mm))
    seen_z, true_z = (points[:, 0] + 1j * points[:, 1] for points in (measured, true))
    factor = np.vdot(true_z, seen_z) / np.vdot(true_z, true_z)
    return float(abs(factor)) - 1, float(np.abs(seen_z - factor * true_z).max())


def _face_near(brightness: Map, rough_px: Floats) -> Floats | None:
    """Find the corners of a face within ``LIMITS.reach`` of rough ones, (4, 2); None if an edge is not visible."""
    longest_px = float(np.linalg.norm(np.roll(rough_px, -1, axis=0) - rough_px, axis=1).max())
    reach_px = max(LIMITS.least_reach_px, LIMITS.reach * longest_px)
    edges = [edge for side in range(4) if (edge := _inner_edge(brightness, rough_px, side, reach_px)) is not None]
    return quadrilateral(edges) if len(edges) == 4 else None


def _inner_edge(brightness: Map, rough_px: Floats, side: int, reach_px: float) -> Floats | None:
    """Fit a line to the edge of the face: to the nearest points outward whose brightness differs from the face's.

    Return a point and a direction.
    """
    offset = np.arange(-reach_px, reach_px + LIMITS.step_px, LIMITS.step_px)
    share = np.linspace(0.06, 0.94, LIMITS.rows)
    foot, outward, light = light_across(brightness, rough_px, side, share, offset, cv2.BORDER_CONSTANT)
    # Neighbouring rows share the edge, but not their grain.
    light = np.asarray(cv2.blur(light, (3, 9)), dtype=float)
    count = len(offset)
    # Row by row, since stains and light vary along the edge.
    of_face = np.median(light[:, : count // 4], axis=1, keepdims=True)
    unlike = np.abs(light - of_face) > LIMITS.unlike * of_face
    lasting = unlike[:, :-2] & unlike[:, 1:-1] & unlike[:, 2:]
    lasting[:, : count // 8] = False
    first = lasting.argmax(axis=1)
    row = np.flatnonzero(first > 0)
    if len(row) < LIMITS.rows // 2:
        return None
    slope = np.abs(np.gradient(light, axis=1))
    near = np.arange(-round(2 * LIMITS.steepest_px / LIMITS.step_px), round(LIMITS.steepest_px / LIMITS.step_px) + 1)
    column = np.clip(first[row][:, None] + near, 1, count - 2)
    peak = column[np.arange(len(row)), slope[row[:, None], column].argmax(axis=1)]
    across = offset[peak]
    aside = np.abs(across - np.median(across))
    usual = aside <= max(2 * LIMITS.straight_px, 3 * float(np.median(aside)))
    return fit_line_to_most(foot[row[usual]] + across[usual, None] * outward, LIMITS.straight_px)[0]


def find_markers(image: NDArray[np.uint8], brightness: Map, board: MarkerBoard, file: Path) -> dict[int, Floats]:
    """Find markers by id: corners in px, (4, 2), clockwise from the upper left. Raises InputError if under four."""
    expected = {marker.id for marker in board.markers}
    rough = _search(np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), dtype=np.uint8), board, expected, file)
    cells = _dictionary(board).markerSize + 2
    refined = {
        number: refined_corners(brightness, quad, float(np.linalg.norm(quad[1] - quad[0])) / cells)
        for number, quad in rough.items()
    }
    clear = {number: quad for number, quad in refined.items() if quad is not None}
    if len(clear) < LIMITS.min_markers:
        raise InputError(
            f"{file}: found {len(clear)} of {len(expected)} markers of {board.dictionary}; {LIMITS.min_markers} are "
            f"needed (missing {_listed(expected - set(clear))}). Take a sharp photo that shows them, with white "
            "around each."
        )
    return clear


def unused_markers(pixels: Pixels, mm_per_px: float, given: str) -> tuple[str, ...]:
    """Return a warning if the photo shows markers, and its scale was ``given`` in another way.

    The size of these markers is unknown. The warning states the size that the given scale implies, and the scale that
    the size printed by default implies.
    """
    small = _at_most(pixels.image, LIMITS.glance_px)
    for dictionary in DICTIONARY:
        ids = _detector(cv2.aruco.getPredefinedDictionary(DICTIONARY[dictionary])).detectMarkers(small)[1]
        numbers = set() if ids is None else {int(number) for number in np.ravel(ids)}
        if len(numbers) < LIMITS.min_markers:
            continue
        places = tuple(Marker(id=number, x_mm=0, y_mm=0) for number in sorted(numbers))
        try:
            content = {"dictionary": dictionary, "size_mm": LIMITS.printed_mm, "markers": places}
            board = MarkerBoard.model_validate(content)
            corners_px = find_markers(pixels.image, pixels.brightness, board, pixels.file)
        except InputError:
            continue
        side_px = float(
            np.median([np.linalg.norm(quad - np.roll(quad, 1, axis=0), axis=1).mean() for quad in corners_px.values()])
        )
        by_markers, off = LIMITS.printed_mm / side_px, LIMITS.printed_mm / side_px / mm_per_px - 1
        side = "above" if off > 0 else "below"
        comparison = (
            f"the photo shows {len(corners_px)} markers of {dictionary}: if they are {LIMITS.printed_mm:g} mm wide, as "
            f"printed by default, the scale is {by_markers:.4g} mm/px, {abs(off):.1%} {side} {given}"
        )
        if abs(off) <= LIMITS.most_off:
            return (f"{comparison}; give [photo.markers] instead to correct for the camera's tilt as well",)
        return (
            f"{comparison}. With this scale they are {side_px * mm_per_px:.1f} mm wide: measure one, and correct the "
            "scale or give [photo.markers] instead",
        )
    return ()


def _detector(dictionary: cv2.aruco.Dictionary) -> cv2.aruco.ArucoDetector:
    how = cv2.aruco.DetectorParameters()
    how.minMarkerDistanceRate = LIMITS.least_apart
    return cv2.aruco.ArucoDetector(dictionary, how)


def _at_most(image: NDArray[np.uint8], longest_px: int) -> NDArray[np.uint8]:
    grey = np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), dtype=np.uint8)
    shrink = longest_px / max(grey.shape)
    if shrink >= 1:
        return grey
    return np.asarray(cv2.resize(grey, None, fx=shrink, fy=shrink, interpolation=cv2.INTER_AREA), dtype=np.uint8)


def _search(grey: NDArray[np.uint8], board: MarkerBoard, expected: set[int], file: Path) -> dict[int, Floats]:
    """Find rough corners of the expected markers in ever larger copies of the photo, until all are found."""
    detector = _detector(_dictionary(board))
    longest = max(grey.shape)
    corners_px: dict[int, Floats] = {}
    copies_px = [side_px for step in range(10) if (side_px := LIMITS.search_px * 2**step) < longest]
    for side_px in (*copies_px, longest):
        shrink = side_px / longest
        copy = grey if shrink == 1 else cv2.resize(grey, None, fx=shrink, fy=shrink, interpolation=cv2.INTER_AREA)
        corners, ids, _ = detector.detectMarkers(copy)
        numbers = [] if ids is None else [int(number) for number in np.ravel(ids)]
        quads = [(np.reshape(quad, (4, 2)).astype(float) + 0.5) / shrink - 0.5 for quad in corners]
        candidates = [(number, quad) for number, quad in zip(numbers, quads, strict=True) if number in expected]
        # Squares much smaller or larger than the median are false detections in grain.
        sides_px = [float(np.linalg.norm(quad[1] - quad[0])) for _, quad in candidates]
        usual_px = float(np.median(sides_px)) if candidates else 0.0
        alike = [marker for marker, px in zip(candidates, sides_px, strict=True) if usual_px / 2 < px < 2 * usual_px]
        if twice := {number for number, times in Counter(number for number, _ in alike).items() if times > 1}:
            raise InputError(
                f"{file}: marker {_listed(twice)} is in the photo more than once; cover the copy, or remove that "
                "marker from [photo.markers]."
            )
        corners_px |= dict(alike)
        if set(corners_px) == expected:
            break
    return corners_px


def corners_mm(board: MarkerBoard, marker: Marker) -> Floats:
    """Return the corners on the face, (4, 2): upper left, upper right, lower right, lower left."""
    half = board.size_mm / 2
    return np.array([marker.x_mm, marker.y_mm]) + half * np.array([[-1, 1], [1, 1], [1, -1], [-1, -1]])


def black_modules(board: MarkerBoard, marker: Marker) -> tuple[Floats, list[Floats]]:
    """Return rings in mm: the black square of a marker, and the white cells inside it."""
    cells = _dictionary(board).markerSize + 2
    bits = cv2.aruco.generateImageMarker(_dictionary(board), marker.id, cells)
    outer = corners_mm(board, marker)
    step = board.size_mm / cells
    cell = step * np.array([[0, 0], [1, 0], [1, -1], [0, -1]])
    return outer, [outer[0] + step * np.array([column, -row]) + cell for row, column in np.argwhere(bits > 0)]


def _dictionary(board: MarkerBoard) -> cv2.aruco.Dictionary:
    return cv2.aruco.getPredefinedDictionary(DICTIONARY[board.dictionary])


def _listed(numbers: set[int]) -> str:
    listed = ", ".join(str(number) for number in sorted(numbers)[: LIMITS.most_named])
    return listed if len(numbers) <= LIMITS.most_named else f"{listed} and {len(numbers) - LIMITS.most_named} more"
