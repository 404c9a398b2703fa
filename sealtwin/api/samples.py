"""Make a sample: read a photo with its scale, trace the crack and build the solid, or import a mesh or a drawing."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from digitise.drawing.given import GivenDrawing, GivenLine, GivenWalls
from digitise.photo import Photo
from digitise.settings import NO_SCALE, CrackShape, MeshInput, PhotoInput
from sealtwin.api import FilePath, Points, content_of, file_of, of_one_crack, settings_from, sha256_of, warn
from sealtwin.core.errors import InputError, ShapeError
from sealtwin.core.records import DataKind, HasSummary, Outline, Solid
from sealtwin.core.settings import SettingsFaults, doubts_of
from sealtwin.core.settings_text import keywords_of


@dataclass(frozen=True, kw_only=True, repr=False)
class SamplePhoto(HasSummary, Photo):
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

    @property
    def data(self) -> DataKind:
        """Declared origin of the photo."""
        return self.settings.data


@dataclass(frozen=True, kw_only=True, repr=False)
class CrackOutline(Outline):
    """A traced crack: what ``trace_crack`` returns.

    Its main figures are ``length_mm``, ``mean_width_mm`` and ``warnings``. Its main arrays are ``centreline_mm``,
    ``left_wall_mm`` and ``right_wall_mm``, (n, 2) each, and ``width_mm``, (n,).
    """

    photo: Photo
    """Photo in which the crack was traced. For a mesh, the view from above."""
    data: DataKind
    """Declared origin of the photo or the mesh."""
    sha256: str
    """SHA-256 hash of the photo or the mesh."""


SCALE = (
    *("mm_per_px", "scale_is", "ruler_px", "ruler_mm", "face_mm", "face_corners_px"),
    *("markers", "lens", "camera_distance_mm", "mask", "data"),
)
HINTS = ("ends_px", "via_px", "roi_px", "crack", "edge_fraction", "branches", "width_mm", "path_only")
"""Settings of [photo] that are hints about the crack. ``SCALE`` lists the settings of [photo] about the scale."""


@keywords_of(PhotoInput, only=SCALE)
def read_photo(
    photo: FilePath | NDArray[np.uint8],
    *,
    mask: FilePath | NDArray[Any] | None = None,
    data: DataKind = "undeclared",
    **keywords: Any,
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
    # A mask may be an array, so it is read here.
    arguments = locals()
    from digitise.image import decoding
    from digitise.photo import beside_markers, offer_of_markers, pixels_of, scaled

    try:
        settings = settings_from(PhotoInput, "read_photo", arguments, mask=None)
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
    read = replace(read, warnings=(*read.warnings, *beside_markers(read, settings)))
    return SamplePhoto(**content_of(read), settings=settings, sha256=sha256_of(photo if is_array else file))


@keywords_of(PhotoInput, only=HINTS)
def trace_crack(
    photo: SamplePhoto,
    ends_px: Points | None = None,
    **keywords: Any,
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
    arguments = {**photo.settings.model_dump(), "keywords": keywords, "mask": painted}
    settings = settings_from(PhotoInput, "trace_crack", arguments, **({} if ends_px is None else {"ends_px": ends_px}))
    from digitise.crack_path.find_path import find_path
    from digitise.outline import trace_outline

    path = find_path(photo, *settings.hints)
    outline = trace_outline(photo, path, settings)
    return CrackOutline(**content_of(outline), photo=photo, data=photo.data, sha256=photo.sha256)


@keywords_of(CrackShape, without=("fill",))
def build_solid(
    crack: Outline,
    depth_mm: float | Points,
    **keywords: Any,
) -> Solid:
    """Build the sample as a watertight solid: a block minus the crack's cavity, with dams at open ends.

    Keywords are settings of [crack] in a trial file.

    Parameters
    ----------
    crack
        The traced crack.

    Returns
    -------
    Solid
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
    settings = settings_from(CrackShape, "build_solid", locals())
    from digitise.solid.build_solid import build_solid

    if settings.scan is not None:
        from digitise.solid.scanned_shape import scanned_shape

        settings, facts = scanned_shape(crack, settings, Path())
        warn(facts)
    warn(doubts_of(settings, width_mm=crack.mean_width_mm))
    return replace(build_solid(crack, settings), made_of=of_one_crack("build_solid", crack))


