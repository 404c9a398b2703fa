"""Lines with unlike sides rank last, faint ones are asked about, and a point in a dark border region is believed."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from digitise.crack_path.find_path import CrackSearch, RivalCracksError
from digitise.crack_path.line_likeness import LEAST_WORST, Likeness, grain_of, likeness
from digitise.crack_path.path_search import LiveWire
from sealtwin.core.errors import InputError
from tests.pictures import distance_to, evenly_scaled, mortar, with_crack, write_png

EDGE = [(30, 220), (130, 236), (240, 214), (350, 232), (470, 218)]
CRACK = [(40, 60), (95, 78), (150, 68), (205, 80), (260, 60), (310, 76), (360, 70), (410, 86), (460, 66)]


def with_patch(picture, lighter=1.9):
    """The same with a lighter patch below a dark edge."""
    below = np.zeros(picture.shape, dtype=np.uint8)
    cv2.fillPoly(below, [np.array([(0, 222), *EDGE, (500, 218), (500, 300), (0, 300)], dtype=np.int32)], [1])
    return with_crack(picture * np.where(below, lighter, 1.0), EDGE, 14)


def test_a_line_with_unlike_sides_ranks_after_a_crack_and_is_never_taken_alone(tmp_path):
    both = with_patch(with_crack(mortar(), CRACK, 5))
    first = CrackSearch.of(evenly_scaled(write_png(tmp_path / "both.png", both)))
    assert distance_to(first.cracks[0].line_px, np.array(CRACK, dtype=float)).max() < 12
    assert [likeness.two_sided for likeness in first.likenesses[:2]] == [True, False]
    assert first.cracks[0].score < first.cracks[1].score
    assert first.path().source == "automatic"
    with pytest.raises(InputError, match=r": 1\. [^;]* px, \d\d%; 2\. [^;]* px, 100% \(unlike sides\)"):
        first.path(9)
    alone = CrackSearch.of(evenly_scaled(write_png(tmp_path / "alone.png", with_patch(mortar()))))
    with pytest.raises(RivalCracksError, match="both sides"):
        alone.path()
    assert alone.path(1).source == "choice"


def test_a_line_as_straight_as_a_joint_ranks_after_a_crack_and_is_never_taken_alone(tmp_path):
    """The joint is as long as a third of the photo, dark, and ends within it: longer ones are left out."""
    rng = np.random.default_rng(3)
    x = np.arange(40, 470, 12.0)
    crack = [(float(a), float(b)) for a, b in zip(x, 60 + 6 * np.cumsum(rng.standard_normal(len(x))), strict=True)]
    joint = [(40, 225), (170, 232)]
    both = with_crack(with_crack(mortar(), crack, 3), joint, 12)
    first = CrackSearch.of(evenly_scaled(write_png(tmp_path / "both.png", both)))
    assert [likeness.may_be_joint for likeness in first.likenesses[:2]] == [False, True]
    assert distance_to(first.cracks[0].line_px, np.array(crack)).max() < 12
    with pytest.raises(InputError, match=r"2\. [^;]*% \(as straight as a joint\)"):
        first.path(9)
    alone = CrackSearch.of(evenly_scaled(write_png(tmp_path / "alone.png", with_crack(mortar(), joint, 12))))
    with pytest.raises(RivalCracksError, match="of the first is straight"):
        alone.path()
    assert alone.path(1).source == "choice"


def test_a_point_deep_in_a_dark_region_at_the_border_is_crack(tmp_path):
    """A wide black wedge that runs along the photo's border, taken for the board around the sample without clicks."""
    picture = mortar()
    cv2.fillPoly(picture, [np.array([(0, 60), (0, 240), (120, 170), (460, 150), (460, 140), (120, 120)])], [0.01])
    wire = LiveWire(evenly_scaled(write_png(tmp_path / "photo.png", picture)))
    assert wire.field.around.any()
    path = wire.path(((12.0, 150.0), (440.0, 146.0)))
    assert distance_to(path.points_px, np.array([(0.0, 150.0), (460.0, 146.0)])).max() < 40
    assert path.points_px[0, 0] < 40
    with pytest.raises(InputError):
        wire.path(((300.0, 30.0), (440.0, 146.0)))


def test_a_line_whose_part_is_as_faint_as_the_grain_is_asked_about(tmp_path):
    """The same line, black all along, is taken."""
    black = with_crack(mortar(), CRACK, 6)
    share = np.ones(500)
    share[200:270] = 0.05
    faint = mortar() * (1 - share) + black * share
    line_px, both = np.array(CRACK, dtype=float), list[Likeness]()
    for name, picture in (("black", black), ("faint", faint)):
        photo = evenly_scaled(write_png(tmp_path / f"{name}.png", picture))
        field = LiveWire(photo).field
        both.append(likeness(photo, line_px, 6.0, grain_of(field), field.to_work(line_px)))
    whole, parted = both
    assert whole.two_sided
    assert parted.two_sided
    assert parted.worst < LEAST_WORST < whole.worst
    search = CrackSearch.of(evenly_scaled(tmp_path / "black.png"))
    assert search.path().source == "automatic"
    with pytest.raises(RivalCracksError, match="times as dark as the ground's grain"):
        replace(search, likenesses=(parted,)).path()
    with pytest.raises(RivalCracksError, match="not darker than the ground"):
        replace(search, likenesses=(replace(parted, worst=-3.2),)).path()
