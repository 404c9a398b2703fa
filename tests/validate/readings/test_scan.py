"""A scan of a bed whose level is known gives this level, names its holes, and refuses what is no sealed crack."""

import re
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from PIL import Image

from digitise.settings import CrackShape
from digitise.solid.build_solid import build_solid
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats, Profile
from sealtwin.scan.height_map import HeightMap
from sealtwin.scan.settings import NamedPoint, Placement
from tests.support.scan_beds import OUTLINE, bed, sloping_mm
from validate.readings.grid import SheetFaults
from validate.readings.scan import read_scan
from validate.settings import Readings

CORNERS_MM = ((-8.0, -8.0), (48.0, -8.0), (35.0, 9.0))
POINTS = tuple(NamedPoint(name=f"{x}", scan=(x, y, 0.0), sample_mm=(x, y)) for x, y in CORNERS_MM)


@pytest.fixture
def read(tmp_path):
    def read(
        points_mm: Floats,
        points: tuple[NamedPoint, ...] = POINTS,
        limit_mm: float | None = None,
        up: Literal["z", "-z"] = "z",
        as_written: tuple[str, ...] = ("sign",),
        **shape: Any,
    ) -> Profile:
        path = tmp_path / "scan.xyz"
        np.savetxt(path, points_mm, fmt="%.4f")
        placement = Placement(units="mm", points=points, up=up)
        settings = Readings(
            scan=path, data="synthetic", role="held-out", placement=placement, limit_mm=limit_mm, as_written=as_written
        )
        solid = build_solid(OUTLINE, CrackShape.model_validate({"depth_mm": 8.0, "tilt": "vertical", **shape}))
        return read_scan(Path(path), settings, OUTLINE, solid)

    return read


@pytest.mark.parametrize("points", [POINTS, ()], ids=["by named points", "by the mouth"])
def test_the_level_of_a_known_bed_is_read_along_the_crack(read, points):
    """Noise of 0.02 mm in cells of two points leaves 0.01 mm. Cells across the walls and the position add the rest."""
    profile = read(bed(spacing_mm=0.5 if points else 0.3), points)
    off_mm = profile.level_mm - sloping_mm(profile.s_mm)
    assert len(profile.s_mm) > 20
    assert np.sqrt(np.mean(off_mm**2)) < 0.06
    assert "below the face" in profile.dialect
    assert profile.scan.figures.under_face_mm3 == pytest.approx(1.6 * 40 * OUTLINE.mean_width_mm, rel=0.03)


def test_the_interval_of_the_volume_below_the_face_is_that_of_the_level_and_of_single_cells(read):
    """If the whole edge of the mouth were off by 0.4 of a cell at once, half of it would be 15 % of the volume."""
    figures = read(bed(spacing_mm=0.3)).scan.figures
    error_mm3 = figures.under_face_mm3 - 1.6 * 40 * OUTLINE.mean_width_mm
    assert abs(error_mm3) < figures.under_face_95_mm3 < 0.05 * figures.under_face_mm3
    assert figures.under_face_95_mm3 > figures.mean_level_95_mm * 38 * OUTLINE.mean_width_mm


def test_a_sound_bed_below_the_face_asks_nothing(read):
    assert read(bed(spacing_mm=0.3), (), as_written=()).questions == ()


@pytest.mark.parametrize("height_mm", [0.05, 0.83, 1.7])
def test_a_level_above_the_face_must_be_confirmed(read, height_mm):
    """A depth map shows a bed below the face like that: its heights grow away from the sensor."""
    points_mm = bed(lambda s_mm: np.full_like(s_mm, height_mm))
    with pytest.raises(SheetFaults) as asked:
        read(points_mm, as_written=("position",))
    (doubt,) = asked.value.doubts
    assert (doubt.kind, doubt.is_remark, doubt.answers) == ("sign", False, {"as_written": ["sign"]})
    assert re.search("negative readings.placement.count_mm.*camera's axes", str(doubt))
    assert read(points_mm, as_written=("position", "sign")).level_mm.mean() == pytest.approx(height_mm, abs=0.05)


@pytest.mark.parametrize("points", [POINTS, ()], ids=["by named points", "by the mouth"])
def test_the_axes_of_a_camera_are_declared_by_up(read, points):
    """Its axes are right-handed: x to the right, y down, z into the face."""
    camera = np.array([1, -1, -1])
    named = tuple(point.model_copy(update={"scan": tuple(point.scan * camera)}) for point in points)
    profile = read(bed(spacing_mm=0.3) * camera, named, up="-z", as_written=())
    assert profile.level_mm.mean() == pytest.approx(-1.6, abs=0.05)
    assert profile.questions == ()


