"""The measurement of a level, tested on lattices of particles with a known surface."""

from dataclasses import replace

import numpy as np
import pytest

from digitise.settings import CrackShape
from digitise.solid.build_solid import build_solid
from sealtwin.core.arc_length import arc_length_at
from sealtwin.core.errors import NumericalError
from sealtwin.core.records import Floats, Outline, Profile, Run, Solid
from sealtwin.core.run_figures import RunHealth
from sealtwin.core.solid_figures import SolidFigures
from simulate.profile import half_side_mm, measure_profile, volume_ratio
from tests.support.shapes import CUT, arc_slot, level_floor, outline_between

LENGTH_MM, WIDTH_MM, DEPTH_MM = 40.0, 3.1, 10.0
BIAS_MM = 0.1
LEVELS = {
    "flat": lambda s: np.full_like(s, -5.3),
    "gentle": lambda s: -6 + 0.1 * s,
    "steep": lambda s: -9 + 0.6 * np.minimum(s, 15) + 0.03 * np.maximum(s - 15, 0),
    "falling": lambda s: 1 - 0.2 * s,
}


def straight(turn_deg: float = 0.0) -> Outline:
    return outline_along(np.column_stack([np.linspace(0, LENGTH_MM, 81), np.zeros(81)]) @ turned(turn_deg).T)


def bow(radius_mm: float = 30.0) -> Outline:
    return arc_slot(radius_mm, float(np.degrees(LENGTH_MM / radius_mm)), WIDTH_MM)


def turned(degrees: float) -> Floats:
    angle = np.radians(degrees)
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def outline_along(centreline: Floats) -> Outline:
    along = np.gradient(centreline, axis=0)
    aside = np.column_stack([-along[:, 1], along[:, 0]]) / np.linalg.norm(along, axis=1)[:, None] * WIDTH_MM / 2
    return outline_between(centreline, centreline + aside, centreline - aside, CUT, None)


def slot(turn_deg: float = 0.0, angle_deg: float = 0.0, tilt: str = "vertical") -> Solid:
    """A block less a slot with walls across its ends."""
    shape = {"depth_mm": DEPTH_MM, "tilt": tilt, "wall_angle_deg": angle_deg}
    return build_solid(straight(turn_deg), CrackShape.model_validate(shape))


def mouth_without_face() -> Solid:
    """A solid of which only the depth is asked: no facet of a face hides any particle."""
    none, box, sections = np.empty((0, 3)), (0.0, 0.0, 0.0, 0.0), level_floor(DEPTH_MM)
    return Solid(
        none, none.astype(int), np.empty(0, int), box, DEPTH_MM, "vertical", (0.0, 0.0), 1.0, sections, SolidFigures()
    )


def run_of(position, radius_mm=0.4, velocity=None, spilled=None, volume_mm3=None) -> Run:
    position = np.asarray(position, dtype=float)
    count = len(position)
    return Run(
        position_mm=position,
        velocity_mm_s=0 * position if velocity is None else velocity,
        age_s=np.ones(count),
        spilled=np.zeros(count, bool) if spilled is None else spilled,
        radius_mm=radius_mm,
        particle_volume_mm3=volume_mm3 or 4 * np.sqrt(2) * (0.97 * radius_mm) ** 3,
        escaped_particles=0,
        device="cpu",
        settings={},
        health=RunHealth(),
    )


def read(position, solid: Solid | None = None, outline: Outline | None = None, **run) -> Profile:
    """The profile of particles in the straight slot, if nothing else is given."""
    return measure_profile(run_of(position, **run), outline or straight(), solid or mouth_without_face())


def lattice(outline: Outline, level_of_s, spacing_mm: float, seed: int = 0):
    """Points of a cubic lattice, its axes the frame's and its phase random, in the crack and below the level.

    A point stands for its cell: cells whose middles are below the level make a volume that has that level on average.
    """
    random = np.random.default_rng(seed)
    ring = outline.outline_mm
    low = [*ring.min(axis=0), -DEPTH_MM + spacing_mm / 2]
    high = [*ring.max(axis=0), 3.0]
    phase = [*random.uniform(0, spacing_mm, 2), 0.0]
    axes = [np.arange(a + p, b, spacing_mm) for a, b, p in zip(low, high, phase, strict=True)]
    point = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    s_mm = arc_length_at(point[:, :2], outline.centreline_mm)
    foot = np.column_stack([np.interp(s_mm, outline.s_mm, outline.centreline_mm[:, k]) for k in (0, 1)])
    inside = np.linalg.norm(point[:, :2] - foot, axis=1) <= WIDTH_MM / 2
    return point[inside & (point[:, 2] <= level_of_s(s_mm))]


