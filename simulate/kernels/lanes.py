"""Device code for rows with the 32 threads of a GPU's warp each. A thread is a lane, and the warp is a block.

On a CPU, and in a block of another width, each row has one thread, with lane 0.
"""

from typing import Any

import warp as wp

wp.set_module_options({"enable_backward": False})

WARP = wp.constant(32)  # Threads that run in step, so that their sums need no shared memory


@wp.func_native(f"return WP_TILE_BLOCK_DIM == {int(WARP)} ? {int(WARP)} : 1;")
def lanes() -> int:
    """Return the number of threads of a row, a constant for the compiler. ``wp.block_dim()`` is not, on a GPU."""
    ...


@wp.func_native(f"""
#if defined(__CUDA_ARCH__) && WP_TILE_BLOCK_DIM == {int(WARP)}
return threadIdx.x;
#else
return 0;
#endif
""")
def lane() -> int: ...


# A CPU's blocks of one thread must not have tiles. A tile exists from the call of its function on, in memory that all
# threads of the process share.
@wp.func
def tile_total(value: Any):
    return wp.tile_sum(wp.tile(value, preserve_type=True))[0]


@wp.func
def tile_most(value: Any):
    return wp.tile_max(wp.tile(value))[0]


@wp.func
def over_lanes(value: Any):
    """Return the sum over the threads of a row to all of them. All threads must call it."""
    total = value
    if lanes() > 1:
        total = tile_total(value)
    return total


@wp.func
def over_block(value: Any):
    """Return the sum over the threads of a block to all of them. All threads must call it."""
    total = value
    if wp.block_dim() > 1:
        total = tile_total(value)
    return total


@wp.func
def most_over_block(value: Any):
    """Return the largest value of the threads of a block to all of them. All threads must call it."""
    most = value
    if wp.block_dim() > 1:
        most = tile_most(value)
    return most


@wp.func_native(f"""
#if defined(__CUDA_ARCH__) && WP_TILE_BLOCK_DIM == {int(WARP)}
const unsigned all = __ballot_sync(0xffffffffu, mark);
return wp::vec2i(__popc(all & ((1u << threadIdx.x) - 1)), __popc(all));
#else
return wp::vec2i(0, mark);
#endif
""")
def count_marks(mark: int) -> wp.vec2i:
    """Return the number of marks (0 or 1) of the lanes before this one, and of all lanes. All threads must call it."""
    ...
