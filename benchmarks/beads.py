"""Beads in particles: the closed form by a bead's outline, before and after its correction, and where it ends.

    python -m benchmarks.beads [--record]

The yield stress and the section that the closed form says of the outline at which a bar of paste came to rest, over
those that it had. Outlines stand in ``beads.csv``; ``--record`` computes those that are not there, some ten minutes of
one core. Bars are as high as the filament of their section is thick, or 1.6 times as wide: what a nozzle leaves lies
between, and how they differ is the law's uncertainty. The correction was fitted to the rows of kind ``fit``; those of
kind ``judge`` have other stresses, another shape and finer particles; ``short`` ones are refused. Names are the stress
over rho g sqrt(A), the length over sqrt(A), and the bar's width. No paste was measured for any of this.
"""

import csv
import math
from functools import cache
from pathlib import Path
from typing import Annotated, NamedTuple

import cv2
import numpy as np
from typer import Option

from benchmarks.kept_runs import KeptRuns
from benchmarks.table import Row, run_benchmark
from digitise.bead import BeadOutline, bead_of
from sealtwin.core.records import Floats
from sealtwin.material.by_bead import footprint_of
from simulate.bead_law import STRETCH, Bead, laid_section, slumped_stress
from simulate.device import start_warp
from simulate.plate import paste_on_plate
from simulate.settings import particle_volume
from simulate.slump import FLAT_GALILEI, THICK_UNTIL, THIN_FROM, THINNED
from simulate.spread_law import GRAVITY_M_S2

TABLE = Path(__file__).with_name("beads.csv")
KEPT = KeptRuns(TABLE, "python -m benchmarks.beads --record", ("simulate",))
SECTION_MM2, DENSITY_KG_M3 = 64.0, 1690.0
ENDS = 450.0  # In units of mu / (rho g V^(1/3)), as of a slump's
ANGLES = 25
LEAST_DIAMETERS = {"fit": 4.0, "short": 4.0, "judge": 5.0}
SOFT, SOFT_DIAMETERS = 0.05, {"fit": 3.5, "judge": 4.0}
"""Softer beads have fewer particles over each other, since they would have some ten times as many."""
COARSEST_MM = 0.5
JUDGED_LENGTH = 5.0
OFF, SECTION_OFF = 0.1, 0.05


class Shape(NamedTuple):
    """A bead at rest without units: lengths over the root of its section as laid."""

    kind: str
    stress: float  # tau / (rho g sqrt(A))
    length: float  # As laid
    wide: float
    half_length: float
    half_width: float
    radii: tuple[float, ...]  # Of a quarter of its outline, scaled to a square's, from its tip to its side

    def ring(self) -> Floats:
        """Return the outline, (n, 2)."""
        quarter = np.linspace(0, np.pi / 2, ANGLES)
        x, y = np.array(self.radii) * np.array([np.cos(quarter), np.sin(quarter)])
        right = np.column_stack([np.r_[x, -x[-2::-1]], np.r_[y, y[-2::-1]]])
        return np.vstack([right, -right[1:-1]]) * [self.half_length, self.half_width]

    def seen(self) -> BeadOutline:
        """Return what an exact photo of it would show."""
        ring = self.ring()
        return bead_of(ring, 0.0, 0.0, (), Path("bead"))


WANTED = [("fit", stress, 5.0, wide) for stress in (0.03, 0.06, 0.1, 0.16) for wide in (1.0, 1.6)]
WANTED += [("short", 0.1, 3.2, 1.0), ("short", 0.1, 3.2, 1.6), ("short", 0.06, 3.2, 1.6)]
WANTED += [("judge", stress, 5.0, 1.3) for stress in (0.03, 0.045, 0.08, 0.13, 0.16)] + [("judge", 0.1, 4.2, 1.3)]


@cache
def recorded() -> tuple[Shape, ...]:
    """Return all beads. Leaves if another solver computed them."""
    KEPT.require()
    with TABLE.open(newline="", encoding="utf-8") as file:
        lines = list(csv.reader(file))[1:]
    shapes = []
    for kind, *numbers in lines:
        stress, length, wide, half_length, half_width, *radii = map(float, numbers)
        shapes.append(Shape(kind, stress, length, wide, half_length, half_width, tuple(radii)))
    return tuple(shapes)


def record() -> None:
    """Compute what is not in the table yet, one bead after the other."""
    KEPT.begin()
    if not TABLE.is_file():
        head = ["kind", "stress", "length", "wide", "half_length", "half_width", *map(str, range(ANGLES))]
        TABLE.write_text(",".join(head) + "\n", encoding="utf-8")
    done = {shape[:4] for shape in recorded()}
    for case in (case for case in WANTED if case not in done):
        shape = at_rest(*case)
        with TABLE.open("a", newline="", encoding="utf-8") as file:
            csv.writer(file).writerow([*shape[:4], *(f"{value:.5g}" for value in (*shape[4:6], *shape.radii))])


