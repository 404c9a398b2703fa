"""Measure a paste with a photo of a cone's spread or of a bead, or with a rheometer, and write a file for trials."""
