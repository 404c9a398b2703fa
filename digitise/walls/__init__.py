"""Measure a crack's walls to a fraction of a pixel."""
