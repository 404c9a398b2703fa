"""The path along an imported crack: in the middle of its mouth, or as the user gives it."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.ndimage import map_coordinates

from digitise.crack_path.find_path import painted_path
from digitise.crack_path.hints import CrackPath
from digitise.geometry.polyline import at_arc_length, resampled
from digitise.photo import Photo
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats, Outline, arc_length_at

AT_ONCE = 2_000_000  # Pairs of a point and an edge that are compared at a time
LARGEST_BYTES = 5_000_000  # Largest path file, of fifty thousand points; a path has some hundred
SEPARATORS = re.compile(r"[;,\s]+")
HEADERS = (("x_mm", "y_mm"), ("x", "y"))  # Optional first line; without it, a line's first two numbers count
MOST_BESIDE = 0.05  # Largest share of a given line, between its entry and its exit, that may be beside the crack
WHOLE = 0.9  # Least share of the mouth's area that a line along the whole crack covers: oblique ends take some of it
SPACING_MM = 0.25  # Spacing of a given line's points: that of the centreline at 0.1 mm/px


def nearest_on_ring(points: Floats, ring: Floats) -> Floats:
    """Return the nearest place on a ring for each point, (n, 2)."""
    start, step = ring, np.roll(ring, -1, axis=0) - ring
    length_squared = (step**2).sum(axis=1)
    found = []
    for some in np.array_split(points, 1 + len(points) * len(ring) // AT_ONCE):
        along = ((some[:, None] - start) * step).sum(axis=2)
        share = np.divide(along, length_squared, out=np.zeros_like(along), where=length_squared > 0).clip(0, 1)
        place = start + share[:, :, None] * step
        best = ((place - some[:, None]) ** 2).sum(axis=2).argmin(axis=1)
        found.append(place[np.arange(len(some)), best])
    return np.concatenate(found)


def read_path(path: Path) -> Floats:
    """Read points in mm, (n, 2), from lines of x, y and perhaps z. Raises InputError with file and line."""
    if not path.is_file():
        raise InputError(
            f"{path}: no such path file; what mesh.path names is looked for beside its trial file. It may be left out."
        )
    if path.stat().st_size > LARGEST_BYTES:
        raise InputError(f"{path}: larger than {LARGEST_BYTES / 1e6:g} MB; a path has some hundred lines.")
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except UnicodeDecodeError:
        raise InputError(f"{path}: no text; a path is x and y in mm, a line for each point.") from None
    points, columns = [], [0, 1]
    for number, line in enumerate(lines, start=1):
        words = [word for word in SEPARATORS.split(line.partition("#")[0]) if word]
        header = next((names for names in HEADERS if not points and set(names) <= set(words)), None)
        if header is not None:
            columns = [words.index(name) for name in header]
        elif words:
            try:
                x, y = (float(words[column]) for column in columns)
            except (ValueError, IndexError):
                x = y = np.nan
            if not np.isfinite([x, y]).all():
                found = " ".join(words)[:60]
                raise InputError(f"{path}, line {number}: expected x and y in mm, two finite numbers, found {found!r}.")
            points.append((x, y))
    places_mm = np.array(points).reshape(-1, 2)
    places_mm = places_mm[np.append(True, np.any(np.diff(places_mm, axis=0) != 0, axis=1))[: len(places_mm)]]
    if len(places_mm) < 2:
        raise InputError(f"{path}: {len(places_mm)} different points; a path needs two and more.")
    return places_mm


def middle_path(photo: Photo, line_mm: Floats | None) -> CrackPath:
    """Find the path in the middle of the mouth: along its longest line, or between the ends of the given one."""
    ends_px = None
    if line_mm is not None:
        (x0, y0), (x1, y1) = photo.to_px(_in_mouth(photo, line_mm)[[0, -1]]).tolist()
        ends_px = ((x0, y0), (x1, y1))
    return replace(painted_path(photo, ends_px), source="mesh")


def along(outline: Outline, photo: Photo, line_mm: Floats) -> tuple[Outline, str]:
    """Return the outline with the given line as its centreline, and a note of its distance from the middle."""
    line_mm = _in_mouth(photo, line_mm)
    beside = 1 - float(_covered(photo, line_mm).mean())
    if beside > MOST_BESIDE:
        raise InputError(
            f"The given path is beside the crack on {beside:.0%} of its length (at most {MOST_BESIDE:.0%}). It is read "
            "as x and y in mm, in the mesh's own axes turned upright."
        )
    middle_s_mm = np.maximum.accumulate(arc_length_at(line_mm, outline.centreline_mm).clip(0, outline.length_mm))
    lines_mm = np.hstack([outline.centreline_mm, outline.left_wall_mm, outline.right_wall_mm])
    middle_mm, left_mm, right_mm = np.hsplit(at_arc_length(lines_mm, outline.s_mm, middle_s_mm), 3)
    away_mm = np.linalg.norm(line_mm - middle_mm, axis=1)
    given = replace(
        outline,
        **photo.in_both_units(centreline=line_mm, left_wall=left_mm, right_wall=right_mm),
        path_source="line",
    )
    followed = given.mean_width_mm * given.length_mm / (np.asarray(photo.drawn).sum() * photo.mm_per_px**2)
    if followed < WHOLE:
        doubt = (
            f"the given path, {given.length_mm:.1f} mm long, follows {100 * followed:.0f} % of the crack's mouth: "
            'volume_ml = "cavity" would give all of the sealant there; give volume_ml, or a path along the whole crack'
        )
        given = replace(given, warnings=(*given.warnings, doubt))
    return given, (
        f"the centreline is the given path; it is {np.sqrt(np.mean(away_mm**2)):.2f} mm (RMS), at most "
        f"{away_mm.max():.2f} mm, from the middle between the walls"
    )


def _in_mouth(photo: Photo, line_mm: Floats) -> Floats:
    """Return the line between its first and last place in the crack's mouth, evenly spaced."""
    even_mm = resampled(line_mm, SPACING_MM)
    inside = np.flatnonzero(_covered(photo, even_mm))
    if len(inside) < 2:
        raise InputError("The given path is not in the crack. It is read as x and y in mm.")
    return even_mm[inside[0] : inside[-1] + 1]


def _covered(photo: Photo, points_mm: Floats) -> np.ndarray:
    """Return True for each point in the mouth, (n,)."""
    rows_columns = photo.to_px(points_mm).T[::-1]
    return map_coordinates(np.asarray(photo.drawn, dtype=np.uint8), rows_columns, order=0) > 0
