"""The synthetic cracks that tracing is held to: clean ones and hard ones."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from fixtures.generate.fracture import fracture
from fixtures.generate.lighting import MODERATE_LAMP, STRONG_LAMP, Look, SideLamp
from fixtures.generate.recipe import Recipe
from fixtures.generate.specimen import Specimen
from sealtwin.core.records import Floats

Ends = tuple[tuple[float, float], tuple[float, float]]
CLICK_PX = 2.0
"""Standard deviation, in x and in y, of an end that somebody clicks."""
FACE_HEIGHT_MM = 40.0
"""The paper's; an open crack crosses it."""


@dataclass(frozen=True)
class Case:
    """One crack to trace between clicked ends, and the means that the tool offers against its difficulty."""

    tier: str
    group: str
    seed: int
    recipe: Recipe
    edge_fraction: float = 0.5

    @property
    def name(self) -> str:
        return f"{self.tier} {self.group} {self.seed}"

    def ends_px(self, truth: Specimen) -> Ends:
        """Return where the user clicks: the true ends, missed by a hand's noise."""
        return clicked(truth.ends_px, CLICK_PX, [self.seed, 7], np.array(truth.camera.size_px))


def clicked(ends_px: Sequence[Sequence[float]] | Floats, sd_px: float, seed: Sequence[int], size_px: Floats) -> Ends:
    """Return the ends as a hand clicks them, with errors of this standard deviation in x and y, inside the photo."""
    miss_px = sd_px * np.random.default_rng(seed).standard_normal((2, 2))
    (a, b), (c, d) = np.clip(np.array(ends_px) + miss_px, 0, size_px - 1).tolist()
    return (a, b), (c, d)


def clean_case(seed: int) -> Case:
    """In turn closed and open, every fourth through a lens that bends; every other number by chance."""
    ends, bent = _ends(seed), seed % 4 in (2, 3)

    def draw(rng: np.random.Generator) -> Recipe:
        return replace(
            _sound_recipe(rng, ends, least_px=16.0, most_px=80.0),
            tilt_deg=rng.uniform(0, 10),
            lens_k1=rng.uniform(-0.2, -0.03) if bent else 0.0,
            camera_mm=rng.uniform(262, 450),
        )

    return Case("clean", f"{ends}{', bent' if bent else ''}", seed, _fitting(seed, (8,), draw))


def oblique_case(seed: int) -> Case:
    """A clean crack that is open at both edges of the face, 0 to 60 degrees from the shortest way across."""

    def draw(rng: np.random.Generator) -> Recipe:
        recipe, from_square = _sound_recipe(rng, "open", least_px=16.0, most_px=80.0), np.radians(rng.uniform(0, 60))
        # A little longer than the straight way, for the wander.
        length_mm = float(1.01 * FACE_HEIGHT_MM / np.cos(from_square)) + 0.5
        width_mm = min(recipe.width_mm, length_mm / 10)
        return replace(
            recipe,
            length_mm=length_mm,
            face_mm=(float(length_mm * np.sin(from_square)) + 60, FACE_HEIGHT_MM),
            width_mm=width_mm,
            shortest_wave=max(0.06, 2.5 * width_mm / length_mm),
            tilt_deg=rng.uniform(0, 10),
        )

    return Case("oblique", "open", seed, _fitting(seed, (11,), draw))


def _fitting(seed: int, kind: tuple[int, ...], draw: Callable[[np.random.Generator], Recipe]) -> Recipe:
    """Return the first recipe whose crack fits its face."""
    for attempt in range(100):
        recipe = draw(np.random.default_rng([seed, *kind, attempt]))
        try:
            fracture(recipe, np.random.default_rng([seed, 1]), np.random.default_rng([seed, 3]))
        except ValueError:
            continue
        return recipe
    raise RuntimeError(f"no crack of seed {seed} fits its face")


