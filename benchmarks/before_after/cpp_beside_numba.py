"""The program in C++ that the fluid is timed against, over the one in numba: independent ones by hand take a fifth.

Both copy one settled state, on one thread; the least of twelve turns of processor time.
"""

import json
import time

import numba

from benchmarks.pbf_cpp import CppStep
from benchmarks.pbf_numba import NumbaStep
from benchmarks.pbf_step import settled_block, take_turns

SIDE_MM, DEPTH_MM = 26.0, 22.0  # Of the tank of 15,000 particles
AT_MOST = 0.35

numba.set_num_threads(1)
engine = settled_block(15_000, 1, steps=60)
cpp_ms, numba_ms = take_turns(
    (CppStep(engine, SIDE_MM, DEPTH_MM, 1).step, NumbaStep.copy_of(engine).step), time.process_time
)
ratio = cpp_ms / numba_ms
print(json.dumps({"line": f"C++ takes {ratio:.2f} of numba's time, {cpp_ms:.1f} ms", "sound": ratio <= AT_MOST}))
