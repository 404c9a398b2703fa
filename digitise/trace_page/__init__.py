"""The trace page in this machine's browser."""
