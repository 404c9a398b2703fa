"""Read layers of a drawing by their meaning: closed lines around and in a crack, or one line from end to end."""

from collections.abc import Sequence

import numpy as np
from manifold3d import CrossSection, FillRule

from digitise.drawing.join_lines import DrawnLine, Gap, forks, gaps
from digitise.drawing.read_dxf import Drawing
from digitise.geometry.polyline import crossings, meeting, signed_area
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats

MOST_GAPS = 3  # Most gaps that a refusal names
BESIDE_MM2 = 1e-3  # Area outside another line that is only the sag of two curves
NO_AREA_MM2 = 1e-6  # Area of a closed line that runs back along itself


class DrawnLayers:
    """Lines of a drawing by layer. Error messages give the file, the layer and the place."""

    def __init__(self, drawing: Drawing) -> None:
        self.drawing = drawing

    def has(self, name: str) -> bool:
        return bool(self.drawing.lines(name))

    def rings(self, name: str) -> list[Floats]:
        """Return the closed lines of a layer, the largest first, counter-clockwise.

        Raises InputError for an open line, or a layer without lines.
        """
        lines = self._lines(name)
        if open_lines := [line for line in lines if not line.closed]:
            raise InputError(
                f"{self.drawing.file}, layer {name}: "
                + (f"{len(open_lines)} open lines: " if len(open_lines) > 1 else "an open line: ")
                + f"{self._gaps(name, open_lines, len(open_lines))}. Close the edge there."
            )
        rings = [line.points_mm for line in lines]
        for ring in rings:
            if abs(signed_area(ring)) < NO_AREA_MM2:
                raise InputError(
                    f"{self.drawing.file}, layer {name}: the closed line at {self._at(ring)} encloses nothing: it is "
                    "a speck, crosses itself, or runs back along itself. Delete it, or draw the edge once, around "
                    "the whole area."
                )
        return sorted(
            (ring if signed_area(ring) > 0 else ring[::-1] for ring in rings), key=lambda ring: -signed_area(ring)
        )

    def one_ring(self, name: str) -> Floats:
        """Return the one closed line of a layer. Raises InputError if the layer has more than one."""
        largest, *others = self.rings(name)
        if others:
            raise InputError(
                f"{self.drawing.file}, layer {name}: {1 + len(others)} closed lines, the second at "
                f"{self._at(others[0])}; one is the edge of the sample. Put the others on another layer."
            )
        return largest

    def outline(self, name: str) -> list[Floats]:
        """Return the closed lines of a layer, the largest first. Raises InputError if another one is not inside it."""
        largest, *stones = self.rings(name)
        self._require_inside(largest, stones, name)
        inside = [number for number in range(1, len(stones)) if not _reaches_beyond(stones[number], stones[:number])]
        if inside:
            self.drawing.notes.append(
                f"{self.drawing.file.name}, layer {name}: {len(inside)} closed lines inside a stone change nothing, "
                f"one at {self._at(stones[inside[0]])}"
            )
        return [largest, *stones]

    def islands(self, largest: Floats, name: str) -> list[Floats]:
        """Return the closed lines of a layer. Raises InputError if one of them is not inside ``largest``."""
        stones = self.rings(name)
        self._require_inside(largest, stones, name)
        return stones

    def _require_inside(self, largest: Floats, stones: Sequence[Floats], name: str) -> None:
        edge = CrossSection([largest])
        for ring in stones:
            stone = CrossSection([ring])
            outside_mm2 = (stone - edge).area()
            if outside_mm2 <= BESIDE_MM2:
                continue
            beside = outside_mm2 >= stone.area() - BESIDE_MM2
            raise InputError(
                f"{self.drawing.file}, layer {name}: the closed line at {self._at(ring)} "
                + ("is beside" if beside else "crosses")
                + f" the crack's edge (the closed line at {self._at(largest)}). Lines inside it are stones, and a "
                "trial has one crack. Put each crack on a layer of its own and give it as --outline."
            )

    def way(self, name: str) -> Floats:
        """Return the one open line of a layer. Raises InputError if there are several lines, or a closed one."""
        lines = self._lines(name)
        if len(lines) == 1 and not lines[0].closed:
            return self._without_crossing(lines[0].points_mm, name)
        open_lines = [line for line in lines if not line.closed]
        if len(open_lines) == len(lines):
            content = f"{len(lines)} lines that do not join into one: {self._gaps(name, open_lines, len(lines) - 1)}"
        elif len(lines) > 1:
            content = f"{len(lines)} lines, {len(lines) - len(open_lines)} of them closed"
        elif abs(signed_area(lines[0].points_mm)) < NO_AREA_MM2:
            content = (
                f"a line at {self._at(lines[0].points_mm)} that runs back along itself, perhaps because it was drawn "
                "twice"
            )
        else:
            content = "a closed line"
        raise InputError(f"{self.drawing.file}, layer {name}: {content}; draw one open line from end to end.")

    def _without_crossing(self, line_mm: Floats, name: str) -> Floats:
        for first, second in crossings(line_mm, closed=False)[:1]:
            step = np.diff(line_mm, axis=0)
            place_mm = meeting((line_mm[first], step[first]), (line_mm[second], step[second]))
            raise InputError(
                f"{self.drawing.file}, layer {name}: the line crosses itself at {self.drawing.place(place_mm)}; draw "
                "one open line from end to end."
            )
        return line_mm

    def _gaps(self, name: str, lines: Sequence[DrawnLine], count: int) -> str:
        """List the places where lines fork, and the ``count`` smallest gaps, which have to be closed."""
        faults = [*forks(self.drawing.pieces(name)), *gaps(lines)[:count]]
        more = f" and {len(faults) - MOST_GAPS} more" if len(faults) > MOST_GAPS else ""
        return ", ".join(self._gap(gap) for gap in faults[:MOST_GAPS]) + more

    def _gap(self, gap: Gap) -> str:
        where = self.drawing.place(gap.place_mm)
        return f"{gap.lines} lines meet at {where}" if gap.lines > 1 else f"a gap of {gap.size_mm:.3g} mm at {where}"

    def _at(self, ring_mm: Floats) -> str:
        return self.drawing.place((ring_mm.min(axis=0) + ring_mm.max(axis=0)) / 2)

    def _lines(self, name: str) -> Sequence[DrawnLine]:
        lines = self.drawing.lines(name)
        if not lines:
            left_out = self.drawing.left_out(name)
            there = ", ".join(self.drawing.with_lines()) or "none"
            raise InputError(
                f"{self.drawing.file}: the layer {name} has no lines to read"
                + (f" (left out: {left_out})" if left_out else "")
                + f"; layers with lines: {there}."
            )
        return lines


def _reaches_beyond(ring_mm: Floats, others_mm: Sequence[Floats]) -> bool:
    """Return True if part of a ring is outside all of the others; all are counter-clockwise."""
    return (CrossSection([ring_mm]) - CrossSection(list(others_mm), FillRule.NonZero)).area() > BESIDE_MM2
