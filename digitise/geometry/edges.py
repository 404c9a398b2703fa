"""Edges of triangles, and how many faces use each."""

import numpy as np

from digitise.geometry.equal_rows import EqualRows, equal_rows
from sealtwin.records import Integers


def directed_edges(faces: Integers) -> Integers:
    """(3f, 2): the three of each face, face by face, each from its start to its end as the face runs."""
    return faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)


def edge_uses(faces: Integers) -> tuple[Integers, EqualRows]:
    """Directed edges, and those among them that join the same two vertices, whichever way."""
    directed = directed_edges(faces)
    return directed, equal_rows(np.column_stack([directed.min(axis=1), directed.max(axis=1)]))


def open_edges(faces: Integers) -> Integers:
    """Directed edges that one face alone uses, (n, 2)."""
    directed, uses = edge_uses(faces)
    return directed[uses.first[uses.count == 1]]
