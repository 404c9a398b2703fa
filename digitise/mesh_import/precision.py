"""Steps of a file's numbers in single precision, which grow with the distance from its origin."""

import numpy as np

from sealtwin.core.records import Floats

WORTH_SAYING_MM = 0.01  # Step from which on it is said: a tenth of a fine photo's pixel
MOST_OF_WIDTH = 0.25  # Largest step in widths of the crack: each wall is off by up to half of it


def step_of(vertices: Floats) -> float:
    """Return the step between neighbouring numbers at the farthest vertex; 0 if they have more digits than float32."""
    single = vertices.astype(np.float32)
    if not np.array_equal(single, vertices):
        return 0.0
    step = float(np.spacing(np.abs(single).max()))
    # Whole numbers below its largest are exact in either precision.
    return 0.0 if step < 1 and np.array_equal(np.rint(vertices), vertices) else step


def in_words(step_mm: float) -> str:
    """Return what a step means for a mesh, and what to do about it."""
    return (
        f"its numbers have steps of {step_mm:.2g} mm so far from its origin. Move the mesh to the origin in the "
        "program that made it, and save it again"
    )
