"""Metrics of a comparison: distances between levels, volumes, and the verdict."""
