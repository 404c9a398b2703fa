"""Figures and pages of studies with many runs."""
