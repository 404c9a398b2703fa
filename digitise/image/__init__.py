"""Decode photos and masks, and provide the picture operations that several packages share."""
