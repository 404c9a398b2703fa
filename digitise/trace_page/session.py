"""State of the trace page: a photo in tiles, and its scale, path and walls for the current hints."""

import io
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from functools import cache
from pathlib import Path
from threading import Lock
from typing import Annotated, Any, Literal, NamedTuple, Self, TypeVar

import numpy as np
from PIL import Image
from pydantic import BeforeValidator, Field

from digitise.crack_path.candidates import FoundCrack
from digitise.crack_path.find_path import CrackSearch, LiveWire, RivalCracksError
from digitise.crack_path.hints import CrackPath
from digitise.crack_path.painted_path import painted_path
from digitise.geometry.polyline import signed_area
from digitise.outline import trace_outline
from digitise.photo import Photo, read_pixels, scaled
from digitise.scale.marker_scale import PRINTED_MM, board_around, seen_markers
from digitise.settings import (
    MAX_VIA,
    Clicks,
    Dictionary,
    PhotoInput,
    Pixel,
    PixelPair,
    Region,
    Tilt,
    Walls,
)
from digitise.walls.doubts import PLAUSIBLE, numbered_walls
from sealtwin.core.arrays import Pixels
from sealtwin.core.errors import InputError
from sealtwin.core.facts import of_keys, texts
from sealtwin.core.records import Floats, Outline
from sealtwin.core.settings import Settings, checked

TILE_PX = 512
JPEG_QUALITY = 92  # With lower JPEG quality, blocks look like grain when enlarged
UNSCALED_MM_PER_PX = 1.0  # Scale that is used if a photo has none, so that lengths in mm are lengths in px
CHOOSE = "{count} lines may be the crack: click the number of the right one, or press its key."
CHOOSE_ONE = "This line may be the crack: click its number, press its key, or click the crack's ends."
Answer = dict[str, Any]
T = TypeVar("T")
Until = Literal["scale", "path", "walls"]


class PageSettings(Settings):
    """Settings of a trial that the page edits. A setting that is not given is None."""

    @classmethod
    def of(cls, settings: Settings) -> Self:
        """Return the settings that a trial gives. Defaults are left out."""
        keys = cls.model_fields.keys() & settings.model_fields_set
        return cls(**{key: value for key, value in settings if key in keys})

    def entries(self, keys: set[str] | None = None) -> dict[str, Any]:
        """Return the values that were given, as a dict. ``keys`` limits the result to these names."""
        return self.model_dump(mode="json", exclude_none=True, include=keys)


class Hints(PageSettings):
    """Photo settings that the page edits. ``PhotoInput`` checks their values."""

    ends_px: PixelPair | None = None
    crack: int | None = None
    via_px: Clicks | None = Field(default=None, max_length=MAX_VIA)
    roi_px: Region | None = None
    walls_px: Walls | None = None
    wall: Literal[1, 2] | None = None
    branches: Literal["drop", "keep"] | None = None
    mm_per_px: float | None = None
    scale_is: Literal["measured", "assumed"] | None = None
    ruler_px: PixelPair | None = None
    ruler_mm: float | None = None
    face_mm: tuple[float, float] | None = None
    face_corners_px: tuple[Pixel, Pixel, Pixel, Pixel] | None = None
    frame: tuple[float, Dictionary, int, float | None] | None = None
    """Frame of markers printed around ``face_mm``: marker size in mm, dictionary, number of markers, and measured
    length of the ruler in mm. The length is None if it was not measured."""

    def entries(self, keys: set[str] | None = None) -> dict[str, Any]:
        """Return the values that were given. A printed frame is returned as markers.

        Raises InputError if the frame does not fit around the face.
        """
        values = super().entries(keys)
        frame = values.pop("frame", None)
        if frame and self.face_mm:
            values["markers"] = board_around(self.face_mm, *frame).model_dump(mode="json", exclude_none=True)
        return values


Single = Annotated[float | None, BeforeValidator(lambda value: None if isinstance(value, list | tuple) else value)]
"""A number. A table, which the page does not edit, becomes None."""


