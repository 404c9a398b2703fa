import numpy as np
import pytest

from digitise.image.raster import sampled


@pytest.mark.parametrize("shape", [(3,), (40_000,), (20_000, 7), (5, 4, 3)])
def test_sampled_pixel_values_have_the_array_shape_of_their_positions(shape):
    """OpenCV samples at most 32,767 rows at once; the end of a crack 150 px wide has more and crashed."""
    picture = np.arange(100, dtype=np.float32)[None] + 1000 * np.arange(50, dtype=np.float32)[:, None]
    rng = np.random.default_rng(1)
    places = np.stack([rng.uniform(0, 99, shape), rng.uniform(0, 49, shape)], axis=-1)
    values = sampled(picture, places)
    assert values.shape == shape
    # OpenCV's table of weights has 32 steps a pixel.
    assert np.abs(values - (places[..., 0] + 1000 * places[..., 1])).max() <= 17
