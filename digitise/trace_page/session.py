"""What the trace page knows: one photo, and what its scale, path and walls are with the hints of the moment."""

import math
import re
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from threading import Lock
from typing import Any, Literal, NamedTuple

import numpy as np

from digitise.finding.crack_path import CrackPath
from digitise.finding.livewire import LiveWire
from digitise.geometry.polyline import signed_area
from digitise.outline import PROPOSAL, trace_outline
from digitise.path import find_path
from digitise.photo import Photo, read_pixels, scaled
from digitise.settings import PhotoInput, Pixel
from digitise.trace_page.glance import glance
from digitise.trace_page.hints import SCALE_KEYS, UNSCALED_MM_PER_PX, Hints, path_settings, rest_of, scale_settings
from digitise.trace_page.tiles import Pyramid
from sealtwin.errors import InputError
from sealtwin.records import Floats, Outline

Answer = dict[str, Any]
Until = Literal["scale", "path", "glance", "walls"]


class OutdatedError(Exception):
    """A newer question has arrived: nobody waits for this one's answer."""


class _Scaled(NamedTuple):
    photo: Photo
    known: bool
    refused: str | None
    """Why the scale that was given cannot be used."""


class TraceSession:
    """Safe to ask from several threads; of several questions at once, the newest is answered."""

    def __init__(self, settings: PhotoInput, folder: Path, hints: Hints) -> None:
        """``hints`` are those that the user starts with, whatever ``settings`` say in their place.

        Raises InputError where the photo cannot be read.
        """
        self._rest, self.hints = rest_of(settings), hints
        self._edge_fraction, self._keep_branches = settings.edge_fraction, settings.branches == "keep"
        pixels = read_pixels(settings, folder)
        # Whoever reads a sentence on the page sees which photo it is about: a name is enough.
        self._pixels = replace(pixels, file=Path(pixels.file.name))
        self._plain = scaled(self._pixels, path_settings(self._rest, Hints()))
        self.pyramid = Pyramid(pixels.image)
        self._newest, self._scaling = 0.0, Lock()
        # One after the other each; a click does not wait for a search, which may take seconds.
        self._clicking, self._searching = Lock(), Lock()
        self._last_scale: tuple[Hints, _Scaled] | None = None
        self._last_wire: tuple[Photo, tuple[Pixel, ...] | None, LiveWire] | None = None
        # The first click shall not wait for the search map. What is wrong with the region is said when it is asked for.
        with suppress(InputError):
            self._wire(self._scaled(hints).photo, hints.roi_px)

    def opening(self) -> Answer:
        """What the page starts from."""
        return {
            "name": self._plain.file.name,
            "size_px": self._plain.size_px,
            "levels": self.pyramid.levels,
            "hints": self.hints.said(),
            "markers": bool(self._rest.get("markers")),
            "painted": self._plain.drawn is not None,
        }

    def trace(self, hints: Hints, revision: float, until: Until) -> Iterator[Answer]:
        """Scale, path, walls at a glance and walls, each as soon as it is known; the last may be a refusal.

        Without ends the crack is searched for, unless painted. ``revision`` grows from question to question.

        Raises OutdatedError as soon as a newer one was asked.
        """
        self._newest = max(self._newest, revision)
        self._check_newest(revision)
        seen = self._scaled(hints)
        by_edges = hints.face_mm is not None and hints.face_corners_px is None and not self._rest.get("markers")
        yield {"scale": _scale_answer(seen, by_edges)}
        if until == "scale":
            return
        with self._searching if hints.ends_px is None else self._clicking:
            try:
                self._check_newest(revision)
                path = self._path(seen.photo, hints)
                yield {"path": _path_answer(path, seen.known)}
                if until == "path":
                    return
                self._check_newest(revision)
                if (rough := glance(seen.photo, path, self._edge_fraction)) is not None:
                    yield {"glance": _walls_answer(seen.photo, rough, seen.known)}
                if until == "glance":
                    return
                self._check_newest(revision)
                outline = trace_outline(seen.photo, path, self._edge_fraction, self._keep_branches)
                yield {"walls": _walls_answer(seen.photo, outline, seen.known)}
            except InputError as fault:
                yield {"refused": _in_px_unless(seen.known, str(fault))}

    def end(self) -> None:
        """Whatever is under way stops at its next step."""
        self._newest = math.inf

    def _check_newest(self, revision: float) -> None:
        if revision < self._newest:
            raise OutdatedError

    def _scaled(self, hints: Hints) -> _Scaled:
        """The photo with the scale of the hints, or without one."""
        wanted = Hints(**{key: getattr(hints, key) for key in SCALE_KEYS})
        with self._scaling:
            if self._last_scale is None or self._last_scale[0] != wanted:
                self._last_scale = wanted, self._find_scale(wanted)
            return self._last_scale[1]

    def _find_scale(self, hints: Hints) -> _Scaled:
        try:
            settings = scale_settings(self._rest, hints)
            if settings is None:
                return _Scaled(self._plain, known=False, refused=None)
            return _Scaled(scaled(self._pixels, settings), known=True, refused=None)
        except InputError as fault:
            return _Scaled(self._plain, known=False, refused=str(fault))

    def _path(self, photo: Photo, hints: Hints) -> CrackPath:
        settings = path_settings(self._rest, hints)
        if settings.ends_px is None or photo.drawn is not None:
            return find_path(photo, settings.ends_px, settings.via_px, settings.roi_px)
        return self._wire(photo, settings.roi_px).path(settings.ends_px, settings.via_px)

    def _wire(self, photo: Photo, roi_px: tuple[Pixel, ...] | None) -> LiveWire:
        """The same for as long as face and region stay: to make it takes longer than to ask it."""
        if photo.face_mm is None and not photo.markers_px:
            # A plain scale changes nothing of where a crack may be.
            photo = self._plain
        if self._last_wire is None or self._last_wire[0] is not photo or self._last_wire[1] != roi_px:
            self._last_wire = photo, roi_px, LiveWire(photo, roi_px)
        return self._last_wire[2]


