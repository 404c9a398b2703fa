"""Figure of a cavity by weight: the liquid below each level, and the mean width at each depth."""

import numpy as np
from matplotlib.figure import FigureBase

from sealtwin.core.solid_figures import WeighedCavity
from validate.figures import theme


@theme.themed()
def draw_weighed_fill(weighed: WeighedCavity, mouth_mm: float, floor_mm: float) -> FigureBase:
    """Draw the weighed volumes over their levels and the widths over depth, each with the fitted walls."""
    figure = theme.plate(4.6)
    upper, lower = figure.subplots(2, 1)
    levels_mm, volumes_ml = np.array(weighed.levels_mm), np.array(weighed.volumes_mm3) / 1e3
    fitted_ml = volumes_ml - np.array(weighed.misfits_mm3) / 1e3
    bars = {"color": theme.MEASURED, "markersize": 5, "markerfacecolor": "none", "capsize": 3}
    label = "weighed, ± 2 sd"
    errors_ml = 2 * np.array(weighed.misfit_sds_mm3) / 1e3
    upper.errorbar(levels_mm, volumes_ml, yerr=errors_ml, fmt="o", label=label, **bars)
    at_mm = np.append(-weighed.depth_mm, levels_mm)
    upper.plot(at_mm, np.append(0.0, fitted_ml), color=theme.SIMULATED, label="fitted walls")
    theme.label_axes(upper, "mean level from the face (mm)", "liquid (ml)", "Liquid below each level")
    theme.put_legend_under_title(upper, columns=2)
    if weighed.slabs_mm:
        depth_mm, width_mm, sd_mm = np.array(weighed.slabs_mm).T
        lower.errorbar(width_mm, -depth_mm, xerr=2 * sd_mm, fmt="o", label="between two steps, ± 2 sd", **bars)
    lower.plot([mouth_mm, floor_mm], [0.0, -weighed.depth_mm], color=theme.SIMULATED, label="fitted walls")
    lower.set_xlim(0, None)
    lower.set_ylim(-1.05 * weighed.depth_mm, 0)
    theme.label_axes(lower, "mean width (mm)", "depth (mm)", "Mean width at each depth")
    theme.put_legend_under_title(lower, columns=2)
    return figure
