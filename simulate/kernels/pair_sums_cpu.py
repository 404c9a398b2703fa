"""Compute the sums of ``pair_sums`` on CPUs, eight or sixteen neighbours at a time. Names and arguments are the same.

The code uses vectors of the C++ compiler. If the processor has AVX2 or AVX-512, it uses two of their instructions: an
approximate inverse root, and one that packs the neighbours. The dummy point that pads a list is so far away that its
terms are zero. Terms are added in another order than in ``pair_sums``, so the last bits of the sums differ.
"""

import warp as wp

from simulate.kernels.neighbours import Neighbours
from simulate.kernels.pair_sums import (
    ALONG,
    NEAREST_WALL,
    CoupleSums,
    DensitySums,
    DragSums,
    GradientSums,
    WallSums,
)
from simulate.kernels.run_module import cpu_block
from simulate.kernels.status import RESTS, Particles

wp.set_module_options({"enable_backward": False})

# LOADS reads as many positions of 16 bytes as a register has lanes, and returns one vector for each coordinate.
VECTORS = """
typedef float f4 __attribute__((vector_size(16)));
#define PAIR(a, b) __builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7)
#define LOAD(at) ([](const void* p) { f4 v; __builtin_memcpy(&v, p, 16); return v; }(at))
#define BOTH(l, k) PAIR(LOAD(from+n*l[k]), LOAD(from+n*l[(k) + 4]))
#define HALVES(v, ...) (__builtin_shufflevector(v, v, __VA_ARGS__))
#define SUM8(eight) ({ \\
    const auto four = HALVES(eight, 0, 1, 2, 3) + HALVES(eight, 4, 5, 6, 7); \\
    (four[0] + four[1]) + (four[2] + four[3]); })
#ifdef __AVX512F__
#define LANES 16
typedef float floats __attribute__((vector_size(64)));
#define ROWS(l, k) __builtin_shufflevector(BOTH(l, k), BOTH(l, (k) + 8), 0,1,2,3,4,5,6,7,8,9,10,11,12,13,14,15)
#define LOW(a, b) __builtin_shufflevector(a, b, 0, 16, 1, 17, 4, 20, 5, 21, 8, 24, 9, 25, 12, 28, 13, 29)
#define HIGH(a, b) __builtin_shufflevector(a, b, 2, 18, 3, 19, 6, 22, 7, 23, 10, 26, 11, 27, 14, 30, 15, 31)
#define FIRST(a, b) __builtin_shufflevector(a, b, 0, 1, 16, 17, 4, 5, 20, 21, 8, 9, 24, 25, 12, 13, 28, 29)
#define SECOND(a, b) __builtin_shufflevector(a, b, 2, 3, 18, 19, 6, 7, 22, 23, 10, 11, 26, 27, 14, 15, 30, 31)
#define SUM(v) ({ \\
    const auto eight = HALVES(v, 0, 1, 2, 3, 4, 5, 6, 7) + HALVES(v, 8, 9, 10, 11, 12, 13, 14, 15); \\
    SUM8(eight); })
#define ROUGHLY(v) __builtin_ia32_rsqrt14ps512_mask(v, v, (unsigned short)0xffff)
#else
#define LANES 8
typedef float floats __attribute__((vector_size(32)));
#define ROWS(l, k) BOTH(l, k)
#define LOW(a, b) __builtin_shufflevector(a, b, 0, 8, 1, 9, 4, 12, 5, 13)
#define HIGH(a, b) __builtin_shufflevector(a, b, 2, 10, 3, 11, 6, 14, 7, 15)
#define FIRST(a, b) __builtin_shufflevector(a, b, 0, 1, 8, 9, 4, 5, 12, 13)
#define SECOND(a, b) __builtin_shufflevector(a, b, 2, 3, 10, 11, 6, 7, 14, 15)
#define SUM(v) SUM8(v)
#ifdef __AVX__
#define ROUGHLY(v) __builtin_ia32_rsqrtps256(v)
#endif
#endif
const floats none = {};
#define LOADS(X, Y, Z, W, base, bytes, l) \\
    floats X, Y, Z, W; { \\
    const char* from = (const char*)(base); const size_t n = (bytes); \\
    const floats a = ROWS(l, 0), b = ROWS(l, 1), c = ROWS(l, 2), d = ROWS(l, 3); \\
    const floats ab = LOW(a, b), cd = LOW(c, d), ab2 = HIGH(a, b), cd2 = HIGH(c, d); \\
    X = FIRST(ab, cd); Y = SECOND(ab, cd); Z = FIRST(ab2, cd2); W = SECOND(ab2, cd2); }
// One over the root, to float32's rounding: a step of Newton's from a processor's 12 bits or more.
#ifdef ROUGHLY
#define INVERSE_ROOT(v) ({ const floats x = (v), y = ROUGHLY(x); y * (1.5f - 0.5f * x * y * y); })
#else
#define INVERSE_ROOT(v) (1.0f / __builtin_elementwise_sqrt(v))
#endif
typedef _Float16 halves __attribute__((vector_size(2 * LANES)));
#define PUT(v, at) ({ const halves h = __builtin_convertvector(v, halves); __builtin_memcpy(at, &h, sizeof h); })
#define TAKEN(at) ({ halves h; __builtin_memcpy(&h, at, sizeof h); __builtin_convertvector(h, floats); })
#define ABOVE(v) ({ const floats w = (v); w > 0.0f ? w : none; })
// exp(-u) for 0 <= u <= 1, by the squares of exp(-u/4): to 1e-7.
#define FADE(u) ({ const floats t = (u) * -0.25f; \\
    floats e = 1.0f + t * (1.0f + t * (0.5f + t * (1/6.0f + t * (1/24.0f + t * (1/120.0f + t * (1/720.0f)))))); \\
    e *= e; e * e; })
#define WINDOW(of, kind) \\
    ((char*)(of).data + (size_t)near.kind##_at.data[row] * (size_t)(of).strides[0])
const float h2 = support * support;
"""
LISTED = """
const int i = particles.mover.data[row];
const wp::vec4 position = particles.position.data[i];
const int* list = (const int*)WINDOW(near.KIND, KIND);
const int count = near.KIND_count.data[row];
"""
OFFSETS = """
for (int s = 0; s < count; s += LANES) {
    const int* l = list + s;
    LOADS(X, Y, Z, W, POSITIONS.data, 16, l)
    X = position[0] - X; Y = position[1] - Y; Z = position[2] - Z;
    const floats d2 = X * X + Y * Y + Z * Z;
"""
SPIKE = """
    const floats inverse = INVERSE_ROOT(__builtin_elementwise_max(d2, none + 1e-30f));
    const floats short_of = ABOVE(support - d2 * inverse);
    // For two particles at one position: large, times offsets of zero.
    floats spike = short_of * short_of * inverse;
"""
POLY6 = """
    const floats left = ABOVE(1.0f - d2 * (1.0f / h2)), weigh = left * left * left;
"""
GAUSS = """
    const floats weigh = d2 < h2 ? FADE(d2 * (1.0f / h2)) : none;
"""


