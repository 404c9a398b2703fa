"""Where in a photo the crack runs."""
