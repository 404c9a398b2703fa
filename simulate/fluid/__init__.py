"""State of the fluid, and the parts of one substep: neighbours, pressure and viscosity."""
