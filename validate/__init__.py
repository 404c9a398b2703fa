"""Validation: a simulated surface and caliper readings become a comparison, a verdict and a report."""

PART_OF = "sealtwin"

STAGE_NUMBER = 3
"""Raised by one whenever the same input gives another number in the results of this stage; what moves no bit leaves it.

Runs of another number are computed anew. ``python -m tests.stage_record`` remakes the record that a test holds it to.
"""
