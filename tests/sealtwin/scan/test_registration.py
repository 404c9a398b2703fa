"""A scan is brought to the sample, or refused with a sentence that names the cause."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sealtwin.core.errors import InputError, present
from sealtwin.core.records import Floats
from sealtwin.scan.mouth_search import Target
from sealtwin.scan.registration import Placed, place
from sealtwin.scan.settings import NamedPoint, Placement
from tests.support.scan_beds import bed, bed_of, sloping_mm, target
from tests.support.shapes import CLOSED, CUT, straight_slot

MOVE = Rotation.from_euler("xyz", [4, -5, 6], degrees=True)
AWAY_MM = np.array([3.0, -2.0, 20.0])
CORNERS = np.array([(-8.0, -8.0), (48.0, -8.0), (35.0, 9.0), (-5.0, 8.0)])
TURNABLE = np.array([(20.0, 12.0), (9.6, -6.0), (30.4, -6.0)])  # Equilateral


def moved(points_mm: Floats) -> Floats:
    return MOVE.apply(points_mm) + AWAY_MM


def named(points_mm: Floats, scan_mm: Floats | None = None) -> Placement:
    """Name points of the sample, (n, 2), that have coordinates in the scan, (n, 3)."""
    seen_mm = moved(np.pad(points_mm, ((0, 0), (0, 1)))) if scan_mm is None else scan_mm
    pairs = enumerate(zip(seen_mm.tolist(), points_mm.tolist(), strict=True))
    names = (NamedPoint(name=f"P{number}", scan=(*scan,), sample_mm=(*sample,)) for number, (scan, sample) in pairs)
    return Placement(units="mm", points=tuple(names))


def placed(points_mm: Floats, placement: Placement) -> Placed:
    return place(points_mm, placement, target(), Path("scan.xyz"))


CORNERS_SEEN = moved(np.pad(CORNERS, ((0, 0), (0, 1))))
RECTANGLE = np.array([(-8.0, -8.0), (48.0, -8.0), (48.0, 9.0), (-8.0, 9.0)])
RECTANGLE_SEEN = moved(np.pad(RECTANGLE, ((0, 0), (0, 1))))
TURNABLE_SEEN = moved(np.pad(TURNABLE, ((0, 0), (0, 1))))
BY_POINTS = {
    "two exchanged": (named(CORNERS, CORNERS_SEEN[[1, 0, 2, 3]]), "P0 and P1 are exchanged"),
    "two of a rectangle": (named(RECTANGLE, RECTANGLE_SEEN[[1, 0, 2, 3]]), "points P0 and P1 are exchanged"),
    "two opposite ones": (named(RECTANGLE, RECTANGLE_SEEN[[2, 1, 0, 3]]), "P1 and P3 or P0 and P2 are exchanged"),
    "mirrored": (named(CORNERS, CORNERS_SEEN * [-1, 1, 1]), "mirrored"),
    "another unit": (named(CORNERS, CORNERS_SEEN / 10), "0.1 times.*placement.units"),
    "all the same": (named(CORNERS, CORNERS_SEEN[[0, 0, 0, 0]]), "0 times as far apart"),
    "one 5 mm off": (named(CORNERS, CORNERS_SEEN + 5 * np.eye(4, 3, 1)), r"mm \(RMS\) from their"),
    "on one line": (named(np.array([(0.0, 0.0), (20, 1), (40, 0)])), "almost on one line"),
    "off the face": (named(CORNERS, CORNERS_SEEN + MOVE.apply(CORNERS[:, :1] * [0, 0, 0.15])), "face is tilted"),
    "no face there": (named(CORNERS, CORNERS_SEEN + 40 * np.eye(3)[2]), "no face at the height"),
}


@pytest.mark.parametrize(("placement", "cause"), BY_POINTS.values(), ids=BY_POINTS)
def test_wrong_named_points_are_refused_with_their_cause(placement, cause):
    with pytest.raises(InputError, match=cause):
        placed(moved(bed()), placement)


@pytest.mark.parametrize(
    ("placement", "cause"),
    [
        (named(TURNABLE, TURNABLE_SEEN[[1, 2, 0]]), "turned by -?1[12]. degrees"),
        (named(CORNERS, CORNERS_SEEN + MOVE.apply([0.0, 3.0, 0.0])), "(2.9|3..) mm away"),
    ],
    ids=["exchanged in a circle", "shifted by 3 mm"],
)
def test_named_points_are_compared_with_the_mouth(placement, cause):
    """These points agree with each other, so only the crack shows that they are wrong."""
    with pytest.raises(InputError, match=f"the crack is .*{cause}"):
        placed(moved(bed()), placement)


def with_table(points_mm: Floats) -> Floats:
    """Add a table 30 mm below the face, with twice as many points as the face."""
    table_mm = np.random.default_rng(3).uniform((-80, -70, -30.02), (120, 70, -29.98), (2 * len(points_mm), 3))
    return np.vstack([points_mm, table_mm])


def beside_the_crack(away_mm: float) -> Floats:
    points_mm = bed(spacing_mm=0.3)
    near = np.abs(points_mm[:, 1] - np.interp(points_mm[:, 0], *target().centreline_mm.T)) < away_mm
    return points_mm[near & (points_mm[:, 0] > -2) & (points_mm[:, 0] < 42)]


BY_MOUTH = {
    "another unit": (lambda: bed() / 10, "another unit.*cm"),
    "a table": (lambda: with_table(bed()), "table"),
    "no crack": (lambda: bed(np.zeros_like), "not found.*level with the face"),
    "mirrored": (lambda: bed() * [1, -1, 1], "mirrored"),
    "turned by 90 degrees": (lambda: bed() @ np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]]), "turned by -?[89]. degrees"),
    "one end missing": (lambda: (lambda points: points[points[:, 0] < 22])(bed()), "several positions"),
    "another size": (lambda: bed() * 1.4, "1.[34]. times as large"),
    "on its side": (lambda: bed()[:, [0, 2, 1]], "placement.up"),
    "cropped to the mouth": (lambda: beside_the_crack(1.8), "only .* of the face.*do not crop it"),
    "cropped to 6 mm beside it": (lambda: beside_the_crack(6.0), "only 1.% of the face.*do not crop it"),
    "too steep": (lambda: Rotation.from_euler("x", 50, degrees=True).apply(bed()), "placement.up"),
}


@pytest.mark.parametrize(("scan", "cause"), BY_MOUTH.values(), ids=BY_MOUTH)
def test_a_scan_that_does_not_fit_is_refused_with_its_cause(scan, cause):
    with pytest.raises(InputError, match=f"(?s){cause}"):
        placed(scan(), Placement(units="mm"))


SLOT = straight_slot(40.0, 3.0, CLOSED)


def slot(length_mm: float = 40.0) -> Floats:
    return bed_of(straight_slot(length_mm, 3.0, CLOSED), lambda s_mm: np.full_like(s_mm, -2.0), 0.4)


def test_a_crack_that_looks_alike_from_both_ends_is_placed_as_its_axes_say():
    scan = place(slot() + np.array([2.0, -1.0, 0.0]), Placement(units="mm"), Target.of(SLOT), Path("scan.xyz"))
    assert scan.agreeing == 1.0
    assert np.nanmedian(scan.heights.at_mm(*SLOT.centreline_mm[3:-3].T)) == pytest.approx(-2.0, abs=0.05)


@pytest.mark.parametrize(
    ("scan", "ends"),
    [(np.vstack([slot(), slot() + np.array([0, 28, 0])]), CLOSED), (slot(70.0), CUT)],
    ids=["twice", "without ends"],
)
def test_a_crack_that_agrees_at_several_positions_is_refused(scan, ends):
    with pytest.raises(InputError, match="several positions"):
        place(scan, Placement(units="mm"), Target.of(replace(SLOT, ends=ends)), Path("scan.xyz"))


@pytest.mark.parametrize("from_mm", [5.0, -5.0])
def test_the_border_of_a_scan_is_no_end_of_a_crack(from_mm):
    whole = bed_of(straight_slot(180.0, 4.0, CLOSED), lambda s_mm: -2.0 - 0.03 * s_mm, 0.4) - [50, 0, 0]
    scan_mm = whole[(whole[:, 0] > from_mm) & (whole[:, 0] < from_mm + 80)]
    with pytest.raises(InputError, match="several positions"):
        place(scan_mm, Placement(units="mm"), Target.of(straight_slot(80.0, 4.0, CUT)), Path("scan.xyz"))


def test_points_too_far_apart_are_refused():
    x_mm, y_mm = np.mgrid[-20:100:9.5, -60:60:9.5].reshape(2, -1)
    scan_mm = np.column_stack([x_mm, y_mm, np.where((np.abs(y_mm) < 10) & (x_mm > 0) & (x_mm < 80), -1.0, 0.0)])
    with pytest.raises(InputError, match="not found"):
        place(scan_mm, Placement(units="mm"), Target.of(straight_slot(80.0, 20.0, CUT)), Path("scan.xyz"))


def test_ends_that_disagree_do_not_place_a_scan():
    with pytest.raises(InputError, match=r"1\.1[34] times as large"):
        place(slot(), Placement(units="mm"), Target.of(straight_slot(35.0, 3.0, CLOSED)), Path("scan.xyz"))


def test_named_points_that_are_all_shifted_show_it_as_an_uncertainty():
    shifted = placed(moved(bed()), named(CORNERS, CORNERS_SEEN + MOVE.apply([0.0, 1.0, 0.0])))
    assert shifted.across_sd_mm == pytest.approx(1.0, abs=0.15)
    with pytest.raises(InputError, match=r"(2\.9|3\..) mm away"):
        placed(moved(with_table(bed())), named(CORNERS, CORNERS_SEEN + MOVE.apply([0.0, 3.0, 0.0])))


def test_named_points_may_be_off_by_the_limit_of_the_scanner():
    points = named(CORNERS, CORNERS_SEEN + MOVE.apply(np.array([(3, 0, 0), (3, 0, 0), (-3, 0, 0), (-3, 0, 0)])))
    assert present(place(moved(bed()), points, target(), Path("a"), limit_mm=10.0).points_off_mm, "off") > 1.5


@pytest.mark.parametrize("with_plane", [bed, lambda: with_table(bed())], ids=["the face", "a table below it"])
def test_named_points_place_a_scan_to_their_accuracy(with_plane):
    scan = placed(moved(with_plane()), named(CORNERS))
    middle_mm = scan.heights.at_mm(*target().centreline_mm[5:-5].T)
    assert np.nanmean(middle_mm) == pytest.approx(sloping_mm(np.array(20.0)), abs=0.05)
