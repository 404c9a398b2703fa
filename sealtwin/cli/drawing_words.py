"""Remedies for a drawn crack that the import of its mesh refuses: they name layers and options of 'import-dxf'."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from sealtwin.core.errors import InputError, ShapeError, ShapeKind

NO_RECTANGLE = (
    "The edge of the sample on the layer FACE does not have four straight sides at right angles.",
    "Draw a rectangle round the crack, or none: the block then reaches 12 mm beyond the crack.",
)
IN_A_DRAWING: dict[ShapeKind, tuple[str, str]] = {
    "outline": ("", "Mend the drawn lines there."),
    "face": ("The crack takes more of the sample's face than it leaves.", "Draw the edge on the layer FACE larger."),
    "sides": NO_RECTANGLE,
    "through": NO_RECTANGLE,
    "mouth": ("No crack opens in the face.", "Check --units, and that the edge on the layer FACE is round the crack."),
    "rivals": ("", "The edge on the layer FACE cuts the crack in pieces: draw it round the crack or beyond one end."),
    "walls": ("", "Draw the crack's middle instead and give it as --line LAYER --width-mm W."),
    "narrow": ("The crack is too narrow for its length to be followed.", "Check --units, and the crack's width."),
    "path": ("The drawn line is not along one crack.", "Draw it from end to end, without loops."),
    "cut": (
        "The drawn lines bound no sound solid.",
        "Draw them without crossings and without points closer than 1 µm.",
    ),
}
"""Fault of a drawing, if the mesh's words do not fit it, and its remedy."""


@contextmanager
def of_a_drawing(drawing: Path) -> Iterator[None]:
    """Let a ShapeError from within name the drawing, and what to draw or to give instead."""
    try:
        yield
    except ShapeError as fault:
        wrong, remedy = IN_A_DRAWING.get(fault.kind, ("", "Check --units and the layers."))
        raise InputError(f"{drawing}: {wrong or fault.wrong} {remedy}") from None
