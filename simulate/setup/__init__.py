"""Prepare a run: release schedule, walls, signed distance, and checks of the settings."""
