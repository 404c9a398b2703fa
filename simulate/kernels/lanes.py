"""Device code for rows that are each processed by the 32 threads (lanes) of a GPU's warp. The warp is a block.

On a CPU, and in blocks of another width, each row has one thread, lane 0.
"""

from typing import Any

import warp as wp

wp.set_module_options({"enable_backward": False})

WARP = wp.constant(32)  # Number of threads of a warp. They run in step, so their sums need no shared memory


@wp.func_native(f"return WP_TILE_BLOCK_DIM == {int(WARP)} ? {int(WARP)} : 1;")
def lanes() -> int:
    """Return the number of threads per row. It is a constant for the compiler, unlike ``wp.block_dim()`` on a GPU."""
    ...


@wp.func_native(f"""
#if defined(__CUDA_ARCH__) && WP_TILE_BLOCK_DIM == {int(WARP)}
return threadIdx.x;
#else
return 0;
#endif
""")
def lane() -> int: ...


# Blocks of one thread, as on a CPU, must not call functions with tiles. A tile is in memory that all threads of the
# process share.
@wp.func
def tile_total(value: Any):
    return wp.tile_sum(wp.tile(value, preserve_type=True))[0]


@wp.func
def tile_most(value: Any):
    return wp.tile_max(wp.tile(value))[0]


@wp.func
def over_lanes(value: Any):
    """Return to every thread of a row the sum over its threads. All threads must call this."""
    total = value
    if lanes() > 1:
        total = tile_total(value)
    return total


@wp.func
def over_block(value: Any):
    """Return to every thread of a block the sum over its threads. All threads must call this."""
    total = value
    if wp.block_dim() > 1:
        total = tile_total(value)
    return total


@wp.func
def most_over_block(value: Any):
    """Return to every thread of a block the largest value of its threads. All threads must call this."""
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
    """Return the number of lanes with a mark of 1 before this lane, and in total. All threads must call this."""
    ...
