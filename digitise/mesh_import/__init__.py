"""Import a user's own mesh: place it in its frame, repair it, and find the crack in it."""
