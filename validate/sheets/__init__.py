"""A lab's sheet of readings, whatever its dialect: read without guessing, or refused cell by cell."""
