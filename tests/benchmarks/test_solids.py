"""The benchmark of solids accepts a valid solid and detects faults."""

from dataclasses import replace

import numpy as np

from benchmarks.solids import (
    Built,
    faults_of_the_cavity,
    faults_of_the_file,
    rows,
    shape_of,
)
from digitise.solid.build_solid import build_solid
from digitise.solid.footprint import lay_out
from digitise.solid.sections import Slicer
from digitise.solid.wedges import wall_shifts_mm
from tests.support.shapes import CUT, straight_slot


def test_solid_checks_detect_a_hole_a_wrong_volume_and_a_missing_island():
    outline = straight_slot(20.0, 4.0, CUT)
    solid = build_solid(outline, shape_of(0, "flare"))
    assert faults_of_the_file(solid) == []
    assert any("open edges" in fault for fault in faults_of_the_file(replace(solid, faces=solid.faces[1:])))

    def cavity_faults(**changes) -> list[str]:
        shape = shape_of(0, "flare")
        footprint = lay_out(outline, shape, max(wall_shifts_mm(shape)))
        return faults_of_the_cavity(replace(solid, **changes), Slicer(footprint, shape))

    assert cavity_faults() == []
    assert "short of the block" in cavity_faults(cavity_volume_mm3=solid.cavity_volume_mm3 * 1.001)[0]
    turn = -2 * np.pi * np.arange(12) / 12
    stone = np.array([10.0, 0.0]) + np.column_stack([np.cos(turn), np.sin(turn)])
    standing = build_solid(replace(outline, islands_mm=(stone,)), shape_of(0, "funnel"))
    shape = shape_of(0, "funnel")
    without = Slicer(lay_out(outline, shape, max(wall_shifts_mm(shape))), shape)
    assert "Euler number is 0, not 2" in faults_of_the_cavity(standing, without)[0]


def test_a_refused_crack_is_counted_as_a_failure_in_the_table():
    """A crack without a solid is counted as unsound and has no other figures."""
    good = Built("plain", 0, "flare", (), 0.002)
    table = {row.name: row for row in rows([good, Built("plain", 1, "flare", ("no crack",))])}
    assert (table["flare: sound, of 2"].value, table["flare: sound, of 2"].met) == (1, False)
    assert table["flare: shortest edge"].value == 0.002
