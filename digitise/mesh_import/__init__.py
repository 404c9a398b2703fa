"""Import of a user's own mesh: its frame, its repair, and the crack in it."""
