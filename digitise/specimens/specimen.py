"""A synthetic top-down photo of a cracked mortar face, with exact truth, for demo, tests and benchmarks.

``python -m digitise.specimens.specimen DIR`` writes photo.jpg and truth.json of the default recipe. Same seed, same
picture.
"""

import sys
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from digitise.geometry.polyline import depth_inside, rectangle
from digitise.scaling.camera import Camera, camera_above
from digitise.scaling.markers import black_modules, corners_mm
from digitise.settings import Marker, MarkerBoard, PhotoInput
from digitise.specimens.fracture import STEP_MM, Fracture, fracture, mean_width_mm, round_pores
from digitise.specimens.lighting import Look, exposed, illuminated, shadowed
from digitise.specimens.recipe import PAPER, Recipe
from digitise.specimens.rendering import BOARD, Scene, draw_texture, paint
from sealtwin.records import Floats, Integers, arc_length
from sealtwin.store.files import write_bytes, write_json

GENERATOR_VERSION = 1
"""Raised whenever the same seed would give another picture."""
FRAME_MM = 26.0
"""Board seen around the face: room for a row of markers with white around each."""
MARKER_MM = 16.0
MARKER_OFFSET_MM = 14.0
"""From the edge of the face to the centres of the markers."""
CARD = 1.3
"""Side of a white card over that of the marker on it."""
LIT_RIM_MM = (0.12, -0.12)
"""How far the crack's floor is seen shifted from its mouth, in diffuse light: by eye."""


@dataclass(frozen=True)
class Specimen:
    """A photo, and what it shows exactly. Lengths in the frame of the face: origin at its lower left corner."""

    seed: int
    recipe: Recipe
    jpeg: bytes
    second_jpeg: bytes | None
    """Lit from the other side, where the recipe asks for it."""
    centreline_mm: Floats
    width_mm: Floats
    """At each point of the centreline."""
    left_wall_mm: Floats
    """Clipped to the face, like the right one; the two need not have the same number of points."""
    right_wall_mm: Floats
    branches_mm: tuple[Floats, ...]
    """Centre polylines of the side cracks, from the main crack outward; their rings, counter-clockwise, beside them."""
    branch_rings_mm: tuple[Floats, ...]
    islands_mm: tuple[Floats, ...]
    """Clockwise rings of what stands in the crack, level with the face."""
    camera: Camera
    board: MarkerBoard

    @property
    def outline_mm(self) -> Floats:
        """Ring of the main crack, counter-clockwise."""
        return np.concatenate([self.right_wall_mm, self.left_wall_mm[::-1]])

    @property
    def ends_px(self) -> tuple[tuple[float, float], tuple[float, float]]:
        first, last = self.to_px(self.centreline_mm[[0, -1]])
        return (float(first[0]), float(first[1])), (float(last[0]), float(last[1]))

    def to_px(self, points_mm: Floats) -> Floats:
        """Where the photo shows places on the face, (n, 2) to (n, 2)."""
        return self.camera.to_px(points_mm)

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
        """photo.jpg, truth.json and, where there is one, second.jpg."""
        write_bytes(folder / "photo.jpg", self.jpeg)
        if self.second_jpeg is not None:
            write_bytes(folder / "second.jpg", self.second_jpeg)
        write_json(folder / "truth.json", self.truth())

    def truth(self) -> dict[str, object]:
        """The content of truth.json."""
        every = round(0.25 / STEP_MM)
        thin = np.unique(np.append(np.arange(0, len(self.centreline_mm), every), len(self.centreline_mm) - 1))
        centreline_mm = self.centreline_mm[thin]
        return {
            "about": "SYNTHETIC photo of a procedural crack; no camera and no sample were involved.",
            "generator": f"digitise.specimens.specimen version {GENERATOR_VERSION}",
            "seed": self.seed,
            "recipe": asdict(self.recipe),
            "length_mm": float(arc_length(self.centreline_mm)[-1]),
            "mean_width_mm": mean_width_mm(self.centreline_mm, self.width_mm),
            "ends_px": self.ends_px,
            "markers": self.board.model_dump(),
            "px_from_mm": self.camera.homography,
            "lens": {"k1": self.camera.lens_k1, "focal_px": self.camera.focal_px},
            "centreline_mm": np.round(centreline_mm, 4),
            "centreline_px": np.round(self.to_px(centreline_mm), 3),
            "width_mm": np.round(self.width_mm[thin], 4),
            "left_wall_mm": np.round(self.left_wall_mm[_thinned(self.left_wall_mm)], 4),
            "right_wall_mm": np.round(self.right_wall_mm[_thinned(self.right_wall_mm)], 4),
            "branches_mm": [np.round(line, 4) for line in self.branches_mm],
            "islands_mm": [np.round(ring, 4) for ring in self.islands_mm],
        }