class Shape(PageSettings):
    """Settings of the crack's shape that the page edits. ``CrackShape`` checks their values."""

    depth_mm: Single = None
    tilt: Tilt | None = None
    wall_angle_deg: Single = None


SCALE_KEYS = {"mm_per_px", "scale_is", "ruler_px", "ruler_mm", "face_mm", "face_corners_px", "frame"}
PATH_KEYS = Hints.model_fields.keys() - SCALE_KEYS


def rest_of(photo: PhotoInput) -> dict[str, Any]:
    """Return the photo settings of a trial that are not hints."""
    return photo.model_dump(mode="json", exclude=set(Hints.model_fields), exclude_none=True)


def scale_settings(rest: dict[str, Any], hints: Hints) -> PhotoInput | None:
    """Return photo settings with the scale from markers or hints. None if neither gives a scale.

    Raises InputError for an incomplete scale.
    """
    scale = hints.entries(SCALE_KEYS)
    if not rest.get("markers") and not scale.keys() - {"scale_is"}:
        return None
    return checked(PhotoInput, Path(rest["file"]), {**rest, **scale})


def path_settings(rest: dict[str, Any], hints: Hints) -> PhotoInput:
    """Return photo settings with the hints about the crack, without a scale. Raises InputError for impossible hints."""
    unscaled = {key: value for key, value in rest.items() if key != "markers"} | {"mm_per_px": UNSCALED_MM_PER_PX}
    return checked(PhotoInput, Path(rest["file"]), {**unscaled, **hints.entries(PATH_KEYS)})


class Pyramid:
    """A photo in tiles, so that a browser fetches only the tiles that it shows.

    The photo is half as large on each level as on the level before. The last level is a single tile.
    """

    def __init__(self, image: Pixels) -> None:
        photo = Image.fromarray(image)
        self.levels = 1 + max(0, int(np.ceil(np.log2(max(photo.size) / TILE_PX))))
        # A pixel is the mean of the square of the photo that it covers, so that nothing is shifted.
        self._level = cache(lambda level: np.asarray(photo.reduce(2**level)) if level else image)

    def tile(self, level: int, column: int, row: int) -> bytes | None:
        """Return a tile as JPEG. None if there is no such tile.

        Tiles at the photo's right and lower edge may be smaller.
        """
        if min(level, column, row) < 0 or level >= self.levels:
            return None
        left, upper = column * TILE_PX, row * TILE_PX
        part = self._level(level)[upper : upper + TILE_PX, left : left + TILE_PX]
        if part.size == 0:
            return None
        written = io.BytesIO()
        Image.fromarray(part).save(written, "JPEG", quality=JPEG_QUALITY)
        return written.getvalue()


class OutdatedError(Exception):
    """Raised for a request that is dropped because a newer one has arrived."""


class _Scaled(NamedTuple):
    photo: Photo  # Its unit is px if the photo has no scale yet
    refused: str | None = None  # Reason why the scale cannot be used


