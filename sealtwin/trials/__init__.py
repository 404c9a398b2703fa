"""One trial, from a photo to a report."""
