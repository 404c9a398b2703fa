"""Validation of a simulated level with caliper readings: comparison, verdict and report."""

PART_OF = "sealtwin"

STAGE_NUMBER = 7
"""Version number of this stage's results. It is raised by one whenever the same input gives other results, even in a
single bit. Runs that were computed with another number are computed again. A test compares the results with the record
that ``python -m tests.stage_record`` writes."""
