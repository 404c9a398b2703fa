"""Samples of outputs, and the nudge of their inputs."""

from collections.abc import Callable
from typing import Any

import numpy as np

from sealtwin.core.records import Floats

SAMPLES = 24

Nudge = Callable[[Any], Floats]
"""Function through which outputs take their inputs: it returns them as they are, or each moved by a rounding."""
Outputs = dict[str, Floats]


def sampled(values: Any) -> Floats:
    """Return a few values as they are; of many some, evenly spaced, and the mean and root mean square of all."""
    flat = np.asarray(values, dtype=float).ravel()
    if len(flat) <= SAMPLES:
        return flat
    some = flat[np.linspace(0, len(flat) - 1, SAMPLES).astype(int)]
    return np.array([*some, flat.mean(), np.sqrt(np.mean(flat**2))])
