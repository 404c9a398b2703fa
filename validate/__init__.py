"""Validation: a simulated surface and caliper readings become a comparison, a verdict and a report."""

PART_OF = "sealtwin"
