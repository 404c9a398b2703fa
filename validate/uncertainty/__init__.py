"""Uncertainty of a comparison, which is due to the readings, the numerics and the inputs."""
