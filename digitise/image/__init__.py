"""Decoding of photos, and the picture operations that several parts share."""
