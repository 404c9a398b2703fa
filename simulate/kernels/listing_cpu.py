"""Search neighbours as ``listing`` does, on CPUs, eight or sixteen points at a time. Names and arguments are the same.

Each thread lists a block of rows. Rows are sorted by cell, and the points around a cell are copied once for all rows of
the cell. The lists follow each other in one array. Each list is padded with a dummy point to a multiple of sixteen
entries, as the loops of ``pair_sums_cpu`` require.
"""

import warp as wp

from simulate.kernels.cells import CellArrays
from simulate.kernels.neighbours import BLOCK, Neighbours
from simulate.kernels.run_module import cpu_block
from simulate.kernels.status import Particles

wp.set_module_options({"enable_backward": False})

ROWS = BLOCK

# PACKED moves the lanes that are set in a mask to the front of a register.
REGISTERS = """
#ifdef __AVX512F__
#define AT_ONCE 16
#define MASK_TYPE unsigned short
#define PACKED(v, mask) __builtin_ia32_compresssi512_mask(v, v, (unsigned short)(mask))
#else
#define AT_ONCE 8
#define MASK_TYPE unsigned char
#ifdef __AVX2__
typedef unsigned char bytes __attribute__((vector_size(8)));
// The lanes of each mask.
struct Lanes {
    bytes of[256];
    constexpr Lanes() : of() {
        for (int mask = 0; mask < 256; ++mask)
            for (int lane = 0, at = 0; lane < 8; ++lane)
                if (mask >> lane & 1) of[mask][at++] = lane;
    }
};
static constexpr Lanes lanes;
#define PACKED(v, mask) __builtin_ia32_permvarsi256(v, __builtin_convertvector(lanes.of[mask], ints))
#endif
#endif
typedef float floats __attribute__((vector_size(4 * AT_ONCE)));
typedef int ints __attribute__((vector_size(4 * AT_ONCE)));
typedef bool bits __attribute__((ext_vector_type(AT_ONCE)));
#define MASK(v) __builtin_bit_cast(MASK_TYPE, __builtin_convertvector(v, bits))
"""

# Copies the points of the three cells along x in each of nine lines around a cell, unless there are more than MOST.
AROUND = """
enum { MOST = 1024 };
struct Points { const float *x, *y, *z; const int* number; };
struct Around {
    float x[MOST + AT_ONCE], y[MOST + AT_ONCE], z[MOST + AT_ONCE];
    int number[MOST + AT_ONCE];
    int begin[9], end[9], lines, count;
};
const auto bring = [](const auto& cells, int base, const int* cell, Around& to) {
    const int nx = cells.count[0], ny = cells.count[1], nz = cells.count[2], b = cell[1], c = cell[2];
    const int low = cell[0] > 0 ? cell[0] - 1 : 0, high = cell[0] + 2 < nx ? cell[0] + 2 : nx;
    to.lines = to.count = 0;
    for (int cc = c > 0 ? c - 1 : 0; cc < nz && cc < c + 2; ++cc)
        for (int bb = b > 0 ? b - 1 : 0; bb < ny && bb < b + 2; ++bb) {
            const int* start = cells.start.data + base + nx * (bb + ny * cc);
            const int points = start[high] - start[low];
            to.begin[to.lines] = start[low], to.end[to.lines] = start[high];
            to.count += points;
            to.lines += points > 0;
        }
    if (to.count > MOST) return;
    for (int line = 0, first = 0; line < to.lines; first += to.end[line] - to.begin[line], ++line)
        for (int k = to.begin[line], at = first; k < to.end[line]; k += AT_ONCE, at += AT_ONCE) {
            __builtin_memcpy(to.x + at, cells.x.data + k, 4 * AT_ONCE);
            __builtin_memcpy(to.y + at, cells.y.data + k, 4 * AT_ONCE);
            __builtin_memcpy(to.z + at, cells.z.data + k, 4 * AT_ONCE);
            __builtin_memcpy(to.number + at, cells.number.data + k, 4 * AT_ONCE);
        }
};
"""

