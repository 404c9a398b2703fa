"""Statistics of a calibration: what measured levels determine about settings that were not measured. Makes no runs."""
