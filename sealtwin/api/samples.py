"""Make a sample: read a photo with its scale, trace the crack and build the solid, or import a mesh or a drawing."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, TypedDict, Unpack

import numpy as np
from numpy.typing import NDArray

from digitise.drawing.given import DrawnLines, DrawnUnit, GivenLine, GivenWalls
from digitise.photo import Photo
from digitise.settings import NO_SCALE, CrackShape, MarkerBoard, MeshInput, MeshUnit, PhotoInput, Tilt
from sealtwin.api import FilePath, Points, content_of, file_of, public, settings_from, sha256_of, warn
from sealtwin.core import records
from sealtwin.core.arrays import HasSummary, ReadOnly
from sealtwin.core.errors import InputError, ShapeError
from sealtwin.core.records import DataKind, Outline
from sealtwin.core.settings import SettingsFaults, doubts_of
from sealtwin.scan.settings import Placement


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class SamplePhoto(ReadOnly, HasSummary, Photo):
    """A photo with its scale: what ``read_photo`` returns."""

    settings: PhotoInput
    """Settings with which the photo was read: its scale, and hints about the crack."""
    sha256: str
    """SHA-256 hash of the file, or of the array's bytes."""

    @property
    def main_figures(self) -> dict[str, str]:
        return {
            "size": "{} x {} px".format(*self.size_px),
            "scale": f"{self.mm_per_px:.4g} mm/px, {self.scale_source}",
            "warnings": str(len(self.warnings)),
        }


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class CrackOutline(Outline):
    """A traced crack: what ``trace_crack`` returns.

    Its main figures are ``length_mm``, ``mean_width_mm`` and ``warnings``. Its main arrays are ``centreline_mm``,
    ``left_wall_mm`` and ``right_wall_mm``, (n, 2) each, and ``width_mm``, (n,).
    """

    photo: Photo | None
    """Photo in which the crack was traced. For a mesh, the view from above. A pickle does not contain the photo, so it
    is None after unpickling, and in a crack of a run folder."""
    data: DataKind
    """Declared origin of the photo or the mesh."""
    sha256: str
    """SHA-256 hash of the photo or the mesh."""

    def __getstate__(self) -> dict[str, Any]:
        return {**vars(self), "photo": None}


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class SampleSolid(records.Solid):
    """The sample as a watertight solid: what ``build_solid`` returns.

    Its main arrays are ``vertices_mm``, (v, 3), and ``faces``, (f, 3), which ``mesh`` returns for trimesh.
    """

    crack: CrackOutline
    """Crack in the solid."""


class ScaleKeywords(TypedDict, total=False):
    """Settings of [photo] about its scale."""

    mm_per_px: float | None
    scale_is: Literal["measured", "assumed"]
    ruler_px: Points | None
    ruler_mm: float | None
    face_mm: Sequence[float] | None
    face_corners_px: Points | None
    markers: MarkerBoard | Mapping[str, Any] | None
    lens: Literal["auto", "none"]
    camera_distance_mm: float | None


@public(PhotoInput)
def read_photo(
    photo: FilePath | NDArray[np.uint8],
    *,
    mask: FilePath | NDArray[Any] | None = None,
    data: DataKind = "undeclared",
    **keywords: Unpack[ScaleKeywords],
) -> SamplePhoto:
    """Read a photo taken from above, with its scale. The scale is never guessed, so you must give one.

    Keywords are settings of [photo] in a trial file. ``mask`` may also be an array.

    Parameters
    ----------
    photo
        A file (JPEG, PNG, WEBP, TIFF, BMP), or an array of type uint8: RGB, (height, width, 3), or grey, (height,
        width).

    Returns
    -------
    SamplePhoto
        Pixel coordinates are 0 at the centre of the first pixel, with x right and y down. Coordinates in mm have x
        right and y up.

    Raises
    ------
    InputError
        The photo cannot be read or is black, no scale or two scales are given, or the markers are not found.

    Examples
    --------
    >>> photo = st.read_photo("crack.png", mm_per_px=0.1)
    >>> photo.size_px
    (200, 200)
    """
    is_array = isinstance(photo, np.ndarray)
    # Messages call an array by the name of the argument.
    file = Path("photo") if is_array else file_of(photo, "photo")
    from digitise.image import decoding
    from digitise.photo import offer_of_markers, pixels_of, scaled

    try:
        # A mask may be an array, so it is read here.
        settings = settings_from(PhotoInput, "read_photo", keywords, file=file, data=data)
    except SettingsFaults as fault:
        raise InputError(f"{fault}{offer_of_markers(file) if NO_SCALE in fault.types else ''}") from None

    decoded = decoding.take_photo(photo, "photo") if is_array else decoding.read_photo(file, "photo")
    height, width = decoded.image.shape[:2]
    drawn = None
    if isinstance(mask, np.ndarray):
        drawn = decoding.take_mask(mask, (width, height), "mask")
    elif mask is not None:
        drawn = decoding.read_mask(file_of(mask, "mask"), (width, height))
    read = scaled(pixels_of(decoded, file, drawn), settings)
    return SamplePhoto(**content_of(read), settings=settings, sha256=sha256_of(photo if is_array else file))


