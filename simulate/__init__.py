"""Simulation of the sealant: position-based fluid on Warp, from a crack solid and a trajectory to a settled surface."""

PART_OF = "sealtwin"

STAGE_NUMBER = 2
"""Increased by one when the same input gives other numbers in the results of this stage.

Runs that were computed under another number are computed again. ``python -m tests.stage_record`` remakes the record
with which a test compares."""
