"""What lies beyond a sample that the photo cuts."""

import numpy as np
import pytest

from digitise.crack_path.darkness import surroundings
from digitise.crack_path.find_path import find_path
from tests.pictures import distance_to, evenly_scaled, mortar, wandering, with_crack, write_png


def picture(dark, rows=slice(220, 300), columns=slice(0, 500)):
    shown = np.full((300, 500), 0.6, dtype=np.float32)
    shown[rows, columns] = 0.6 * dark
    return shown


def test_black_cloth_is_beyond_the_sample():
    around = surroundings(picture(0.15))
    assert around[221:].all()
    assert not around[:215].any()


@pytest.mark.parametrize(
    "shown",
    [
        picture(0.5),
        picture(0.15, slice(100, 160), slice(100, 160)),
        picture(0.15, slice(290, 300), slice(0, 100)),
        # A wide crack was taken for the cloth around the sample: clicks in it were "outside the searched area".
        picture(0.15, slice(120, 170), slice(0, 500)),
        picture(0.15, slice(120, 170), slice(60, 500)),
    ],
    ids=["a hard shadow", "a hole inside", "a corner of a hole", "a crack right through", "a crack to one edge"],
)
def test_shadows_holes_and_cracks_that_leave_the_photo_are_part_of_it(shown):
    assert not surroundings(shown).any()


@pytest.mark.broad
def test_a_crack_that_runs_to_the_edge_does_not_turn_along_it(tmp_path):
    """Seen on a cropped photo of a sample over black cloth, whose edge is the longest dark line there."""
    crack = wandering([(60.0, 5.0), (150.0, 90.0), (210.0, 215.0)])
    scene = with_crack(mortar(), crack)
    x, y = np.meshgrid(np.arange(500), np.arange(300))
    scene = np.where(y > 218 + 0.01 * x, 0.004, scene)
    path = find_path(evenly_scaled(write_png(tmp_path / "photo.png", scene)), None)
    assert distance_to(path.points_px, np.array(crack)).max() < 14
    assert np.ptp(path.points_px[:, 1]) > 180
