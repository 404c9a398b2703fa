"""One trial: its file, its three stages, and what they leave in a run folder."""
