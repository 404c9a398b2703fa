"""Calibrate settings of trials on their readings. The result is a posterior distribution of the settings."""
