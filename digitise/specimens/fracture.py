"""The shape of a made-up crack, in mm on its face: every curve that its photo must show."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from digitise.geometry.polyline import depth_inside, left_normals, signed_area, tangents
from digitise.specimens.recipe import Recipe, SideCrack
from sealtwin.records import Floats, arc_length

STEP_MM = 0.05
"""Between points of the exact curves."""
TAPER_WIDTHS = 4.0
"""Over so many widths a crack narrows to its tip, as the root of the distance from it."""


@dataclass(frozen=True)
class Fracture:
    """A crack, station by station along its centreline; an open one runs on beyond the face."""

    line_mm: Floats
    left_mm: Floats
    right_mm: Floats
    side_lines_mm: tuple[Floats, ...]
    """Centre polylines of the side cracks, from the main crack outward."""
    side_rings_mm: tuple[Floats, ...]
    """Their outlines, counter-clockwise, each beginning inside the main crack."""
    stones_mm: tuple[Floats, ...]
    """Clockwise rings inside the crack."""
    wall_pores_mm: tuple[Floats, ...]
    """Rings on its walls, mostly outside of it."""

    @property
    def walls_mm(self) -> Floats:
        """Every point of every wall, (n, 2)."""
        return np.concatenate([self.left_mm, self.right_mm, *self.side_rings_mm])

    def mirrored(self, face_width_mm: float) -> "Fracture":
        """Left and right of the face swapped."""

        def flipped(points_mm: Floats) -> Floats:
            return points_mm * (-1.0, 1.0) + (face_width_mm, 0.0)

        return Fracture(
            line_mm=flipped(self.line_mm),
            left_mm=flipped(self.right_mm),
            right_mm=flipped(self.left_mm),
            side_lines_mm=tuple(flipped(line) for line in self.side_lines_mm),
            side_rings_mm=tuple(flipped(ring)[::-1] for ring in self.side_rings_mm),
            stones_mm=tuple(flipped(ring)[::-1] for ring in self.stones_mm),
            wall_pores_mm=tuple(flipped(ring) for ring in self.wall_pores_mm),
        )


def fracture(recipe: Recipe, rng: np.random.Generator, spoiling: np.random.Generator) -> Fracture:
    """The crack that ``rng`` gives; ``spoiling`` places what a plain crack does not have.

    Raises ValueError where it does not fit its face, or its walls cross.
    """
    line_mm, left_mm, right_mm = _main_crack(recipe, rng)
    # Beside a bend sharper than its half width a wall runs backwards, and so in a loop.
    if any(np.any((np.diff(wall, axis=0) * np.diff(line_mm, axis=0)).sum(axis=1) <= 0) for wall in (left_mm, right_mm)):
        raise ValueError("a wall of the crack crosses itself: give it less wander, longer waves or less width")
    on_face = depth_inside(line_mm, (0, 0, *recipe.face_mm)) > -1e-6
    sides = [_side_crack(line_mm[on_face], side, recipe, spoiling) for side in recipe.side_cracks]
    return Fracture(
        line_mm=line_mm,
        left_mm=left_mm,
        right_mm=right_mm,
        side_lines_mm=tuple(line for line, _ in sides),
        side_rings_mm=tuple(ring for _, ring in sides),
        stones_mm=tuple(_stones(line_mm[on_face], left_mm[on_face], right_mm[on_face], recipe.stones, spoiling)),
        wall_pores_mm=tuple(_wall_pores(left_mm[on_face], right_mm[on_face], recipe.wall_pores, spoiling)),
    )


def round_pores(recipe: Recipe, walls_mm: Floats, rng: np.random.Generator) -> list[Floats]:
    """Round pores anywhere on the face but at the crack, whose truth they would change."""
    from scipy.spatial import KDTree

    near_crack = KDTree(walls_mm)
    rings = []
    for _ in range(recipe.pores):
        centre_mm = rng.uniform((1.5, 1.5), np.array(recipe.face_mm) - 1.5)
        radius_mm = min(0.16 * np.exp(0.55 * rng.standard_normal()), 0.9)
        if near_crack.query(centre_mm)[0] > radius_mm + 0.6 + recipe.width_mm / 2:
            rings.append(_circle(centre_mm, radius_mm))
    return rings


def mean_width_mm(centreline_mm: Floats, width_mm: Floats) -> float:
    """Averaged over arc length."""
    s_mm = arc_length(centreline_mm)
    return float(np.trapezoid(width_mm, s_mm) / s_mm[-1])


def _main_crack(recipe: Recipe, rng: np.random.Generator) -> tuple[Floats, Floats, Floats]:
    """Centreline, left and right wall, station by station; an open crack runs on beyond the face."""
    from scipy.optimize import root_scalar

    wander = _harmonics(rng, longest=1.0, shortest=recipe.shortest_wave, decay=1.5)
    swell = _harmonics(rng, longest=0.7, shortest=0.04, decay=1.0)
    rough = [_harmonics(rng, longest=0.04, shortest=0.006, decay=0.7) for _ in range(2)]
    width_face, height_face = recipe.face_mm
    centre = np.array([width_face / 2 + recipe.offset_mm, height_face / 2])
    steps = round(recipe.length_mm / STEP_MM)
    beyond = round(max(12.0, 5 * recipe.width_mm) / STEP_MM) if recipe.ends == "open" else 0
    t = np.arange(-beyond, steps + beyond + 1) / steps
    sideways_mm = recipe.wander_mm * (wander(t) - wander(np.zeros(1)) * (1 - t) - wander(np.ones(1)) * t)

    def line(chord: Floats) -> Floats:
        along = chord / np.linalg.norm(chord)
        normal = np.array([-along[1], along[0]])
        return centre + np.outer(t - 0.5, chord) + np.outer(sideways_mm, normal)

    def chord(scale: float) -> Floats:
        if recipe.ends == "open":
            return np.array([scale, height_face])
        angle = np.radians(recipe.angle_deg)
        return scale * np.array([np.cos(angle), np.sin(angle)])

    def too_long_mm(scale: float) -> float:
        return float(arc_length(line(chord(scale))[(t >= 0) & (t <= 1)])[-1] - recipe.length_mm)

    shortest = 0.0 if recipe.ends == "open" else 0.1 * recipe.length_mm
    if too_long_mm(shortest) >= 0:
        raise ValueError(
            f"a crack {recipe.length_mm:g} mm long is too short for a face {height_face:g} mm high and its wander"
        )
    scale = root_scalar(too_long_mm, bracket=(shortest, recipe.length_mm), xtol=1e-9).root
    line_mm = line(chord(scale))
    on_face = (t >= 0) & (t <= 1)
    if np.any(line_mm[on_face] < -1e-6) or np.any(line_mm[on_face] > np.array(recipe.face_mm) + 1e-6):
        raise ValueError(f"a crack {recipe.length_mm:g} mm long does not fit a face of {recipe.face_mm} mm")

    shape = np.clip(1 + recipe.width_variation * swell(t), 0.3, None)
    if recipe.ends == "closed":
        taper_mm = TAPER_WIDTHS * recipe.width_mm
        to_tip_mm = np.minimum(t, 1 - t) * recipe.length_mm
        shape *= np.sqrt(np.clip(to_tip_mm / taper_mm, 0, 1))
    width_mm = shape * recipe.width_mm / mean_width_mm(line_mm[on_face], shape[on_face])
    along = np.gradient(line_mm, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    normal = np.column_stack([-along[:, 1], along[:, 0]])
    fade = np.minimum(1, shape)
    left_mm, right_mm = (
        line_mm + side * (width_mm / 2 + recipe.roughness_mm * fade * own(t))[:, None] * normal
        for side, own in zip((1, -1), rough, strict=True)
    )
    return line_mm, left_mm, right_mm


def _side_crack(line_mm: Floats, side: SideCrack, recipe: Recipe, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Its centre polyline from the main crack's, and its ring."""
    s_mm = arc_length(line_mm)
    start = int(np.searchsorted(s_mm, side.at * s_mm[-1]))
    along = tangents(line_mm)[start]
    turn = np.radians(side.angle_deg if side.side == "left" else -side.angle_deg)
    way = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]) @ along
    normal = np.array([-way[1], way[0]])
    t = np.linspace(0, 1, round(side.length_mm / STEP_MM) + 1)
    wander = _harmonics(rng, longest=1.0, shortest=0.12, decay=1.5)
    sideways_mm = 0.02 * side.length_mm * (wander(t) - wander(np.zeros(1)))
    branch_mm = line_mm[start] + side.length_mm * np.outer(t, way) + np.outer(sideways_mm, normal)
    if depth_inside(branch_mm, (0, 0, *recipe.face_mm)).min() < 1:
        raise ValueError(f"a side crack {side.length_mm:g} mm long does not fit a face of {recipe.face_mm} mm")
    to_tip_mm = (1 - t) * side.length_mm
    half_mm = side.width_mm / 2 * np.sqrt(np.clip(to_tip_mm / (TAPER_WIDTHS * side.width_mm), 0, 1))
    offset_mm = half_mm[:, None] * left_normals(branch_mm)
    return branch_mm, np.concatenate([branch_mm - offset_mm, (branch_mm + offset_mm)[::-1]])