def bias_mm(profile, level_of_s, trim_mm=2.0):
    inner = (profile.s_mm > trim_mm) & (profile.s_mm < profile.s_mm[-1] - trim_mm)
    return float(np.mean((profile.level_mm - level_of_s(profile.s_mm))[inner]))


@pytest.mark.parametrize(
    ("outline", "radius_mm", "level"),
    [(straight(), 0.4, "flat"), (straight(30), 0.5, "gentle"), (bow(), 0.4, "steep"), (bow(), 0.5, "falling")],
    ids=["straight", "oblique", "bow", "bow over the face"],
)
def test_the_profile_of_a_particle_lattice_has_the_level_of_the_lattice(outline, radius_mm, level):
    """The largest error is 0.04 mm; by the upper edges of the pixels, levels would be 0.20 to 0.26 mm too high."""
    spacing_mm = (4 * np.sqrt(2)) ** (1 / 3) * 0.97 * radius_mm
    point = lattice(outline, LEVELS[level], spacing_mm, seed=int(100 * radius_mm))
    cut_mm = 0.0
    if level == "flat":
        # The top layer is up to half a cell off the given level; expected is the level of the whole cells.
        cut_mm = np.arange(-DEPTH_MM + spacing_mm / 2, -5.3, spacing_mm)[-1] + spacing_mm / 2 + 5.3
    assert abs(bias_mm(read(point, outline=outline, radius_mm=radius_mm), LEVELS[level]) - cut_mm) <= BIAS_MM


def test_an_empty_stretch_lowers_the_level_to_the_floor_but_packing_gaps_do_not():
    point = lattice(straight(), LEVELS["flat"], 0.69)
    s_mm = point[:, 0]
    hole = (s_mm > 10) & (s_mm < 15)
    chink = (s_mm > 25) & (s_mm < 25.8)
    bubble = (np.abs(s_mm - 30) < 1) & (np.abs(point[:, 2] + 8) < 0.6)
    profile = read(point[~hole & ~chink & ~bubble])
    assert (profile.level_mm[(profile.s_mm > 11) & (profile.s_mm < 14)] == -DEPTH_MM).all()
    assert np.ptp(profile.level_mm[(profile.s_mm < 9) | (profile.s_mm > 16)]) < 1e-9
    assert read(np.empty((0, 3))).level_mm.max() == -DEPTH_MM


def test_jets_and_spilled_drops_are_not_part_of_the_level():
    """The part of the jet within a radius of the bed counts as bed, and so do fast particles of the bed.

    If the jet is counted on purpose, the profile has a spike of 8 mm at s = 20.
    """
    bed = lattice(straight(), LEVELS["flat"], 0.69)
    jet = np.array([[20 + dx, dy, z] for z in np.arange(-5, 3, 0.5) for dx in (-0.8, 0, 0.8) for dy in (-0.8, 0, 0.8)])
    point = np.vstack([bed, jet, [[30.0, 0.0, -1.0]], [[10.0, 30.0, -9.0]]])
    velocity = np.zeros_like(point)
    velocity[len(bed) : len(bed) + len(jet), 2] = -120.0
    calm, profile = read(bed), read(point, velocity=velocity, spilled=np.arange(len(point)) == len(point) - 1)
    off_mm = np.abs(profile.level_mm - calm.level_mm)
    assert off_mm.max() <= 0.4 + 1e-9
    assert off_mm[np.abs(profile.s_mm - 20) > 2].max() == 0.0
    agitated = read(bed, velocity=np.outer(np.arange(len(bed)) % 2, [0, 0, -150.0]))
    assert np.array_equal(agitated.level_mm, calm.level_mm)


def test_sealant_on_the_face_beside_the_mouth_does_not_raise_the_level():
    bed = lattice(straight(), lambda s: np.full_like(s, -0.6), 0.69)
    film = np.array([[x, y, 0.35] for x in np.arange(5, 35, 0.7) for y in (-4.0, -3.2, -2.4, 2.4, 3.2, 4.0)])
    heap = np.array([[x, 0.0, 0.4] for x in np.arange(20, 30, 0.7)])
    assert np.array_equal(read(np.vstack([bed, film]), slot()).level_mm, read(bed, slot()).level_mm)
    above = read(np.vstack([bed, film, heap]), slot())
    top_mm = 0.4 + half_side_mm(0.4, run_of(heap).particle_volume_mm3)
    assert above.level_mm[np.abs(above.s_mm - 25) < 4] == pytest.approx(top_mm)


