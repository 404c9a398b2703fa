// A fluid in a square tank: prediction, sorting by cell, neighbours, pressure and one explicit pass of viscosity.
#pragma once
#include <algorithm>
#include <atomic>
#include <cmath>
#include <vector>
#include <omp.h>
#include "lanes.h"

constexpr int SLOTS = 144;  // Of fluid and walls together

static inline int whole(int count) { return (count + LANES - 1) / LANES * LANES; }

// In the order in which pbf_cpp.py gives them.
struct Numbers {
    float h, step, damping, mass, density, slope, wall_density, wall_slope, relaxation, longest, thin, drag;
    // Of paste alone, but for ``carried``.
    float carried, yield, thin_at_walls, per_viscosity, slowest_shear, along, nearest_wall, wall_moment, least_moment;
    float undone, undone_range, of_the_right, of_the_change, rounds;
    float low[3], high[3], corner[3];
};

struct Tank : Numbers {
    int n, walls, iterations, cells[3];
    int exactly = -1, solves = 0;  // Iterations of an implicit solve, -1 for as many as it needs; those of the last
    std::atomic<int> full{0};  // 1 once a list had no room for what is near
    // Particles first, then walls and a point that pads lists; w is the multiplier, or the share of a wall particle.
    std::vector<Point> point;
    // The same of their velocities and volumes, zero for walls; ``change`` is written to.
    std::vector<Point> velocity, change;
    // Where a substep began, and the way since, whose float32 is finer; the velocity before the last one; the walls'
    // slope and the multiplier.
    std::vector<Point> before, moved, earlier, pressed;
    std::vector<float> first_density, last_density;
    std::vector<int> order, start, wall_start;
    std::vector<int> list, fluid, all;  // All neighbours, row by row; how many slots of a row the fluid's take, and all
    std::vector<size_t> row_at;
    std::vector<float> x, y, z;

    virtual ~Tank() = default;
    virtual void prepare() {}
    virtual void before_pressure() {}
    virtual void slow_down() { pass_viscosity(); }

