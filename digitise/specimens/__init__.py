"""Made-up samples, drawn with exact truth."""
