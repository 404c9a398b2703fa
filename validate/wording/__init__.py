"""Results in words: headline, cautions, tables and sentences of a report."""