# Appends the near points of a range to a list that has space for ``most``. Returns the number of points so far.
TAKE = """
const float reach2 = cells.size * cells.size;
const auto take = [reach2](Points of, int begin, int end, wp::vec4 point, int self, int* list, int most, int so_far)
    __attribute__((always_inline)) {
    for (int k = begin; k < end; k += AT_ONCE) {
        floats dx, dy, dz;
        __builtin_memcpy(&dx, of.x + k, sizeof dx);
        __builtin_memcpy(&dy, of.y + k, sizeof dy);
        __builtin_memcpy(&dz, of.z + k, sizeof dz);
        dx -= point[0]; dy -= point[1]; dz -= point[2];
        const ints near_by = dx * dx + dy * dy + dz * dz < reach2;
        ints who;
        __builtin_memcpy(&who, of.number + k, sizeof who);
        unsigned mask = MASK(near_by) & ~MASK(who == self);
        if (end - k < AT_ONCE) mask &= (1u << (end - k)) - 1;
#ifdef PACKED
        // Packed in a register and stored whole: some processors take 20 ns to pack straight into memory.
        const ints packed = PACKED(who, mask);
        const int left = most - so_far, more = __builtin_popcount(mask);
        if (left >= AT_ONCE) __builtin_memcpy(list + so_far, &packed, sizeof packed);
        // As many as fit, up to the list's last slot: slots that are not written would keep the entries of before.
        else if (left > 0) __builtin_memcpy(list + so_far, &packed, 4 * __builtin_elementwise_min(more, left));
        so_far += more;
#else
        for (; mask; mask &= mask - 1, ++so_far)
            if (so_far < most) list[so_far] = who[__builtin_ctz(mask)];
#endif
    }
    return so_far;
};
"""


@wp.func_native(
    cpu_block(
        f"enum {{ BLOCK = {int(BLOCK)} }};",
        REGISTERS,
        AROUND,
        TAKE,
        """
const int end = (first / BLOCK + 1) * near.room;
int at = first / BLOCK * near.room;
const auto list_one = [&](const auto& of, const Around& around, wp::vec4 point, int self, int slots, int dummy) {
    int* list = near.store.data + 16 * (size_t)at;
    const int room = 16 * (end - at), most = room < slots ? room : slots;
    int found = 0;
    // A compiler makes a copy of ``take`` for each of its calls.
    const bool together = around.count <= MOST;
    const Points points = together ? Points{around.x, around.y, around.z, around.number}
                                   : Points{of.x.data, of.y.data, of.z.data, of.number.data};
    for (int line = 0, lines = together ? 1 : around.lines; line < lines; ++line)
        found = take(points, together ? 0 : around.begin[line], together ? around.count : around.end[line], point, self,
                     list, most, found);
    if (found > most && most < slots) near.lacking.data[0] = 1;
    int slot = found < most ? found : most;
    for (; slot % 16; ++slot) list[slot] = dummy;
    at += slot / 16;
    return found;
};
Around fluid, wall;
int last_cell = -1;
for (int row = first; row < last; ++row) {
    const int i = particles.mover.data[row];
    const wp::vec4 point = particles.position.data[i];
    int cell[3];
    for (int k = 0; k < 3; ++k) {
        const int along = (int)__builtin_elementwise_floor((point[cells.axis[k]] - cells.corner[k]) / cells.size);
        cell[k] = along < 0 ? 0 : along < cells.count[k] ? along : cells.count[k] - 1;
    }
    const int base = i / cells.points_per_run * cells.count[0] * cells.count[1] * cells.count[2];
    const int key = base + cell[0] + cells.count[0] * (cell[1] + cells.count[1] * cell[2]);
    if (key != last_cell) {
        bring(cells, base, cell, fluid);
        bring(wall_cells, 0, cell, wall);
        last_cell = key;
    }
    near.fluid_at.data[row] = at;
    near.fluid_count.data[row] = list_one(cells, fluid, point, i, near.fluid.shape[1], particles.position.shape[0]);
    near.wall_at.data[row] = at;
    near.wall_count.data[row] = list_one(wall_cells, wall, point, -1, near.wall.shape[1], near.wall_particle.shape[0]);
}""",
    )
)
def list_rows(
    first: int,
    last: int,
    particles: Particles,
    cells: CellArrays,
    wall_cells: CellArrays,
    near: Neighbours,
): ...
