"""Show the trace page in this machine's browser, and trace photos for it."""
