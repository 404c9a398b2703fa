"""Measures of a comparison: distances between levels, volumes, baselines and the verdict."""
