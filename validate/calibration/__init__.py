"""Statistics of a calibration: what measured levels reveal about settings that were not measured.

This package makes no runs.
"""
