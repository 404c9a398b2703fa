"""A sample: a photo with its scale, the crack that is traced in it, and the solid; or a mesh in place of them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from digitise.photo import Photo
from digitise.settings import CrackShape, MeshInput, MeshUnit, PhotoInput, Tilt
from sealtwin.api.shared import FilePath, Points, content_of, file_of, settings_from, settings_of, sha256_of
from sealtwin.core.errors import InputError
from sealtwin.core.records import DataKind, Outline, Solid

if TYPE_CHECKING:
    from digitise.image.decoding import Decoded


@dataclass(frozen=True, kw_only=True)
class SamplePhoto(Photo):
    """A photo with its scale: what ``read_photo`` returns."""

    settings: PhotoInput
    """The scale and the hints that it was read with."""
    sha256: str
    """Hash of the file, or of the array's bytes."""

    @property
    def data(self) -> DataKind:
        """Declared origin of the photo."""
        return self.settings.data


@dataclass(frozen=True, kw_only=True)
class CrackOutline(Outline):
    """A traced crack: what ``trace_crack`` returns.

    Its main figures are ``length_mm``, ``mean_width_mm`` and ``warnings``; its arrays ``centreline_mm``,
    ``left_wall_mm`` and ``right_wall_mm``, (n, 2) each, and ``width_mm``, (n,).
    """

    photo: Photo
    """The photo it was traced in; of a mesh the view from above."""
    data: DataKind
    """Declared origin of the photo or the mesh."""
    sha256: str
    """Hash of the photo or the mesh."""


def read_photo(
    photo: FilePath | NDArray[np.uint8],
    *,
    mm_per_px: float | None = None,
    scale_is: Literal["measured", "assumed"] = "measured",
    ruler_px: Points | None = None,
    ruler_mm: float | None = None,
    face_mm: Sequence[float] | None = None,
    face_corners_px: Points | None = None,
    markers: Mapping[str, Any] | None = None,
    lens: Literal["auto", "none"] = "auto",
    camera_distance_mm: float | None = None,
    second_photo: FilePath | NDArray[np.uint8] | None = None,
    mask: FilePath | NDArray[Any] | None = None,
    data: DataKind = "undeclared",
) -> SamplePhoto:
    """Read a top-down photo and find its scale. Give one scale: it is never guessed.

    Parameters
    ----------
    photo
        A file (JPEG, PNG, WEBP, TIFF, BMP), or an array (height, width, 3) RGB or (height, width) grey of type uint8.
    mm_per_px, scale_is
        Scale in mm per pixel, of a photo square to the face; "assumed" says so wherever a length is shown.
    ruler_px, ruler_mm
        Two points (x, y) on a ruler in the plane of the face, in px, and their distance in mm.
    face_mm, face_corners_px
        Width and height of the sample's face in mm, and its corners in px: lower left, lower right, upper right, upper
        left; they are searched for where left out.
    markers
        ArUco markers in the plane of the face, as in the table [photo.markers]: ``dictionary``, ``size_mm``, and
        ``markers``, a list of ``{"id", "x_mm", "y_mm"}``.
    lens
        "auto" fits one radial term where markers show it.
    camera_distance_mm
        Distance from lens to face in mm, to state what markers off the face would cost.
    second_photo, mask
        The sample from the same camera, lit from the other side; and the crack, painted in the photo's size: each a
        file or an array.
    data
        Where the photo comes from: "measured", "reconstructed" or "synthetic". Left "undeclared", every report says
        so, and no comparison counts as a validation.

    Returns
    -------
    SamplePhoto
        Pixels count from the centre of the first one, x right and y down; mm run x right and y up.

    Raises
    ------
    InputError
        The photo cannot be read, is black, has no scale or two, or does not show its markers.
    """
    given = locals()
    from digitise.image.painted import read_mask, take_mask
    from digitise.photo import beside_markers, pixels_of, scaled

    file = _name_of(photo, "photo")
    # Both pictures are read here, of a file or of an array.
    settings = settings_from(PhotoInput, "read_photo", given, file=file, second_photo=None, mask=None)
    decoded = _decoded(photo, "photo")
    second = None
    if second_photo is not None:
        second = _decoded(second_photo, "second_photo"), _name_of(second_photo, "second_photo")
    height, width = decoded.image.shape[:2]
    drawn = None
    if isinstance(mask, np.ndarray):
        drawn = take_mask(mask, (width, height), "mask")
    elif mask is not None:
        drawn = read_mask(file_of(mask, "mask"), (width, height))
    pixels = pixels_of(decoded, file, second, drawn)
    digest = sha256_of(photo if isinstance(photo, np.ndarray) else file)
    seen = scaled(pixels, settings)
    seen = replace(seen, warnings=(*seen.warnings, *beside_markers(seen, settings)))
    return SamplePhoto(**content_of(seen), settings=settings, sha256=digest)


