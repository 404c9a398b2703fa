"""The surroundings of a sample in its photo."""

import numpy as np
import pytest

from digitise.crack_path.line_map import surroundings


def with_box(dark, rows=slice(220, 300), columns=slice(0, 500)):
    shown = np.full((300, 500), 0.6, dtype=np.float32)
    shown[rows, columns] *= dark
    return shown


@pytest.mark.parametrize(
    "shown",
    [
        with_box(0.5),
        with_box(0.15, slice(100, 160), slice(100, 160)),
        with_box(0.15, slice(290, 300), slice(0, 100)),
        # A wide crack was taken for the cloth around the sample: clicks in it were "outside the searched area".
        with_box(0.15, slice(120, 170), slice(0, 500)),
        with_box(0.15, slice(120, 170), slice(60, 500)),
    ],
    ids=["a hard shadow", "a hole inside", "a corner of a hole", "a crack right through", "a crack to one edge"],
)
def test_shadows_holes_and_cracks_are_not_taken_for_the_surroundings_of_the_sample(shown):
    assert not surroundings(shown).any()