def at_rest(kind: str, stress: float, length: float, wide: float) -> Shape:
    """Let a bar go down on a plate, without inertia, as a slump's cone."""
    root_mm = math.sqrt(SECTION_MM2)
    weight_n_m3 = DENSITY_KG_M3 * GRAVITY_M_S2
    per_mm, bar = stress * root_mm, Bead(length * root_mm, SECTION_MM2, wide)
    layers = (SOFT_DIAMETERS if stress < SOFT else LEAST_DIAMETERS)[kind]
    half_mm = (0.75 * SECTION_MM2 / math.sqrt(2 * per_mm)) ** (2 / 3)
    radius_mm = min(math.sqrt(2 * per_mm * half_mm) / layers / 2, COARSEST_MM)
    start_warp()
    volume_m3 = bar.volume_mm3 * 1e-9
    thick_pa_s = DENSITY_KG_M3 * math.sqrt(GRAVITY_M_S2 * volume_m3 / FLAT_GALILEI)
    unit_s = thick_pa_s / (weight_n_m3 * volume_m3 ** (1 / 3))
    curve = {
        "age_s": [0.0, THICK_UNTIL * unit_s, THIN_FROM * unit_s],
        "viscosity_pa_s": [thick_pa_s, thick_pa_s, thick_pa_s / THINNED],
        "yield_stress_pa": [per_mm * 1e-3 * weight_n_m3] * 3,
    }
    plate = paste_on_plate(bar, radius_mm, bar.length_mm / 2 + 1.3 * half_mm, DENSITY_KG_M3, curve)
    for _ in plate.run(ENDS * unit_s, every_s=ENDS * unit_s):
        pass
    place_mm, around_mm = plate.place_mm[:, :2], plate.half_mm
    # The volume that whole particles have is a little off the bar's.
    root_mm = math.sqrt(len(place_mm) * particle_volume(radius_mm) / bar.length_mm)
    return _shape((kind, stress, length, wide), _outline(place_mm, around_mm), root_mm)


def _outline(place_mm: Floats, around_mm: float) -> Floats:
    """Return the outline of discs around particles, gaps and strays of twice their size left out, (n, 2)."""
    cell_mm = around_mm / 5
    low = place_mm.min(axis=0) - 4 * around_mm
    size = np.ceil((np.ptp(place_mm, axis=0) + 8 * around_mm) / cell_mm).astype(int)
    mask = np.zeros((size[1], size[0]), np.uint8)
    for x, y in np.round((place_mm - low) / cell_mm).astype(int).tolist():
        cv2.circle(mask, (x, y), 5, 1, cv2.FILLED)
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (21, 21))
    mask = cv2.morphologyEx(cv2.morphologyEx(mask, cv2.MORPH_CLOSE, kernel), cv2.MORPH_OPEN, kernel)
    rings, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    return low + np.asarray(max(rings, key=cv2.contourArea)[:, 0], dtype=float) * cell_mm


def _shape(case: tuple[str, float, float, float], ring_mm: Floats, root_mm: float) -> Shape:
    """Return a bead by the mean of the quarters of its outline."""
    ring_mm = ring_mm - (ring_mm.max(axis=0) + ring_mm.min(axis=0)) / 2
    x, y = np.abs(ring_mm).T
    # Ends and sides are taken over a stretch, since single particles stand out.
    half_length, half_width = (float(np.median(one[other < 0.15 * other.max()])) for one, other in ((x, y), (y, x)))
    turn, away = np.arctan2(y / half_width, x / half_length), np.hypot(x / half_length, y / half_width)
    order = np.argsort(turn)
    quarter = np.linspace(0, np.pi / 2, ANGLES)
    reach = np.pi / 2 / ANGLES
    radii = [float(np.median(away[order][np.abs(turn[order] - angle) < reach])) for angle in quarter]
    return Shape(*case, half_length / root_mm, half_width / root_mm, tuple(radii))


def judged_range() -> tuple[float, float]:
    """Return the least and the largest stress of the judges of one length."""
    stresses = [shape.stress for shape in _judges()]
    return min(stresses), max(stresses)


def _judges() -> list[Shape]:
    """Return the judges of one length."""
    return sorted(shape for shape in recorded() if shape.kind == "judge" and shape.length == JUDGED_LENGTH)


def between(stress: float) -> Shape:
    """Return a bead of the judges' shape and length, of a stress between theirs."""
    rows = _judges()
    along = np.log([shape.stress for shape in rows])
    sizes = np.array([(shape.half_length, shape.half_width, *shape.radii) for shape in rows])
    half_length, half_width, *radii = (float(np.interp(np.log(stress), along, column)) for column in sizes.T)
    return Shape("judge", stress, JUDGED_LENGTH, rows[0].wide, half_length, half_width, tuple(radii))


def by_closed_form(shape: Shape) -> tuple[float, float, float, float]:
    """Return the stress and the section that the closed form says, without and with its correction, over the truth."""
    footprint, one = footprint_of(shape.seen()), np.ones(1)
    per_mm = footprint.per_mm(shape.length * one, one, 0 * one, STRETCH)
    section = footprint.volume_mm3(per_mm, one, 0 * one, STRETCH)[1]
    raw, corrected = float(per_mm[0]) / shape.stress, float(slumped_stress(per_mm, section)[0]) / shape.stress
    return raw, corrected, float(section[0]), float(laid_section(per_mm, section)[0])


def rows() -> list[Row]:
    """Return the figures by bead."""
    table = []
    for shape in sorted(recorded()):
        raw, corrected, section, laid = by_closed_form(shape)
        name = f"{shape.kind} {shape.stress:g}, length {shape.length:g}, bar {shape.wide:g}"
        off = (OFF, SECTION_OFF) if shape.kind == "judge" else (math.inf, math.inf)
        for figure, value, alone, most in zip(
            ("stress", "section"), (corrected, laid), (raw, section), off, strict=True
        ):
            table.append(Row(f"{name}: {figure}", value, "", max(0.0, 1 - most), 1 + most, "1"))
            table.append(Row(f"{name}: {figure}, closed form alone", alone, ""))
    return [*table, Row("beads that --record has yet to compute", len(WANTED) - len(recorded()), "")]


def main(compute: Annotated[bool, Option("--record")] = False) -> list[Row]:
    if compute:
        record()
        recorded.cache_clear()
    return rows()


if __name__ == "__main__":
    run_benchmark(main)