def test_a_depth_map_is_read_with_a_negative_count(tmp_path):
    """The sensor is 300 mm above the face. A count is 0.01 mm."""
    points_mm = bed(spacing_mm=0.3, noise_mm=0.0)
    low_mm, high_mm = points_mm.min(axis=0)[:2], points_mm.max(axis=0)[:2]
    heights = HeightMap.of(points_mm, low_mm, high_mm, 0.4).filled()
    path = tmp_path / "depth.png"
    Image.fromarray(np.rint(30_000 - 100 * heights[::-1]).astype(np.uint16)).save(path)
    placement = Placement(step_mm=0.4, count_mm=-0.01)
    settings = Readings(scan=path, data="synthetic", role="held-out", placement=placement)
    solid = build_solid(OUTLINE, CrackShape(depth_mm=8.0, tilt="vertical"))
    profile = read_scan(path, settings, OUTLINE, solid)
    assert profile.level_mm.mean() == pytest.approx(-1.6, abs=0.05)


def test_a_stretch_that_is_not_seen_is_a_hole(read):
    points_mm = bed()
    profile = read(points_mm[np.abs(points_mm[:, 0] - 20) > 4])
    assert profile.scan is not None
    hole = max(profile.scan.figures.holes_mm, key=np.ptp)
    assert hole == pytest.approx((16, 24), abs=2.5)  # Stations are 1.4 mm long
    assert "holes from" in profile.dialect
    assert not ((profile.s_mm > hole[0]) & (profile.s_mm < hole[1])).any()


