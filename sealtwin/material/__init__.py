"""Measure a paste by a cone's spread, a bead, a rheometer or strips that slide, and write a file for trials."""
