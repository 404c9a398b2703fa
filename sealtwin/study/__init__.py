"""Studies, which compute one trial many times with different settings, and comparisons of runs."""