def _stones(line_mm: Floats, left_mm: Floats, right_mm: Floats, count: int, rng: np.random.Generator) -> list[Floats]:
    """Rough ovals along the middle of the crack, a third as wide as it is there, one to each stretch of its length."""
    if count == 0:
        return []
    s_mm = arc_length(line_mm)
    across_mm = (left_mm - right_mm) / 2
    turn = np.linspace(0, 2 * np.pi, 72, endpoint=False)
    rings = []
    for number in range(count):
        place = 0.1 + 0.8 * (number + rng.uniform(0.3, 0.7)) / count
        width_mm = 2 * float(np.linalg.norm(across_mm[int(np.searchsorted(s_mm, place * s_mm[-1]))]))
        rough = 1 + 0.08 * np.cos(3 * turn + rng.uniform(0, 6)) + 0.05 * np.cos(5 * turn + rng.uniform(0, 6))
        along_mm = place * s_mm[-1] + rng.uniform(0.6, 1.0) * width_mm * rough * np.cos(turn)
        share = rng.uniform(-0.2, 0.2) + rng.uniform(0.3, 0.4) * rough * np.sin(turn)
        middle_mm, side_mm = (
            np.column_stack([np.interp(along_mm, s_mm, column) for column in curve.T])
            for curve in ((left_mm + right_mm) / 2, across_mm)
        )
        ring = middle_mm + share[:, None] * side_mm
        rings.append(ring if signed_area(ring) < 0 else ring[::-1])
    return rings


