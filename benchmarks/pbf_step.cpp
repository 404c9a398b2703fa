// The contestant of speed_bars.py: simulate.fluid.solver's substep in a tank, by hand in C++ with OpenMP.
//
// Predict, sort by cell in memory, list neighbours, pressure iterations (PBF eqs 1 to 3), velocity, one explicit pass
// of viscosity. Lengths are in cm. Walls stop particles as planes, which costs less than a grid of distances.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>
#include <immintrin.h>
#include <omp.h>

#ifdef __AVX512F__
constexpr int LANES = 16;
#else
constexpr int LANES = 8;
#endif
typedef float Lanes __attribute__((vector_size(4 * LANES)));
typedef int Mask __attribute__((vector_size(4 * LANES)));
struct Point { float x, y, z, w; };
constexpr int SLOTS = 144;  // Of fluid and walls together

struct Gathered { Lanes x, y, z, w; };
// Four points at a time lie in each quarter of a register; two rounds of shuffles turn them into coordinates.
static inline Gathered gather(const Point* from, const int* list) {
    typedef float Four __attribute__((vector_size(16)));
    Lanes row[4];
    for (int r = 0; r < 4; ++r) {
        Four part[LANES / 4];
        for (int q = 0; q < LANES / 4; ++q) std::memcpy(&part[q], &from[list[r + 4 * q]], 16);
        std::memcpy(&row[r], part, sizeof row[r]);
    }
    Mask low, high, first, second;
    for (int l = 0; l < LANES; ++l) {
        const int base = l / 4 * 4, at = l % 4;
        low[l] = base + at / 2 + (at % 2) * LANES;
        high[l] = low[l] + 2;
        first[l] = base + at % 2 + (at / 2) * LANES;
        second[l] = first[l] + 2;
    }
    const Lanes ab = __builtin_shuffle(row[0], row[1], low), cd = __builtin_shuffle(row[2], row[3], low);
    const Lanes ab2 = __builtin_shuffle(row[0], row[1], high), cd2 = __builtin_shuffle(row[2], row[3], high);
    return {__builtin_shuffle(ab, cd, first), __builtin_shuffle(ab, cd, second), __builtin_shuffle(ab2, cd2, first),
            __builtin_shuffle(ab2, cd2, second)};
}
#ifdef __AVX512F__
static inline unsigned nearer(Lanes v, float than) { return _mm512_cmp_ps_mask(v, _mm512_set1_ps(than), _CMP_LT_OQ); }
#else
static inline unsigned nearer(Lanes v, float than) { return _mm256_movemask_ps((__m256)(v < than)); }
#endif
static inline float sum(Lanes v) { float s = 0; for (int l = 0; l < LANES; ++l) s += v[l]; return s; }
static inline Lanes above(Lanes v) { return v > 0.0f ? v : Lanes{}; }
static inline Lanes inverse_root(Lanes v) {
    Lanes r;
    for (int l = 0; l < LANES; ++l) r[l] = 1.0f / std::sqrt(v[l]);
    return r;
}

struct Tank {
    int n, walls, iterations;
    float h, step, damping, mass, density, slope, wall_density, wall_slope, relaxation, longest, thin, drag;
    float low[3], high[3], corner[3];
    int cells[3];
    // Particles first, then walls; w is the multiplier, or the share of a wall particle.
    std::vector<Point> point, before, velocity, change;
    std::vector<int> order, start, wall_start, list, fluid, all;
    std::vector<float> volume;
    std::vector<float> x, y, z;

