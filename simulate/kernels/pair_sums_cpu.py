"""The sums of ``pair_sums`` for CPUs, sixteen neighbours at a time; same names, same arguments, same meaning.

They use vectors of the C++ compiler, and one instruction of a processor: AVX-512, where present, packs the neighbours
found. On two cores of an EPYC the plain loops take eight to twelve times as long (``benchmarks/pbf_step.py``). The
dummy point that pads a list is so far away that its terms are zero. The order of the sums differs, and so do the last
bits.
"""

import warp as wp

from simulate.kernels.pair_sums import DensitySums, WallSums
from simulate.kernels.status import RESTS

wp.set_module_options({"enable_backward": False})

# Sixteen positions of 16 bytes each, turned into one vector for each coordinate.
VECTORS = """
typedef float f4 __attribute__((vector_size(16)));
typedef float f16 __attribute__((vector_size(64)));
const f16 none = {};
#define PAIR(a, b) __builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7)
#define QUAD(a, b, c, d) __builtin_shufflevector(PAIR(a, b), PAIR(c, d), 0,1,2,3,4,5,6,7,8,9,10,11,12,13,14,15)
#define LOW(a, b) __builtin_shufflevector(a, b, 0, 16, 1, 17, 4, 20, 5, 21, 8, 24, 9, 25, 12, 28, 13, 29)
#define HIGH(a, b) __builtin_shufflevector(a, b, 2, 18, 3, 19, 6, 22, 7, 23, 10, 26, 11, 27, 14, 30, 15, 31)
#define FIRST(a, b) __builtin_shufflevector(a, b, 0, 1, 16, 17, 4, 5, 20, 21, 8, 9, 24, 25, 12, 13, 28, 29)
#define SECOND(a, b) __builtin_shufflevector(a, b, 2, 3, 18, 19, 6, 7, 22, 23, 10, 11, 26, 27, 14, 15, 30, 31)
#define LOAD(at) ([](const void* p) { f4 v; __builtin_memcpy(&v, p, 16); return v; }(at))
#define LOAD16(X, Y, Z, W, base, bytes, l) \\
    f16 X, Y, Z, W; { \\
    const char* from = (const char*)(base); const size_t n = (bytes); \\
    const f16 a = QUAD(LOAD(from+n*l[0]), LOAD(from+n*l[4]), LOAD(from+n*l[8]), LOAD(from+n*l[12])); \\
    const f16 b = QUAD(LOAD(from+n*l[1]), LOAD(from+n*l[5]), LOAD(from+n*l[9]), LOAD(from+n*l[13])); \\
    const f16 c = QUAD(LOAD(from+n*l[2]), LOAD(from+n*l[6]), LOAD(from+n*l[10]), LOAD(from+n*l[14])); \\
    const f16 d = QUAD(LOAD(from+n*l[3]), LOAD(from+n*l[7]), LOAD(from+n*l[11]), LOAD(from+n*l[15])); \\
    const f16 ab = LOW(a, b), cd = LOW(c, d), ab2 = HIGH(a, b), cd2 = HIGH(c, d); \\
    X = FIRST(ab, cd); Y = SECOND(ab, cd); Z = FIRST(ab2, cd2); W = SECOND(ab2, cd2); }
#define HALVES(v, ...) (__builtin_shufflevector(v, v, __VA_ARGS__))
#define SUM(v) ({ \\
    const auto eight = HALVES(v, 0, 1, 2, 3, 4, 5, 6, 7) + HALVES(v, 8, 9, 10, 11, 12, 13, 14, 15); \\
    const auto four = HALVES(eight, 0, 1, 2, 3) + HALVES(eight, 4, 5, 6, 7); \\
    (four[0] + four[1]) + (four[2] + four[3]); })
#define ABOVE(v) ({ const f16 w = (v); w > 0.0f ? w : none; })
// exp(-u) for 0 <= u <= 1, by the squares of exp(-u/4): to 1e-7.
#define FADE(u) ({ const f16 t = (u) * -0.25f; \\
    f16 e = 1.0f + t * (1.0f + t * (0.5f + t * (1/6.0f + t * (1/24.0f + t * (1/120.0f + t * (1/720.0f)))))); \\
    e *= e; e * e; })
const int* list = listed.data + (size_t)row * (size_t)listed.shape[1];
const float h2 = support * support;
"""
OFFSETS = """
for (int s = 0; s < count; s += 16) {
    const int* l = list + s;
    LOAD16(X, Y, Z, W, POSITIONS.data, 16, l)
    X = here[0] - X; Y = here[1] - Y; Z = here[2] - Z;
    const f16 d2 = X * X + Y * Y + Z * Z;
"""
SPIKE = """
    const f16 inverse = 1.0f / __builtin_elementwise_sqrt(__builtin_elementwise_max(d2, none + 1e-30f));
    const f16 short_of = ABOVE(support - d2 * inverse);
    // For two particles at one position: large, times offsets of zero.
    f16 spike = short_of * short_of * inverse;
"""
GAUSS = """
    const f16 gauss = d2 < h2 ? FADE(d2 * (1.0f / h2)) : none;
"""


