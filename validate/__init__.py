"""Validation: a simulated surface and caliper readings become a comparison, a verdict and a report."""

PART_OF = "sealtwin"

STAGE_NUMBER = 6
"""Number of this stage. Raise it by one if the same input gives other numbers in the stage's results, in any bit.

Runs with another number are computed anew. ``python -m tests.stage_record`` writes the record that a test compares with
the results.
"""