class HintKeywords(TypedDict, total=False):
    """Settings of [photo] that are hints about the crack."""

    via_px: Points
    roi_px: Points | None
    crack: int | None
    edge_fraction: float
    branches: Literal["drop", "keep"]
    width_mm: float | Points | None
    path_only: bool | None


@public(PhotoInput)
def trace_crack(
    photo: SamplePhoto,
    ends_px: Points | None = None,
    **keywords: Unpack[HintKeywords],
) -> CrackOutline:
    """Trace both walls of a crack to a fraction of a pixel.

    Keywords are settings of [photo] in a trial file.

    Parameters
    ----------
    photo
        The photo with its scale.

    Returns
    -------
    CrackOutline
        The crack in mm and px. ``s_mm`` is the arc length along the centreline from the first end. If the texture of
        the surface is as coarse as the crack, the walls are the rims of the dark region (``width_source`` "region"). If
        the crack is narrower than 8 px, its width is fitted to its profile ("fit", with ``width_95_mm``). If it is
        narrower than 2 px, the result is a path without walls ("none").

    Raises
    ------
    InputError
        A point is outside the photo or not on a crack, there is no crack, several cracks are possible, or the crack is
        too short.

    Examples
    --------
    >>> photo = st.read_photo("crack.png", mm_per_px=0.1)
    >>> crack = st.trace_crack(photo, ends_px=[(40, 101), (160, 98)])
    >>> crack.path_source, crack.width_source
    ('ends', 'walls')
    """
    # With a mask, fewer hints are required. The settings check which.
    painted = None if photo.drawn is None else photo.file
    hints = {**keywords, "ends_px": ends_px, "mask": painted}
    settings = settings_from(PhotoInput, "trace_crack", photo.settings.model_dump(), **hints)
    from digitise.crack_path.find_path import find_path
    from digitise.outline import trace_outline

    path = find_path(photo, *settings.hints)
    outline = trace_outline(photo, path, settings)
    return CrackOutline(**content_of(outline), photo=photo, data=settings.data, sha256=photo.sha256)


class ShapeKeywords(TypedDict, total=False):
    """Settings of [crack] that a function accepts."""

    tilt: Tilt
    wall_angle_deg: float | Sequence[float]
    scan: FilePath | None
    placement: Placement | Mapping[str, Any] | None
    lean_to: Literal["left", "right"]
    floor_thickness_mm: float
    margin_mm: float
    dam_height_mm: float


@public(CrackShape)
def build_solid(
    crack: CrackOutline,
    depth_mm: float | Points,
    **keywords: Unpack[ShapeKeywords],
) -> SampleSolid:
    """Build the sample as a watertight solid: a block minus the crack's cavity, with dams at open ends.

    Keywords are settings of [crack] in a trial file.

    Parameters
    ----------
    crack
        The traced crack.

    Returns
    -------
    SampleSolid
        Vertices in mm, with z = 0 on the face and z negative below it. ``cavity_volume_mm3`` is the crack's volume.

    Raises
    ------
    InputError
        A value is out of bounds, or the outline crosses itself, leaves the block, or has no area.

    Examples
    --------
    >>> crack = st.crack_from_polyline([(0, 20), (60, 20)], width_mm=3)
    >>> solid = st.build_solid(crack, depth_mm=10, tilt="vertical")
    >>> round(solid.cavity_volume_mm3)
    1800
    """
    settings = settings_from(CrackShape, "build_solid", keywords, depth_mm=depth_mm)
    from digitise.solid.build_solid import build_solid

    if settings.scan is not None:
        from digitise.solid.scanned_shape import scanned_shape

        settings, facts = scanned_shape(crack, settings, Path())
        warn(facts)
    warn(doubts_of(settings, width_mm=crack.mean_width_mm))
    return SampleSolid(**content_of(build_solid(crack, settings)), crack=crack)


class MeshKeywords(TypedDict, total=False):
    """Settings of [mesh] that a function accepts."""

    up: Literal["x", "y", "z", "-x", "-y", "-z"]
    dam_height_mm: float


@public(MeshInput)
def import_mesh(
    mesh: FilePath,
    units: MeshUnit,
    *,
    data: DataKind = "undeclared",
    **keywords: Unpack[MeshKeywords],
) -> SampleSolid:
    """Read a modelled or scanned sample instead of a photo and a depth.

    Keywords are settings of [mesh] in a trial file.

    Parameters
    ----------
    mesh
        A mesh file: STL, PLY or GLB.

    Returns
    -------
    SampleSolid
        The solid in mm, with its crack. z is 0 on the face, and the origin is the face's lower left corner.

    Raises
    ------
    InputError
        The file cannot be read, is not a block, or does not have exactly one crack.

    Examples
    --------
    >>> solid = st.import_mesh("crack.stl", units="mm")
    >>> round(solid.crack.length_mm), round(solid.depth_mm)
    (60, 10)
    """
    settings = settings_from(MeshInput, "import_mesh", keywords, file=file_of(mesh, "mesh"), units=units, data=data)
    from digitise.mesh_import.import_mesh import import_sample

    sample = import_sample(settings, Path())
    crack = _without_trace(sample.outline, sample.photo, settings.data, settings.file)
    return SampleSolid(**content_of(sample.solid), crack=crack)