    void cell(const Point& p, int* at) const {
        const float q[3] = {p.x, p.y, p.z};
        for (int k = 0; k < 3; ++k) at[k] = std::clamp(int((q[k] - corner[k]) / h), 0, cells[k] - 1);
    }
    void sort(int from, int count, std::vector<int>& begin, std::vector<int>& number) {
        begin.assign(cells[0] * cells[1] * cells[2] + 1, 0);
        std::vector<int> key(count);
        for (int i = 0; i < count; ++i) {
            int at[3];
            cell(point[from + i], at);
            ++begin[(key[i] = at[0] + cells[0] * (at[1] + cells[1] * at[2])) + 1];
        }
        for (size_t k = 1; k < begin.size(); ++k) begin[k] += begin[k - 1];
        std::vector<int> at(begin.begin(), begin.end() - 1);
        number.resize(count);
        for (int i = 0; i < count; ++i) number[at[key[i]]++] = i;
        for (int& b : begin) b += from;
    }
    template <class T> void reorder(std::vector<T>& values, int from, const std::vector<int>& number) {
        std::vector<T> old(values.begin() + from, values.begin() + from + number.size());
        for (size_t k = 0; k < number.size(); ++k) values[from + k] = old[number[k]];
    }
    // Moves a coordinate as far as walls allow; returns how far.
    float move_along(int axis, float& at, float by) const {
        const float there = at + by, stopped = std::min(std::max(there, low[axis]), high[axis]);
        const float way = stopped == there ? by : stopped - at;
        at = stopped;
        return way;
    }
    void move(int i, const Point& by) {
        Point &p = point[i], &m = moved[i];
        m.x += move_along(0, p.x, by.x); m.y += move_along(1, p.y, by.y); m.z += move_along(2, p.z, by.z);
    }
    // Appends the points near ``here`` in the cells around, and pads the list to a whole register.
    int append_near(const Point& here, const int* at, const std::vector<int>& begin, int self, int* row, int count) {
        const float reach2 = h * h;
        const int a = std::max(at[0] - 1, 0), end_a = std::min(at[0] + 1, cells[0] - 1) + 1;
        for (int c = std::max(at[2] - 1, 0); c <= std::min(at[2] + 1, cells[2] - 1); ++c)
            for (int b = std::max(at[1] - 1, 0); b <= std::min(at[1] + 1, cells[1] - 1); ++b) {
                const int line = cells[0] * (b + cells[1] * c), end = begin[line + end_a];
                for (int k = begin[line + a]; k < end; k += LANES) {
                    const Lanes dx = load(&x[k]) - here.x, dy = load(&y[k]) - here.y, dz = load(&z[k]) - here.z;
                    unsigned near = nearer(dx * dx + dy * dy + dz * dz, reach2);
                    if (end - k < LANES) near &= (1u << (end - k)) - 1;
                    if (unsigned(self - k) < LANES) near &= ~(1u << (self - k));
                    if (count > SLOTS - LANES) { full = 1; return SLOTS; }
                    compress(row + count, k, near);
                    count += __builtin_popcount(near);
                }
            }
        for (int k = count; k < whole(count); ++k) row[k] = n + walls;
        return count;
    }
    void list_neighbours() {
        for (int i = 0; i < n + walls; ++i) { x[i] = point[i].x; y[i] = point[i].y; z[i] = point[i].z; }
        // A thread's lists lie one behind the other, which its loads of them then find early.
        #pragma omp parallel
        {
            const size_t thread = omp_get_thread_num(), threads = omp_get_num_threads();
            const int first = n * thread / threads, last = n * (thread + 1) / threads;
            size_t next = size_t(first) * SLOTS;
            for (int i = first; i < last; ++i) {
                int at[3], *row = &list[next];
                cell(point[i], at);
                row_at[i] = next;
                fluid[i] = append_near(point[i], at, start, i, row, 0);
                all[i] = whole(append_near(point[i], at, wall_start, -1, row, whole(fluid[i])));
                next += all[i];
            }
        }
    }
    void predict() {
        const float part = 1 - step * damping;
        for (int i = 0; i < n; ++i) {
            const Point& v = velocity[i];
            before[i] = point[i];
            moved[i] = {};
            move(i, {step * part * v.x, step * part * v.y, step * (part * v.z - 981 * step), 0});
            point[i].w = pressed[i].w *= carried;
        }
    }
    void advance() {
        predict();
        std::vector<int> number;
        sort(0, n, start, number);
        for (auto* values : {&point, &before, &moved, &velocity, &earlier, &pressed}) reorder(*values, 0, number);
        reorder(order, 0, number);
        list_neighbours();
        before_pressure();
        if (carried > 0) correct();
        for (int turn = 0; turn < iterations; ++turn) {
            measure();
            if (turn == 0) first_density = last_density;
            correct();
        }
        slow_down();
    }
    Point speed_of_way(int i) const {
        return {moved[i].x / step, moved[i].y / step, moved[i].z / step, velocity[i].w};
    }
    struct Near { Lanes x, y, z, w, squared; };
    Near near(const Point& here, const int* row) const {
        const Coordinates g = gather(point.data(), row);
        const Lanes dx = here.x - g.x, dy = here.y - g.y, dz = here.z - g.z;
        return {dx, dy, dz, g.w, dx * dx + dy * dy + dz * dz};
    }
    // (h - r)^2 / r
    Lanes spike(const Near& p) const {
        const Lanes squared = p.squared + 1e-14f, inverse = inverse_root(squared);
        const Lanes remaining = above(h - squared * inverse);
        return remaining * remaining * inverse;
    }
    void measure() {
        const float h2 = h * h;
        #pragma omp parallel for schedule(static)
        for (int i = 0; i < n; ++i) {
            const int* row = &list[row_at[i]];
            const Point here = point[i];
            Lanes total{}, gx{}, gy{}, gz{}, squares{}, wtotal{}, wx{}, wy{}, wz{};
            for (int k = 0; k < fluid[i]; k += LANES) {
                const Near p = near(here, row + k);
                const Lanes remaining = above(h2 - p.squared), weight = spike(p);
                total += remaining * remaining * remaining;
                gx += weight * p.x; gy += weight * p.y; gz += weight * p.z;
                squares += weight * weight * p.squared;
            }
            for (int k = whole(fluid[i]); k < all[i]; k += LANES) {
                const Near p = near(here, row + k);
                const Lanes remaining = above(h2 - p.squared), weight = p.w * spike(p);
                wtotal += p.w * remaining * remaining * remaining;
                wx += weight * p.x; wy += weight * p.y; wz += weight * p.z;
            }
            const float rho = density * (h2 * h2 * h2 + sum(total)) + wall_density * sum(wtotal);
            const Point by{wall_slope * sum(wx), wall_slope * sum(wy), wall_slope * sum(wz), 0};
            const float sx = slope * sum(gx) + by.x, sy = slope * sum(gy) + by.y, sz = slope * sum(gz) + by.z;
            const float curvature = sx * sx + sy * sy + sz * sz + slope * slope * sum(squares) + relaxation;
            const float old = pressed[i].w, now = std::min(old - (rho - 1) / curvature, 0.0f);
            last_density[i] = rho;
            velocity[i].w = mass / rho;
            change[i].w = now - old;
            pressed[i] = {by.x, by.y, by.z, carried > 0 ? now : 0};
        }
        for (int i = 0; i < n; ++i) point[i].w = change[i].w;
    }
    void correct() {
        #pragma omp parallel for schedule(static)
        for (int i = 0; i < n; ++i) {
            const int* row = &list[row_at[i]];
            const Point here = point[i], by = pressed[i];
            Lanes cx{}, cy{}, cz{};
            for (int k = 0; k < fluid[i]; k += LANES) {
                const Near p = near(here, row + k);
                const Lanes pull = (here.w + p.w) * spike(p);
                cx += pull * p.x; cy += pull * p.y; cz += pull * p.z;
            }
            const float sx = here.w * by.x + slope * sum(cx), sy = here.w * by.y + slope * sum(cy),
                        sz = here.w * by.z + slope * sum(cz), length = std::sqrt(sx * sx + sy * sy + sz * sz);
            const float part = length > longest ? longest / length : 1;
            change[i] = {part * sx, part * sy, part * sz, 0};
        }
        for (int i = 0; i < n; ++i) move(i, change[i]);
    }
    void pass_viscosity() {
        const float h2 = h * h, by_h2 = 1 / h2;
        for (int i = 0; i < n; ++i) velocity[i] = speed_of_way(i);
        #pragma omp parallel for schedule(static)
        for (int i = 0; i < n; ++i) {
            const int* row = &list[row_at[i]];
            const Point here = point[i], v = velocity[i];
            Lanes px{}, py{}, pz{}, walled{};
            for (int k = 0; k < fluid[i]; k += LANES) {
                const Near p = near(here, row + k);
                const Coordinates u = gather(velocity.data(), row + k);
                const Lanes weight = p.squared < h2 ? u.w * fade(p.squared * by_h2) : Lanes{};
                px += weight * (v.x - u.x); py += weight * (v.y - u.y); pz += weight * (v.z - u.z);
            }
            for (int k = whole(fluid[i]); k < all[i]; k += LANES) {
                const Near p = near(here, row + k);
                walled += p.squared < h2 ? p.w * fade(p.squared * by_h2) : Lanes{};
            }
            const float wall = drag * sum(walled);
            change[i] = {v.x - thin * sum(px) - wall * v.x, v.y - thin * sum(py) - wall * v.y,
                         v.z - thin * sum(pz) - wall * v.z, v.w};
        }
        std::swap(velocity, change);
    }
};

