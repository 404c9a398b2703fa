"""Statistics of a calibration: what measured levels determine about settings that were not measured.

It makes no runs.
"""
