"""Validation of a simulated level with caliper readings: comparison, verdict and report."""

PART_OF = "sealtwin"

STAGE_NUMBER = 6
"""Version number of this stage's results. It increases by one when the same input gives other numbers, in any bit. Runs
that were computed under another number are computed again. ``python -m tests.stage_record`` writes the record with
which a test compares."""
