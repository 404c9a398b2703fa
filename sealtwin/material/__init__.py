"""Measurement of a paste by a cone or a bead and a photo, or by a rheometer's table; writes a file for trials."""
