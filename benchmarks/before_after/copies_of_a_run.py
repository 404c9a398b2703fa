"""Three runs of each particle size of which those of a size are copies: no uncertainty follows from their agreement."""

import json

import numpy as np

from sealtwin.core.errors import SealtwinError
from validate.uncertainty.computed import SizeRuns, Spread, numerical_errors

s_mm = np.linspace(0.0, 80.0, 17)
scatter_mm = 0.15 * np.random.default_rng(1).standard_normal((3, 3, 17))


def numerics(different: int) -> str:
    """Return scatter and interval of the mean level by three runs of a size, so many of them ``different``."""
    fine, own, coarse = (
        SizeRuns(radius_mm, np.array([scatter_mm[size, min(run, different - 1)] for run in range(3)]))
        for size, radius_mm in enumerate((0.5, 0.65, 0.85))
    )
    runs = Spread(s_mm, (fine, own, coarse), (), None, None).at(s_mm)
    assert runs is not None
    draws_mm = sum(one.draws_mm.mean(axis=1) for one in numerical_errors(runs, None))
    half_mm = np.quantile(np.abs(draws_mm), 0.95)
    return f"a run scatters by {runs.scatter.mean():.3f} mm, numerics of the mean level ± {half_mm:.2f} mm"


line = f"three different runs: {numerics(3)}"
try:
    answer = {"line": f"{line}; three copies: {numerics(1)}", "sound": False}
except SealtwinError as refused:
    answer = {"line": f"{line}; three copies: {refused}", "sound": "copies" in str(refused)}
print(json.dumps(answer))