    int cell(const Point& p) const {
        int at[3];
        const float q[3] = {p.x, p.y, p.z};
        for (int k = 0; k < 3; ++k) at[k] = std::clamp(int(std::floor((q[k] - corner[k]) / h)), 0, cells[k] - 1);
        return at[0] + cells[0] * (at[1] + cells[1] * at[2]);
    }
    void sort(int from, int count, std::vector<int>& begin, std::vector<int>& moved) {
        begin.assign(cells[0] * cells[1] * cells[2] + 1, 0);
        std::vector<int> key(count);
        for (int i = 0; i < count; ++i) ++begin[(key[i] = cell(point[from + i])) + 1];
        for (size_t k = 1; k < begin.size(); ++k) begin[k] += begin[k - 1];
        std::vector<int> at(begin.begin(), begin.end() - 1);
        moved.resize(count);
        for (int i = 0; i < count; ++i) moved[at[key[i]]++] = i;
        for (int& b : begin) b += from;
    }
    template <class T> void reorder(std::vector<T>& values, int from, const std::vector<int>& moved) {
        std::vector<T> old(values.begin() + from, values.begin() + from + moved.size());
        for (size_t k = 0; k < moved.size(); ++k) values[from + k] = old[moved[k]];
    }
    void hold(Point& p) const {
        p.x = std::clamp(p.x, low[0], high[0]); p.y = std::clamp(p.y, low[1], high[1]); p.z = std::max(p.z, low[2]);
    }
    void find(int i, const std::vector<int>& begin, int& found) {
        const Point here = point[i];
        const int c = cell(here), a = c % cells[0], b = c / cells[0] % cells[1], d = c / cells[0] / cells[1];
        int* row = &list[size_t(i) * SLOTS];
        const float reach2 = h * h;
        for (int dd = std::max(d - 1, 0); dd <= std::min(d + 1, cells[2] - 1); ++dd)
            for (int bb = std::max(b - 1, 0); bb <= std::min(b + 1, cells[1] - 1); ++bb) {
                const int line = cells[0] * (bb + cells[1] * dd);
                const int end = begin[line + std::min(a + 1, cells[0] - 1) + 1];
                for (int k = begin[line + std::max(a - 1, 0)]; k < end; k += LANES) {
                    Lanes dx, dy, dz;
                    std::memcpy(&dx, &x[k], sizeof dx); std::memcpy(&dy, &y[k], sizeof dy);
                    std::memcpy(&dz, &z[k], sizeof dz);
                    dx -= here.x; dy -= here.y; dz -= here.z;
                    unsigned bits = nearer(dx * dx + dy * dy + dz * dz, reach2);
                    if (end - k < LANES) bits &= (1u << (end - k)) - 1;
                    for (; bits; bits &= bits - 1) {
                        const int j = k + __builtin_ctz(bits);
                        if (j != i && found < SLOTS - LANES) row[found++] = j;
                    }
                }
            }
    }
    void pad(int i, int found) {
        for (int k = found; k < (found + LANES - 1) / LANES * LANES; ++k) list[size_t(i) * SLOTS + k] = n + walls;
    }
    void advance() {
        for (int i = 0; i < n; ++i) {
            before[i] = point[i];
            Point& v = velocity[i];
            const float left = 1 - step * damping;
            point[i].x += step * left * v.x; point[i].y += step * left * v.y;
            point[i].z += step * (left * v.z - 981 * step);
            hold(point[i]);
        }
        std::vector<int> moved;
        sort(0, n, start, moved);
        reorder(point, 0, moved); reorder(before, 0, moved); reorder(velocity, 0, moved); reorder(order, 0, moved);
        for (int i = 0; i < n + walls; ++i) { x[i] = point[i].x; y[i] = point[i].y; z[i] = point[i].z; }
        #pragma omp parallel for schedule(static)
        for (int i = 0; i < n; ++i) {
            int found = 0;
            find(i, start, found);
            pad(i, found);
            fluid[i] = found;
            found = (found + LANES - 1) / LANES * LANES;
            find(i, wall_start, found);
            pad(i, found);
            all[i] = found;
        }
        for (int turn = 0; turn < iterations; ++turn) {
            measure();
            correct();
            for (int i = 0; i < n; ++i) {
                point[i].x += change[i].x; point[i].y += change[i].y; point[i].z += change[i].z;
                hold(point[i]);
            }
        }
        for (int i = 0; i < n; ++i)
            velocity[i] = {(point[i].x - before[i].x) / step, (point[i].y - before[i].y) / step,
                           (point[i].z - before[i].z) / step, 0};
        slow();
    }
    struct Near { Lanes x, y, z, w, squared, spike; };
    Near near(const Point& here, const int* row) const {
        const Gathered g = gather(point.data(), row);
        Near p{here.x - g.x, here.y - g.y, here.z - g.z, g.w, {}, {}};
        p.squared = p.x * p.x + p.y * p.y + p.z * p.z + 1e-14f;
        const Lanes inverse = inverse_root(p.squared), left = above(h - p.squared * inverse);
        p.spike = left * left * inverse;
        return p;
    }
    void measure() {
        const float h2 = h * h;
        #pragma omp parallel for schedule(static)
        for (int i = 0; i < n; ++i) {
            const int* row = &list[size_t(i) * SLOTS];
            const int wall = (fluid[i] + LANES - 1) / LANES * LANES;
            Lanes total{}, gx{}, gy{}, gz{}, squares{}, wtotal{}, wx{}, wy{}, wz{};
            for (int k = 0; k < fluid[i]; k += LANES) {
                const Near p = near(point[i], row + k);
                const Lanes left = above(h2 - p.squared);
                total += left * left * left;
                gx += p.spike * p.x; gy += p.spike * p.y; gz += p.spike * p.z;
                squares += p.spike * p.spike * p.squared;
            }
            for (int k = wall; k < all[i]; k += LANES) {
                const Near p = near(point[i], row + k);
                const Lanes left = above(h2 - p.squared), spike = p.w * p.spike;
                wtotal += p.w * left * left * left;
                wx += spike * p.x; wy += spike * p.y; wz += spike * p.z;
            }
            const float rho = density * (h2 * h2 * h2 + sum(total)) + wall_density * sum(wtotal);
            const Point by{wall_slope * sum(wx), wall_slope * sum(wy), wall_slope * sum(wz), 0};
            const float sx = slope * sum(gx) + by.x, sy = slope * sum(gy) + by.y, sz = slope * sum(gz) + by.z;
            const float curvature = sx * sx + sy * sy + sz * sz + slope * slope * sum(squares) + relaxation;
            volume[i] = mass / rho;
            change[i] = {by.x, by.y, by.z, -std::max(rho - 1, 0.0f) / curvature};
        }
        for (int i = 0; i < n; ++i) point[i].w = change[i].w;
    }
    void correct() {
        #pragma omp parallel for schedule(static)
        for (int i = 0; i < n; ++i) {
            const int* row = &list[size_t(i) * SLOTS];
            const float own = point[i].w;
            Lanes cx{}, cy{}, cz{};
            for (int k = 0; k < fluid[i]; k += LANES) {
                const Near p = near(point[i], row + k);
                const Lanes pull = (own + p.w) * p.spike;
                cx += pull * p.x; cy += pull * p.y; cz += pull * p.z;
            }
            Point by = change[i];
            by.x = own * by.x + slope * sum(cx); by.y = own * by.y + slope * sum(cy); by.z = own * by.z + slope * sum(cz);
            const float length = std::sqrt(by.x * by.x + by.y * by.y + by.z * by.z);
            const float part = length > longest ? longest / length : 1;
            change[i] = {part * by.x, part * by.y, part * by.z, 0};
        }
    }
    void slow() {
        const float h2 = h * h;
        #pragma omp parallel for schedule(static)
        for (int i = 0; i < n; ++i) {
            const int* row = &list[size_t(i) * SLOTS];
            const Point here = point[i], v = velocity[i];
            float total = 0, px = 0, py = 0, pz = 0, held = 0;
            for (int k = 0; k < all[i]; ++k) {
                const int j = row[k];
                if (j == n + walls) continue;
                const float dx = here.x - point[j].x, dy = here.y - point[j].y, dz = here.z - point[j].z;
                const float squared = dx * dx + dy * dy + dz * dz;
                if (squared >= h2) continue;
                const float gauss = std::exp(-squared / h2);
                if (j >= n) { held += drag * point[j].w * gauss; continue; }
                const float weight = thin * volume[j] * gauss;
                total += weight;
                px += weight * velocity[j].x; py += weight * velocity[j].y; pz += weight * velocity[j].z;
            }
            total += held;
            change[i] = {v.x - (total * v.x - px), v.y - (total * v.y - py), v.z - (total * v.z - pz), 0};
        }
        std::swap(velocity, change);
    }
};