@keywords_of(MeshInput, without=("file",))
def import_mesh(
    mesh: FilePath,
    *,
    data: DataKind = "undeclared",
    **keywords: Any,
) -> tuple[CrackOutline, Solid]:
    """Read a modelled or scanned sample instead of a photo and a depth.

    Keywords are settings of [mesh] in a trial file.

    Parameters
    ----------
    mesh
        A mesh file: STL, PLY or GLB.

    Returns
    -------
    tuple of CrackOutline and Solid
        The crack and the solid in mm. z is 0 on the face, and the origin is the face's lower left corner.

    Raises
    ------
    InputError
        The file cannot be read, is not a block, or does not have exactly one crack.

    Examples
    --------
    >>> crack, solid = st.import_mesh("crack.stl", units="mm")
    >>> round(crack.length_mm), round(solid.depth_mm)
    (60, 10)
    """
    settings = settings_from(MeshInput, "import_mesh", locals(), file=file_of(mesh, "mesh"))
    from digitise.mesh_import.import_mesh import import_sample

    sample = import_sample(settings, Path())
    crack = _without_trace(sample.outline, sample.photo, settings.data, settings.file)
    return crack, replace(sample.solid, made_of=of_one_crack("import_mesh", crack))


@keywords_of(GivenLine)
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
    settings = settings_from(GivenLine, "crack_from_polyline", locals())
    from digitise.drawing.given_lines import outline_of_line

    line_mm = np.array(settings.points_mm)
    outline, photo = outline_of_line(line_mm, settings.widths_mm, settings.box_mm, "crack_from_polyline")
    return _without_trace(outline, photo, settings.data, np.concatenate([line_mm, settings.widths_mm]))


@keywords_of(GivenWalls)
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
    settings = settings_from(GivenWalls, "crack_from_walls", locals())
    from digitise.drawing.given_lines import outline_between

    walls_mm = np.array(settings.left_mm), np.array(settings.right_mm)
    outline, photo = outline_between(*walls_mm, settings.box_mm, "crack_from_walls")
    return _without_trace(outline, photo, settings.data, np.concatenate(walls_mm))


@keywords_of(GivenDrawing)
def import_dxf(
    drawing: FilePath,
    depth_mm: float,
    *,
    data: DataKind = "undeclared",
    **keywords: Any,
) -> tuple[CrackOutline, Solid]:
    """Read a crack that is drawn from above in CAD. Its walls are upright and its floor is level.

    Parameters
    ----------
    drawing
        A DXF file.

    Returns
    -------
    tuple of CrackOutline and Solid
        The crack and the solid in mm. z is 0 on the face, and the origin is that of the drawing. The crack's
        ``warnings`` state the drawing's unit and the parts of the drawing that were not read.

    Raises
    ------
    InputError
        The file cannot be read, a layer is missing or contains other lines than expected, or the lines do not bound a
        crack.

    Examples
    --------
    >>> crack, solid = st.import_dxf("crack.dxf", depth_mm=10, line="MIDDLE", width_mm=3)
    >>> round(crack.length_mm)
    60
    """
    file = file_of(drawing, "drawing")
    settings = settings_from(GivenDrawing, "import_dxf", locals())
    from digitise.drawing.read_dxf import drawn_crack, open_drawing
    from digitise.solid.build_solid import build_solid

    drawn = open_drawing(file, settings.units)
    try:
        outlined, photo = drawn_crack(drawn, settings)
        solid = build_solid(outlined, CrackShape(depth_mm=settings.depth_mm, tilt="vertical"))
    except ShapeError as fault:
        raise InputError(f"{file}: {fault.wrong} Check units, and the lines on the crack's layers.") from None
    crack = _without_trace(replace(outlined, warnings=(*outlined.warnings, *drawn.notes)), photo, data, file)
    return crack, replace(solid, made_of=of_one_crack("import_dxf", crack))


def _without_trace(outline: Outline, photo: Photo, data: DataKind, content: Path | NDArray[Any]) -> CrackOutline:
    return CrackOutline(**content_of(outline), photo=photo, data=data, sha256=sha256_of(content))
