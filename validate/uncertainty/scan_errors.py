"""Budget of a scan: the plane of the face, the position along it, and noise that neighbouring stations share."""

import numpy as np

from sealtwin.core.scan_figures import Scan
from validate.uncertainty.budget import Budget, Component, draws_for, normals, uniforms

SCANNER_MM = 0.05
"""Size in mm that the table of undeclared errors assumes: the stated accuracy of usual desktop scanners."""
LIMIT = "limit of error of the scanner"


def budget_of_scan(scan: Scan, limit_mm: float | None) -> Budget:
    """Return the budget of a scan. ``limit_mm`` is the limit of the scanner's error, or None if it is undeclared."""
    stations = len(scan.covariance_mm2)
    draws = draws_for(stations)
    values, vectors = np.linalg.eigh(scan.covariance_mm2)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    draws_mm = normals("scan", stations, draws) @ root.T
    component = Component("position and noise of the scan", "detected", draws_mm, shared=True)
    size_mm = SCANNER_MM if limit_mm is None else limit_mm
    limit_draws_mm = size_mm * np.ones(stations) * (2 * uniforms("limit", 1, draws) - 1)
    limit = Component(LIMIT, "declared", limit_draws_mm, shared=True, setting="readings.limit_mm")
    if limit_mm is None:
        return Budget(stations=stations, components=(component,), missing=(limit,))
    return Budget(stations=stations, components=(component, limit))
