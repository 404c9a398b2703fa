"""Simulation of the sealant: position-based fluid on Warp, from a crack solid and a trajectory to a settled surface."""

PART_OF = "sealtwin"