def _scale_answer(seen: _Scaled, by_edges: bool) -> Answer:
    """``corners_px``: those of the face, where they were found by its edges and can be set right by hand."""
    photo = seen.photo
    answer: Answer = {"refused": seen.refused, "markers_px": [_rounded(corners) for corners in photo.markers_px]}
    if not seen.known:
        return answer | {"mm_per_px": None, "face_px": None, "corners_px": None}
    return answer | {
        "mm_per_px": photo.mm_per_px,
        "source": photo.scale_source,
        "residual_mm": photo.scale_residual_mm,
        "uncertainty": photo.scale_uncertainty,
        "camera_tilt_deg": photo.camera_tilt_deg,
        "face_px": None if photo.face_ring_px is None else _rounded(photo.face_ring_px),
        "corners_px": _rounded(photo.face_px) if by_edges and photo.face_px is not None else None,
        "warnings": photo.warnings,
    }


def _path_answer(path: CrackPath, in_mm: bool) -> Answer:
    return {
        "points_px": _rounded(path.points_px),
        "width_px": path.width_px,
        "source": path.source,
        "warnings": [_in_px_unless(in_mm, warning) for warning in path.warnings],
    }


def _walls_answer(photo: Photo, outline: Outline, in_mm: bool) -> Answer:
    rings = [outline.outline_mm, *outline.islands_mm]
    lines_mm = {
        "left": outline.left_wall_mm,
        "right": outline.right_wall_mm,
        "centreline": outline.centreline_mm,
        "outline": outline.outline_mm,
    }
    return {
        **{f"{name}_px": _rounded(photo.to_px(line_mm)) for name, line_mm in lines_mm.items()},
        "islands_px": [_rounded(photo.to_px(ring)) for ring in outline.islands_mm],
        "branches_px": [_rounded(photo.to_px(line)) for line in outline.branches_mm],
        "unit": "mm" if in_mm else "px",
        "length": outline.length_mm,
        "mean_width": outline.mean_width_mm,
        # Islands turn the other way round, so that their area counts against the outline's.
        "area": sum(signed_area(ring) for ring in rings),
        "ends": outline.ends,
        # The page asks itself whether a proposal is the crack, and has no overlay.png.
        "warnings": [_in_px_unless(in_mm, warning) for warning in outline.warnings if warning != PROPOSAL],
    }


def _in_px_unless(in_mm: bool, sentence: str) -> str:
    """Without a scale a millimetre is a pixel, and must be called one."""
    assert UNSCALED_MM_PER_PX == 1
    return sentence if in_mm else re.sub(r"\bmm\b", "px", sentence)


def _rounded(points_px: Floats) -> list[list[float]]:
    """A hundredth of a pixel is finer than anything that is seen."""
    return np.round(points_px, 2).tolist()
