"""Simulation of the sealant: position-based fluid on Warp, from a crack solid and a trajectory to a settled surface."""

PART_OF = "sealtwin"

STAGE_NUMBER = 1
"""Raised by one when the same input gives other numbers in the results of this stage.

Runs of another number are computed again. ``python -m tests.stage_record`` remakes the record that a test compares.
"""
