"""Export a traced crack as a mask of its photo, or as a DXF drawing in mm."""

import io

import cv2
import ezdxf.filemanagement
import numpy as np
from ezdxf import units

from digitise.geometry.polyline import coverage, rectangle
from sealtwin.core.errors import InputError
from sealtwin.core.records import Booleans, Outline, Trajectory

LAYERS = {
    "OUTLINE": 1,
    "ISLANDS": 2,
    "WALL_LEFT": 3,
    "WALL_RIGHT": 4,
    "CENTRELINE": 5,
    "SIDE_CRACKS": 6,
    "FACE": 8,
    "NOZZLE_PATH": 30,
}
"""AutoCAD colour index of each layer."""
CLOSED = {"OUTLINE", "ISLANDS", "FACE"}


def mask_of(outline: Outline, name: str) -> Booleans:
    """Return the pixels that the crack covers at least half, (height, width).

    Raises InputError, with the crack's ``name``, if the crack has no photo of known size or is a path without walls.
    """
    if outline.seen_in != "photo" or outline.photo_size_px is None or outline.width_source == "none":
        raise InputError(
            f"{name}: this crack has no walls in a photo of known size. Digitise its photo again, with --width-mm if "
            "it has only a path."
        )
    covered = coverage(outline.outline_px, outline.photo_size_px)
    for ring_mm in outline.islands_mm:
        # The homography follows from the outline's points in mm and in px.
        view, _ = cv2.findHomography(outline.outline_mm, outline.outline_px)
        covered = covered - coverage(cv2.perspectiveTransform(ring_mm[None], view)[0], outline.photo_size_px)
    return covered >= 0.5


def mask_png(outline: Outline, name: str) -> bytes:
    """Return the mask of ``mask_of`` as a PNG, white on black. Raises InputError if there is no mask."""
    return cv2.imencode(".png", 255 * mask_of(outline, name).astype(np.uint8))[1].tobytes()


def dxf_text(outline: Outline, trajectory: Trajectory | None) -> str:
    """Return a DXF (R2010) drawing in mm, in the coordinates of the outline. z = 0 is the face.

    The nozzle path is a polyline in space.
    """
    drawing = ezdxf.filemanagement.new("R2010", units=units.MM)
    for name, colour in LAYERS.items():
        drawing.layers.add(name, color=colour)
    space = drawing.modelspace()
    # A path alone has neither edge nor walls.
    edges = {"OUTLINE": outline.outline_mm, "WALL_LEFT": outline.left_wall_mm, "WALL_RIGHT": outline.right_wall_mm}
    lines = [] if outline.width_source == "none" else list(edges.items())
    lines += [("ISLANDS", ring_mm) for ring_mm in outline.islands_mm]
    lines += [("CENTRELINE", outline.centreline_mm), *(("SIDE_CRACKS", line_mm) for line_mm in outline.branches_mm)]
    lines += [] if outline.face_mm is None else [("FACE", rectangle(outline.face_mm))]
    for layer, points_mm in lines:
        space.add_lwpolyline(points_mm.tolist(), close=layer in CLOSED, dxfattribs={"layer": layer})
    if trajectory is not None:
        space.add_polyline3d(trajectory.position_mm.tolist(), dxfattribs={"layer": "NOZZLE_PATH"})
    text = io.StringIO()
    drawing.write(text)
    return text.getvalue()
