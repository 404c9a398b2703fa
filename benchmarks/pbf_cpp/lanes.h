// Registers of floats for pbf_step.cpp: sixteen at a time with AVX-512, eight with AVX2.
#pragma once
#include <immintrin.h>

struct alignas(16) Point { float x, y, z, w; };
typedef unsigned short Half;

#ifdef __AVX512F__
constexpr int LANES = 16;
typedef __m512 Lanes;
static inline Lanes quarters(const Point* from, const int* list) {
    const auto load = [&](int k) { return _mm_load_ps(&from[list[k]].x); };
    Lanes rows = _mm512_castps128_ps512(load(0));
    rows = _mm512_insertf32x4(rows, load(4), 1);
    rows = _mm512_insertf32x4(rows, load(8), 2);
    return _mm512_insertf32x4(rows, load(12), 3);
}
static inline Lanes low(Lanes a, Lanes b) { return _mm512_unpacklo_ps(a, b); }
static inline Lanes high(Lanes a, Lanes b) { return _mm512_unpackhi_ps(a, b); }
static inline Lanes first(Lanes a, Lanes b) { return _mm512_shuffle_ps(a, b, 0x44); }
static inline Lanes second(Lanes a, Lanes b) { return _mm512_shuffle_ps(a, b, 0xEE); }
static inline Lanes load(const float* from) { return _mm512_loadu_ps(from); }
static inline Lanes rough_inverse_root(Lanes v) { return _mm512_rsqrt14_ps(v); }
static inline Lanes larger(Lanes a, Lanes b) { return _mm512_max_ps(a, b); }
static inline float sum(Lanes v) { return _mm512_reduce_add_ps(v); }
static inline void store_halves(Half* to, Lanes v) {
    _mm256_storeu_si256((__m256i*)to, _mm512_cvtps_ph(v, _MM_FROUND_TO_NEAREST_INT));
}
static inline Lanes load_halves(const Half* from) { return _mm512_cvtph_ps(_mm256_loadu_si256((const __m256i*)from)); }
static inline unsigned nearer(Lanes v, float than) { return _mm512_cmp_ps_mask(v, _mm512_set1_ps(than), _CMP_LT_OQ); }
// Writes the numbers of the lanes of a mask one behind the other, and anything behind them.
static inline void compress(int* to, int number, unsigned mask) {
    const __m512i lane = _mm512_set_epi32(15, 14, 13, 12, 11, 10, 9, 8, 7, 6, 5, 4, 3, 2, 1, 0);
    const __m512i numbers = _mm512_add_epi32(lane, _mm512_set1_epi32(number));
    // In a register, and stored whole: some processors take 20 ns to compress straight into memory.
    _mm512_storeu_si512(to, _mm512_maskz_compress_epi32(mask, numbers));
}
#else
constexpr int LANES = 8;
typedef __m256 Lanes;
static inline Lanes quarters(const Point* from, const int* list) {
    const auto load = [&](int k) { return _mm_load_ps(&from[list[k]].x); };
    return _mm256_insertf128_ps(_mm256_castps128_ps256(load(0)), load(4), 1);
}
static inline Lanes low(Lanes a, Lanes b) { return _mm256_unpacklo_ps(a, b); }
static inline Lanes high(Lanes a, Lanes b) { return _mm256_unpackhi_ps(a, b); }
static inline Lanes first(Lanes a, Lanes b) { return _mm256_shuffle_ps(a, b, 0x44); }
static inline Lanes second(Lanes a, Lanes b) { return _mm256_shuffle_ps(a, b, 0xEE); }
static inline Lanes load(const float* from) { return _mm256_loadu_ps(from); }
static inline Lanes rough_inverse_root(Lanes v) { return _mm256_rsqrt_ps(v); }
static inline Lanes larger(Lanes a, Lanes b) { return _mm256_max_ps(a, b); }
static inline float sum(Lanes v) {
    __m128 four = _mm_add_ps(_mm256_castps256_ps128(v), _mm256_extractf128_ps(v, 1));
    four = _mm_add_ps(four, _mm_movehl_ps(four, four));
    return _mm_cvtss_f32(_mm_add_ss(four, _mm_movehdup_ps(four)));
}
static inline void store_halves(Half* to, Lanes v) {
    _mm_storeu_si128((__m128i*)to, _mm256_cvtps_ph(v, _MM_FROUND_TO_NEAREST_INT));
}
static inline Lanes load_halves(const Half* from) { return _mm256_cvtph_ps(_mm_loadu_si128((const __m128i*)from)); }
static inline unsigned nearer(Lanes v, float than) { return _mm256_movemask_ps(v < than); }
static inline void compress(int* to, int number, unsigned mask) {
    for (; mask; mask &= mask - 1) *to++ = number + __builtin_ctz(mask);
}
#endif

struct Coordinates { Lanes x, y, z, w; };
// Four points at a time lie in each quarter of a register; two rounds of shuffles turn them into coordinates.
static inline Coordinates gather(const Point* from, const int* list) {
    const Lanes a = quarters(from, list), b = quarters(from, list + 1), c = quarters(from, list + 2),
                d = quarters(from, list + 3);
    const Lanes ab = low(a, b), cd = low(c, d), ab2 = high(a, b), cd2 = high(c, d);
    return {first(ab, cd), second(ab, cd), first(ab2, cd2), second(ab2, cd2)};
}
static inline Lanes above(Lanes v) { return larger(v, Lanes{}); }
// To float32's rounding: a step of Newton's from the processor's 12 bits or more.
static inline Lanes inverse_root(Lanes v) {
    const Lanes rough = rough_inverse_root(v);
    return rough * (1.5f - 0.5f * v * rough * rough);
}
// exp(-u) for 0 <= u <= 1, by the squares of exp(-u/4): to 1e-7.
static inline Lanes fade(Lanes u) {
    const Lanes t = u * -0.25f;
    Lanes e = 1.0f + t * (1.0f + t * (1 / 2.0f + t * (1 / 6.0f + t * (1 / 24.0f + t * (1 / 120.0f + t / 720.0f)))));
    e *= e;
    return e * e;
}
