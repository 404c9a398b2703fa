"""From a crack solid and a trajectory to a settled sealant surface, by position-based fluid on Warp."""
