"""A nozzle's path in the languages of robots."""