def summed(kind: str, sums: str, *terms: str, constants: str = "") -> str:
    """Return C++ code that adds ``terms`` to ``sums`` for each near particle of a kind, and returns the sums.

    ``sums`` lists the names of the sums. A name may follow a factor and an asterisk. The factor multiplies the whole
    sum.
    """
    pairs = [term.rpartition("*") for term in sums.split()]
    return cpu_block(
        VECTORS,
        LISTED.replace("KIND", kind),
        constants,
        f"floats {', '.join(f'{name} = {{}}' for _, _, name in pairs)};",
        OFFSETS.replace("POSITIONS", {"fluid": "particles.position", "wall": "near.wall_particle"}[kind]),
        *terms,
        f"}}\nwp::vec_t<{len(pairs)}, wp::float32> sums;\n",
        *(f"sums[{k}] = {by}{times}SUM({name});\n" for k, (by, times, name) in enumerate(pairs)),
        "return sums;",
    )


@wp.func_native(
    summed(
        "fluid",
        "density gx gy gz squares",
        SPIKE,
        """
    const floats left = ABOVE(h2 - d2);
    density += left * left * left;
    gx += spike * X; gy += spike * Y; gz += spike * Z;
    squares += spike * spike * d2;
""",
    )
)
def sum_density(particles: Particles, near: Neighbours, row: int, support: float) -> DensitySums: ...


@wp.func_native(
    summed(
        "wall",
        "density gx gy gz",
        SPIKE,
        """
    const floats left = ABOVE(h2 - d2);
    density += W * left * left * left;
    spike *= W;
    gx += spike * X; gy += spike * Y; gz += spike * Z;
""",
    )
)
def sum_walls(particles: Particles, near: Neighbours, row: int, support: float) -> WallSums: ...


@wp.func_native(
    summed(
        "fluid",
        "x y z",
        SPIKE,
        """
    spike *= position[3] + (W == RESTS ? none + resting : W);
    x += spike * X; y += spike * Y; z += spike * Z;
""",
        constants=f"const float RESTS = {float(RESTS)!r}f;",
    )
)
def sum_correction(particles: Particles, near: Neighbours, row: int, support: float, resting: float) -> wp.vec3: ...


@wp.func_native(
    summed(
        "fluid",
        "xx yy zz xy yz zx ux uy uz vx vy vz tx ty tz",
        POLY6,
        """
    LOADS(U, V, T, unused, particles.velocity.data, 12, l)
    U = moves[0] - U; V = moves[1] - V; T = moves[2] - T;
    const floats wx = weigh * X, wy = weigh * Y, wz = weigh * Z;
    xx += wx * X; yy += wy * Y; zz += wz * Z; xy += wx * Y; yz += wy * Z; zx += wz * X;
    ux += U * wx; uy += U * wy; uz += U * wz;
    vx += V * wx; vy += V * wy; vz += V * wz;
    tx += T * wx; ty += T * wy; tz += T * wz;
""",
        constants="const wp::vec3 moves = particles.velocity.data[i];",
    )
)
def sum_gradient(particles: Particles, near: Neighbours, row: int, support: float) -> GradientSums: ...