def _wall_pores(left_mm: Floats, right_mm: Floats, count: int, rng: np.random.Generator) -> list[Floats]:
    """Round pores whose centres lie just outside a wall, so that each opens into the crack."""
    rings = []
    for _ in range(count):
        wall_mm, other_mm = (left_mm, right_mm) if rng.uniform() < 0.5 else (right_mm, left_mm)
        station = int(rng.uniform(0.08, 0.92) * len(wall_mm))
        outward = wall_mm[station] - other_mm[station]
        radius_mm = min(0.35 * np.exp(0.4 * rng.standard_normal()), 0.9)
        away_mm = rng.uniform(0.2, 0.9) * radius_mm
        rings.append(_circle(wall_mm[station] + away_mm * outward / np.linalg.norm(outward), radius_mm))
    return rings


def _circle(centre_mm: Floats, radius_mm: float) -> Floats:
    turn = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    return centre_mm + radius_mm * np.column_stack([np.cos(turn), np.sin(turn)])


def _harmonics(rng: np.random.Generator, longest: float, shortest: float, decay: float) -> Callable[[Floats], Floats]:
    """A smooth random function of unit standard deviation, of wavelengths between the two given."""
    waves = np.arange(1.0, np.floor(longest / shortest) + 1) / longest
    size = (waves * longest) ** -decay * rng.uniform(0.5, 1.0, len(waves))
    size /= np.sqrt((size**2).sum() / 2)
    phase = rng.uniform(0, 2 * np.pi, len(waves))
    return lambda t: np.sin(2 * np.pi * np.outer(t, waves) + phase) @ size
