"""What lamp and lens do to a painted face: uneven light, a shadow across it, blur, noise and JPEG."""

from dataclasses import dataclass, replace

import cv2
import numpy as np

from digitise.pictures.raster import Map, blurred
from sealtwin.records import Floats

DISPLAY_GAMMA = 2.2
SHADOW_MM, PENUMBRA_MM = 14.0, 1.5
"""Width of the shadow of a cable or a lamp's arm, and the sigma of its soft edges."""


@dataclass(frozen=True)
class SideLamp:
    """A lamp low beside the sample. The wall of the crack that faces it is lit as far down as it is seen from above."""

    from_deg: float
    """On the face: 0 for light from the right, 90 from the top of the photo."""
    wall: float
    """Reflectance of the lit wall, as seen beside a face of MORTAR."""
    rim: float
    """Its width as seen from above, over the crack's mean width."""


MODERATE_LAMP = SideLamp(from_deg=-60.0, wall=0.12, rim=0.12)
"""A wall that stays darker than half the face: its edge is softened, not moved."""
STRONG_LAMP = SideLamp(from_deg=-60.0, wall=0.2, rim=0.16)
"""A wall brighter than half the face: seen as mortar, the crack would be narrower by all of the rim."""


@dataclass(frozen=True)
class Look:
    """What the lamp and the camera do to the face."""

    light: float
    """Brightest over mean of the uneven lighting, less 1."""
    grain: float
    """Relative brightness of the sand, standard deviation."""
    blur_px: float
    """Gaussian sigma of lens and focus."""
    noise: float
    """Standard deviation of the sensor's noise at full brightness; below it, it shrinks like shot noise."""
    jpeg_quality: int
    lamp: SideLamp | None = None
    """None: diffuse light, a little stronger from somewhere."""
    shadow: float = 0.0
    """Share of the light that a soft-edged shadow along the crack takes away."""

    @property
    def from_the_other_side(self) -> "Look":
        """The same with the lamp carried across the sample."""
        if self.lamp is None:
            raise ValueError("diffuse light has no other side: give the look a lamp")
        return replace(self, lamp=replace(self.lamp, from_deg=self.lamp.from_deg + 180))


DIFFUSE = Look(light=0.3, grain=0.09, blur_px=0.9, noise=0.02, jpeg_quality=88)
"""A steady hand, a diffuse lamp to one side, a phone's compression."""


def illuminated(painted: Map, look: Look, rng: np.random.Generator) -> Floats:
    """Reflectance times light, which falls off from the lamp and towards the corners."""
    height, width = painted.shape
    y, x = np.mgrid[-1 : 1 : height * 1j, -1 : 1 : width * 1j].astype(np.float32)
    # From the right is +x; from the top of the photo is -y.
    direction = rng.uniform(0, 2 * np.pi) if look.lamp is None else -np.radians(look.lamp.from_deg)
    slope = np.cos(direction) * x + np.sin(direction) * y
    return painted * (1 + look.light * (0.7 * slope - 0.3 * (x**2 + y**2)))


def shadowed(picture: Floats, depth: float, chord_px: Floats, px_per_mm: float, rng: np.random.Generator) -> Floats:
    """A band of shadow along ``chord_px``, (2, 2), that covers one wall of the crack for most of its length."""
    height, width = picture.shape
    y, x = np.mgrid[:height, :width].astype(np.float32)
    along = (chord_px[1] - chord_px[0]) / np.linalg.norm(chord_px[1] - chord_px[0])
    turn = np.radians(rng.uniform(-6, 6))
    normal = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]) @ np.array([-along[1], along[0]])
    middle = chord_px.mean(axis=0)
    across_mm = ((x - middle[0]) * normal[0] + (y - middle[1]) * normal[1]) / px_per_mm
    # The edge swings over the crack as a cable's does.
    along_mm = ((x - middle[0]) * along[0] + (y - middle[1]) * along[1]) / px_per_mm
    across_mm = across_mm + 1.5 * np.sin(along_mm / 12 + rng.uniform(0, 2 * np.pi))
    inside = _step(across_mm / PENUMBRA_MM) * _step((SHADOW_MM - across_mm) / PENUMBRA_MM)
    return picture * (1 - depth * inside)


def exposed(light: Floats, look: Look, rng: np.random.Generator) -> bytes:
    """The photo of such light, as the bytes of a JPEG file."""
    seen = blurred(light, look.blur_px)
    # One sensor's noise for all colours: three would double the file and help nobody.
    seen += look.noise * np.sqrt(np.clip(seen, 0, 1)) * rng.standard_normal(seen.shape, dtype=np.float32)
    warm_bgr = np.array([0.94, 1.0, 1.03], dtype=np.float32)
    display = np.clip(seen[..., None] * warm_bgr, 0, 1) ** (1 / DISPLAY_GAMMA)
    quality = [cv2.IMWRITE_JPEG_QUALITY, look.jpeg_quality]
    return cv2.imencode(".jpg", np.rint(255 * display).astype(np.uint8), quality)[1].tobytes()


def _step(sigmas: Floats) -> Floats:
    """Edge of a penumbra, 0 to 1: a logistic curve as steep as the integral of a Gaussian of sigma 1."""
    return 1 / (1 + np.exp(-1.7 * sigmas))
