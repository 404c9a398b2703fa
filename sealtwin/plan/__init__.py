"""Plans: flow and speed along a path, chosen so that the crack is full and nothing overspills, and their correction."""
