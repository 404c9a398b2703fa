"""Plan the flow and speed along a path so that the crack is filled without overspill, or the rest of a pour."""
