"""Emulated photos of paste on the printed marker sheet, with exact truth. Nothing in them was measured."""

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from scipy.optimize import root_scalar

from digitise.geometry.polyline import coverage
from digitise.image.raster import DISPLAY_GAMMA, blurred
from digitise.scale.marker_scale import black_modules, board_around, board_toml
from fixtures.generate.camera import camera_above
from sealtwin.core.records import Floats
from simulate.spread_law import flat_stress_pa, stretched_stress_pa

FACE_MM = (150.0, 150.0)  # Opening of the sheet
MARKER_MM, FRAME_MM = 12.0, 24.0
BOARD = board_around(FACE_MM, MARKER_MM, "4x4_50", 8)
PAPER, INK, DARK, LIGHT, FILM = 0.8, 0.035, 0.16, 0.7, 0.25
"""Reflectances of paper, ink, cement paste, white paste, and of a dark film in the opening."""
DISTANCE_MM = 450.0


@dataclass(frozen=True)
class Blob:
    """A blob, and how its photo is taken."""

    radius_mm: float  # Of the circle of its area
    middle_mm: tuple[float, float] = (75.0, 75.0)
    unround: tuple[float, ...] = (0.0, 0.0, 0.0)  # Amplitudes of two, three and four lobes, over the mean radius
    turn: float = 0.0
    dark: bool = True
    mm_per_px: float = 0.25
    tilt_deg: float = 3.0
    lens_k1: float = 0.0
    gradient: float = 0.2  # Light's change across the photo
    noise: float = 0.01  # Of the light, relative
    seed: int = 0

    @property
    def ring_mm(self) -> Floats:
        turn = np.linspace(0, 2 * np.pi, 720, endpoint=False)
        lobes = [size * np.cos(number * (turn - self.turn)) for number, size in enumerate(self.unround, start=2)]
        away = 1 + np.sum(lobes, axis=0)
        away *= self.radius_mm / np.sqrt(np.mean(away**2))
        return np.array(self.middle_mm) + away[:, None] * np.column_stack([np.cos(turn), np.sin(turn)])

    def draw(self) -> np.ndarray:
        """Return the photo as 8-bit grey, (height, width)."""
        rng = np.random.default_rng(self.seed)
        camera = camera_above(FACE_MM, FRAME_MM, self.mm_per_px, DISTANCE_MM, self.tilt_deg, self.lens_k1)
        width, height = camera.size_px
        light = np.full((height, width), PAPER)

        def paint(ring_mm: Floats, reflectance: float) -> None:
            ring_px = camera.ring_px(ring_mm)
            low = np.maximum(np.floor(ring_px.min(axis=0)).astype(int) - 1, 0)
            high = np.minimum(np.ceil(ring_px.max(axis=0)).astype(int) + 2, [width, height])
            if (high <= low).any():
                return
            window = light[low[1] : high[1], low[0] : high[0]]
            share = coverage(ring_px - low, (int(high[0] - low[0]), int(high[1] - low[1])))
            window += share * (reflectance - window)

        if not self.dark:
            x, y = FACE_MM
            paint(np.array([[0.0, 0.0], [x, 0.0], [x, y], [0.0, y]]), FILM)
        for marker in BOARD.markers:
            square, cells = black_modules(BOARD, marker)
            paint(square, INK)
            for cell in cells:
                paint(cell, PAPER)
        paint(self.ring_mm, DARK if self.dark else LIGHT)
        # A glint, as of a lamp on wet paste.
        glint = np.array(self.middle_mm) + 0.2 * self.radius_mm * np.array([1.0, 0.6])
        paint(glint + 0.06 * (self.ring_mm - self.middle_mm), 0.9)
        soft = np.asarray(blurred(light.astype(np.float32), 0.8), dtype=float)
        rows, columns = np.mgrid[0:height, 0:width]
        soft *= 1 + self.gradient * (columns / width - 0.5) - 0.5 * self.gradient * (rows / height - 0.5)
        soft *= 1 + self.noise * rng.standard_normal(soft.shape)
        return (255 * np.clip(soft, 0, 1) ** (1 / DISPLAY_GAMMA) + 0.5).astype(np.uint8)

    def write(self, path: Path) -> Path:
        cv2.imwrite(str(path), self.draw())
        return path


def write_sheet_table(path: Path) -> Path:
    path.write_text(board_toml(FACE_MM, BOARD), encoding="utf-8")
    return path


def spread_radius_mm(stress_pa: float, volume_mm3: float, density_kg_m3: float) -> float:
    """Return the radius of a heap with a yield stress. It is the inverse of ``stretched_stress_pa``."""

    def excess_pa(radius_mm: float) -> float:
        return float(stretched_stress_pa(volume_mm3, radius_mm, density_kg_m3)) - stress_pa

    flat_mm = 1e3 * float(flat_stress_pa(volume_mm3, 1e3, density_kg_m3) / stress_pa) ** 0.2
    return float(root_scalar(excess_pa, bracket=(flat_mm / 4, flat_mm), xtol=1e-12).root)
