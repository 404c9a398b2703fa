"""Find the crack in a photo: the darkest way between two given ends, or the most crack-like line there is."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, maximum_filter
from skimage.graph import MCP_Geometric

from digitise.beside import unlike_length_px
from digitise.darkness import DarkMap, map_darkness
from digitise.face import see_face
from digitise.photo import Photo
from digitise.polyline import depth_inside
from digitise.settings import Pixel
from digitise.skeleton import longest_lines
from sealtwin.errors import InputError
from sealtwin.records import Floats, Integers, arc_length

THIN_PX = 6.0
"""On the search map: thinner cracks are told by their shape as lines, wider ones by their darkness."""
LEAST_DARKNESS = 0.2
"""Of a crack's middle, relative to the mortar beside it: stains and shadows stay below."""
SNAP_PX = 15.0
"""How far an end may be clicked beside its crack, in the photo; or one crack width, if that is more."""
SURE_RIDGE = 5.0
"""In noise units: a line this strong is a crack even where the search map is too coarse to show how dark it is."""
MOST_GAPS = 0.2
"""Share of the path that may be as bright as mortar."""
EDGES_SEEN = (
    "the crack was searched for inside the edges of the sample, which the photo shows; "
    "give face_mm, its size, to have the crack open where it meets them"
)
EDGE_WIDTHS, EDGE_SHARE = 3.0, 0.05
"""In widths and in shares of the line: a stretch with unlike sides that is longer than both is told of."""
RUNNER_UP = 0.5
"""A second line with more than this share of the first one's score makes the choice the user's."""


@dataclass(frozen=True)
class CrackPath:
    """A rough way along the crack, inside it."""

    points_px: Floats
    """(n, 2), from the first end."""
    width_px: float
    """Typical width of the crack along it."""
    source: Literal["ends", "automatic"]
    warnings: tuple[str, ...] = ()


def find_path(photo: Photo, ends_px: tuple[Pixel, Pixel] | None) -> CrackPath:
    """Between the given ends, in their order; without ends, along the one crack that stands out, from left to right.

    Raises InputError where an end is outside the photo or on no crack, where no crack is found or two compete.
    """
    if ends_px is None:
        return _automatic(photo)
    _check_ends(photo, ends_px)
    return _between(photo, np.array(ends_px, dtype=float), map_darkness(photo, _window(photo, ends_px)), "ends")


def _between(photo: Photo, ends_px: Floats, field: DarkMap, source: Literal["ends", "automatic"]) -> CrackPath:
    start, end = ((int(row), int(column)) for row, column in _on_map(field, ends_px))
    # Cost B, of wide cracks, finds any path well enough to tell how wide the crack is.
    cells = _cheapest(_cost_of_wide(field), start, end)
    darkness, width = _measure(field, cells)
    if width < THIN_PX:
        cells = _cheapest(_cost_of_thin(field), start, end)
        darkness, width = _measure(field, cells)
    if darkness < LEAST_DARKNESS and np.median(field.ridge[tuple(cells.T)]) < SURE_RIDGE:
        raise InputError(
            f"{photo.file}: no crack between the ends: the way there is only {darkness:.0%} darker than around it "
            f"(a crack is at least {LEAST_DARKNESS:.0%}); check ends_px."
        )
    if width >= THIN_PX:
        cells = _cheapest(_cost_off_centre(field, cells, darkness), start, end)
        darkness, width = _measure(field, cells)
    width_px = width / field.scale
    # A path through a thin crack may run a cell beside it.
    on_crack = maximum_filter(field.dark, size=3)[tuple(cells.T)] > darkness / 2
    points_px = _from_crack_to_crack(photo, field.to_photo(cells[:, ::-1]), on_crack, ends_px, width_px)
    return CrackPath(points_px, width_px, source)


def _automatic(photo: Photo) -> CrackPath:
    # The shadow around a sample is the longest dark line in its photo.
    seen_px = see_face(photo.brightness) if photo.face_px is None else None
    field = map_darkness(photo, seen_face_px=seen_px)
    lines = longest_lines(field)
    if not lines:
        where = "" if seen_px is None else " inside the edges of the sample"
        raise InputError(f"{photo.file}: no crack found{where}: nothing dark, thin and long stands out; give ends_px.")
    ends_px, score = field.to_photo(lines[0][0][[0, -1], ::-1]), lines[0][1]
    if len(lines) > 1 and lines[1][1] > RUNNER_UP * score:
        rival_px = field.to_photo(lines[1][0][[0, -1], ::-1])
        raise InputError(
            f"{photo.file}: two cracks compete, {_listed(ends_px)} and {_listed(rival_px)} px (the second has "
            f"{lines[1][1] / score:.0%} of the first one's score); choose with ends_px."
        )
    if ends_px[0, 0] > ends_px[1, 0]:
        ends_px = ends_px[::-1]
    path = _between(photo, ends_px, field, "automatic")
    warnings = () if seen_px is None else (EDGES_SEEN,)
    unlike_px = unlike_length_px(photo, path.points_px, path.width_px)
    if unlike_px > max(EDGE_WIDTHS * path.width_px, EDGE_SHARE * float(arc_length(path.points_px)[-1])):
        warnings = (
            *warnings,
            f"along {unlike_px * photo.mm_per_px:.0f} mm of the line that was found, one side is far brighter than the "
            "other, as at the sample's edge, where no nozzle must go: look at overlay.png, and give ends_px or face_mm",
        )
    return replace(path, warnings=warnings)


