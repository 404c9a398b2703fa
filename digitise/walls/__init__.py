"""Where a crack's walls stand, to a fraction of a pixel."""
