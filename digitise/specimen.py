"""A synthetic top-down photo of a cracked mortar face, with exact truth, for demo, tests and benchmarks.

``python -m digitise.specimen DIR`` writes photo.jpg and truth.json of the default recipe. Same seed, same picture.
"""

import sys
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from digitise.markers import black_modules
from digitise.polyline import depth_inside, project, rectangle
from digitise.rendering import Look, Scene, render_jpeg
from digitise.settings import Marker, MarkerBoard, PhotoInput
from sealtwin.files import write_bytes, write_json
from sealtwin.records import Floats, Integers, arc_length

GENERATOR_VERSION = 1
"""Raised whenever the same seed would give another picture."""
STEP_MM = 0.05
"""Between points of the exact curves, before they are thinned for truth.json."""
FRAME_MM = 26.0
"""Board seen around the face: room for a row of markers with white around each."""
MARKER_MM = 16.0
MARKER_OFFSET_MM = 14.0
"""From the edge of the face to the centres of the markers."""

DIFFUSE = Look(light=0.3, grain=0.09, blur_px=0.9, noise=0.02, jpeg_quality=88)
"""A steady hand, a diffuse lamp to one side, a phone's compression."""


@dataclass(frozen=True)
class Recipe:
    """A sample, its crack and its photo. The defaults are the trial of the paper, reconstructed."""

    face_mm: tuple[float, float] = (160.0, 40.0)
    length_mm: float = 80.0
    """Of the centreline: between the edges of the face where the ends are open, else between the tips."""
    width_mm: float = 3.1
    """Mean over the centreline."""
    ends: Literal["open", "closed"] = "open"
    """open: the crack crosses the face from its lower edge to its upper edge; closed: it ends in two tips."""
    angle_deg: float = 30.0
    """Of a closed crack to the long side; an open one's follows from its length and the height of the face."""
    wander_mm: float = 1.0
    """Standard deviation of the centreline from the straight line."""
    width_variation: float = 0.08
    """Standard deviation of the width over its mean: small, since the sample was split and its halves set apart."""
    roughness_mm: float = 0.05
    """Standard deviation of each wall's own roughness, at the scale of sand."""
    mirrored: bool = False
    """Swap left and right on the face; the markers stay readable."""
    mm_per_px: float = 0.1
    tilt_deg: float = 3.0
    """Of the camera, about the x axis, and half of it about the y axis."""
    camera_mm: float = 450.0
    """Distance of the camera."""
    gap_mm: float = 0.5
    """Shadow between the face and the board."""
    pores: int = 160
    look: Look = DIFFUSE


PAPER = Recipe()


@dataclass(frozen=True)
class Specimen:
    """A photo, and what it shows exactly. Lengths in the frame of the face: origin at its lower left corner."""

    seed: int
    recipe: Recipe
    jpeg: bytes
    centreline_mm: Floats
    width_mm: Floats
    """At each point of the centreline."""
    left_wall_mm: Floats
    """Clipped to the face, like the right one; the two need not have the same number of points."""
    right_wall_mm: Floats
    px_from_mm: Floats
    """Homography, (3, 3)."""
    board: MarkerBoard

    @property
    def outline_mm(self) -> Floats:
        """Ring, counter-clockwise."""
        return np.concatenate([self.right_wall_mm, self.left_wall_mm[::-1]])

    @property
    def ends_px(self) -> tuple[tuple[float, float], tuple[float, float]]:
        first, last = project(self.px_from_mm, self.centreline_mm[[0, -1]])
        return (float(first[0]), float(first[1])), (float(last[0]), float(last[1]))

    def photo_input(self, file: Path = Path("photo.jpg"), with_ends: bool = True) -> PhotoInput:
        """The settings that a user of this photo would write."""
        return PhotoInput(
            file=file,
            data="synthetic",
            ends_px=self.ends_px if with_ends else None,
            markers=self.board,
            face_mm=self.recipe.face_mm,
        )

    def write(self, folder: Path) -> None:
        write_bytes(folder / "photo.jpg", self.jpeg)
        write_json(folder / "truth.json", self.truth())

    def truth(self) -> dict[str, object]:
        """The content of truth.json."""
        every = round(0.25 / STEP_MM)
        thin = np.unique(np.append(np.arange(0, len(self.centreline_mm), every), len(self.centreline_mm) - 1))
        centreline_mm = self.centreline_mm[thin]
        return {
            "about": "SYNTHETIC photo of a procedural crack; no camera and no sample were involved.",
            "generator": f"digitise.specimen version {GENERATOR_VERSION}",
            "seed": self.seed,
            "recipe": asdict(self.recipe),
            "length_mm": float(arc_length(self.centreline_mm)[-1]),
            "mean_width_mm": mean_width_mm(self.centreline_mm, self.width_mm),
            "ends_px": self.ends_px,
            "markers": self.board.model_dump(),
            "px_from_mm": self.px_from_mm,
            "centreline_mm": np.round(centreline_mm, 4),
            "centreline_px": np.round(project(self.px_from_mm, centreline_mm), 3),
            "width_mm": np.round(self.width_mm[thin], 4),
            "left_wall_mm": np.round(self.left_wall_mm[_thinned(self.left_wall_mm)], 4),
            "right_wall_mm": np.round(self.right_wall_mm[_thinned(self.right_wall_mm)], 4),
        }