def _block(*parts: str) -> str:
    """A block of C++ in which, and only in which, the compiler may reorder sums."""
    return "{\n#pragma clang fp reassociate(on) contract(fast)\n" + "".join(parts) + "\n}"


@wp.func_native(
    _block(
        VECTORS,
        "f16 density = {}, gx = {}, gy = {}, gz = {}, squares = {};",
        OFFSETS.replace("POSITIONS", "position"),
        SPIKE,
        """
    const f16 left = ABOVE(h2 - d2);
    density += left * left * left;
    gx += spike * X; gy += spike * Y; gz += spike * Z;
    squares += spike * spike * d2;
}
wp::vec_t<5, wp::float32> sums;
sums[0] = SUM(density); sums[1] = SUM(gx); sums[2] = SUM(gy); sums[3] = SUM(gz); sums[4] = SUM(squares);
return sums;
""",
    )
)
def sum_density(
    position: wp.array[wp.vec4], listed: wp.array2d[int], row: int, count: int, here: wp.vec4, support: float
) -> DensitySums: ...


@wp.func_native(
    _block(
        VECTORS,
        "f16 density = {}, gx = {}, gy = {}, gz = {};",
        OFFSETS.replace("POSITIONS", "wall"),
        SPIKE,
        """
    const f16 left = ABOVE(h2 - d2);
    density += W * left * left * left;
    spike *= W;
    gx += spike * X; gy += spike * Y; gz += spike * Z;
}
wp::vec_t<4, wp::float32> sums;
sums[0] = SUM(density); sums[1] = SUM(gx); sums[2] = SUM(gy); sums[3] = SUM(gz);
return sums;
""",
    )
)
def sum_walls(
    wall: wp.array[wp.vec4], listed: wp.array2d[int], row: int, count: int, here: wp.vec4, support: float
) -> WallSums: ...


@wp.func_native(
    _block(
        VECTORS,
        f"const float RESTS = {float(RESTS)!r}f;",
        "f16 x = {}, y = {}, z = {};",
        OFFSETS.replace("POSITIONS", "position"),
        SPIKE,
        """
    spike *= here[3] + (W == RESTS ? none + resting : W);
    x += spike * X; y += spike * Y; z += spike * Z;
}
return wp::vec3(SUM(x), SUM(y), SUM(z));
""",
    )
)
def sum_correction(
    position: wp.array[wp.vec4],
    listed: wp.array2d[int],
    row: int,
    count: int,
    here: wp.vec4,
    support: float,
    resting: float,
) -> wp.vec3: ...


@wp.func_native(
    _block(
        VECTORS,
        "f16 total = {};",
        OFFSETS.replace("POSITIONS", "position"),
        GAUSS,
        """
    LOAD16(U, V, T, unused, velocity.data, 12, l)
    U = moves[0] - U; V = moves[1] - V; T = moves[2] - T;
    LOAD16(volume, viscosity, next, after, volume_and_viscosity.data, 8, l)
    total += volume * gauss * (U * U + V * V + T * T);
}
return SUM(total);
""",
    )
)
def sum_shear(
    position: wp.array[wp.vec4],
    velocity: wp.array[wp.vec3],
    volume_and_viscosity: wp.array[wp.vec2],
    listed: wp.array2d[int],
    row: int,
    count: int,
    here: wp.vec4,
    moves: wp.vec3,
    support: float,
) -> float: ...