LINK = """
    LOADS(volume, viscosity, next, after, particles.volume_and_viscosity.data, 8, l)
    const floats mean = 0.5f * (own[1] + viscosity);
    const floats weight = 0.5f * ALONG * (volume + own[0]) * weigh * mean;
    const floats root = weight * INVERSE_ROOT(__builtin_elementwise_max(weight * d2, none + 1e-30f));
    X *= root; Y *= root; Z *= root;
    _Float16* at = out + s / 16 * 48 + s % 16;
    PUT(X, at); PUT(Y, at + 16); PUT(Z, at + 32);
    xx += X * X; yy += Y * Y; zz += Z * Z; xy += X * Y; yz += Y * Z; zx += Z * X;
    resting += W == RESTS ? weight : none;
    LOADS(U, V, T, unused, particles.velocity.data, 12, l)
    const floats still = (moves[0] - U) * X + (moves[1] - V) * Y + (moves[2] - T) * Z;
    vx += still * X; vy += still * Y; vz += still * Z;
    LOADS(E, F, G, spare, particles.scaled_residual.data, 12, l)
    const floats moved = (guessed[0] - E) * X + (guessed[1] - F) * Y + (guessed[2] - G) * Z;
    gx += moved * X; gy += moved * Y; gz += moved * Z;
"""


LINK_CONSTANTS = f"""
const float RESTS = {float(RESTS)!r}f, ALONG = {ALONG!r}f;
_Float16* out = (_Float16*)WINDOW(links, fluid);
const wp::vec2 own = particles.volume_and_viscosity.data[i];
const wp::vec3 moves = particles.velocity.data[i], guessed = particles.scaled_residual.data[i];
"""


@wp.func_native(summed("fluid", "xx yy zz xy yz zx resting vx vy vz gx gy gz", POLY6, LINK, constants=LINK_CONSTANTS))
def link_pairs(
    particles: Particles, near: Neighbours, row: int, support: float, links: wp.array2d[wp.vec3h]
) -> CoupleSums: ...


EQ5 = """
    LOADS(U, V, T, unused, velocity.data, 12, l)
    LOADS(volume, theirs, next, after, particles.volume_and_viscosity.data, 8, l)
    const floats both = __builtin_elementwise_max(viscosity + theirs, none + 1e-20f);
    const floats weight = 2.0f * viscosity * volume * theirs * weigh / both;
    x += weight * (moves[0] - U); y += weight * (moves[1] - V); z += weight * (moves[2] - T);
    total += weight;
"""


@wp.func_native(
    summed(
        "fluid",
        "x y z total",
        GAUSS,
        EQ5,
        constants="const wp::vec3 moves = velocity.data[i];"
        "const float viscosity = particles.volume_and_viscosity.data[i][1];",
    )
)
def sum_eq5(
    particles: Particles, velocity: wp.array[wp.vec3], near: Neighbours, row: int, support: float
) -> wp.vec4: ...


@wp.func_native(
    summed(
        "wall",
        "drag h3*sticks h4*far h4*x h4*y h4*z",
        GAUSS,
        """
    drag += W * weigh;
    const floats share = __builtin_elementwise_max(d2 * (1.0f / h2), none + NEAREST_WALL);
    const floats inverse = 1.0f / share, left = W * ABOVE(1.0f - share);
    sticks += left * (1.0f - share) * (0.42132f + (0.15390f * inverse - 0.19697f) * inverse);
    const floats by = left * ((0.12740f - 0.01363f * inverse) * inverse - 0.08634f);
    far += by;
    x += by * X; y += by * Y; z += by * Z;
""",
        constants=f"""
const float NEAREST_WALL = {float(NEAREST_WALL)!r}f;
const float h3 = support * support * support, h4 = (support * support) * (support * support);
""",
    )
)
def sum_drag(particles: Particles, near: Neighbours, row: int, support: float) -> DragSums: ...


@wp.func_native(
    cpu_block(
        "const float support = 1.0f;",
        VECTORS,
        LISTED.replace("KIND", "fluid"),
        """
const auto* vector = particles.scaled_residual.data;
const wp::vec3 own = vector[i];
const _Float16* link = (const _Float16*)WINDOW(links, fluid);
floats x = {}, y = {}, z = {};
for (int s = 0; s < count; s += LANES) {
    const int* l = list + s;
    LOADS(U, V, T, unused, vector, 12, l)
    const _Float16* at = link + s / 16 * 48 + s % 16;
    const floats X = TAKEN(at), Y = TAKEN(at + 16), Z = TAKEN(at + 32);
    const floats along = (own[0] - U) * X + (own[1] - V) * Y + (own[2] - T) * Z;
    x += along * X; y += along * Y; z += along * Z;
}
return wp::vec3(SUM(x), SUM(y), SUM(z));
""",
    )
)
def sum_pulled(particles: Particles, near: Neighbours, row: int, links: wp.array2d[wp.vec3h]) -> wp.vec3: ...
