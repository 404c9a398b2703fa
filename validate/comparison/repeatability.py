"""How well readings that were repeated agree among themselves."""

from typing import Any

import numpy as np

from sealtwin.records import Profile


def repeatability(measured: Profile) -> dict[str, Any]:
    """Scatter of repeated readings, pooled over the stations, and the 95 % band of their means."""
    from scipy.stats import t

    repeats_mm = measured.repeats_mm if measured.repeats_mm is not None else measured.level_mm[:, None]
    count = (~np.isnan(repeats_mm)).sum(axis=1)
    freedom = int((count - 1).sum())
    summary: dict[str, Any] = {"stations": len(count), "readings": int(count.sum()), "degrees_of_freedom": freedom}
    if freedom == 0:
        return summary | {"repeatability_sd_mm": None, "band_95_mm": None}
    residual_mm = repeats_mm - np.nanmean(repeats_mm, axis=1, keepdims=True)
    deviation_mm = float(np.sqrt(np.nansum(residual_mm**2) / freedom))
    band_mm = float(t.ppf(0.975, freedom)) * deviation_mm / np.sqrt(count)
    return summary | {"repeatability_sd_mm": deviation_mm, "band_95_mm": band_mm}
