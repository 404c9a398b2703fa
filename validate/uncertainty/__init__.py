"""Uncertainty of a comparison: that of the readings, of the numerics and of the inputs."""