def test_the_profile_is_reversed_with_the_direction_of_the_centreline():
    """The same particles are measured with the centreline from either end."""
    point, forward = lattice(bow(), LEVELS["gentle"], 0.69), bow()
    onward_mm, back_mm = (
        read(point, outline=outline).level_mm for outline in (forward, outline_along(forward.centreline_mm[::-1]))
    )
    assert onward_mm[-10] > onward_mm[10] + 3
    assert np.abs(onward_mm - back_mm[::-1]).mean() < 0.05


def test_arc_length_is_that_of_the_nearest_point_on_the_extended_line():
    corner = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0]])
    point = np.array([[4.0, 1.0], [11.0, 5.0], [-2.0, 1.0], [9.0, 13.0], [9.0, 2.0]])
    assert arc_length_at(point, corner) == pytest.approx([4.0, 15.0, -2.0, 23.0, 12.0])
    hook = np.array([[x, 0.0] for x in range(40)] + [[39.0, 60.0], *([float(x), 60.0] for x in range(39, -80, -1))])
    assert arc_length_at(np.array([[-70.0, 25.0]]), hook) == pytest.approx([-70.0])


def test_a_particle_at_a_nan_position_stops_the_measurement_of_the_level():
    with pytest.raises(NumericalError, match="Particle 1"):
        read([[1, 0, -5], [2, np.nan, -5]])


@pytest.mark.parametrize(
    ("reading", "turn_deg"), [("vertical", 0), ("vertical", 30), ("lean", 90), ("flare", 131), ("undercut", 0)]
)
def test_the_volume_ratio_of_a_filled_slot_is_1(reading, turn_deg):
    """It is filled to 6 mm above its floor: 18.6 mm² if vertical or leaning, 23.7 mm² with 8 degrees of flare.

    An undercut with this mouth has 30.4 mm². Broken on purpose without the turn of the cells, the ratio of the slot
    along x is 3 % off.
    """
    point = cavity_lattice(0.5, reading, 8.0, top_mm=-4.0)
    point[:, :2] = point[:, :2] @ turned(turn_deg).T
    beside_mm2 = {"flare": 36.0, "undercut": 2 * (6 * DEPTH_MM - 18.0)}.get(reading, 0.0) * np.tan(np.radians(8.0))
    section_mm2 = 6 * WIDTH_MM + beside_mm2
    run = run_of(point, volume_mm3=section_mm2 * LENGTH_MM / len(point))
    assert volume_ratio(run, slot(turn_deg, 8.0, reading)) == pytest.approx(1.0, abs=0.02)


def test_the_volume_ratio_includes_heaps_above_the_face_but_no_spill():
    full = cavity_lattice(0.5, "vertical", 0.0, top_mm=0.0)
    heap = [(x, y, z) for x in np.arange(5, 35, 0.5) for y in np.arange(-5, 5.1, 0.5) for z in (0.25, 0.75, 1.25)]
    both = run_of(np.vstack([full, heap]), volume_mm3=0.5**3)
    assert volume_ratio(both, slot()) == pytest.approx(1.0, abs=0.03)
    lost = replace(both, spilled=np.arange(len(both.spilled)) >= len(full))
    assert volume_ratio(lost, slot()) == pytest.approx(len(full) / len(both.spilled), abs=0.02)
    assert volume_ratio(run_of(np.empty((0, 3))), slot()) == 0.0


def cavity_lattice(spacing_mm, reading, tilt_deg, top_mm):
    """Lattice points of the cavity that ``slot`` makes, below a level, along x."""
    slope = np.tan(np.radians(tilt_deg)) if reading != "vertical" else 0.0
    axes = [np.arange(a + spacing_mm * p, b, spacing_mm) for a, b, p in ((0, LENGTH_MM, 0.5), (-5, 5, 0.37))]
    height = np.arange(-DEPTH_MM + spacing_mm / 2, top_mm, spacing_mm)
    x, y, z = (c.ravel() for c in np.meshgrid(*axes, height, indexing="ij"))
    # Walls that flare have the traced width at the floor, others at the mouth.
    rise = (-z if reading in ("undercut", "lean") else z + DEPTH_MM) * slope
    left = WIDTH_MM / 2 + rise
    right = -WIDTH_MM / 2 - (-rise if reading == "lean" else rise)
    return np.column_stack([x, y, z])[(y < left) & (y > right)]
