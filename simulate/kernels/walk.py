"""Loop in which several threads of a CPU launch the kernels of a table in order. The rows of a kernel form slices.

A thread takes any slice that is left, so it never waits for a thread that has not started. A kernel begins when all
slices of the kernel before it are finished.
"""

import warp as wp

from simulate.kernels.run_module import run_kernel

wp.set_module_options({"enable_backward": False})

# Indices in ``Control.words``. Words that different threads write are in different lines of the cache.
LINE = 8
STATE = 0
"""Word with two halves. The upper half, the turn, is the number of kernels since the first walk. The lower half is the
current line of the table."""
FINISHED = LINE  # Number of slices finished since the first walk
TABLE = 2 * LINE  # Address of the first line of the table
LINES = TABLE + 1
BOUNDS = TABLE + 2  # Address of the bounds of a launch of one thread
YIELD = TABLE + 3  # Address of the operating system's function with which a thread lets others run
INVITED = TABLE + 4  # Number of threads that may take slices
LOST = 3 * LINE  # Time, in ``SPIN_US``, that the first thread waited for slices of threads that lost their core
WORKERS = 4 * LINE  # A line of the cache for each slice: the slice's last turn, and 1 if the thread has left
# Words of a line of the table. The addresses of the arguments follow, one for each slice.
FUNCTION, COUNT, BLOCK, ARGUMENTS = 0, 1, 2, 4
CONDITION, TARGET, WANTED = 1, 2, 3  # Words of a jump. Its word FUNCTION is 0
DONE = 0xFFFFFFFF  # Value of the current line if no walk is in progress
SPIN_US = 50  # Time that a thread waits before it lets others run
LATE_US = 500  # If a slice takes this much longer than the first thread's slices, its thread has lost its core
HOLD_US = 500  # Time after which a background thread lets others run, so that it is not interrupted later


@wp.struct
class Control:
    """Words in memory that all threads of a walk use."""

    words: wp.array[wp.uint64]


@wp.func_native(
    f"""
#ifndef __CUDA_ARCH__
enum {{ LINE = {LINE}, ARGUMENTS = {ARGUMENTS}, WORKERS = {WORKERS} }};
typedef unsigned long long word;
typedef void (*kernel)(word bounds, word arguments);
typedef void (*action)();
word* const control = (word*)control_of.words.data;
word* const state = control + {STATE};
const word width = ARGUMENTS + slices;
word* const left = control + WORKERS + LINE * worker + 1;
#if defined(__x86_64__) || defined(_M_X64)
// Time stamps count at 2 to 5 GHz.
const word patience = {SPIN_US} * 3000ull;
const auto ticks = [] {{ return __builtin_ia32_rdtsc(); }};
const auto pause = [] {{ __builtin_ia32_pause(); }};
#else
word frequency;
asm volatile("mrs %0, cntfrq_el0" : "=r"(frequency));
const word patience = {SPIN_US} * frequency / 1000000;
const auto ticks = [] {{ word now; asm volatile("mrs %0, cntvct_el0" : "=r"(now)); return now; }};
const auto pause = [] {{ asm volatile("yield"); }};
#endif
const auto read = [](const word* from) {{ return __atomic_load_n(from, __ATOMIC_ACQUIRE); }};
// Waits for another state, at most for the time of a spin. Returns True if there is one.
const auto changes = [&](word before) {{
    for (const word begin = ticks(); read(state) == before; pause())
        if (ticks() - begin > patience) return false;
    return true;
}};
// Returns the place of the next kernel after the jumps.
const auto follow = [&](word place) {{
    const word lines = control[{LINES}];
    while (place < lines) {{
        const word* line = (const word*)control[{TABLE}] + place * width;
        if (line[{FUNCTION}]) return place;
        const word holds = *(const volatile int*)line[{CONDITION}] != 0;
        place = holds == line[{WANTED}] ? line[{TARGET}] : place + 1;
    }}
    return (word){DONE};
}};
const auto take = [&](const word* line, word slice) {{
    const int count = *(const int*)line[{COUNT}], block = (int)line[{BLOCK}], blocks = (count + block - 1) / block;
    int* span = (int*)line[ARGUMENTS + slice];
    // A single block is the first slice's.
    const auto first = [=](word slice) {{ return (int)((blocks * slice + slices - 1) / slices) * block; }};
    const int end = first(slice + 1);
    span[0] = first(slice), span[1] = end < count ? end : count, span[2] = 1;
    if (span[0] < span[1]) ((kernel)line[{FUNCTION}])(control[{BOUNDS}], (word)span);
}};
if (worker == 0) {{
    const word turn = read(state) >> 32 << 32;
    __atomic_store_n(state, turn | follow(0), __ATOMIC_SEQ_CST);
}}
word fresh = ticks();
for (;;) {{
    if (worker && ticks() - fresh > {HOLD_US // SPIN_US} * patience) {{
        ((action)control[{YIELD}])();
        fresh = ticks();
    }}
    const word now = read(state), turn = now >> 32, place = now & {DONE};
    if (place == {DONE} || (word)worker >= read(control + {INVITED})) {{
        if (worker == 0) return;
        if (place == {DONE} && changes(now)) continue;
        __atomic_store_n(left, 1, __ATOMIC_SEQ_CST);
        return;
    }}
    const word begin = ticks();
    for (word k = 0; k < (word)slices; ++k) {{
        // Rows become lighter from the first to the last: a thread takes one from each end.
        const word nth = (worker + k / 2) % workers, slice = k % 2 ? slices - 1 - nth : nth;
        word before = turn - 1;
        word* const last = control + WORKERS + LINE * slice;
        // Nobody else can take it, and no walk can end before it is finished.
        if (!__atomic_compare_exchange_n(last, &before, turn, false, __ATOMIC_ACQ_REL, __ATOMIC_RELAXED)) continue;
        take((const word*)control[{TABLE}] + place * width, slice);
        if (__atomic_add_fetch(control + {FINISHED}, 1, __ATOMIC_ACQ_REL) == turn * slices)
            __atomic_store_n(state, (turn + 1) << 32 | follow(place + 1), __ATOMIC_RELEASE);
    }}
    const word end = ticks();
    if (changes(now)) continue;
    while (read(state) == now) ((action)control[{YIELD}])();
    const word wait = ticks() - end;
    if (worker == 0 && wait > end - begin + {LATE_US // SPIN_US} * patience) control[{LOST}] += wait / patience;
}}
#endif
"""
)
def walk(control_of: Control, worker: int, workers: int, slices: int): ...


@run_kernel
def walk_table(control: Control, worker: int, workers: int, slices: int):
    """Launch the kernels of the table. The first worker returns at the end of the walk.

    Other workers return ``SPIN_US`` later if no other walk has begun by then.
    """
    walk(control, worker, workers, slices)