class TraceSession:
    """Traces one photo. Any thread may call it. Of simultaneous requests, only the newest is completed."""

    def __init__(self, settings: PhotoInput, folder: Path, hints: Hints) -> None:
        """Read the photo. Raises InputError for a bad photo.

        ``hints`` are the initial hints. They replace the hints in ``settings``.
        """
        self._rest, self.hints = rest_of(settings), hints
        pixels = read_pixels(settings, folder)
        # In messages on the page, the photo's name has no folder.
        self._pixels = replace(pixels, file=Path(pixels.file.name))
        self._plain = replace(scaled(self._pixels, path_settings(self._rest, Hints())), unit="px")
        self.pyramid = Pyramid(pixels.image)
        self._newest, self._scaling = 0.0, Lock()
        # Clicks do not wait for a search, which may take seconds.
        self._clicking, self._searching = Lock(), Lock()
        self._last = dict[str, tuple[object, tuple[object, ...], Any]]()
        # The search map is made before the first click. A bad region is reported with the first answer.
        with suppress(InputError):
            self._wire(self._scaled(hints).photo, hints.roi_px)

    def opening(self) -> Answer:
        """Return the page's initial state. For a photo without a scale it includes the detected markers."""
        dictionary, corners_px = ("", {}) if self._scaled(self.hints).photo.unit == "mm" else seen_markers(self._pixels)
        return {
            "name": self._plain.file.name,
            "size_px": self._plain.size_px,
            "levels": self.pyramid.levels,
            "hints": {
                **self.hints.entries(),
                "frame": (PRINTED_MM, dictionary, 4 if max(corners_px, default=4) < 4 else 8, None),
            },
            "seen": len(corners_px),
            "markers": bool(self._rest.get("markers")),
            "painted": self._plain.drawn is not None,
        }

    def trace(self, hints: Hints, revision: float, until: Until) -> Iterator[Answer]:
        """Yield the scale, the found cracks if no ends are given, the path and the walls, up to the step ``until``.

        If a step fails, the last item is the reason. ``revision`` increases with each request. Raises OutdatedError if
        there is a newer request.
        """
        self._newest = max(self._newest, revision)
        self._check_newest(revision)
        for name, answer in self._steps(hints, revision):
            if answer is not None:
                yield {name: answer}
            if name in (until, "refused"):
                return
            self._check_newest(revision)

    def _steps(self, hints: Hints, revision: float) -> Iterator[tuple[str, Answer | list[Answer] | str | None]]:
        photo, refused = self._scaled(hints)
        yield "scale", _scale_answer(photo, refused)
        with self._searching if hints.ends_px is None else self._clicking:
            self._check_newest(revision)
            try:
                settings = path_settings(self._rest, hints)
                roi_px = settings.roi_px
                if settings.ends_px is None and photo.drawn is None:
                    search = self._kept("search", photo, (roi_px,), lambda: CrackSearch.of(photo, roi_px))
                    yield "cracks", list(map(_crack_answer, search.cracks))
                    path = self._kept("path", search, (settings.crack,), lambda: search.path(settings.crack))
                else:
                    path = self._kept("path", photo, settings.hints, lambda: self._path(photo, settings))
                    if path.doubtful:
                        wire = self._wire(photo, roi_px)
                        yield "cracks", list(map(_crack_answer, self._kept("rivals", wire, (), wire.rivals)))
                figures: Answer = {"width_px": path.width_px, "source": path.source, "warnings": texts(path.warnings)}
                yield "path", figures | {"points_px": _rounded(path.points_px)}
                outline = trace_outline(photo, path, settings)
                yield "walls", _walls_answer(photo, outline)
            except RivalCracksError as rivals:
                yield "cracks", list(map(_crack_answer, rivals.cracks))
                count = len(rivals.cracks)
                choose = CHOOSE_ONE if count == 1 else CHOOSE.format(count=count)
                yield "refused", choose if hints.ends_px is None else str(rivals)
            except InputError as fault:
                yield "refused", str(fault)

    def end(self) -> None:
        """Stop all requests in progress at their next step."""
        self._newest = np.inf

    def _check_newest(self, revision: float) -> None:
        if revision < self._newest:
            raise OutdatedError

    def _kept(self, name: str, source: object, hints: tuple[object, ...], make: Callable[[], T]) -> T:
        """Return the last result of this name if its source and hints are the same. Otherwise call ``make``."""
        last = self._last.get(name)
        if last is None or last[0] is not source or last[1] != hints:
            last = self._last[name] = source, hints, make()
        return last[2]

    def _scaled(self, hints: Hints) -> _Scaled:
        """Return the photo with the scale from the hints, or without a scale if the hints give none."""
        wanted = hints.model_copy(update=dict.fromkeys(PATH_KEYS))
        with self._scaling:
            return self._kept("scale", self, (wanted,), lambda: self._find_scale(wanted))

    def _find_scale(self, hints: Hints) -> _Scaled:
        try:
            settings = scale_settings(self._rest, hints)
            return _Scaled(self._plain if settings is None else scaled(self._pixels, settings))
        except InputError as fault:
            return _Scaled(self._plain, str(fault))

    def _path(self, photo: Photo, settings: PhotoInput) -> CrackPath:
        if photo.drawn is not None or settings.ends_px is None:
            return painted_path(photo, settings.ends_px)
        return self._wire(photo, settings.roi_px).path(settings.ends_px, settings.via_px)

    def _wire(self, photo: Photo, roi_px: Clicks | None) -> LiveWire:
        """Return the map for path searches. The map is cached, because computing it takes longer than a search."""
        if photo.face_mm is None and not photo.markers_px:
            # If there are no face and no markers, the scale does not change the search.
            photo = self._plain
        return self._kept("wire", photo, (roi_px,), lambda: LiveWire(photo, roi_px))


