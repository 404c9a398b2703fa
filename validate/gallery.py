"""The pictures of a fluid run beside its files: snapshots, the fill as it goes, its health."""

from collections.abc import Mapping
from pathlib import Path

from matplotlib import rc_context
from matplotlib.figure import Figure, FigureBase

from sealtwin.records import Floats, Frame
from sealtwin.store.files import replacing
from validate.drawing.health_plot import draw_health
from validate.drawing.snapshots import Scene, draw_fill, draw_snapshot
from validate.drawing.theme import themed

DPI = 150
"""Of a PNG, and of what is drawn as pixels inside an SVG."""
NO_METADATA = {"png": {"Software": None}, "svg": dict.fromkeys(("Date", "Creator", "Format", "Type"))}
"""No dates: the same run leaves the same pictures."""


def write_gallery(
    folder: Path, frames: Mapping[str, Frame], scene: Scene, health: Mapping[str, Floats]
) -> list[str]:  # fmt: skip
    """PNG and SVG of each frame under its name in snapshots/, of all below each other, and of the run's health.

    Returns the files' names in the folder.
    """
    written = _write(folder, "health", draw_health(health))
    for name, frame in frames.items():
        written += _write(folder, f"snapshots/{name}", draw_snapshot(frame, scene))
    if frames:
        written += _write(folder, "snapshots/fill", draw_fill(list(frames.values()), scene))
    return written


def _write(folder: Path, name: str, figure: FigureBase) -> list[str]:
    assert isinstance(figure, Figure)
    names = []
    for kind, metadata in NO_METADATA.items():
        with replacing(folder / f"{name}.{kind}") as temporary, themed(), rc_context({"svg.hashsalt": name}):
            figure.savefig(temporary, dpi=DPI, metadata=metadata)
        names.append(f"{name}.{kind}")
    return names
