"""The cavity below a photo by weight: a liquid poured into the crack in steps, its mass and its level."""
