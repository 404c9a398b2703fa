"""Simulate the sealant: a position-based fluid on Warp, from a crack solid and a trajectory to a settled surface."""

PART_OF = "sealtwin"

STAGE_NUMBER = 2
"""Version of this stage. Increase it by one whenever the same input gives other results. Runs that were computed under
another number are computed again. ``python -m tests.stage_record`` updates the record against which a test checks the
number."""
