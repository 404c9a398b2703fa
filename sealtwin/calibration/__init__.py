"""Calibration: runs of trials with readings, chosen one after the other, to a posterior of free settings."""