def make_specimen(seed: int = 1, recipe: Recipe = PAPER) -> Specimen:
    """Draw the crack that ``seed`` gives, and photograph it.

    Raises ValueError where the recipe's crack does not fit its face.
    """
    shape_rng, picture_rng = np.random.default_rng([seed, 1]), np.random.default_rng([seed, 2])
    line_mm, left_mm, right_mm = _crack(recipe, shape_rng)
    if recipe.mirrored:
        mirror = np.array([-1.0, 1.0])
        shift = np.array([recipe.face_mm[0], 0.0])
        line_mm, left_mm, right_mm = (points * mirror + shift for points in (line_mm, right_mm, left_mm))
    board = _board(recipe)
    px_from_mm, size_px = _camera(recipe)
    jpeg = render_jpeg(
        _scene(recipe, board, px_from_mm, size_px, left_mm, right_mm, picture_rng), recipe.look, picture_rng
    )
    width_mm = np.linalg.norm(left_mm - right_mm, axis=1)
    inside = depth_inside(line_mm, (0, 0, *recipe.face_mm)) > -1e-6
    return Specimen(
        seed=seed,
        recipe=recipe,
        jpeg=jpeg,
        centreline_mm=line_mm[inside],
        width_mm=width_mm[inside],
        left_wall_mm=_clipped(left_mm, recipe),
        right_wall_mm=_clipped(right_mm, recipe),
        px_from_mm=px_from_mm,
        board=board,
    )


def mean_width_mm(centreline_mm: Floats, width_mm: Floats) -> float:
    """Averaged over arc length."""
    s_mm = arc_length(centreline_mm)
    return float(np.trapezoid(width_mm, s_mm) / s_mm[-1])


def _crack(recipe: Recipe, rng: np.random.Generator) -> tuple[Floats, Floats, Floats]:
    """Centreline, left and right wall, station by station; an open crack runs on beyond the face."""
    from scipy.optimize import root_scalar

    wander = _harmonics(rng, longest=1.0, shortest=0.06, decay=1.5)
    swell = _harmonics(rng, longest=0.7, shortest=0.04, decay=1.0)
    rough = [_harmonics(rng, longest=0.04, shortest=0.006, decay=0.7) for _ in range(2)]
    width_face, height_face = recipe.face_mm
    centre = np.array([width_face, height_face]) / 2
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
        taper_mm = 4 * recipe.width_mm
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


def _harmonics(rng: np.random.Generator, longest: float, shortest: float, decay: float) -> Callable[[Floats], Floats]:
    """A smooth random function of unit standard deviation, of wavelengths between the two given."""
    waves = np.arange(1.0, np.floor(longest / shortest) + 1) / longest
    size = (waves * longest) ** -decay * rng.uniform(0.5, 1.0, len(waves))
    size /= np.sqrt((size**2).sum() / 2)
    phase = rng.uniform(0, 2 * np.pi, len(waves))
    return lambda t: np.sin(2 * np.pi * np.outer(t, waves) + phase) @ size


def _clipped(wall_mm: Floats, recipe: Recipe) -> Floats:
    """The part on the face, with its crossings of the lower and upper edge; a closed wall is all of it."""
    if recipe.ends == "closed":
        return wall_mm
    x, y = wall_mm.T
    height = recipe.face_mm[1]
    inner = (y > 0) & (y < height)
    # Roughness never turns an oblique wall back, so y grows along it and may be looked up.
    crossings = np.array([[np.interp(edge, y, x), edge] for edge in (0.0, height)])
    return np.concatenate([crossings[:1], wall_mm[inner], crossings[1:]])


