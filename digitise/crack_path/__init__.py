"""The path along a crack: search between clicked points, painted masks, and the automatic search."""
