"""A sample that somebody has modelled or scanned."""
