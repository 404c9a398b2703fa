"""One trial: its file, its three stages, and the files that they write into a run folder."""