@public(GivenLine)
def crack_from_polyline(
    points_mm: Points,
    width_mm: float | Points,
    *,
    face_mm: Sequence[float] | None = None,
    data: DataKind = "undeclared",
) -> CrackOutline:
    """Make a crack along a line, without a photo.

    Parameters
    ----------
    points_mm
        Points of the centreline in mm, (n, 2). x is right and y is up. s is 0 at the first point.

    Returns
    -------
    CrackOutline
        The crack. Its ``photo`` is a drawing.

    Raises
    ------
    InputError
        A value is out of bounds, the line is shorter than three widths or outside the face, or the walls cross.

    Examples
    --------
    >>> crack = st.crack_from_polyline([(0, 20), (30, 24), (60, 20)], width_mm=[[0, 2.0], [60, 4.0]])
    >>> round(crack.length_mm, 1)
    60.5
    """
    lines = {"points_mm": points_mm, "width_mm": width_mm, "face_mm": face_mm, "data": data}
    settings = settings_from(GivenLine, "crack_from_polyline", lines)
    from digitise.drawing.given_lines import outline_of_line

    line_mm = np.array(settings.points_mm)
    outline, photo = outline_of_line(line_mm, settings.widths_mm, settings.box_mm, "crack_from_polyline")
    return _without_trace(outline, photo, settings.data, np.concatenate([line_mm, settings.widths_mm]))


@public(GivenWalls)
def crack_from_walls(
    left_mm: Points,
    right_mm: Points,
    *,
    face_mm: Sequence[float] | None = None,
    data: DataKind = "undeclared",
) -> CrackOutline:
    """Make a crack between two lines, without a photo.

    Parameters
    ----------
    left_mm, right_mm
        Points of the walls in mm, (n, 2) and (m, 2). x is right and y is up. Seen along the left wall, the crack is on
        the right. s is 0 at the first point of the left wall.

    Returns
    -------
    CrackOutline
        The crack. Its ``photo`` is a drawing.

    Raises
    ------
    InputError
        A value is out of bounds, the walls cross or are exchanged, or they do not bound a crack with two ends.

    Examples
    --------
    >>> crack = st.crack_from_walls([(0, 22), (60, 22)], [(0, 18), (60, 18)])
    >>> round(crack.mean_width_mm, 1)
    4.0
    """
    lines = {"left_mm": left_mm, "right_mm": right_mm, "face_mm": face_mm, "data": data}
    settings = settings_from(GivenWalls, "crack_from_walls", lines)
    from digitise.drawing.given_lines import outline_between

    walls_mm = np.array(settings.left_mm), np.array(settings.right_mm)
    outline, photo = outline_between(*walls_mm, settings.box_mm, "crack_from_walls")
    return _without_trace(outline, photo, settings.data, np.concatenate(walls_mm))


class DrawingKeywords(TypedDict, total=False):
    """Settings of a drawn crack."""

    face_mm: Sequence[float] | None
    data: DataKind
    walls: Sequence[str] | None
    line: str | None
    width_mm: float | None
    units: DrawnUnit | None


@public(DrawnLines)
def import_dxf(drawing: FilePath, **keywords: Unpack[DrawingKeywords]) -> CrackOutline:
    """Read a crack that is drawn from above in CAD.

    Parameters
    ----------
    drawing
        A DXF file.

    Returns
    -------
    CrackOutline
        The crack in mm. The origin is that of the drawing. Its ``scale_source`` states the drawing's unit, and its
        ``warnings`` the parts of the drawing that were not read.

    Raises
    ------
    InputError
        The file cannot be read, a layer is missing or contains other lines than expected, or the lines do not bound a
        crack.

    Examples
    --------
    >>> crack = st.import_dxf("crack.dxf", line="MIDDLE", width_mm=3)
    >>> round(crack.length_mm)
    60
    """
    file = file_of(drawing, "drawing")
    settings = settings_from(DrawnLines, "import_dxf", keywords)
    from digitise.drawing.read_dxf import drawn_crack, open_drawing

    drawn = open_drawing(file, settings.units)
    try:
        outline, photo = drawn_crack(drawn, settings)
    except ShapeError as fault:
        raise InputError(f"{file}: {fault.wrong} Check units, and the lines on the crack's layers.") from None
    outline = replace(outline, warnings=(*outline.warnings, *drawn.notes))
    return _without_trace(outline, photo, settings.data, file)


def _without_trace(outline: Outline, photo: Photo, data: DataKind, content: Path | NDArray[Any]) -> CrackOutline:
    return CrackOutline(**content_of(outline), photo=photo, data=data, sha256=sha256_of(content))
