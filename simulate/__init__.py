"""Simulate the sealant: a position-based fluid on Warp, from a crack solid and a trajectory to a settled surface."""

PART_OF = "sealtwin"

STAGE_NUMBER = 2
"""Version number of this stage's results. It increases by one when the same input gives other numbers. Runs that were
computed under another number are computed again. ``python -m tests.stage_record`` renews the record with which a test
compares."""
