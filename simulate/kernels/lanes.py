"""Device code for a row that the 32 threads of a GPU's warp share: each thread is a lane, and the warp is one block.

In a block of another width, and on a CPU, each row has one thread, whose lane is 0.
"""

from typing import Any

import warp as wp

wp.set_module_options({"enable_backward": False})

WARP = wp.constant(32)  # Threads that run in step, so that their sums take no other memory


@wp.func_native(f"return WP_TILE_BLOCK_DIM == {int(WARP)} ? {int(WARP)} : 1;")
def lanes() -> int:
    """Number of threads of a row; a compiler knows it, as it does not know ``wp.block_dim()``."""
    ...


@wp.func_native(f"""
#if defined(__CUDA_ARCH__) && WP_TILE_BLOCK_DIM == {int(WARP)}
return threadIdx.x;
#else
return 0;
#endif
""")
def lane() -> int: ...


@wp.func
def over_lanes(own: Any):
    """The sum of what the threads of a row have, for all of them; all of them come here."""
    total = own
    if lanes() > 1:
        total = wp.tile_sum(wp.tile(own, preserve_type=True))[0]
    return total


@wp.func_native(f"""
#if defined(__CUDA_ARCH__) && WP_TILE_BLOCK_DIM == {int(WARP)}
const unsigned all = __ballot_sync(0xffffffffu, mark);
return wp::vec2i(__popc(all & ((1u << threadIdx.x) - 1)), __popc(all));
#else
return wp::vec2i(0, mark);
#endif
""")
def count_marks(mark: int) -> wp.vec2i:
    """Number of marks, each 0 or 1, of the lanes before this one, and of all; all of them come here."""
    ...