HARD: dict[str, Callable[[Recipe, np.random.Generator], Recipe]] = {
    "stains": lambda recipe, rng: replace(recipe, stain=rng.uniform(0.3, 0.5)),
    "shadow": lambda recipe, rng: _looking(recipe, shadow=rng.uniform(0.4, 0.6)),
    "wall lit a little": lambda recipe, rng: _lit(recipe, rng, MODERATE_LAMP),
    "wall lit, fraction 0.7": lambda recipe, rng: _lit(recipe, rng, STRONG_LAMP),
    "pores at the wall": lambda recipe, rng: replace(recipe, wall_pores=14, pores=400),
    "blur 2 px": lambda recipe, rng: _looking(recipe, blur_px=2.0),
    "JPEG 50": lambda recipe, rng: _looking(recipe, jpeg_quality=50, noise=0.03),
    "8 to 15 px": lambda recipe, rng: replace(recipe, width_mm=rng.uniform(8.5, 14.5) * recipe.mm_per_px),
}


def hard_case(group: str, seed: int) -> Case:
    """A clean crack with one difficulty, of a size that a user would meet it in."""

    def draw(rng: np.random.Generator) -> Recipe:
        return HARD[group](_sound_recipe(rng, _ends(seed), least_px=16.0, most_px=50.0), rng)

    # No kind has the number 3: the photos of a kind follow from its own.
    number = list(HARD).index(group)
    recipe = _fitting(seed, (9, number + (number >= 3)), draw)
    return Case("hard", group, seed, recipe, 0.7 if "fraction" in group else 0.5)


def _ends(seed: int) -> Literal["closed", "open"]:
    return "open" if seed % 2 else "closed"


def _sound_recipe(rng: np.random.Generator, ends: Literal["closed", "open"], least_px: float, most_px: float) -> Recipe:
    """A crack ``least_px`` to ``most_px`` wide in a steady photo in diffuse light."""
    mm_per_px = rng.uniform(0.06, 0.15)
    length_mm = rng.uniform(48, 80)
    # A crack must be ten widths long, or it is a hole.
    widest_mm = min(8.0, length_mm / 10, most_px * mm_per_px)
    width_mm = float(np.exp(rng.uniform(np.log(least_px * mm_per_px), np.log(widest_mm))))
    return Recipe(
        face_mm=(length_mm + 40, FACE_HEIGHT_MM),
        offset_mm=rng.uniform(-15, 15),
        ends=ends,
        length_mm=length_mm,
        width_mm=width_mm,
        angle_deg=rng.uniform(5, 22),
        wander_mm=rng.uniform(0.4, 1.4),
        shortest_wave=max(0.06, 2.5 * width_mm / length_mm),
        # The halves of a sample that is cracked through were set apart as they are, the mouth of a tip was not.
        width_variation=rng.uniform(0.03, 0.12 if ends == "open" else 0.2),
        mirrored=bool(rng.integers(2)),
        mm_per_px=mm_per_px,
        tilt_deg=rng.uniform(0, 5),
        look=Look(
            light=rng.uniform(0.1, 0.4),
            grain=rng.uniform(0.05, 0.12),
            blur_px=rng.uniform(0.5, 1.2),
            noise=rng.uniform(0.01, 0.03),
            jpeg_quality=int(rng.integers(80, 96)),
        ),
    )


def _looking(recipe: Recipe, **changes: object) -> Recipe:
    return replace(recipe, look=replace(recipe.look, **changes))


def _lit(recipe: Recipe, rng: np.random.Generator, lamp: SideLamp) -> Recipe:
    """The lamp stands within 30 degrees of square to the crack, on either side of it."""
    run_deg = recipe.angle_deg
    if recipe.ends == "open":
        run_deg = np.degrees(np.arcsin(min(1.0, FACE_HEIGHT_MM / recipe.length_mm)))
    if recipe.mirrored:
        run_deg = 180 - run_deg
    from_deg = run_deg + rng.choice([-90, 90]) + rng.uniform(-30, 30)
    return _looking(recipe, light=0.4, lamp=replace(lamp, from_deg=float(from_deg)))