def make_specimen(seed: int = 1, recipe: Recipe = PAPER) -> Specimen:
    """Draw the crack that ``seed`` gives, and photograph it.

    Raises ValueError where the recipe's crack does not fit its face.
    """
    shape_rng, picture_rng, spoiling = (np.random.default_rng([seed, stream]) for stream in (1, 2, 3))
    crack = fracture(recipe, shape_rng, spoiling)
    if recipe.mirrored:
        crack = crack.mirrored(recipe.face_mm[0])
    board = _board(recipe)
    camera = camera_above(recipe.face_mm, FRAME_MM, recipe.mm_per_px, recipe.camera_mm, recipe.tilt_deg, recipe.lens_k1)
    jpegs = _photos(recipe, crack, board, camera, seed, picture_rng)
    inside = depth_inside(crack.line_mm, (0, 0, *recipe.face_mm)) > -1e-6
    return Specimen(
        seed=seed,
        recipe=recipe,
        jpeg=jpegs[0],
        second_jpeg=jpegs[1] if recipe.second_photo else None,
        centreline_mm=crack.line_mm[inside],
        width_mm=np.linalg.norm(crack.left_mm - crack.right_mm, axis=1)[inside],
        left_wall_mm=_clipped(crack.left_mm, recipe),
        right_wall_mm=_clipped(crack.right_mm, recipe),
        branches_mm=crack.side_lines_mm,
        branch_rings_mm=crack.side_rings_mm,
        islands_mm=crack.stones_mm,
        camera=camera,
        board=board,
    )


def _photos(
    recipe: Recipe, crack: Fracture, board: MarkerBoard, camera: Camera, seed: int, rng: np.random.Generator
) -> list[bytes]:
    """One, or one from either side: the same surface, other light, other noise."""
    look = recipe.look
    scene = _scene(recipe, crack, board, camera, rng)
    texture = draw_texture(scene, rng, np.random.default_rng([seed, 4]) if recipe.stain else None)
    chord_px = camera.to_px(crack.line_mm[[0, -1]])
    shots = [(look, scene, rng)]
    if recipe.second_photo:
        other = look.from_the_other_side
        floor_px = _floor_px(recipe, other, crack, camera)
        shots.append((other, replace(scene, crack_floor=floor_px), np.random.default_rng([seed, 5])))
    photos = []
    for shot, seen, own in shots:
        light = illuminated(paint(seen, texture, shot.grain, recipe.stain, shot.lamp), shot, own)
        if shot.shadow:
            light = shadowed(light, shot.shadow, chord_px, scene.px_per_mm, np.random.default_rng([seed, 6]))
        photos.append(exposed(light, shot, own))
    return photos


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
        dictionary=recipe.dictionary,
        size_mm=MARKER_MM,
        markers=tuple(Marker(id=number, x_mm=x, y_mm=y) for number, (x, y) in enumerate(places)),
    )


def _scene(recipe: Recipe, crack: Fracture, board: MarkerBoard, camera: Camera, rng: np.random.Generator) -> Scene:
    width, height = recipe.face_mm

    def box(grown_mm: float) -> Floats:
        return camera.ring_px(rectangle((-grown_mm, -grown_mm, width + grown_mm, height + grown_mm)))

    squares = [black_modules(board, marker) for marker in board.markers]
    cards = [] if recipe.board == BOARD else [corners_mm(board, marker) for marker in board.markers]
    return Scene(
        size_px=camera.size_px,
        px_per_mm=1 / recipe.mm_per_px,
        face=box(0.0),
        gap=box(recipe.gap_mm),
        crack=camera.to_px(_ring_mm(crack)),
        crack_floor=_floor_px(recipe, recipe.look, crack, camera),
        pores=[camera.to_px(ring) for ring in (*round_pores(recipe, crack.walls_mm, rng), *crack.wall_pores_mm)],
        ink=[camera.ring_px(outer) for outer, _ in squares],
        paper=[camera.ring_px(cell) for _, cells in squares for cell in cells],
        cards=[camera.ring_px(card.mean(axis=0) + CARD * (card - card.mean(axis=0))) for card in cards],
        side_cracks=[camera.to_px(ring) for ring in crack.side_rings_mm],
        stones=[camera.to_px(ring) for ring in crack.stones_mm],
        mortar=recipe.mortar,
        board=recipe.board,
    )


def _ring_mm(crack: Fracture) -> Floats:
    return np.concatenate([crack.right_mm, crack.left_mm[::-1]])


def _floor_px(recipe: Recipe, look: Look, crack: Fracture, camera: Camera) -> Floats:
    """The crack's ring less the rim of a wall that the lamp lights: shifted toward the lamp."""
    shift_mm = np.array(LIT_RIM_MM) * min(1.0, recipe.width_mm)
    if look.lamp is not None:
        angle = np.radians(look.lamp.from_deg)
        shift_mm = look.lamp.rim * recipe.width_mm * np.array([np.cos(angle), np.sin(angle)])
    return camera.to_px(_ring_mm(crack) + shift_mm)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: python -m digitise.specimens.specimen DIR")
    make_specimen().write(Path(sys.argv[1]))
