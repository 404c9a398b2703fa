"""What to draw: a sample, its crack, what spoils it, and how it is photographed."""

from dataclasses import dataclass
from typing import Literal

from digitise.specimens.lighting import DIFFUSE, Look
from digitise.specimens.rendering import BOARD, MORTAR


@dataclass(frozen=True)
class SideCrack:
    """A crack that leaves the main one and ends in a tip."""

    at: float
    """Where it leaves: share of the main crack's length."""
    side: Literal["left", "right"]
    angle_deg: float
    """Between its way and the main crack's onward way; 20 is a fork, 90 a branch."""
    length_mm: float
    """From the middle of the main crack."""
    width_mm: float
    """Before it tapers."""


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
    offset_mm: float = 0.0
    """Of the crack's middle, to the right of the face's: through the very middle a lens bends a crack along itself."""
    angle_deg: float = 30.0
    """Of a closed crack to the long side; an open one's follows from its length and the height of the face."""
    wander_mm: float = 1.0
    """Standard deviation of the centreline from the straight line."""
    shortest_wave: float = 0.06
    """Of the wander, over the crack's length: walls far apart cross where the line between them turns sharply."""
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
    lens_k1: float = 0.0
    """Radial term of the lens: see Camera. A phone's is 0.05 or less once its own software has worked, -0.2 before."""
    wall_pores: int = 0
    """Pores that break the crack's walls open, as warts on an outline that follows the dark."""
    side_cracks: tuple[SideCrack, ...] = ()
    stones: int = 0
    """Grains left standing in the crack, level with the face."""
    stain: float = 0.0
    """Share of its light that the mortar loses where oil or damp has stained it."""
    mortar: float = MORTAR
    """Reflectance of the face."""
    board: float = BOARD
    """Reflectance of what it lies on; where that is not white, markers lie on white cards."""
    dictionary: Literal["4x4_50", "5x5_100", "6x6_250", "apriltag_36h11"] = "4x4_50"
    """Of the markers."""
    second_photo: bool = False
    """Also draw the photo of a camera that stayed in its place while the lamp was carried to the other side."""


PAPER = Recipe()
