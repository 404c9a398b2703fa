"""A stretch of a path that the ground beside it equals refuses the path, unless it is pointed at."""

import pytest

from digitise.crack_path.path_search import LiveWire
from sealtwin.core.errors import InputError
from tests.pictures import evenly_scaled, mortar, with_crack, write_png

LEFT, RIGHT = [(20, 60), (100, 76), (185, 92)], [(255, 85), (330, 97), (400, 110)]
ENDS = (22.0, 60.0), (398.0, 110.0)


def broken(folder, between) -> LiveWire:
    """A crack with a gap; ``between`` is drawn over it."""
    picture = with_crack(with_crack(mortar((420, 170), 3), LEFT, 3), RIGHT, 3)
    return LiveWire(evenly_scaled(write_png(folder / "photo.png", between(picture))))


def filled(picture):
    """A smooth filling without a grain to follow: the ground beside it is the darker way."""
    picture[68:114, 190:250] = 0.35
    return picture


def faint(picture):
    return 0.9 * picture + 0.1 * with_crack(picture, [(185, 92), (220, 86), (255, 85)], 3)


@pytest.mark.parametrize(("between", "refused"), [(filled, True), (faint, False)])
def test_a_gap_that_the_ground_beside_it_equals_is_refused_with_its_place(tmp_path, between, refused):
    wire = broken(tmp_path, between)
    if refused:
        with pytest.raises(InputError, match=r"plain ground: \d+ px from \(1[89]\d, .*via_px"):
            wire.path(ENDS)
    else:
        (doubt,) = wire.path(ENDS).warnings
        assert "shows no crack" in doubt