def _thinned(wall_mm: Floats) -> Integers:
    """Indices about 0.1 mm apart, both ends kept."""
    return np.unique(np.append(np.arange(0, len(wall_mm), 2), len(wall_mm) - 1))


def _board(recipe: Recipe) -> MarkerBoard:
    """Eight markers round the face: at its corners and in the middle of its sides."""
    width, height = recipe.face_mm
    x_mm = (-MARKER_OFFSET_MM, width / 2, width + MARKER_OFFSET_MM)
    y_mm = (-MARKER_OFFSET_MM, height / 2, height + MARKER_OFFSET_MM)
    places = [(x, y) for y in y_mm for x in x_mm if (x, y) != (width / 2, height / 2)]
    return MarkerBoard(
        size_mm=MARKER_MM, markers=tuple(Marker(id=number, x_mm=x, y_mm=y) for number, (x, y) in enumerate(places))
    )


def _camera(recipe: Recipe) -> tuple[Floats, tuple[int, int]]:
    """Homography from the face (mm, y up) to the photo (px, y down), and the photo's width and height."""
    size_px = tuple(round((side + 2 * FRAME_MM) / recipe.mm_per_px) for side in recipe.face_mm)
    focal_px = recipe.camera_mm / recipe.mm_per_px
    about_x, about_y = np.radians(recipe.tilt_deg), np.radians(recipe.tilt_deg / 2)
    rotation_x = np.array([[1, 0, 0], [0, np.cos(about_x), -np.sin(about_x)], [0, np.sin(about_x), np.cos(about_x)]])
    rotation_y = np.array([[np.cos(about_y), 0, np.sin(about_y)], [0, 1, 0], [-np.sin(about_y), 0, np.cos(about_y)]])
    rotation = rotation_y @ rotation_x
    lens = np.array([[focal_px, 0, (size_px[0] - 1) / 2], [0, focal_px, (size_px[1] - 1) / 2], [0.0, 0.0, 1.0]])
    pose = np.column_stack([rotation[:, 0], rotation[:, 1], [0, 0, recipe.camera_mm]])
    to_camera = np.array([[1, 0, -recipe.face_mm[0] / 2], [0, -1, recipe.face_mm[1] / 2], [0, 0, 1]])
    homography = lens @ pose @ to_camera
    return homography / homography[2, 2], (size_px[0], size_px[1])


def _scene(
    recipe: Recipe,
    board: MarkerBoard,
    px_from_mm: Floats,
    size_px: tuple[int, int],
    left_mm: Floats,
    right_mm: Floats,
    rng: np.random.Generator,
) -> Scene:
    width, height = recipe.face_mm
    crack_mm = np.concatenate([right_mm, left_mm[::-1]])
    lit_mm = np.array([0.12, -0.12]) * min(1.0, recipe.width_mm)

    def box(grown_mm: float) -> Floats:
        return project(px_from_mm, rectangle((-grown_mm, -grown_mm, width + grown_mm, height + grown_mm)))

    squares = [black_modules(board, marker) for marker in board.markers]
    return Scene(
        size_px=size_px,
        px_per_mm=1 / recipe.mm_per_px,
        face=box(0.0),
        gap=box(recipe.gap_mm),
        crack=project(px_from_mm, crack_mm),
        crack_floor=project(px_from_mm, crack_mm + lit_mm),
        pores=[project(px_from_mm, ring) for ring in _pores(recipe, np.concatenate([left_mm, right_mm]), rng)],
        ink=[project(px_from_mm, outer) for outer, _ in squares],
        paper=[project(px_from_mm, cell) for _, cells in squares for cell in cells],
    )


def _pores(recipe: Recipe, walls_mm: Floats, rng: np.random.Generator) -> list[Floats]:
    """Round pores anywhere on the face but at the crack, whose truth they would change."""
    from scipy.spatial import KDTree

    near_crack = KDTree(walls_mm)
    turn = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    rings = []
    for _ in range(recipe.pores):
        centre_mm = rng.uniform((1.5, 1.5), np.array(recipe.face_mm) - 1.5)
        radius_mm = min(0.16 * np.exp(0.55 * rng.standard_normal()), 0.9)
        if near_crack.query(centre_mm)[0] > radius_mm + 0.6 + recipe.width_mm / 2:
            rings.append(centre_mm + radius_mm * np.column_stack([np.cos(turn), np.sin(turn)]))
    return rings


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: python -m digitise.specimen DIR")
    make_specimen().write(Path(sys.argv[1]))
