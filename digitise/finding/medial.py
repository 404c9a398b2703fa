"""Lines in the middle of a region: its skeleton, the longest way along it, and the side lines that leave a way."""

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components, dijkstra, minimum_spanning_tree
from scipy.spatial import KDTree
from skimage.morphology import skeletonize

from sealtwin.records import Floats, Integers

STEPS = ((0, 1), (1, -1), (1, 0), (1, 1))
"""To half of a cell's eight neighbours: row, column."""
LEAST_BRANCH = 0.7
"""In widths: what ends nearer to the wall is roughness. A side crack at 30 degrees is then 1.4 widths long."""
LEAST_BRANCH_PX = 8.0
"""The same in pixels: shorter is a pore or a slip of a brush."""
AT_RIM = 1.5
"""Cells: from one to the next across a corner."""


def radius(region: NDArray[np.bool_]) -> Floats:
    """Distance from each cell of the region to the nearest cell outside it; what lies off the picture is outside."""
    padded = np.pad(region.astype(np.uint8), 1)
    return cv2.distanceTransform(padded, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)[1:-1, 1:-1].astype(float)


def longest_line(region: NDArray[np.bool_]) -> Integers:
    """Rows and columns, (n, 2), along the longest way through the region's skeleton; empty where there is none."""
    cells = np.argwhere(skeletonize(region))
    if len(cells) < 2:
        return cells
    graph = linked(cells)
    _, piece = connected_components(graph, directed=False)
    walks = [longest_walk(graph, int(np.flatnonzero(piece == number)[0])) for number in range(piece.max() + 1)]
    lengths = [walk[1] for walk in walks]
    return cells[walks[int(np.argmax(lengths))][0]]


def without_hooks(way: Integers, to_rim: Floats) -> Integers:
    """Less half a width at both ends: a skeleton turns into a corner of a blunt end."""
    back = round(float(np.median(to_rim[tuple(way.T)])))
    return way[back:-back] if 0 < 2 * back < len(way) - 1 else way


def linked(cells: Integers, worth: Floats | None = None) -> csr_array:
    """Graph of cells and their eight neighbours; a link is as long as its step, or that times the mean ``worth``."""
    index = {(int(row), int(column)): number for number, (row, column) in enumerate(cells)}
    links = [
        (here, index[row + down, column + right], float(np.hypot(down, right)))
        for (row, column), here in index.items()
        for down, right in STEPS
        if (row + down, column + right) in index
    ]
    first, second, length = (np.array(column) for column in zip(*links, strict=True)) if links else (np.empty(0),) * 3
    first, second = first.astype(int), second.astype(int)
    if worth is not None:
        length = length * (worth[first] + worth[second]) / 2
    return csr_array(coo_array((length, (first, second)), shape=(len(cells), len(cells))))


def strongest_tree(graph: csr_array, worth: Floats) -> csr_array:
    """The graph less what closes its loops: of each loop the link between the least worthy cells goes."""
    links = coo_array(graph)
    weakness = 1 / (worth[links.row] + worth[links.col])
    kept = coo_array(minimum_spanning_tree(csr_array(coo_array((weakness, (links.row, links.col)), shape=graph.shape))))
    return csr_array(coo_array((np.asarray(graph[kept.row, kept.col]), (kept.row, kept.col)), shape=graph.shape))


def longest_walk(graph: csr_array, start: int) -> tuple[Integers, float]:
    """Indices of the longest of the shortest ways through the piece that holds ``start``, and its length.

    Exact where the piece is a tree: from anywhere to its far end, and from there to the other.
    """
    far = _farthest(dijkstra(graph, directed=False, indices=start))
    away, before = dijkstra(graph, directed=False, indices=far, return_predecessors=True)
    end = _farthest(away)
    return _walked(before, far, end), float(away[end])


class SideLine(NamedTuple):
    """A line of a region's skeleton that leaves a way."""

    cells: Integers
    """Rows and columns, (n, 2), from the rim of the region around the way outward."""
    comes_back: bool
    """It ends on that rim again."""


def side_lines(region: NDArray[np.bool_], way: Integers, least: float) -> list[SideLine]:
    """Lines of the region's skeleton that leave that part of it which goes with ``way``, longest first.

    Left out are those that end nearer than ``least`` to the region's rim, as a rough wall's own do, and what goes on
    past the ends of the way.
    """
    cells = np.argwhere(skeletonize(region))
    if len(cells) < 2:
        return []
    trunk = _beside(cells, way)
    if len(trunk) < 2:
        return []
    to_rim = radius(region)[tuple(trunk.T)]
    away, nearest = KDTree(trunk).query(cells)
    nearest = np.asarray(nearest)
    beyond = away - to_rim[nearest]
    outside = np.flatnonzero(beyond > 0)
    if len(outside) < 2:
        return []
    graph = linked(cells)[outside][:, outside]
    _, piece = connected_components(graph, directed=False)
    lines = []
    for number in range(piece.max() + 1):
        members = np.flatnonzero(piece == number)
        own = outside[members]
        root = int(np.argmin(beyond[own]))
        foot = nearest[own[root]]
        if beyond[own].max() < least or foot in (0, len(trunk) - 1):
            continue
        length, before = dijkstra(graph[members][:, members], directed=False, indices=root, return_predecessors=True)
        walk = _walked(before, root, _farthest(length))
        lines.append(SideLine(cells[own[walk]], comes_back=bool(beyond[own[walk[-1]]] <= AT_RIM)))
    return sorted(lines, key=lambda line: -len(line.cells))


def _beside(cells: Integers, way: Integers) -> Integers:
    """The walk along a skeleton from one end of ``way`` to the other that keeps nearest to it.

    A way need not run in the middle: where it does not, half of the skeleton lies beside it.
    """
    away = np.asarray(KDTree(way).query(cells)[0])
    _, piece = connected_components(linked(cells), directed=False)
    own = np.flatnonzero(piece == np.bincount(piece[np.unique(KDTree(cells).query(way)[1])]).argmax())
    cells, away = cells[own], away[own]
    first, last = (int(np.argmin(np.sum((cells - end) ** 2, axis=1))) for end in way[[0, -1]])
    graph = linked(cells, worth=1 + away / max(float(np.median(away)), 1.0))
    _, before = dijkstra(graph, directed=False, indices=first, return_predecessors=True)
    return cells[_walked(before, first, last)]


def _walked(before: Integers, start: int, end: int) -> Integers:
    """Indices from start to end of a search that started there."""
    walk = [end]
    while walk[-1] != start:
        walk.append(int(before[walk[-1]]))
    return np.array(walk[::-1], dtype=np.int64)


def _farthest(away: Floats) -> int:
    return int(np.argmax(np.where(np.isfinite(away), away, -1)))
