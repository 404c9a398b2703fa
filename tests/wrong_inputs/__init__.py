"""Wrong inputs in a table for each stage, each with its command and the words that the answer must have."""
