"""A column of liquid let go, by potential flow: no viscosity, no gate, nothing that the solver shares with it.

Longuet-Higgins and Cokelet's way (1976): the free surface moves with its liquid, D phi / Dt = u^2 / 2 - g z, and
between two steps Laplace's equation is solved by linear boundary elements. Walls and floor are planes of symmetry:
images stand for them, and only the free surface has nodes. Units: the width a of a column twice as high, and
T = t sqrt(2 g / a).
"""

from collections.abc import Iterator

import numpy as np
from scipy.interpolate import PchipInterpolator

from sealtwin.core.records import Floats

GRAVITY = 0.5
HEIGHT = 2.0
FINEST, COARSEST, GROWTH = 0.02, 0.05, 0.06
"""Spacing of nodes at the front, elsewhere at most, and its growth with the distance: half of them move Z by 0.001."""
STRETCH, LONGEST = 0.25, 0.01
"""Of an element in a step, over its length; and of a step in T."""
SMOOTHED = 0.25
"""Of what alternates between nodes, in each step."""
IMAGES = np.array([(1, 1), (-1, 1), (1, -1), (-1, -1)])


def column_front(share: float, until: float) -> Floats:
    """T and Z, (n, 2): the place that this share of the liquid has passed."""
    return np.array([[t, passed_by(surface, share)] for t, surface, _ in collapse(until)])


def collapse(until: float) -> Iterator[tuple[float, Floats, Floats]]:
    """T, the free surface, (n, 2), and the potential on it, (n,), step by step."""
    surface, potential = _with_nodes(*_at_rest())
    t = 0.0
    while t < until:
        velocity, change = rates(surface, potential)
        apart = np.linalg.norm(np.diff(velocity, axis=0), axis=1)
        step = min(LONGEST, float((STRETCH * _lengths(surface) / np.maximum(apart, 1e-9)).min()))
        half = surface + step / 2 * velocity, potential + step / 2 * change
        velocity, change = rates(*half)
        surface, potential = _with_nodes(surface + step * velocity, potential + step * change)
        surface, potential = _smooth(surface), _smooth(potential)
        t += step
        yield t, surface, potential


def rates(surface: Floats, potential: Floats) -> tuple[Floats, Floats]:
    """Velocity of the free surface's nodes, (n, 2), and what their potential gains, (n,).

    ``surface``: (n, 2), from the wall at x = 0 to the front on the floor.
    """
    along = np.append(0.0, np.cumsum(_lengths(surface)))
    tangent = np.gradient(surface, along, axis=0, edge_order=2)
    tangent /= np.linalg.norm(tangent, axis=1)[:, None]
    outward = tangent @ np.array([[0.0, 1.0], [-1.0, 0.0]])
    slope = np.gradient(potential, along, edge_order=2)
    velocity = slope[:, None] * tangent + flux(surface, potential)[:, None] * outward
    velocity[0, 0] = velocity[-1, 1] = 0.0
    return velocity, (velocity**2).sum(axis=1) / 2 - GRAVITY * surface[:, 1]


def flux(surface: Floats, potential: Floats) -> Floats:
    """Outward derivative of the potential, (n,), that makes it harmonic inside: Green's second identity."""
    single, double = np.sum([_layers(surface * image, surface) for image in IMAGES], axis=0)
    # A constant potential has no flux, which gives the corners' angles.
    double -= np.diag(np.sum(double, axis=1))
    return np.linalg.solve(single, double @ potential).astype(np.float64)


def _layers(points: Floats, nodes: Floats) -> tuple[Floats, Floats]:
    """Integrals of log r and of its outward derivative over the elements, by point and by nodal value, each (n, n)."""
    length = _lengths(nodes)
    tangent = np.diff(nodes, axis=0) / length[:, None]
    from_start = points[:, None] - nodes[None, :-1]
    foot = (from_start * tangent).sum(axis=2)
    above = from_start[..., 1] * tangent[:, 0] - from_start[..., 0] * tangent[:, 1]

    def up_to(s: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        squared = np.maximum(s**2 + above**2, 1e-300)
        # On the line of an element its double layer vanishes.
        angle = np.where(np.abs(above) > 1e-12, np.arctan(s / np.where(above == 0, 1.0, above)), 0.0)
        log = np.log(squared)
        return s * log / 2 - s + above * angle, squared * (log - 1) / 4, -angle, -above * log / 2

    single, single_s, double, double_s = (b - a for a, b in zip(up_to(-foot), up_to(length - foot), strict=True))
    layers = []
    for flat, rising in ((single, single_s), (double, double_s)):
        end = (rising + foot * flat) / length
        layer = np.zeros((len(points), len(nodes)))
        layer[:, 1:] += end
        layer[:, :-1] += flat - end
        layers.append(layer)
    return layers[0], layers[1]


def passed_by(surface: Floats, share: float) -> float:
    """The x beyond which this share of the volume lies."""
    x, z = surface[::-1].T
    beyond = np.append(0.0, np.cumsum(-np.diff(x) * (z[1:] + z[:-1]) / 2)) / HEIGHT
    last = int(np.argmax(beyond >= share))
    return float(np.interp(share, beyond[last - 1 : last + 1], x[last - 1 : last + 1]))


def _at_rest() -> tuple[Floats, Floats]:
    level = np.column_stack([np.linspace(0, 1, 101), np.full(101, HEIGHT)])
    face = np.column_stack([np.ones(200), np.linspace(HEIGHT, 0, 201)[1:]])
    return np.vstack([level, face]), np.zeros(301)


def _with_nodes(surface: Floats, potential: Floats) -> tuple[Floats, Floats]:
    """The same surface with its nodes spread anew, closest at the front: liquid only ever leaves it."""
    along = np.append(0.0, np.cumsum(_lengths(surface)))
    from_front = [0.0]
    while from_front[-1] < along[-1]:
        from_front.append(from_front[-1] + min(COARSEST, FINEST + GROWTH * from_front[-1]))
    place = along[-1] * (1 - np.array(from_front[::-1]) / from_front[-1])
    x, z, spread = (PchipInterpolator(along, values)(place) for values in (*surface.T, potential))
    return np.column_stack([x, z]), spread


def _smooth(values: Floats) -> Floats:
    """With less of the saw teeth that grow from node to node in this way; by their five points."""
    smooth = values.copy()
    teeth = 6 * values[2:-2] - 4 * (values[1:-3] + values[3:-1]) + values[:-4] + values[4:]
    smooth[2:-2] -= SMOOTHED / 16 * teeth
    return smooth


def _lengths(surface: Floats) -> Floats:
    return np.hypot(*np.diff(surface, axis=0).T)
