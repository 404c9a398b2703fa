"""Device code of who moves: release, freezing by age, sleep below the yield stress, and waking."""

import warp as wp

wp.set_module_options({"enable_backward": False})

MOVING = wp.constant(0)
ASLEEP = wp.constant(1)
"""It lies where it is, and others feel it; what hits it hard wakes it."""
FROZEN = wp.constant(2)
"""By its age: the same for good."""
SPILLED = wp.constant(3)
ESCAPED = wp.constant(4)
WAITING = wp.constant(5)
"""Not released yet."""
GIVEN_UP = wp.constant(6)
"""Of a run that failed, whose particles are gone at once, those still to come included."""

RESTS = wp.constant(1.0e30)
"""In place of a multiplier: who rests has none, and the pressure's loops read it with the place."""


@wp.struct
class Movers:
    """The particles that move, in the order of release, run by run."""

    who: wp.array[int]
    count: wp.array[int]
    first_row: wp.array[int]
    """Of each run, and one past the last row."""


@wp.kernel
def count_frame(
    frame: wp.array[int],  # in, out
):
    """The clock ticks on the device: a recorded frame knows which one it is."""
    frame[0] = frame[0] + 1


@wp.kernel
def release(
    frame: wp.array[int],
    frame_of: wp.array[int],
    fate: wp.array[int],  # in, out
):
    i = wp.tid()
    if fate[i] == WAITING and frame_of[i] <= frame[0]:
        fate[i] = MOVING


@wp.kernel
def freeze(
    frame: wp.array[int],
    points_a_run: int,
    frames_to_freeze: wp.array[int],
    frame_of: wp.array[int],
    fate: wp.array[int],  # in, out
    place: wp.array[wp.vec4],  # out
    velocity: wp.array[wp.vec3],  # out
    direction: wp.array[wp.vec3],  # out
):
    """Fix what is older than the paste's stiffening time, as the paper does to bound its cost."""
    i = wp.tid()
    if fate[i] == MOVING and frame[0] - frame_of[i] >= frames_to_freeze[i // points_a_run]:
        fate[i] = FROZEN
        lay_down(i, place, velocity, direction)


@wp.func
def lay_down(
    i: int,
    place: wp.array[wp.vec4],
    velocity: wp.array[wp.vec3],
    direction: wp.array[wp.vec3],
):
    x = place[i]
    place[i] = wp.vec4(x[0], x[1], x[2], RESTS)
    velocity[i] = wp.vec3(0.0)
    direction[i] = wp.vec3(0.0)


@wp.kernel
def mark_movers(
    fate: wp.array[int],
    moves: wp.array[int],  # out
):
    i = wp.tid()
    moves[i] = 0
    if fate[i] == MOVING:
        moves[i] = 1


@wp.kernel
def number_movers(
    points_a_run: int,
    fate: wp.array[int],
    row: wp.array[int],
    movers: Movers,  # out
):
    """``row`` is the number of movers before each particle; its last entry is their number."""
    i = wp.tid()
    if fate[i] == MOVING:
        movers.who[row[i]] = i
    if i % points_a_run == 0:
        movers.first_row[i // points_a_run] = row[i]
    if i == fate.shape[0] - 1:
        total = row[i]
        if fate[i] == MOVING:
            total += 1
        movers.count[0] = total
        movers.first_row[fate.shape[0] // points_a_run] = total


@wp.kernel
def fall_asleep(
    begin: int,
    movers: Movers,
    points_a_run: int,
    yields: wp.array[float],
    step_s: float,
    patience_s: float,
    slowest_shear: float,
    slowest: float,
    shear: wp.array[float],
    quiet_s: wp.array[float],  # in, out
    fate: wp.array[int],  # in, out
    place: wp.array[wp.vec4],  # in, out
    velocity: wp.array[wp.vec3],  # in, out
    direction: wp.array[wp.vec3],  # out
):
    """Lie down what has stood below its yield stress for ``patience_s``."""
    row = begin + wp.tid()
    if row >= movers.count[0]:
        return
    i = movers.who[row]
    if fate[i] != MOVING or yields[i // points_a_run] == 0.0:
        return
    quiet = float(0.0)
    if shear[i] < slowest_shear and wp.length(velocity[i]) < slowest:
        quiet = quiet_s[i] + step_s
    quiet_s[i] = quiet
    if quiet >= patience_s:
        fate[i] = ASLEEP
        lay_down(i, place, velocity, direction)


@wp.kernel
def wake(
    begin: int,
    movers: Movers,
    points_a_run: int,
    yields: wp.array[float],
    fast: float,
    velocity: wp.array[wp.vec3],
    listed: wp.array2d[int],
    count: wp.array[int],
    fate: wp.array[int],  # in, out
    quiet_s: wp.array[float],  # out
):
    """A neighbour that is fast wakes who sleeps. Several may: they write the same."""
    row = begin + wp.tid()
    if row >= movers.count[0]:
        return
    i = movers.who[row]
    if yields[i // points_a_run] > 0.0 and wp.length(velocity[i]) > fast:
        for slot in range(count[row]):
            j = listed[row, slot]
            if fate[j] == ASLEEP:
                fate[j] = MOVING
                quiet_s[j] = 0.0
