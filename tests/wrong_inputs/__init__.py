"""Wrong inputs, a table for each stage: what a command answers to each, and where it says what is wrong."""
