"""Plan the flow and speed along a path so that the crack is filled without overspill, and correct it in the pour."""
