"""What a comparison allows one to say: the readings' own doubt, that of the numbers, and that of what went in."""
