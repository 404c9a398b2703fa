"""All cracks of a photo: where they are, and how crack-like each of them is."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from skimage.filters import apply_hysteresis_threshold
from skimage.morphology import skeletonize

from digitise.finding.costs import CLEAR, NOTHING, cost_of_thin
from digitise.finding.darkness import DarkMap, inner, map_darkness
from digitise.finding.growth import grown
from digitise.finding.joints import beside_straight, straight_lines
from digitise.finding.lines import support
from digitise.finding.medial import linked, longest_walk, radius, strongest_tree, without_hooks
from digitise.finding.pieces import larger_pieces, pieces
from digitise.finding.voting import voted_lines
from digitise.photo import Photo
from digitise.pictures.raster import Map
from sealtwin.records import Floats, Integers, arc_length

SURE, LIKELY = 4.0, 2.7
"""Support, in standard deviations of plain ground, that starts a crack and that lets it go on. Best on 90 drawn photos
of asphalt and concrete; a quarter more or less of either costs 0.01 of F1.
"""
LEAST_BONE_PX = 25
"""Cells: what starts a crack is at least as long as the support looks to one side."""
LEAST_EVIDENCE = 100.0
"""Support summed along a crack's lines: shorter or fainter ones are rows of grains."""
LEAST_SHARE = 0.07
"""Of the strongest crack's evidence: less is rarely a crack where there is such a one."""
LEAST_WORTH = 1e-3
"""Of a cell of a line: bridges count for next to nothing, but their length is no nothing."""
RIM_PX, LONGEST_ACROSS = 8.0, 5.0
"""Cells from the edge of what is searched in which its own shadow lies, and how many times that a crack may be in it:
it meets the edge at more than 12 degrees.
"""
FADING = 0.5
"""Of a line's own median worth: where its ends fall below, it has left the crack."""


@dataclass(frozen=True)
class Crack:
    """One of them, with the side cracks that hang together with it."""

    line_px: Floats
    """Its main line, (n, 2), in the photo, from left to right."""
    width_px: float
    """Typical width along it."""
    score: float
    """Darkness times clearness as a line, summed along the main line, in pixels of the photo."""


@dataclass(frozen=True)
class CrackMap:
    """What there is of cracks in a photo."""

    mask: NDArray[np.bool_]
    """(height, width) of the photo: in some crack."""
    cracks: tuple[Crack, ...]
    """Best first."""
    straight_px: tuple[Floats, ...] = ()
    """Ends of lines that are too straight for a crack, (2, 2): joints, or the edge of the sample."""


def find_cracks(photo: Photo) -> CrackMap:
    """Look for cracks all over the photo; there may be none."""
    return cracks_on(map_darkness(photo), photo)


def cracks_on(field: DarkMap, photo: Photo, straight_too: bool = False) -> CrackMap:
    """Look for cracks on a search map of ``photo``: lines too straight for one are none but with ``straight_too``."""
    clear = np.where(inner(field.allowed), support(field.even, field.allowed), 0).astype(np.float32)
    seen = apply_hysteresis_threshold(clear, LIKELY, SURE)
    straight = straight_lines(skeletonize(seen))
    cost = cost_of_thin(field, np.argwhere(skeletonize(seen)))
    if not straight_too:
        joint = beside_straight(seen.shape, straight)
        seen &= ~joint
        cost[joint & field.allowed] = 1 / NOTHING
    lines = voted_lines(larger_pieces(skeletonize(seen), LEAST_BONE_PX), seen, cost)
    lines = _with_evidence(_without_rim(lines, field.allowed), clear)
    mask = grown(lines, field.dark, field.allowed)
    worth = (np.clip(field.ridge, 0, CLEAR) / CLEAR * field.dark).astype(float) + LEAST_WORTH
    # A wide crack has lines along both its walls, and one middle.
    half_width, bones, (label, area) = radius(mask), skeletonize(mask), pieces(mask)
    skeletons = [np.argwhere(bones & (label == piece)) for piece in range(1, len(area))]
    main_lines = [_main_line(cells, worth, half_width) for cells in skeletons]
    cracks = [_crack(line, worth, half_width, field) for line in main_lines]
    return CrackMap(
        mask=_on_photo(mask, field, photo),
        cracks=tuple(sorted(cracks, key=lambda crack: -crack.score)),
        straight_px=tuple(field.to_photo(line) for line in straight),
    )


def _without_rim(lines: NDArray[np.bool_], allowed: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Lines less what runs along the edge of what was searched, not across it: such an edge throws a shadow."""
    near = lines & (radius(allowed) <= RIM_PX)
    return lines & ~larger_pieces(near, LONGEST_ACROSS * RIM_PX)


def _with_evidence(lines: NDArray[np.bool_], clear: Map) -> NDArray[np.bool_]:
    """Lines less the pieces that have too little to say for themselves."""
    label, area = pieces(lines)
    evidence = np.bincount(label.ravel(), np.where(lines, np.clip(clear, 0, None), 0).ravel(), len(area))
    enough = evidence >= max(LEAST_EVIDENCE, LEAST_SHARE * evidence.max())
    return lines & enough[label]


def _main_line(cells: Integers, worth: Floats, half_width: Floats) -> Integers:
    """Of a piece's skeleton the line along which most worth adds up."""
    own = worth[tuple(cells.T)]
    walk, _ = longest_walk(strongest_tree(linked(cells, own), own), 0)
    strong = np.flatnonzero(own[walk] >= FADING * np.median(own[walk]))
    return without_hooks(cells[walk[strong[0] : strong[-1] + 1]], half_width)


def _crack(line: Integers, worth: Floats, half_width: Floats, field: DarkMap) -> Crack:
    score = float(arc_length(line.astype(float))[-1] * np.mean(worth[tuple(line.T)]))
    return Crack(
        line_px=field.to_photo((line if line[0, 1] <= line[-1, 1] else line[::-1])[:, ::-1]),
        width_px=(2 * float(np.median(half_width[tuple(line.T)])) - 1) / field.scale,
        score=score / field.scale,
    )


def _on_photo(mask: NDArray[np.bool_], field: DarkMap, photo: Photo) -> NDArray[np.bool_]:
    """The map's cells as pixels of the photo."""
    width, height = photo.size_px
    to_map = np.array(
        [
            [field.scale, 0, 0.5 * field.scale - 0.5 - field.offset_px[0] * field.scale],
            [0, field.scale, 0.5 * field.scale - 0.5 - field.offset_px[1] * field.scale],
        ]
    )
    on_photo = cv2.warpAffine(
        mask.astype(np.uint8) * 255, to_map, (width, height), flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    )
    return on_photo > 127