def _scale_answer(photo: Photo, refused: str | None) -> Answer:
    """Return the scale as fields of an answer."""
    in_mm = photo.unit == "mm"
    answer: Answer = {
        "refused": refused,
        "markers_px": [_rounded(corners) for corners in photo.markers_px],
        "mm_per_px": photo.mm_per_px if in_mm else None,
        "face_px": _rounded(photo.face_ring_px) if in_mm and photo.face_ring_px is not None else None,
    }
    if in_mm:
        answer |= {
            "source": photo.scale_source,
            "residual_mm": photo.scale_residual_mm,
            "uncertainty": photo.scale_uncertainty,
            "camera_tilt_deg": photo.camera_tilt_deg,
            "warnings": texts(photo.warnings),
        }
    return answer


def _crack_answer(crack: FoundCrack) -> Answer:
    return {
        "ends_px": _rounded(crack.line_px[[0, -1]]),
        "middle_px": _rounded(crack.middle_px),
        "outline_px": _rounded(crack.outline_px),
    }


def _choice(number: int, wall_px: Floats) -> Answer:
    there_and_back = np.concatenate([wall_px, wall_px[::-1]])
    ends_px, middle_px = wall_px[[0, -1]], wall_px[len(wall_px) // 3]
    points_px = {"ends_px": ends_px, "middle_px": middle_px, "outline_px": there_and_back}
    return {"wall": number, **{name: _rounded(points) for name, points in points_px.items()}}


def _walls_answer(photo: Photo, outline: Outline) -> Answer:
    lines_mm = {
        "left_px": outline.left_wall_mm,
        "right_px": outline.right_wall_mm,
        "centreline_px": outline.centreline_mm,
        "outline_px": outline.outline_mm,
    }
    several_mm = {"islands_px": outline.islands_mm, "bands_px": outline.bands_mm, "branches_px": outline.branches_mm}
    return {
        **{name: _rounded(photo.to_px(line_mm)) for name, line_mm in lines_mm.items()},
        **{name: [_rounded(photo.to_px(line_mm)) for line_mm in lines] for name, lines in several_mm.items()},
        "choices": [_choice(*wall) for wall in enumerate(map(photo.to_px, numbered_walls(outline)), 1)] or None,
        # For each stretch of a wall: its side, its first and last station, and how it was measured.
        "why": [
            (
                stretch.side,
                *np.searchsorted(outline.s_mm, (stretch.s_from_mm, stretch.s_to_mm)).tolist(),
                stretch.sentence(photo.unit),
            )
            for stretch in outline.walls
        ],
        "unit": photo.unit,
        "length": outline.length_mm,
        "mean_width": outline.mean_width_mm,
        "width_source": outline.width_source,
        "width_95": outline.width_95_mm,
        # Islands run clockwise, so that their area is negative.
        "area": sum(map(signed_area, (outline.outline_mm, *outline.islands_mm))),
        "ends": outline.ends,
        "doubtful": bool(of_keys(outline.warnings, PLAUSIBLE)),
        "warnings": texts(outline.warnings),
    }


def _rounded(points_px: Floats) -> list[Any]:
    """Round points to a hundredth of a pixel, which is finer than any display."""
    return np.round(points_px, 2).tolist()