extern "C" {
// ``numbers``: h, step, damping, mass, density, slope, wall_density, wall_slope, relaxation, longest, thin, drag,
// the low and high corner of what particles reach, and the corner of the cells.
Tank* make_tank(int n, const float* place, const float* velocity, int walls, const float* wall, const float* numbers,
                const int* cells, int iterations, int threads) {
    omp_set_num_threads(threads);
    Tank* t = new Tank;
    t->n = n; t->walls = walls; t->iterations = iterations;
    std::memcpy(&t->h, numbers, 12 * sizeof(float));
    std::memcpy(t->low, numbers + 12, 9 * sizeof(float));
    std::memcpy(t->cells, cells, sizeof t->cells);
    const size_t whole = n + walls + 1;
    t->point.resize(whole); t->before.resize(n); t->velocity.resize(n + 1); t->change.resize(n + 1);
    t->order.resize(n); t->list.resize(size_t(n) * SLOTS); t->fluid.resize(n); t->all.resize(n); t->volume.resize(n);
    for (auto* axis : {&t->x, &t->y, &t->z}) axis->resize(whole + LANES);
    for (int i = 0; i < n; ++i) {
        t->point[i] = {place[3 * i], place[3 * i + 1], place[3 * i + 2], 0};
        t->velocity[i] = {velocity[3 * i], velocity[3 * i + 1], velocity[3 * i + 2], 0};
        t->order[i] = i;
    }
    for (int i = 0; i < walls; ++i) std::memcpy(&t->point[n + i], wall + 4 * i, sizeof(Point));
    t->point[n + walls] = {1e6f, 1e6f, 1e6f, 0};
    std::vector<int> moved;
    t->sort(n, walls, t->wall_start, moved);
    t->reorder(t->point, n, moved);
    return t;
}
void step_tank(Tank* t) { t->advance(); }
void read_tank(const Tank* t, float* place) {
    for (int i = 0; i < t->n; ++i) std::memcpy(place + 3 * t->order[i], &t->point[i], 3 * sizeof(float));
}
}
