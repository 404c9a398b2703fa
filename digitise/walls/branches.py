"""Side cracks: named where they are left out, measured and joined to their crack where they are kept."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from manifold3d import CrossSection, FillRule
from skimage.measure import points_in_poly

from digitise.finding.crack_path import CrackPath
from digitise.finding.medial import radius
from digitise.geometry.polyline import resampled, signed_area
from digitise.geometry.region import ISLAND_MM2
from digitise.photo import Photo
from digitise.walls.patch import patch_around
from digitise.walls.traced import Traced
from sealtwin.errors import InputError
from sealtwin.records import Floats, Outline, arc_length

LINE_STEP_PX = 1.0
"""Between the points of a branch's line: finer than any width that is measured."""


def with_branches(
    photo: Photo, path: CrackPath, outline: Outline, traced: Traced, measure: Callable[[CrackPath], Outline] | None
) -> Outline:
    """The outline with the branches of its path named, and joined to it where ``measure`` is given to measure them.

    Walls and centreline stay those of the main crack. A branch that cannot be measured is left out, and it is said.
    """
    if not path.branches_px:
        return outline
    lines_mm = tuple(photo.to_mm(line) for line in path.branches_px)
    outline = replace(outline, branches_mm=lines_mm)
    if measure is None:
        one = len(lines_mm) == 1
        warning = (
            f'{_count(lines_mm)} {"is" if one else "are"} left out; branches = "keep" keeps {"it" if one else "them"}'
        )
        return replace(outline, warnings=(*outline.warnings, warning))
    rings_mm, warnings = [], []
    for line_px, line_mm in zip(path.branches_px, lines_mm, strict=True):
        try:
            rings_mm.append(measure(_alone(photo, path, outline, traced, line_px)).outline_mm)
        except InputError as error:
            reason = str(error).removeprefix(f"{photo.file}: ").partition(";")[0]
            warnings.append(f"{_count([line_mm])} cannot be measured and is left out: {reason}")
    outline = replace(outline, warnings=(*outline.warnings, *warnings))
    return _united(photo, outline, rings_mm) if rings_mm else outline


def _alone(photo: Photo, path: CrackPath, outline: Outline, traced: Traced, line_px: Floats) -> CrackPath:
    """A branch as a crack of its own, from just inside the main crack."""
    line_px = resampled(line_px, LINE_STEP_PX)
    patch = patch_around(photo, line_px, path.width_px)
    threshold = float(np.median(traced.walls.dark) + np.median(traced.walls.bright)) / 2
    x, y = np.clip(np.rint(line_px - patch.offset_px).astype(int), 0, np.array(patch.soft.shape[::-1]) - 1).T
    width_px = 2 * radius(patch.soft < threshold)[y, x] - 1
    outside = np.flatnonzero(~points_in_poly(photo.to_mm(line_px), outline.outline_mm))
    leaves = int(outside[0]) if len(outside) else len(line_px) - 1
    own_px = max(float(np.median(width_px[leaves:])), 1.0)
    start = max(0, leaves - round(own_px / 2 / LINE_STEP_PX))
    return CrackPath(points_px=line_px[start:], width_px=own_px, source=path.source)


def _united(photo: Photo, outline: Outline, branches_mm: Sequence[Floats]) -> Outline:
    """Main crack and branches in one ring; ground between them that they close in stands as an island."""
    pieces = CrossSection([outline.outline_mm, *branches_mm], FillRule.Positive).decompose()
    main = max(pieces, key=lambda piece: piece.area())
    rings = [np.asarray(ring, dtype=float) for ring in main.to_polygons()]
    outer_mm = max(rings, key=signed_area)
    enclosed = tuple(ring for ring in rings if signed_area(ring) <= -ISLAND_MM2)
    return replace(
        outline,
        outline_mm=outer_mm,
        outline_px=photo.to_px(outer_mm),
        islands_mm=(*outline.islands_mm, *enclosed),
        branches_kept=True,
    )


def _count(lines_mm: Sequence[Floats]) -> str:
    """In words: "2 side cracks (12 and 7 mm)"."""
    *others, last = [f"{arc_length(line)[-1]:.0f}" for line in lines_mm]
    lengths = f"{', '.join(others)} and {last}" if others else last
    return f"{len(lines_mm)} side crack{'s' if others else ''} ({lengths} mm)"
