"""Simulation of the sealant: position-based fluid on Warp, from a crack solid and a trajectory to a settled surface."""

PART_OF = "sealtwin"

STAGE_NUMBER = 1
"""Raised by one whenever the same input gives another number in the results of this stage; what moves no bit leaves it.

Runs of another number are computed anew. ``python -m tests.stage_record`` remakes the record that a test holds it to.
"""
