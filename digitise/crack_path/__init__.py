"""Find the path along a crack: between clicked points, in a painted mask, or by a chosen line."""