def trace_crack(
    photo: SamplePhoto,
    ends_px: Points | None = None,
    *,
    via_px: Points = (),
    roi_px: Points | None = None,
    crack: int | None = None,
    edge_fraction: float = 0.5,
    branches: Literal["drop", "keep"] = "drop",
    width_mm: float | Points | None = None,
    path_only: bool | None = None,
) -> CrackOutline:
    """Trace both walls of a crack to a fraction of a pixel.

    Parameters
    ----------
    photo
        The photo with its scale.
    ends_px, via_px
        The crack's two ends (x, y) in px, of which the nozzle starts at the first, and points that it passes in
        between. Without ends the crack is searched for: plot the result over the photo before you trust it.
    roi_px
        Two opposite corners of a box, or the corners of a polygon, in px: the search stays inside.
    crack
        Number of the crack among those found without ends, best first, where the first does not stand out.
    edge_fraction
        Share of the contrast, from crack to mortar, at which a wall is drawn; 0.2 to 0.9.
    branches
        "keep" makes side cracks a part of the outline; "drop" reports them only.
    width_mm
        Width by a gauge in place of the photo's: one, or rows of (s, width) in mm along the crack.
    path_only
        True for a path without walls, of which no solid can be built.

    Returns
    -------
    CrackOutline
        The crack in mm and px; ``s_mm`` counts along the centreline from the first end. Below 8 px its width is a fit
        of its profile, ``width_source`` "fit", with ``width_95_mm``; below 2 px it is a path without walls, "none".

    Raises
    ------
    InputError
        A point lies off the photo or on no crack; no crack is found, or several compete; it is too short.
    """
    from digitise.crack_path.find_path import find_path
    from digitise.outline import outline_as_set

    hints = {"ends_px": ends_px, "via_px": via_px, "roi_px": roi_px, "crack": crack, "edge_fraction": edge_fraction}
    read = photo.settings.model_dump(mode="json", exclude_none=True)
    given = {"branches": branches, "width_mm": width_mm, "path_only": path_only}
    settings = settings_of(PhotoInput, "trace_crack", {**read, **hints, **given})
    if photo.drawn is not None and (settings.via_px or settings.roi_px is not None):
        raise InputError("trace_crack: via_px or roi_px beside a mask, which shows the crack itself. Leave them out.")
    path = find_path(photo, settings.ends_px, settings.via_px, settings.roi_px, settings.crack)
    outline = outline_as_set(photo, path, settings)
    return CrackOutline(**content_of(outline), photo=photo, data=photo.data, sha256=photo.sha256)


def build_solid(
    crack: Outline,
    depth_mm: float | Points,
    *,
    tilt: Tilt = "lean",
    wall_angle_deg: float | Sequence[float] = 11.0,
    lean_to: Literal["left", "right"] = "left",
    floor_thickness_mm: float = 4.0,
    margin_mm: float = 12.0,
    dam_height_mm: float = 10.0,
) -> Solid:
    """Build the sample as a watertight solid: a block less the crack's cavity, dams at open ends.

    Parameters
    ----------
    crack
        The traced crack.
    depth_mm
        Depth in mm, or a table (n, 2) of arc length and depth along the crack from its first end.
    tilt, lean_to
        How the walls go down: "lean" (both the same way, to that side as seen along the path), "flare" (the
        mouth is wider than the photo shows, the floor as wide), "funnel" (the walls close downward from the photo's
        mouth), "undercut" (they open downward from it) or "vertical".
    wall_angle_deg
        Each wall's angle from vertical in degrees, or that of the left and of the right one.
    floor_thickness_mm, margin_mm, dam_height_mm
        Mortar kept below the crack, and around it where the face's size is not known; height above the face of the tape
        at open ends, 0 for none; in mm.

    Returns
    -------
    Solid
        Vertices in mm, z = 0 on the face and negative below it; ``cavity_volume_mm3`` is the crack's volume.

    Raises
    ------
    InputError
        A value is out of bounds; or the outline crosses itself, leaves the block, or holds nothing.
    """
    given = locals()
    from digitise.solid.build_solid import build_solid

    return build_solid(crack, settings_from(CrackShape, "build_solid", given))


def import_mesh(
    mesh: FilePath,
    *,
    units: MeshUnit,
    up: Literal["x", "y", "z", "-x", "-y", "-z"] = "z",
    path: FilePath | None = None,
    base_mm: float | None = None,
    dam_height_mm: float = 10.0,
    data: DataKind = "undeclared",
) -> tuple[CrackOutline, Solid]:
    """Read a sample that was modelled or scanned, in place of a photo and a depth.

    Parameters
    ----------
    mesh
        STL, PLY, OBJ, OFF, GLB or 3MF.
    units, up
        Unit of its numbers, which most formats do not say, and its axis that points out of the cracked face.
    path
        File with the centreline, x y in mm a line; left out, it is found just under the face.
    base_mm, dam_height_mm
        Depth of a flat underside below the face, for a scan that is open below; height above the face of the dams where
        the crack leaves the block; in mm.
    data
        Where the mesh comes from, as in ``read_photo``.

    Returns
    -------
    tuple of CrackOutline and Solid
        In mm, z = 0 on the face, the face's lower left corner the origin.

    Raises
    ------
    InputError
        The file cannot be read, bounds no block, or shows no single crack.
    """
    given = locals()
    from digitise.mesh_import.import_mesh import import_sample

    line = None if path is None else file_of(path, "path")
    settings = settings_from(MeshInput, "import_mesh", given, file=file_of(mesh, "mesh"), path=line)
    sample = import_sample(settings, Path())
    digest = sha256_of(settings.file)
    crack = CrackOutline(**content_of(sample.outline), photo=sample.photo, data=settings.data, sha256=digest)
    return crack, sample.solid


def _decoded(given: FilePath | NDArray[np.uint8], name: str) -> "Decoded":
    from digitise.image.decoding import read_photo, take_photo

    return take_photo(given, name) if isinstance(given, np.ndarray) else read_photo(file_of(given, name), name)


def _name_of(given: FilePath | NDArray[np.uint8], name: str) -> Path:
    """The path that was given; of an array the argument's name, which then stands in refusals."""
    return Path(name) if isinstance(given, np.ndarray) else file_of(given, name)
