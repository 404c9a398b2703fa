"""Find the crack in a photo: the painted one, the darkest path between given points, or one of the likeliest lines."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import KDTree

from digitise.crack_path.candidates import FoundCrack, candidates
from digitise.crack_path.hints import CrackPath, listed
from digitise.crack_path.painted_path import painted_path
from digitise.crack_path.path_search import LiveWire
from digitise.photo import Photo
from digitise.scale.face_scale import see_face
from digitise.settings import MOST_RANKED, Pixel
from sealtwin.core.errors import InputError
from sealtwin.core.facts import Fact, doubt, texts

EDGES_FOUND = doubt(
    "path.inside-edges",
    "the photo shows the edges of the sample, and the crack was searched for only inside them; if the crack is open "
    "at an edge, give face_mm, the size of the face",
)
FOLLOWS_CELLS, MOST_ASTRAY = 5.0, 0.2  # Least distance and largest share of a path off the line that was chosen
RUNNER_UP = 0.5  # A second line with more than this share of the first one's score makes the choice the user's


class RivalCracksError(InputError):
    """Several cracks compete, so the user must choose one."""

    def __init__(self, message: str, cracks: Sequence[FoundCrack] = ()) -> None:
        super().__init__(message)
        self.cracks = cracks


def find_path(
    photo: Photo,
    ends_px: tuple[Pixel, Pixel] | None,
    via_px: tuple[Pixel, ...] = (),
    roi_px: tuple[Pixel, ...] | None = None,
    crack: int | None = None,
) -> CrackPath:
    """Find the path between the ends, past the via points in order, inside ``roi_px``.

    In a painted photo it runs along the middle of the paint. Without ends it runs from left to right along the found
    crack with the number ``crack``, or along the first if that is surely a crack. Raises InputError if a point is
    outside the photo or off any crack, or no crack is found; RivalCracksError if several compete.
    """
    if photo.drawn is not None:
        return painted_path(photo, ends_px)
    if ends_px is None:
        return CrackSearch.of(photo, roi_px).path(crack)
    return LiveWire(photo, roi_px).path(ends_px, via_px)


@dataclass(frozen=True)
class CrackSearch:
    """The lines that are most likely to be the crack, at most ``MOST_RANKED``. The likeliest is first."""

    photo: Photo
    wire: LiveWire
    cracks: tuple[FoundCrack, ...]
    warnings: tuple[Fact, ...]

    @classmethod
    def of(cls, photo: Photo, roi_px: tuple[Pixel, ...] | None = None) -> "CrackSearch":
        """Search the photo within ``roi_px``; raise InputError if that is not a region."""
        face_px = see_face(photo.brightness) if photo.face_px is None else None
        wire = LiveWire(photo, roi_px, face_px)
        cracks, straight_px = candidates(photo, wire.field)
        warnings = () if face_px is None else (EDGES_FOUND,)
        if straight_px:
            warnings += (doubt("path.joint", f"a line from {listed(straight_px[0])} px is as straight as a joint"),)
        return cls(photo, wire, tuple(cracks[:MOST_RANKED]), warnings)

    def path(self, number: int | None = None) -> CrackPath:
        """Return the path along the crack with a number, from 1, or along the likeliest crack, from left to right.

        Raises InputError if there is no such crack, and RivalCracksError if none is surely a crack, several are about
        equally likely, or a gate doubts the path.
        """
        photo, ranked = self.photo, self.cracks
        if not ranked:
            raise InputError(
                f"{photo.file}: no crack found: nothing dark, thin and long stands out; "
                f"{'; '.join(('give ends_px', *texts(self.warnings)))}."
            )
        if number is not None and number > len(ranked):
            raise InputError(
                f"{photo.file}: photo.crack = {number}, but only {len(ranked)} cracks were found: {self._listed()}. "
                "Give one of these numbers."
            )
        if number is None:
            rivals = [crack for crack in ranked if crack.score > RUNNER_UP * ranked[0].score]
            self._require_sure(f"{len(rivals)} cracks compete" if len(rivals) > 1 else ranked[0].doubt)
        chosen = ranked[(number or 1) - 1]
        try:
            path = self._along(chosen)
        except InputError:
            # The user has not given these ends, so a message about them would not help.
            raise InputError(
                f"{photo.file}: no crack found: line {number or 1}, from {listed(chosen.line_px[[0, -1]])} px, is not "
                "a crack over its whole length; give ends_px."
            ) from None
        if number is None and path.warnings:
            self._require_sure(path.warnings[0].text)
        source = "automatic" if number is None else "choice"
        return replace(path, source=source, warnings=(*self.warnings, *path.warnings))

    def _require_sure(self, doubt: str) -> None:
        if doubt:
            raise RivalCracksError(
                f"{self.photo.file}: no line stands out as the crack: of the first, {doubt}. The lines (best first, "
                f"with the score as a share of the highest) are {self._listed()}; choose one by its number, such as "
                "photo.crack = 2 (in a batch: 2 in the column crack of photos.csv), or give ends_px.",
                self.cracks,
            )

    def _along(self, crack: FoundCrack) -> CrackPath:
        """Return the path between the ends of a line, past points of the line if it takes another way without them."""
        line_px = crack.line_px
        path = self.wire.between(line_px[[0, -1]])
        near_px = max(crack.width_px, FOLLOWS_CELLS / self.wire.field.scale)
        if float(np.mean(KDTree(line_px).query(path.points_px)[0] > near_px)) <= MOST_ASTRAY:
            return path
        return self.wire.between(line_px[np.linspace(0, len(line_px) - 1, 5).astype(int)])

    def _listed(self) -> str:
        best = self.cracks[0].score
        return "; ".join(
            f"{rank}. {listed(crack.line_px[[0, -1]])} px, {crack.score / best:.0%}"
            for rank, crack in enumerate(self.cracks, 1)
        )
