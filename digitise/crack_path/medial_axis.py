"""Find lines in the middle of a region: its skeleton, the longest path along the skeleton, and side lines of a path."""

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components, dijkstra, minimum_spanning_tree
from scipy.spatial import KDTree
from skimage.graph import route_through_array
from skimage.morphology import skeletonize

from digitise.image.raster import Map
from sealtwin.core.arrays import Booleans, Floats, Integers, lengths

MIN_BRANCH = 0.7  # Minimum length of a side crack from the wall, in widths of the crack. Less is roughness of the wall
MIN_BRANCH_PX = 8.0  # Minimum of that length, in px. Shorter side cracks are pores or slips of a brush
# A line that ends within this many cells of the rim ends on it; this is a little more than a diagonal step
AT_RIM = 1.5


def pieces(mask: Booleans, connectivity: int = 8) -> tuple[NDArray[np.int32], Integers]:
    """Return the piece number of each cell, 0 outside the mask, and the area of each piece in cells.

    With ``connectivity`` 8, cells that touch at a corner are connected; with 4 they are not.
    """
    _, label, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=connectivity)
    area = stats[:, cv2.CC_STAT_AREA].astype(np.int64)
    area[0] = 0
    return label.astype(np.int32), area


def holding(mask: Booleans, places: Floats, connectivity: int = 4) -> Booleans:
    """Return the piece of a mask that contains most of the points ``places``, (n, 2) as column and row.

    Returns an empty mask if no point is in the mask.
    """
    label, _ = pieces(mask, connectivity)
    column, row = np.clip(np.rint(places).astype(np.int64), 0, np.array(mask.shape[::-1]) - 1).T
    count = np.bincount(label[row, column], minlength=2)
    count[0] = 0
    return mask & (label == count.argmax())


def larger_pieces(mask: Booleans, least: float, connectivity: int = 8) -> Booleans:
    """Return the mask without pieces that have fewer than ``least`` cells."""
    label, area = pieces(mask, connectivity)
    return mask & (area >= least)[label]


