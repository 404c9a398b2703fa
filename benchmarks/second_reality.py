"""Closed forms, limits and orders of convergence of the second reality, which is no part of sealtwin.

    python -m benchmarks.second_reality

Nothing here is compared with sealtwin. The targets were committed before any figure was computed.
"""

TARGETS: dict[str, tuple[str, float, float]] = {
    "Bingham plates, mean speed at 0.3 of yield": ("ratio", 0.99, 1.01),
    "Bingham plates, mean speed at 0.6 of yield": ("ratio", 0.99, 1.01),
    "Herschel-Bulkley plates, n = 0.5, at 0.5 of yield": ("ratio", 0.99, 1.01),
    "flow 2 % below the yield gradient, over Newtonian": ("ratio", 0.0, 1e-3),
    "Newtonian duct, depth 0.25 of width, to the series": ("ratio", 0.99, 1.01),
    "Newtonian duct, depth 0.5 of width, to the series": ("ratio", 0.99, 1.01),
    "Newtonian duct, depth of the width, to the series": ("ratio", 0.99, 1.01),
    "Newtonian duct, depth twice the width, to the series": ("ratio", 0.99, 1.01),
    "yield gradient of a rectangle, to its Cheeger set": ("ratio", 0.98, 1.02),
    "yield gradient of a trapezoid, to its Cheeger set": ("ratio", 0.98, 1.02),
    "Bingham plates with slip, mean speed": ("ratio", 0.99, 1.01),
    "slip with 10,000 times the friction, to no slip": ("ratio", 0.99, 1.01),
    "order of the section's mesh, ratio of errors": ("ratio", 3.0, 5.0),
    "table between its nodes, worst error of a flow": ("ratio", 0.0, 0.03),
    "spreading front in a slot, height to Barenblatt": ("ratio", 0.98, 1.02),
    "spreading front in a slot, length to Barenblatt": ("ratio", 0.98, 1.02),
    "spreading sheet, height to Huppert": ("ratio", 0.97, 1.03),
    "bank between walls at rest, slope to 2 tau / w": ("ratio", 0.98, 1.02),
    "bank between walls and floor, RMS to its curve": ("mm", 0.0, 0.1),
    "slump with normal stresses, height to Dubash": ("ratio", 0.95, 1.05),
    "thin liquid on a tilted sample, slope to level": ("ratio", 0.99, 1.01),
    "meniscus, weight to the pull of both walls": ("ratio", 0.999, 1.001),
    "meniscus near 90 degrees, rise to the linear one": ("ratio", 0.99, 1.01),
    "volume, poured less in the crack and over the face": ("ratio", 0.0, 1e-12),
    "volume of a late pump, missing over flow x delay": ("ratio", 0.999, 1.001),
    "symmetric pour, left less right": ("mm", 0.0, 1e-9),
    "frozen at once, paste beyond the nozzle": ("mm3", 0.0, 1e-9),
    "rise of the yield stress over rate x rest": ("ratio", 0.95, 1.05),
    "cells 1 to 0.5 mm over 0.5 to 0.25 mm, change of level": ("ratio", 1.6, 6.0),
    "cells 0.5 to 0.25 mm, RMS change of level": ("mm", 0.0, 0.1),
    "steps halved, RMS change of level": ("mm", 0.0, 0.01),
    "yield strain halved, RMS change of level": ("mm", 0.0, 0.1),
    "one pour, median time": ("s", 0.0, 5.0),
}
"""Unit and bounds of each figure."""
