"""The state of the fluid and one substep of it: pressure, viscosity, neighbours."""
