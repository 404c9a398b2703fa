"""Calibration: the settings of trials by their readings, as a posterior."""