def distance_outside(mask: Booleans) -> Map:
    """Return the distance of each cell from the nearest cell of the mask. It is 0 inside the mask."""
    away = cv2.distanceTransform((~mask).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    # Squared distances are whole numbers. OpenCV's last bit depends on the memory address of a small array.
    return np.sqrt(np.rint(np.square(np.asarray(away, np.float32))))


def radius(region: Booleans) -> Floats:
    """Return the distance of each cell from the nearest cell outside the region. Cells off the picture are outside."""
    outside = np.pad(~region, 1, constant_values=True)
    return distance_outside(outside)[1:-1, 1:-1].astype(float)


def longest_line(region: Booleans) -> Integers:
    """Return the longest path through the region's skeleton, (n, 2), as row and column. It may be empty."""
    cells = np.argwhere(skeletonize(region))
    if len(cells) < 2:
        return cells
    graph = linked(cells)
    _, piece = connected_components(graph, directed=False)
    walks = (longest_walk(graph, int(start)) for start in np.unique(piece, return_index=True)[1])
    return cells[max(walks, key=lambda walk: walk[1])[0]]


def nearest_cell(cells: Integers, position: Floats | Integers) -> int:
    """Return the index of the cell that is nearest to a position. ``cells`` are rows and columns, (n, 2)."""
    return int(np.argmin(np.sum((cells - position) ** 2, axis=1)))


def along_middle(region: Booleans, ends: Floats) -> Integers:
    """Return the cells along the middle of a region, (n, 2) as row and column.

    The first cell is nearest to the first of ``ends``, and the last cell is nearest to the second. ``ends``, (2, 2),
    are given as column and row.
    """
    cells = np.argwhere(region)
    start, end = (cells[nearest_cell(cells, position[::-1])] for position in ends)
    to_rim = radius(region)
    share = np.minimum(to_rim / max(2 * np.median(to_rim[region]), 1.0), 1.5)
    way, _ = route_through_array(np.where(region, 1 / (0.03 + share**2), np.inf), start, end)
    return np.array(way, np.int64)


def rightward(way: Integers) -> Integers:
    """Return a path, (n, 2) as row and column, that runs from its left end to its right end."""
    return way if way[0, 1] <= way[-1, 1] else way[::-1]


def without_hooks(way: Integers, to_rim: Floats) -> Integers:
    """Return the path shortened by half the crack's width at each end.

    At a blunt end, a skeleton bends into a corner. This removes the bend.
    """
    back = round(float(np.median(to_rim[tuple(way.T)])))
    return way[back:-back] if 0 < 2 * back < len(way) - 1 else way


def linked(cells: Integers, worth: Floats | None = None) -> csr_array:
    """Return the graph of neighbouring cells.

    The weight of a link is its length. If ``worth`` is given, the length is multiplied by the mean worth of the link's
    two cells.
    """
    first, second = KDTree(cells).query_pairs(1.5, output_type="ndarray").T
    length = lengths(cells[first] - cells[second])
    if worth is not None:
        length = length * (worth[first] + worth[second]) / 2
    graph = csr_array((length, (first, second)), shape=(len(cells), len(cells)))
    graph.sort_indices()
    return graph


def strongest_tree(graph: csr_array, worth: Floats) -> csr_array:
    """Return the spanning tree of the graph. In each loop, the link with the least worth is omitted."""
    links = coo_array(graph)
    weakness = 1 / (worth[links.row] + worth[links.col])
    tree = coo_array(minimum_spanning_tree(csr_array((weakness, (links.row, links.col)), shape=graph.shape)))
    return csr_array((np.asarray(graph[tree.row, tree.col]), (tree.row, tree.col)), shape=graph.shape)


def longest_walk(graph: csr_array, start: int) -> tuple[Integers, float]:
    """Return the longest path without detours in the piece that contains ``start``, as indices, and its length.

    The result is exact if the piece is a tree.
    """
    return _walk(graph, int(_walk(graph, start)[0][-1]))


def side_lines(region: Booleans, way: Integers, least: float) -> list[tuple[Integers, bool]]:
    """Return the side lines of a path, longest first: skeleton lines that leave the crack around the path.

    A side line reaches at least ``least`` cells beyond that crack's rim. It is given as rows and columns, (n, 2), from
    the rim outward, with a flag that is True if the line ends on the rim again. Lines past an end of the path are not
    side lines.
    """
    cells = np.argwhere(skeletonize(region))
    trunk = _beside(cells, way) if len(cells) > 1 else cells
    if len(trunk) < 2:
        return []
    to_rim = radius(region)[tuple(trunk.T)]
    away, nearest = map(np.asarray, KDTree(trunk).query(cells))
    beyond = away - to_rim[nearest]
    outside = np.flatnonzero(beyond > 0)
    if len(outside) < 2:
        return []
    graph = linked(cells)[outside][:, outside]
    _, piece = connected_components(graph, directed=False)
    lines = []
    for number in range(piece.max() + 1):
        members = np.flatnonzero(piece == number)
        indices = outside[members]
        root = int(np.argmin(beyond[indices]))
        foot = nearest[indices[root]]
        # If a click was off the middle, the crack continues past this end beside the path.
        if beyond[indices].max() < least or min(foot, len(trunk) - 1 - foot) <= to_rim[foot]:
            continue
        walk, _ = _walk(graph[members][:, members], root)
        lines.append((cells[indices[walk]], bool(beyond[indices[walk[-1]]] <= AT_RIM)))
    return sorted(lines, key=lambda line: -len(line[0]))


def _beside(cells: Integers, way: Integers) -> Integers:
    """Return the path along a skeleton from one end of ``way`` to the other, (n, 2). ``way`` may be off the middle."""
    away = np.asarray(KDTree(way).query(cells)[0])
    _, piece = connected_components(linked(cells), directed=False)
    indices = np.flatnonzero(piece == np.bincount(piece[np.unique(KDTree(cells).query(way)[1])]).argmax())
    cells, away = cells[indices], away[indices]
    first, last = (nearest_cell(cells, end) for end in way[[0, -1]])
    graph = linked(cells, worth=1 + away / max(np.median(away), 1.0))
    return cells[_walk(graph, first, last)[0]]


def _walk(graph: csr_array, start: int, end: int | None = None) -> tuple[Integers, float]:
    """Return the shortest path from start to end, as indices, and its length.

    If ``end`` is None, the path leads to the cell that is farthest from the start.
    """
    away, before = dijkstra(graph, directed=False, indices=start, return_predecessors=True)
    walk = [int(np.argmax(np.where(np.isfinite(away), away, -1))) if end is None else end]
    while walk[-1] != start:
        walk.append(int(before[walk[-1]]))
    return np.array(walk[::-1], np.int64), float(away[walk[0]])
