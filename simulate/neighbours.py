"""Who is near whom: lists of a row for each mover, of the fluid and of the walls."""

import warp as wp

NEIGHBOURS = 128
"""Slots of a list, a whole number of sixteens. Fluid at rest fills about 50, at twice its density 100."""
WALL_NEIGHBOURS = 96
"""Slots of a list. A flat wall fills about 13, a narrow corner three times that."""

NOWHERE_CM = 1e6
"""Where nobody is, in x, y and z, with whom the rows of lists are filled up: no particle comes near it."""


class NeighbourLists:
    """For at most ``rows`` movers. A GPU reads the same slot of many rows at once, a CPU the slots of a row."""

    def __init__(self, rows: int, device: str) -> None:
        self.fluid, self.fluid_count = pairs_of(rows, NEIGHBOURS, int, device), wp.zeros(rows, dtype=int, device=device)
        self.wall, self.wall_count = (
            pairs_of(rows, WALL_NEIGHBOURS, int, device),
            wp.zeros(rows, dtype=int, device=device),
        )


def pairs_of(rows: int, slots: int, dtype: type, device: str) -> wp.array:
    """Something for each pair, (rows, slots), as it lies best in the device's memory."""
    if device == "cpu":
        return wp.zeros((rows, slots), dtype=dtype, device=device)
    return wp.zeros((slots, rows), dtype=dtype, device=device).transpose()
