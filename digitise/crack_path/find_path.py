"""Find the crack in a photo: the painted one, the darkest path between given points, or one of the likeliest lines."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import KDTree

from digitise.crack_path import step_costs
from digitise.crack_path.crack_map import FoundCrack, cracks_on
from digitise.crack_path.hints import CrackPath, listed
from digitise.crack_path.line_likeness import LEAST_WORST, MOST_STRAIGHT, MOST_UNLIKE, Likeness, grain_of, likeness
from digitise.crack_path.painted_path import painted_path
from digitise.crack_path.path_search import LiveWire
from digitise.crack_path.standing_out import unlike_length_px, unlike_sides
from digitise.photo import Photo
from digitise.scale.face_scale import see_face
from digitise.settings import CHOICE, MOST_RANKED, Pixel
from sealtwin.core.arc_length import arc_length
from sealtwin.core.errors import InputError

EDGES_FOUND = (
    "the photo shows the edges of the sample, and the crack was searched for only inside them; if the crack is open "
    "at an edge, give face_mm, the size of the face"
)
EDGE_WIDTHS, EDGE_SHARE = 3.0, 0.05  # Longest stretch with unlike sides without a warning: widths, share of the line
LEAST_LENGTH = 0.12  # Share of the photo's diagonal between a crack's ends; shorter lines are pores and scratches
UNLIKE, STRAIGHT = " (unlike sides)", " (as straight as a joint)"
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
    crack with the number ``crack``, or along the first if that is far likelier than the others. Raises InputError if a
    point is outside the photo or off any crack, or no crack is found; RivalCracksError if several compete.
    """
    if photo.drawn is not None:
        return painted_path(photo, ends_px)
    if ends_px is None:
        return CrackSearch.of(photo, roi_px).path(crack)
    return LiveWire(photo, roi_px).path(ends_px, via_px)


