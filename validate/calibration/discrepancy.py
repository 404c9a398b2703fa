"""Smooth errors of readings and model together, which no setting stands for: their sizes are stated, not estimated.

One profile cannot tell such an error from a setting that makes the same shape. Without an allowance for it the setting
takes the error up, and its narrow interval lies beside the truth (Kennedy and O'Hagan 2001, J. R. Stat. Soc. B 63:425;
Brynjarsdottir and O'Hagan 2014, Inverse Probl. 30:114007).
"""

import numpy as np

from sealtwin.core.records import Floats

COMMON_MM = 0.3  # The datum, the mean width, shrinkage, and volume that does not arrive: all stations alike
TILT_MM = 0.2  # At either end of the readings: a sheet or a datum that is tilted
SMOOTH_MM, SMOOTH_LENGTH_MM = 0.3, 15.0  # Walls that change along the crack, and what the model leaves out
ENDS_MM, ENDS_LENGTH_MM = 0.4, 5.0  # At each end of the path, and how fast it falls: a late pump, a mound, creep

SMOOTH_ERRORS_MM = {"common": COMMON_MM, "tilt": TILT_MM, "smooth": SMOOTH_MM, "ends": ENDS_MM}


def smooth_errors_mm2(s_mm: Floats, path_mm: tuple[float, float]) -> Floats:
    """Return the covariance of these errors at stations, (n, n). ``path_mm`` has the ends of the nozzle's path."""
    middle_mm, half_mm = (s_mm.max() + s_mm.min()) / 2, max(float(np.ptp(s_mm)) / 2, 1e-9)
    tilt = TILT_MM * (s_mm - middle_mm) / half_mm
    apart = (s_mm[:, None] - s_mm) / SMOOTH_LENGTH_MM
    near, far = path_mm
    total = COMMON_MM**2 + np.outer(tilt, tilt) + SMOOTH_MM**2 * np.exp(-(apart**2) / 2)
    for inward_mm in (s_mm - near, far - s_mm):
        end = ENDS_MM * np.exp(-np.maximum(inward_mm, 0.0) / ENDS_LENGTH_MM)
        total = total + np.outer(end, end)
    return total
