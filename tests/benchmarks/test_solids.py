"""The judge of solids and its cracks: every kind is what it says, a sound solid passes, and an unsound one does not."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.outlines import KINDS, odd_outline
from benchmarks.solids import (
    TILTS,
    Built,
    build,
    faults_of_the_cavity,
    faults_of_the_file,
    rows,
    shape_of,
    wall_errors,
)
from digitise.settings import CrackShape
from digitise.solid.build_solid import build_solid
from digitise.solid.footprint import lay_out
from digitise.solid.tilt_variants import Slicer
from digitise.solid.wedges import wall_shifts_mm
from tests.shapes import CLOSED, CUT, straight_slot


@pytest.mark.parametrize("tilt", TILTS)
@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_crack_becomes_a_sound_solid(kind, tilt):
    """A short one of each; the benchmark builds a hundred of all lengths. Its targets, but for the time."""
    built = build(odd_outline(kind, 2, length_mm=50.0, points=240), kind, 2, tilt)
    assert built.faults == ()
    assert built.volume_percent < 0.1
    assert built.wall_off_percent < 0.1
    assert built.angle_deg < 0.01
    assert built.shortest_mm > 1e-3


def test_outlines_are_what_their_kind_says():
    for seed in range(4):
        plain, pinched, touching, tapered, branched, stony = (odd_outline(kind, seed) for kind in KINDS)
        assert all(
            200 <= len(o.centreline_mm) * 2 <= 2000 for o in (plain, pinched, touching, tapered, branched, stony)
        )
        assert all(50 <= o.length_mm <= 400 for o in (plain, pinched, touching, tapered, branched, stony))
        assert plain.width_mm[len(plain.width_mm) // 4 : -len(plain.width_mm) // 4].min() > 0.5
        assert 0.001 < pinched.width_mm[5:-5].min() < 0.35
        assert touching.width_mm[5:-5].min() == pytest.approx(0.0, abs=1e-9)
        assert np.all(tapered.width_mm[[0, -1]] == 0)
        assert branched.branches_kept
        assert 1 <= len(branched.branches_mm) <= 3
        assert 1 <= len(stony.islands_mm) <= 4
        again = odd_outline("islands", seed)
        assert np.array_equal(again.outline_mm, stony.outline_mm)
        assert np.array_equal(again.islands_mm[0], stony.islands_mm[0])


def test_the_judge_sees_a_hole_a_moved_corner_and_a_missing_island():
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


@pytest.mark.parametrize("tilt", TILTS)
def test_the_judge_sees_a_wrong_angle(tilt):
    """11 degrees against 10.5: all of the wall is off. A lean that is put upright by the wrong shear stays askew."""
    outline = straight_slot(20.0, 8.0, CLOSED)
    shape = shape_of(0, tilt)
    steeper = CrackShape(depth_mm=16.0, tilt=tilt, wall_angle_deg=10.5)
    lean = lay_out(outline, shape, max(wall_shifts_mm(shape))).lean
    solid = build_solid(outline, shape)
    assert wall_errors(solid, lean, shape) == pytest.approx((0.0, 0.0), abs=1e-4)
    off_percent, mean_deg = wall_errors(solid, lean, steeper)
    assert off_percent > 60.0
    # Of a lean that is half a degree askew one wall looks up and the other down, and the two cancel.
    assert mean_deg == pytest.approx(0.5 if tilt != "lean" else 0.0, abs=0.01)


def test_a_refusal_is_no_success():
    """In the table a crack of which nothing was made counts as unsound, and has no other figures."""
    good = Built("plain", 0, "flare", (), 100, 1000, 0.01, 0.0, 0.0, 0.002, 0.1)
    table = {row.name: row for row in rows([good, Built("plain", 1, "flare", ("no crack",))])}
    assert (table["flare: sound, of 2"].value, table["flare: sound, of 2"].met) == (1, False)
    assert table["flare: volume off its sections', worst"].value == 0.01
