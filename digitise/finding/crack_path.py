"""A rough way along a crack, in pixels: what searching hands to measuring."""

from dataclasses import dataclass

from sealtwin.records import Floats, PathSource


@dataclass(frozen=True)
class CrackPath:
    """A rough way along the crack, inside it."""

    points_px: Floats
    """(n, 2), from the first end."""
    width_px: float
    """Typical width of the crack along it."""
    source: PathSource
    warnings: tuple[str, ...] = ()


def listed(points_px: Floats) -> str:
    """Points in words: "(10, 20) to (30, 40)"."""
    return " to ".join(f"({x:.0f}, {y:.0f})" for x, y in points_px)
