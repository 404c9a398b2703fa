"""Readings at the face of cracks with stones, a side crack and closed tips: they hold the whole cavity, no more."""

import json
from dataclasses import replace

import numpy as np

import sealtwin as st
from digitise.settings import CrackShape
from digitise.solid.build_solid import build_solid
from sealtwin.core.records import Floats, Outline
from tests.shapes import CUT, closed_crack, straight_slot, with_ring

DEPTH_MM = 12.0


def rectangle(x_mm: float, y_mm: float, length_mm: float, width_mm: float) -> Floats:
    """Corners of a rectangle around a point, clockwise."""
    half_mm = np.array([length_mm, width_mm]) / 2
    return np.array([x_mm, y_mm]) + half_mm * np.array([(-1, -1), (-1, 1), (1, 1), (1, -1)])


def held_share(outline: Outline, tilt: str, angle_deg: float) -> float:
    """Volume that brimful readings hold, over the cavity of the mesh."""
    shape = CrackShape.model_validate({"depth_mm": DEPTH_MM, "tilt": tilt, "wall_angle_deg": angle_deg})
    solid = build_solid(outline, shape)
    full = np.column_stack([np.linspace(0.0, outline.length_mm, 21), np.zeros(21)])
    readings = st.read_readings(full, data="synthetic", role="undeclared")
    return st.compare(readings, readings, outline, solid).measured_sealant_mm3 / solid.cavity_volume_mm3


slot = straight_slot(40.0, 6.0, CUT)
ring_mm = np.array([(0, -3), (40, -3), (40, 3), (22, 3), (22, 20), (18, 20), (18, 3), (0, 3)], dtype=float)
shares = {
    "stones": held_share(replace(slot, islands_mm=(rectangle(20.0, 0.0, 20.0, 3.0),)), "vertical", 0.0),
    "side crack": held_share(with_ring(slot, ring_mm), "vertical", 0.0),
    "closed tips": held_share(closed_crack(4, 30.0, 8.0), "flare", 25.0),
}
line = "brimful readings over the cavity: " + ", ".join(f"{name} {share:.3f}" for name, share in shares.items())
print(json.dumps({"line": line, "sound": all(abs(share - 1) < 0.005 for share in shares.values())}))
