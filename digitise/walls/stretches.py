"""Check for stretches that a mean width hides: too narrow to measure, or clicked but without walls."""

import numpy as np
from scipy.ndimage import median_filter
from scipy.spatial import KDTree

from digitise.crack_path.hints import listed, snap_px
from digitise.photo import Photo
from sealtwin.core.arc_length import arc_length
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats
from sealtwin.core.solid_figures import EndKind

MIN_WIDTH_PX = 8.0  # Least width between walls; blur and threshold decide a smaller one more than the crack does
UNKNOWN = 0.75  # Share of that width below which a stretch is a hairline: blur makes 5.4 px of a line of 4 px
MOST_MISSING = 0.2  # Share of the path on which a wall may be missing or outside the photo
WORTH_SAYING = 0.05  # Share of the crack from which a warning reports a doubt
STEADY, LEAST = 3.0, 5.0  # Least lengths of a median and of a stretch along the crack, in ``MIN_WIDTH_PX``


def judge_stretches(photo: Photo, centreline_mm: Floats, width_mm: Floats) -> list[str]:
    """Return a warning about stretches too narrow to measure; raise InputError if much of the crack is a hairline."""
    least_px = UNKNOWN * MIN_WIDTH_PX
    share, places = _narrow(photo, centreline_mm, width_mm, least_px)
    if share > MOST_MISSING:
        raise InputError(
            f"{photo.file}: {share:.0%} of the crack is narrower than {least_px:g} px, too narrow to measure (at most "
            f"{MOST_MISSING:.0%} is allowed): {places}; give ends_px of only the wide part, or move the camera closer."
        )
    share, places = _narrow(photo, centreline_mm, width_mm, MIN_WIDTH_PX)
    if share <= WORTH_SAYING:
        return []
    return [
        f"{share:.0%} of the crack is under {MIN_WIDTH_PX:g} px wide, so that its width and volume are uncertain "
        f"there: {places}; take a closer photo to measure it"
    ]


def _narrow(photo: Photo, centreline_mm: Floats, width_mm: Floats, limit_px: float) -> tuple[float, str]:
    """Return the share of the crack in stretches narrower than ``limit_px``, and a list of them as text.

    A stretch is ``LEAST`` times as long as ``MIN_WIDTH_PX``, so that a tapering tip does not count.
    """
    s_mm, width_px = arc_length(centreline_mm), width_mm / photo.mm_per_px
    least_mm = MIN_WIDTH_PX * photo.mm_per_px
    per_station_mm = s_mm[-1] / (len(s_mm) - 1)
    steady_px = median_filter(width_px, size=1 + 2 * int(STEADY * least_mm / per_station_mm / 2), mode="nearest")
    narrow = np.concatenate([[0], (steady_px < limit_px).astype(int), [0]])
    bounds = np.flatnonzero(np.diff(narrow)).reshape(-1, 2) - (0, 1)
    stretches = [(first, last) for first, last in bounds if s_mm[last] - s_mm[first] > LEAST * least_mm]
    places = (
        f"{s_mm[first]:.0f} to {s_mm[last]:.0f} mm along the crack, from "
        f"{listed(photo.to_px(centreline_mm[[first, last]]))} px, about {np.median(width_px[first : last + 1]):.1f} "
        "px wide"
        for first, last in stretches
    )
    return sum(float(s_mm[last]) - float(s_mm[first]) for first, last in stretches) / float(s_mm[-1]), "; ".join(places)


def judge_reach(photo: Photo, path_px: Floats, centreline_px: Floats, kinds: tuple[EndKind, EndKind]) -> list[str]:
    """Return warnings if the crack closes before an end of the path; raise InputError if much of the path is lost."""
    s_mm, warnings = arc_length(photo.to_mm(path_px)), []
    tips_px = centreline_px[[0, -1]]
    first, last = np.asarray(KDTree(path_px).query(tips_px)[1])
    losses_mm = float(s_mm[first]), float(s_mm[-1] - s_mm[last])
    for kind, end_px, tip_px, lost in zip(kinds, path_px[[0, -1]], tips_px, losses_mm, strict=True):
        if kind != "closed" or lost <= snap_px(photo) * photo.mm_per_px:
            continue
        fault = (
            f"the end {listed(end_px[None])} px is not reached: no walls were found on the last {lost:.1f} mm "
            f"({lost / photo.mm_per_px:.0f} px) before it, up to {listed(tip_px[None])} px"
        )
        if lost > MOST_MISSING * s_mm[-1]:
            raise InputError(
                f"{photo.file}: {fault}, {lost / s_mm[-1]:.0%} of the path (at most {MOST_MISSING:.0%}); give that "
                "place as the end, or a photo that shows the crack more clearly."
            )
        warnings.append(f"{fault}: that part of the path is left out")
    return warnings
