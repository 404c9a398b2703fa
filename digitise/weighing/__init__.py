"""Measure the cavity below a photo by weight: a liquid is poured into the crack in steps of known mass and level."""