@dataclass(frozen=True)
class CrackSearch:
    """The lines that are most likely to be the crack, at most ``MOST_RANKED``. The likeliest is first.

    Lines that may be joints are after the others, and lines with unlike sides are last.
    """

    photo: Photo
    wire: LiveWire
    cracks: tuple[FoundCrack, ...]
    likenesses: tuple[Likeness, ...]
    warnings: tuple[str, ...]

    @classmethod
    def of(cls, photo: Photo, roi_px: tuple[Pixel, ...] | None = None) -> "CrackSearch":
        """Search the photo within ``roi_px``; raise InputError if that is not a region."""
        face_px = see_face(photo.brightness) if photo.face_px is None else None
        wire = LiveWire(photo, roi_px, face_px)
        least_px, warnings = LEAST_LENGTH * float(np.hypot(*photo.size_px)), list[str]()
        fine_map = cracks_on(wire.field)
        # On the fine map a wide crack is two lines, one along each wall.
        wide_px = step_costs.THIN_PX / wire.coarse.scale
        wide = [
            crack
            for crack in _long(cracks_on(wire.coarse, fine_map.straight_px).cracks, least_px)
            if crack.width_px >= wide_px
        ]
        fine = [crack for crack in _long(fine_map.cracks, least_px) if not any(_in(crack, other) for other in wide)]
        if fine_map.straight_px:
            line = f"a line from {listed(fine_map.straight_px[0])} px"
            if wide or fine:
                warnings.append(f"{line} was left out: it is as straight as a joint")
            else:
                fine = _long(cracks_on(wire.field, ()).cracks, least_px)
                warnings.append(f"{line} is as straight as a joint, and there is no other line")
        if face_px is not None:
            warnings.insert(0, EDGES_FOUND)
        if fine_map.short_px:
            # Joints hide fainter cracks: they are most of what differs from plain ground.
            fainter = _long(cracks_on(wire.field, (*fine_map.straight_px, *fine_map.short_px)).cracks, least_px)
            fine += [crack for crack in fainter if not any(_in(crack, other) for other in (*wide, *fine))]
        grain = grain_of(wire.field)
        lines = [
            (crack, likeness(photo, crack.line_px, crack.width_px, grain, wire.field.to_work(crack.line_px)))
            for crack in (*wide, *fine)
        ]
        # A marking, an edge or a joint may score higher than any crack.
        lines.sort(key=lambda line: (not line[1].two_sided, line[1].may_be_joint, -line[0].score))
        cracks, likenesses = zip(*lines[:MOST_RANKED], strict=True) if lines else ((), ())
        return cls(photo, wire, tuple(cracks), tuple(likenesses), tuple(warnings))

    def path(self, number: int | None = None) -> CrackPath:
        """Return the path along the crack with a number, from 1, or along the likeliest crack, from left to right.

        Raises InputError if there is no such crack, and RivalCracksError if several are about equally likely.
        """
        photo, ranked = self.photo, self.cracks
        if not ranked:
            where = " inside the edges of the sample" if EDGES_FOUND in self.warnings else ""
            raise InputError(
                f"{photo.file}: no crack found{where}: nothing dark, thin and long stands out; give ends_px."
            )
        if number is None and not self.likenesses[0].sure:
            raise RivalCracksError(
                f"{photo.file}: no line stands out as a crack: {self._doubt()}. The lines (best first, with the score "
                f"as a share of the highest) are {self._listed()}; choose one by its number, such as {CHOICE}, or give "
                "ends_px.",
                ranked,
            )
        pairs = zip(ranked, self.likenesses, strict=True)
        alike = [one for one, own in pairs if own.two_sided and not own.may_be_joint]
        if number is None and len(rivals := [one for one in alike if one.score > RUNNER_UP * ranked[0].score]) > 1:
            raise RivalCracksError(
                f"{photo.file}: {len(rivals)} cracks compete (best first, with the score as a share of the highest): "
                f"{self._listed()}; choose one by its number, such as {CHOICE}, or give ends_px.",
                ranked,
            )
        if number is not None and number > len(ranked):
            raise InputError(
                f"{photo.file}: photo.crack = {number}, but only {len(ranked)} cracks were found: {self._listed()}. "
                "Give one of these numbers."
            )
        chosen = ranked[(number or 1) - 1]
        ends_px = chosen.line_px[[0, -1]]
        try:
            path = self._along(chosen)
        except InputError:
            # The user has not given these ends, so a message about them would not help.
            raise InputError(
                f"{photo.file}: no crack found: line {number or 1}, from {listed(ends_px)} px, is not a crack over its "
                "whole length; give ends_px."
            ) from None
        warnings = [*self.warnings, *path.warnings]
        unlike_px = unlike_length_px(photo, path.points_px, path.width_px)
        if unlike_px > max(EDGE_WIDTHS * path.width_px, EDGE_SHARE * float(arc_length(path.points_px)[-1])):
            warnings.append(
                f"along {unlike_px * photo.mm_per_px:.0f} mm of the found line, one side is far brighter than the "
                "other. If the line follows the edge of the sample there, the nozzle must not go there: look at "
                "overlay.png, and give ends_px or face_mm"
            )
        elif number is None:
            warnings += unlike_sides(photo, path)
        return replace(path, source="automatic" if number is None else "choice", warnings=tuple(warnings))

    def _along(self, crack: FoundCrack) -> CrackPath:
        """Return the path between the ends of a line, past points of the line if it takes another way without them."""
        line_px = crack.line_px
        path = self.wire.between(line_px[[0, -1]])
        near_px = max(crack.width_px, FOLLOWS_CELLS / self.wire.field.scale)
        if float(np.mean(KDTree(line_px).query(path.points_px)[0] > near_px)) <= MOST_ASTRAY:
            return path
        return self.wire.between(line_px[np.linspace(0, len(line_px) - 1, 5).astype(int)])

    def _doubt(self) -> str:
        best = self.likenesses[0]
        if not best.two_sided:
            least = min(own.unlike for own in self.likenesses)
            return (
                f"both sides of each differ in brightness by {least:.0%} or more of its darkness (at most "
                f"{MOST_UNLIKE:.0%} along a crack), as at a marking, a patch or a joint"
            )
        if best.may_be_joint:
            return (
                f"{best.straight:.0%} of the first is straight (at most {MOST_STRAIGHT:.0%} along a crack), as a joint "
                "between bricks, tiles or slabs is"
            )
        return (
            f"the faintest part of the first is {best.worst:.1f} times as dark as the ground's grain (at least "
            f"{LEAST_WORST:g} along a crack)"
            if best.worst >= 0.05
            else "a part of the first is not darker than the ground"
        )

    def _listed(self) -> str:
        best = max(crack.score for crack in self.cracks)
        return "; ".join(
            f"{rank}. {listed(crack.line_px[[0, -1]])} px, {crack.score / best:.0%}{_mark(own)}"
            for rank, (crack, own) in enumerate(zip(self.cracks, self.likenesses, strict=True), 1)
        )


def _mark(own: Likeness) -> str:
    if not own.two_sided:
        return UNLIKE
    return STRAIGHT if own.may_be_joint else ""


def _in(crack: FoundCrack, other: FoundCrack) -> bool:
    """Return True if most of the line of ``crack`` runs inside ``other`` or along its walls."""
    return float(np.median(KDTree(other.line_px).query(crack.line_px)[0])) <= other.width_px


def _long(cracks: Sequence[FoundCrack], least_px: float) -> list[FoundCrack]:
    """Return the cracks whose ends are at least ``least_px`` apart. This excludes the rim of a stain: its ends meet."""
    return [crack for crack in cracks if np.linalg.norm(crack.line_px[-1] - crack.line_px[0]) >= least_px]
