"""Uncertainty of a comparison due to the readings, the numerics and the inputs."""
