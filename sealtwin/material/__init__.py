"""Measure a paste by a cone's spread, a bead or a rheometer, and write a file for trials."""
