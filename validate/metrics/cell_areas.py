"""Exact area of a region in each cell of a raster, however thin the region is."""

from collections.abc import Iterable

import numpy as np

from sealtwin.core.records import Floats


def cell_areas(rings: Iterable[Floats], shape: tuple[int, int]) -> Floats:
    """Return the area of a region in each cell of (rows, columns), in cells.

    Cell (row, column) spans the unit square from (column, row). Rings run counter-clockwise around the region and
    clockwise around its islands, all within the raster.

    Edges are cut at the cells' borders. A piece adds the area between it and the right border of its cell, and its
    height to all cells to the right: Green's theorem, row by row.
    """
    edges = [np.stack([ring, np.roll(ring, -1, axis=0)], axis=1) for ring in rings]
    if not edges:
        return np.zeros(shape)
    start, step = (edge := np.concatenate(edges))[:, 0], edge[:, 1] - edge[:, 0]
    numbers, places = [np.arange(len(start))], [np.zeros(len(start))]
    for axis in (0, 1):
        low = np.ceil(edge[:, :, axis].min(axis=1)).astype(int)
        count = np.maximum(np.floor(edge[:, :, axis].max(axis=1)).astype(int) - low + 1, 0)
        count[step[:, axis] == 0] = 0
        number = np.repeat(np.arange(len(start)), count)
        border = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count) + low[number]
        numbers.append(number)
        places.append(((border - start[number, axis]) / step[number, axis]).clip(0.0, 1.0))
    number, place = np.concatenate(numbers), np.concatenate(places)
    order = np.lexsort((place, number))
    number, place = number[order], place[order]
    end = np.where(np.append(number[1:] == number[:-1], False), np.append(place[1:], 1.0), 1.0)
    middle = start[number] + ((place + end) / 2)[:, None] * step[number]
    column, row = np.floor(middle).astype(int).T
    height = -(end - place) * step[number, 1]
    to_the_right = np.zeros(shape[0] * (shape[1] + 1))
    at, before = row * (shape[1] + 1) + column, middle[:, 0] - column
    to_the_right += np.bincount(at, height * (1 - before), len(to_the_right))
    to_the_right += np.bincount(at + 1, height * before, len(to_the_right))
    return np.cumsum(to_the_right.reshape(shape[0], -1), axis=1)[:, :-1]
