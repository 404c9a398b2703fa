"""Search for a crack in ground as coarse as it is: the path along which the photo is darkest at three blurs together.

The search map finds lines by a filter and by the darkness over the local background. Between stones, both find joints
of the stones; a wide crack is dark at each blur.
"""

from itertools import pairwise

import numpy as np

from digitise.crack_path.darkness import DarkMap
from digitise.crack_path.hints import CrackPath
from digitise.crack_path.profiles import finite_median, profiles_across, width_along
from digitise.crack_path.step_costs import cheapest
from digitise.image.raster import blurred
from digitise.image.tone_curve import DISPLAY_GAMMA
from digitise.photo import Photo
from sealtwin.core.records import Floats, PathSource

SIGMAS_PX = (2.0, 4.0, 8.0)  # Of the blurs, in cells of the search map
DARKEST = 1.0  # Percentile of the blurred light that is fully dark; a maximum of shares would saturate beside the crack
LEAST_SPAN = 0.016  # Least difference from the median to that percentile, in displayed brightness
SHARP, LEAST_COST = 5.0, 0.005  # Cost of a cell: exp(-SHARP darkness) + LEAST_COST
LEAST_WIDTH_PX = 8.0  # Least width of a crack that is looked for in this way
MOST_LIGHT = 0.36  # Largest light of a wide crack over that beside it
BARE, MOST_BARE = 0.1, 1  # Such a step below which a stretch of two widths is bare; most of these in a row
LEAST_STEP = 0.2  # Least 20th percentile, over stretches, of the step to the darker side over the ground's light


def blurred_path(photo: Photo, field: DarkMap, points_px: Floats, source: PathSource) -> CrackPath | None:
    """Return the path past all points; None if it is not as dark as a wide crack along its whole length."""
    shown = np.power(np.clip(field.light, 0, 1), 1 / DISPLAY_GAMMA).astype(np.float32)
    dark = np.zeros(shown.shape)
    for sigma in SIGMAS_PX:
        soft = blurred(shown, sigma)
        middle = float(np.median(soft))
        span = max(LEAST_SPAN, middle - float(np.percentile(soft, DARKEST)))
        dark += np.clip((middle - soft) / span, 0, 1) / len(SIGMAS_PX)
    cost = np.where(field.allowed, np.exp(-SHARP * dark) + LEAST_COST, np.inf)
    stops = np.clip(np.rint(field.to_work(points_px)[:, ::-1]).astype(int), 0, np.array(cost.shape) - 1)
    if not field.allowed[tuple(stops.T)].all():
        return None
    legs = [cheapest(cost, start, end, margin=max(cost.shape)) for start, end in pairwise(stops)]
    line_px = field.to_photo(np.concatenate(legs)[:, ::-1])
    width_px = width_along(photo, line_px, LEAST_WIDTH_PX)
    if width_px < LEAST_WIDTH_PX or not _stands_out(photo, line_px, width_px):
        return None
    return CrackPath(line_px, width_px, source)


def _stands_out(photo: Photo, line_px: Floats, width_px: float) -> bool:
    """Return True if a path is far darker than both its sides, and nowhere bare over more than a few widths."""
    profiles = profiles_across(photo, line_px, width_px, 1.5 * width_px + 4)
    offset_px = profiles.offset_px
    own = profiles.mean(np.abs(offset_px) <= 0.3 * width_px)
    beside = (np.abs(offset_px) > 0.75 * width_px + 1) & (np.abs(offset_px) < 1.5 * width_px + 3)
    left, right = (profiles.mean(beside & (sign * offset_px > 0)) for sign in (1, -1))
    ground = finite_median(np.concatenate([left, right]))
    step = np.fmin(left, right) - own
    if not (ground > 0 and np.isfinite(step).any() and finite_median(own) <= MOST_LIGHT * ground):
        return False
    bare = np.concatenate([[0], ~(step >= BARE * ground), [0]]).astype(int)
    bounds = np.flatnonzero(np.diff(bare)).reshape(-1, 2)
    longest = int(np.diff(bounds).max(initial=0))
    return longest <= MOST_BARE and float(np.nanpercentile(step, 20)) >= LEAST_STEP * ground
