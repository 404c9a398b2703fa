"""The fast model where stones, a dam or a neck narrow or divide a crack, and where nothing that matters does."""

import json
from dataclasses import replace

import numpy as np

from digitise.settings import CrackShape
from digitise.solid.build_solid import build_solid
from sealtwin.core.records import Floats
from simulate.slot.fitness import fitness_of
from simulate.slot.flux import HerschelBulkley
from tests.fluids import path
from tests.shapes import CUT, straight_slot

PASTE = HerschelBulkley(1690.0, 5.0, 0.3)


def stone(length_mm: float, width_mm: float) -> Floats:
    """A ring in the middle of the slot, clockwise: round if it is as long as wide, else a bar."""
    turn = -np.linspace(0.0, 2 * np.pi, 49)[:-1] if length_mm == width_mm else -np.pi * (np.arange(4) / 2 + 0.25)
    ring = np.column_stack([np.cos(turn), np.sin(turn)])
    return [20.0, 0.0] + ring / np.ptp(ring, axis=0) * [length_mm, width_mm]


def judged(depth_mm: object = 12.0, *stones: Floats) -> bool:
    """Return whether the model is said to be unfit for a slot 6 mm wide."""
    outline = replace(straight_slot(40.0, 6.0, CUT), islands_mm=stones)
    shape = CrackShape.model_validate({"depth_mm": depth_mm, "tilt": "vertical", "wall_angle_deg": 0.0})
    solid = build_solid(outline, shape)
    return bool(fitness_of(solid, outline, path(outline, 0.5e-3 * solid.cavity_volume_mm3), PASTE).unfit)


dam = ((0.0, 12.0), (19.8, 12.0), (19.9, 1.0), (20.1, 1.0), (20.2, 12.0), (40.0, 12.0))
cases = {
    "stone of 5.97 mm": (judged(12.0, stone(5.97, 5.97)), True),
    "stone along all of it": (judged(12.0, stone(39.4, 0.5)), True),
    "dam up to 1 mm": (judged(dam), True),
    "stone of 0.6 mm": (judged(12.0, stone(0.6, 0.6)), False),
    "plain": (judged(), False),
}
line = ", ".join(f"{name} {'unfit' if unfit else 'fit'}" for name, (unfit, _) in cases.items())
print(json.dumps({"line": line, "sound": all(unfit is right for unfit, right in cases.values())}))