def test_a_lump_on_the_bed_is_left_out(read):
    points_mm = bed(spacing_mm=0.25)
    points_mm[np.hypot(*(points_mm[:, :2] - OUTLINE.centreline_mm[len(OUTLINE.s_mm) // 30]).T) < 1.7, 2] += 1.5
    profile = read(points_mm)
    assert np.abs(profile.level_mm - sloping_mm(profile.s_mm)).max() < 0.15


def test_many_lumps_are_a_doubt(read):
    """A lump, and the bed between two, is a patch of less than 12 mm²."""
    points_mm = bed(spacing_mm=0.25)
    points_mm[(np.abs(points_mm[:, 1]) < 4) & (points_mm[:, 0] % 6 < 2), 2] += 0.8
    (doubt,) = read(points_mm).questions
    assert doubt.kind == "holes"
    assert re.search("only 2.% of the crack have a level", str(doubt))
    assert read(points_mm, as_written=("holes",)).questions == ()


def test_walls_above_the_sealant_do_not_count(read):
    """Walls of a flare lean inwards from the mouth: its sealant, 3 mm deep, is narrower than the mouth by 2 mm."""
    points_mm = bed(lambda s_mm: np.full_like(s_mm, -3.0))
    y_mm = [np.interp(points_mm[:, 0], *wall.T) for wall in (OUTLINE.left_wall_mm, OUTLINE.right_wall_mm)]
    inside_mm = np.minimum(y_mm[0] - points_mm[:, 1], points_mm[:, 1] - y_mm[1])
    wall_mm = -inside_mm / np.tan(np.radians(18.0))
    points_mm[:, 2] = np.where(points_mm[:, 2] < -1, np.maximum(wall_mm, points_mm[:, 2]), points_mm[:, 2])
    profile = read(points_mm, tilt="funnel", wall_angle_deg=18.0, depth_mm=4.0)
    assert profile.level_mm.mean() == pytest.approx(-3.0, abs=0.1)  # With the walls 0.5 mm higher


@pytest.mark.parametrize(
    ("points_mm", "cause"),
    [
        (bed(lambda s_mm: np.full_like(s_mm, -16.0)), "below its floor.*unit of the heights"),
        (bed()[bed()[:, 2] > -0.5], "0 stations"),
    ],
    ids=["deeper than the crack", "no sealant seen"],
)
def test_a_scan_without_sealant_in_the_crack_is_refused(read, points_mm, cause):
    with pytest.raises(InputError, match=cause):
        read(points_mm)


def test_sealant_above_the_face_is_called_so(read):
    assert re.search(r"sealant 1\.6\d mm above the face", read(bed() * [1, 1, -1]).dialect)


def heap(spill_mm: float = 3.0) -> Floats:
    """Return a scan of sealant 1 mm above the face, which spills to both sides."""
    points_mm = bed(np.zeros_like, spacing_mm=0.3)
    walls_mm = (np.interp(points_mm[:, 0], *wall.T) for wall in (OUTLINE.left_wall_mm, OUTLINE.right_wall_mm))
    left_mm, right_mm = (points_mm[:, 1] - wall_mm for wall_mm in walls_mm)
    beside_mm = np.maximum(0.0, np.maximum(left_mm, -right_mm))
    points_mm[:, 2] += np.maximum(1 - (beside_mm / spill_mm) ** 2, 0.0)
    points_mm[np.abs(points_mm[:, 0] - 20) > 20, 2] = 0.0
    return points_mm


def test_hollows_beside_a_spill_and_sealant_beyond_a_cut_end_do_not_count(read):
    points_mm = heap()
    alone = read(points_mm).scan.figures
    assert alone.over_face_mm3 == pytest.approx(40 * (OUTLINE.mean_width_mm + 2 * 2.0), rel=0.04)
    beyond = np.abs(points_mm[:, 0] - 20) > 20
    points_mm[beyond & (np.abs(points_mm[:, 1]) < 4), 2] = 1.0
    points_mm[(points_mm[:, 1] > 6) & (points_mm[:, 1] < 8), 2] = -4.0
    assert read(points_mm).scan.figures.over_face_mm3 == pytest.approx(alone.over_face_mm3, rel=0.06)


def test_the_volume_of_the_sealant_is_that_in_the_cavity_and_above(read):
    figures = read(heap()).scan.figures
    cavity_mm3 = 8.0 * 40 * OUTLINE.mean_width_mm
    assert figures.sealant_mm3 == pytest.approx(cavity_mm3 + figures.over_face_mm3, rel=0.01)
    assert figures.over_face_95_mm3 <= figures.sealant_95_mm3 < 0.2 * figures.sealant_mm3
    assert read(heap(), limit_mm=0.2).scan.figures.mean_level_95_mm == pytest.approx(2 * 0.2 / 3**0.5, abs=0.02)


def test_a_bed_level_with_the_face_is_read_at_named_points_with_a_doubt(read):
    profile = read(bed(np.zeros_like))
    assert profile.scan.figures.edges_agreeing is None
    assert [doubt.kind for doubt in profile.questions] == ["position"]


def band(points_mm: Floats, width_mm: float) -> Floats:
    """Add 1 mm to the face up to a distance from the crack."""
    away_mm = np.abs(points_mm[:, 1] - np.interp(points_mm[:, 0], *OUTLINE.centreline_mm.T))
    points_mm[:, 2] += (away_mm > OUTLINE.mean_width_mm / 2 + 0.3) & (away_mm < width_mm)
    return points_mm


PEBBLES_MM = np.random.default_rng(0).uniform((8, -14, 0.5), (28, -0.5, 0.51), (9000, 3))


@pytest.mark.parametrize(
    ("points_mm", "words"),
    [
        (bed() + np.outer(bed()[:, 1] > 1.5, [0, 0, 0.8]), "in one plane"),
        (bed() + np.array([0, 0, 0.4]), "0.40 mm above the named points"),
        (np.vstack([heap(), PEBBLES_MM]), "reaches 12"),
    ],
    ids=["stepped face", "covered face", "pebbles"],
)
def test_a_face_that_gives_no_certain_height_is_a_doubt(read, points_mm, words):
    assert re.search(words, " ".join(read(points_mm).doubts))


def test_an_overband_that_covers_most_of_the_face_is_a_doubt(read):
    assert {doubt.kind for doubt in read(band(heap(0.1), 8.5)).questions} >= {"face", "position"}


def test_sealant_beside_a_sunk_bed_counts(read):
    figures = read(band(bed(lambda s_mm: np.full_like(s_mm, -0.5), 0.3), 5.0)).scan.figures
    assert figures.over_face_mm3 > 200  # 2 bands of 40 by 3.2 mm


def test_points_far_from_the_sample_do_not_take_part(read):
    points_mm = bed(spacing_mm=0.3)
    far_mm = np.random.default_rng(0).uniform(-3000, 3000, (len(points_mm) // 300, 3))
    assert read(np.vstack([points_mm, far_mm]), ()).level_mm.mean() == pytest.approx(-1.6, abs=0.05)