def _check_ends(photo: Photo, ends_px: tuple[Pixel, Pixel]) -> None:
    width, height = photo.size_px
    for x, y in ends_px:
        if not (0 <= x <= width - 1 and 0 <= y <= height - 1):
            raise InputError(
                f"{photo.file}: the end ({x:g}, {y:g}) lies outside the photo of {width} x {height} px; "
                "x runs right and y down, from 0."
            )
    apart_px = float(np.linalg.norm(np.subtract(*ends_px)))
    if apart_px < SNAP_PX:
        found = "the same place" if apart_px == 0 else f"only {apart_px:.2g} px apart"
        raise InputError(
            f"{photo.file}: the two ends {_listed(np.array(ends_px))} px are {found}; an end may be clicked "
            f"{SNAP_PX:g} px beside its crack, so they must be farther apart than that. Check ends_px."
        )
    if photo.face_mm is None:
        return
    for (x, y), depth_mm in zip(ends_px, depth_inside(photo.to_mm(np.array(ends_px)), photo.face_mm), strict=True):
        if depth_mm < -SNAP_PX * photo.mm_per_px:
            raise InputError(
                f"{photo.file}: the end ({x:g}, {y:g}) lies {-depth_mm:.1f} mm outside the face; "
                "give the place where the crack meets its edge."
            )


def _window(photo: Photo, ends_px: tuple[Pixel, Pixel]) -> tuple[int, int, int, int]:
    """Where a path between the ends may run: their box, and half their distance around it."""
    ends = np.array(ends_px)
    margin = max(100.0, 0.5 * float(np.linalg.norm(ends[1] - ends[0])))
    left, top = np.maximum(np.floor(ends.min(axis=0) - margin), 0).astype(int)
    right, bottom = np.minimum(np.ceil(ends.max(axis=0) + margin) + 1, photo.size_px).astype(int)
    return int(left), int(top), int(right), int(bottom)


def _on_map(field: DarkMap, ends_px: Floats) -> Integers:
    """Row and column of each end, moved onto the face where a click just missed it."""
    nearest = np.asarray(distance_transform_edt(~field.allowed, return_distances=False, return_indices=True))
    limits = np.array(field.dark.shape) - 1
    cells = np.clip(np.rint(field.to_work(ends_px)[:, ::-1]).astype(int), 0, limits)
    return np.array([nearest[:, row, column] for row, column in cells])


def _cost_of_thin(field: DarkMap) -> Floats:
    return np.where(field.allowed, 1 / (0.04 + np.clip(field.ridge, 0, 8) / 8), np.inf)


def _cost_of_wide(field: DarkMap) -> Floats:
    reference = max(float(np.percentile(field.dark[field.allowed], 99)), LEAST_DARKNESS)
    strength = np.clip(field.ridge, 0, 8) / 8 * field.dark / reference
    return np.where(field.allowed, 1 / (0.03 + np.minimum(strength, 1.5) ** 1.5), np.inf)


def _cost_off_centre(field: DarkMap, cells: Integers, darkness: float) -> Floats:
    """Cheapest in the middle of a wide crack, which is as dark everywhere."""
    to_rim = _to_rim(field, darkness)
    usual = max(float(np.percentile(to_rim[tuple(cells.T)], 75)), 1.0)
    return np.where(field.allowed, 1 / (0.03 + np.minimum(to_rim / usual, 1.5) ** 2), np.inf)


def _cheapest(cost: Floats, start: tuple[int, int], end: tuple[int, int]) -> Integers:
    """Rows and columns, (n, 2), of the path with the least cost per length."""
    search = MCP_Geometric(np.where(np.isfinite(cost), cost, -1), fully_connected=True)
    search.find_costs([start], [end])
    return np.array(search.traceback(end), dtype=np.int64)


def _measure(field: DarkMap, cells: Integers) -> tuple[float, float]:
    """Typical darkness along a path, and width of the dark around it, on the map."""
    darkness = float(np.median(field.dark[tuple(cells.T)]))
    to_rim = _to_rim(field, darkness)[tuple(cells.T)]
    return darkness, float(2 * np.median(to_rim[to_rim > 0]) - 1) if np.any(to_rim > 0) else 0.0


def _to_rim(field: DarkMap, darkness: float) -> Floats:
    """Distance from the nearest cell that is not half as dark as the crack, or not on the sample or the map."""
    mask = (field.dark > darkness / 2) & field.allowed
    mask[[0, -1]] = False
    mask[:, [0, -1]] = False
    return np.asarray(distance_transform_edt(mask))


def _from_crack_to_crack(
    photo: Photo, points_px: Floats, on_crack: NDArray[np.bool_], ends_px: Floats, width_px: float
) -> Floats:
    """The path less what lies before its first and after its last point in the crack."""
    inside = np.flatnonzero(on_crack)
    first, last = int(inside[0]), int(inside[-1])
    s_px = arc_length(points_px)
    limit_px = max(SNAP_PX, width_px)
    for (x, y), beside_px in zip(ends_px, (s_px[first], s_px[-1] - s_px[last]), strict=True):
        if beside_px > limit_px:
            raise InputError(
                f"{photo.file}: the end ({x:g}, {y:g}) is on no crack: the nearest one is {beside_px:.0f} px away "
                f"(at most {limit_px:.0f}); give a point inside the crack."
            )
    gaps = 1 - float(np.mean(on_crack[first : last + 1]))
    if gaps > MOST_GAPS:
        raise InputError(
            f"{photo.file}: no crack on {gaps:.0%} of the way between the ends (at most {MOST_GAPS:.0%}); "
            "give ends of one unbroken crack."
        )
    return points_px[first : last + 1]


def _listed(points_px: Floats) -> str:
    return " to ".join(f"({x:.0f}, {y:.0f})" for x, y in points_px)