@wp.func_native(
    _block(
        VECTORS,
        """
f16 total = {};
float* out = coupling.data + (size_t)row * (size_t)coupling.shape[1];
""",
        OFFSETS.replace("POSITIONS", "position"),
        GAUSS,
        """
    LOAD16(volume, viscosity, next, after, volume_and_viscosity.data, 8, l)
    const f16 both = __builtin_elementwise_max(viscosity + own[1], none + 1e-20f);
    const f16 weight = own[0] * volume * gauss * (2.0f * own[1] * viscosity / both);
    __builtin_memcpy(out + s, &weight, 64);
    total += weight;
}
return SUM(total);
""",
    )
)
def couple(
    position: wp.array[wp.vec4],
    volume_and_viscosity: wp.array[wp.vec2],
    listed: wp.array2d[int],
    row: int,
    count: int,
    here: wp.vec4,
    own: wp.vec2,
    support: float,
    coupling: wp.array2d[float],
) -> float: ...


@wp.func_native(
    _block(
        VECTORS,
        "f16 total = {};",
        OFFSETS.replace("POSITIONS", "wall"),
        GAUSS,
        """
    total += W * gauss;
}
return SUM(total);
""",
    )
)
def sum_drag(
    wall: wp.array[wp.vec4], listed: wp.array2d[int], row: int, count: int, here: wp.vec4, support: float
) -> float: ...


@wp.func_native(
    _block(
        """
typedef float f4 __attribute__((vector_size(16)));
const int* list = listed.data + (size_t)row * (size_t)listed.shape[1];
const float* weight = coupling.data + (size_t)row * (size_t)coupling.shape[1];
const char* from = (const char*)vector.data;
// Four at a time, so that none waits for another; the fourth lane of each is the next particle's and is not used.
f4 a = {}, b = {}, c = {}, d = {};
for (int s = 0; s < count; s += 4) {
    f4 p, q, r, t;
    __builtin_memcpy(&p, from + (size_t)12 * list[s], 16);
    __builtin_memcpy(&q, from + (size_t)12 * list[s + 1], 16);
    __builtin_memcpy(&r, from + (size_t)12 * list[s + 2], 16);
    __builtin_memcpy(&t, from + (size_t)12 * list[s + 3], 16);
    a += weight[s] * p; b += weight[s + 1] * q; c += weight[s + 2] * r; d += weight[s + 3] * t;
}
const f4 sum = (a + b) + (c + d);
return wp::vec3(sum[0], sum[1], sum[2]);
"""
    )
)
def sum_pulled(
    vector: wp.array[wp.vec3], coupling: wp.array2d[float], listed: wp.array2d[int], row: int, count: int
) -> wp.vec3: ...


@wp.func_native(
    _block(
        """
typedef float f16 __attribute__((vector_size(64)));
typedef int i16 __attribute__((vector_size(64)));
const int slots = listed.shape[1];
int* list = listed.data + (size_t)row * (size_t)slots;
const float reach2 = reach * reach;
int so_far = found;
for (int k = begin; k < end; k += 16) {
    const int m = end - k < 16 ? end - k : 16;
    f16 dx, dy, dz;
    i16 who;
    __builtin_memcpy(&dx, x.data + k, 64);
    __builtin_memcpy(&dy, y.data + k, 64);
    __builtin_memcpy(&dz, z.data + k, 64);
    __builtin_memcpy(&who, number.data + k, 64);
    dx -= here[0]; dy -= here[1]; dz -= here[2];
    const f16 d2 = dx * dx + dy * dy + dz * dz;
    const i16 iota = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
    const i16 near = (d2 < reach2) & (who != self) & (iota < m);
#ifdef __AVX512F__
    const unsigned short mask = __builtin_ia32_cmpd512_mask(near, (i16){}, 4, (unsigned short)0xffff);
    const int more = __builtin_popcount(mask);
    if (so_far + more <= slots) __builtin_ia32_compressstoresi512_mask((i16*)(list + so_far), who, mask);
    so_far += more;
#else
    for (int q = 0; q < m; ++q) {
        if (so_far < slots) list[so_far] = who[q];
        so_far -= near[q];
    }
#endif
}
return so_far;
"""
    )
)
def collect(
    x: wp.array[float],
    y: wp.array[float],
    z: wp.array[float],
    number: wp.array[int],
    begin: int,
    end: int,
    here: wp.vec4,
    reach: float,
    self: int,
    listed: wp.array2d[int],
    row: int,
    found: int,
) -> int: ...
