// What a run of paste adds to a tank: viscosity by the shear, the implicit solve, and the move by its velocities.
#pragma once
#include "tank.h"

constexpr int ITERATIONS_AT_MOST = 500;
struct Symmetric { float xx, yy, zz, xy, yz, zx; };

static inline float dot(const Point& a, const Point& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static inline Point times(const Symmetric& m, const Point& v) {
    return {m.xx * v.x + m.xy * v.y + m.zx * v.z, m.xy * v.x + m.yy * v.y + m.yz * v.z,
            m.zx * v.x + m.yz * v.y + m.zz * v.z, v.w};
}
static inline Symmetric inverse_of(const Symmetric& m) {
    const float xx = m.yy * m.zz - m.yz * m.yz, xy = m.yz * m.zx - m.xy * m.zz, zx = m.xy * m.yz - m.yy * m.zx;
    const float by = 1 / (m.xx * xx + m.xy * xy + m.zx * zx);
    return {by * xx, by * (m.xx * m.zz - m.zx * m.zx), by * (m.xx * m.yy - m.xy * m.xy),
            by * xy, by * (m.xy * m.zx - m.xx * m.yz), by * zx};
}

struct Paste : Tank {
    // The guess, and later the scaled residual; w is the viscosity. The w of the others is not used.
    std::vector<Point> guess, residual, product, direction, pull;
    std::vector<Symmetric> inverse;
    std::vector<float> at_walls, wall_drag;
    std::vector<Half> links;  // Of each register of a list, x, y and z one behind the other

    void prepare() override {
        for (auto* values : {&residual, &product, &direction, &pull}) values->resize(n);
        guess.resize(point.size());
        inverse.resize(n); at_walls.resize(n); wall_drag.resize(n);
        links.resize(size_t(n) * SLOTS * 3);
    }
    // D's sum over walls; drag that holds a fluid of viscosity 1; the same times the distance, and times the offsets.
    struct Drag { float plain, sticks, far, x, y, z; };
    Drag drag_of_walls(int i) const {
        const float h2 = h * h, by_h2 = 1 / h2;
        const Point here = point[i];
        const int* row = &list[row_at[i]];
        Lanes plain{}, sticks{}, far{}, x{}, y{}, z{};
        for (int k = whole(fluid[i]); k < all[i]; k += LANES) {
            const Near p = near(here, row + k);
            plain += p.squared < h2 ? p.w * fade(p.squared * by_h2) : Lanes{};
            const Lanes share = larger(p.squared * by_h2, Lanes{} + nearest_wall), by = 1 / share;
            const Lanes remaining = p.w * above(1 - share);
            sticks += remaining * (1 - share) * (0.42132f + (0.15390f * by - 0.19697f) * by);
            const Lanes weight = remaining * ((0.12740f - 0.01363f * by) * by - 0.08634f);
            far += weight;
            x += weight * p.x; y += weight * p.y; z += weight * p.z;
        }
        const float h3 = h2 * h, h4 = h2 * h2;
        return {sum(plain), h3 * sum(sticks), h4 * sum(far), h4 * sum(x), h4 * sum(y), h4 * sum(z)};
    }
    float slowed(float shear) const { return std::sqrt(shear * shear + slowest_shear * slowest_shear); }
    void before_pressure() override {
        const float by_h2 = 1 / (h * h);
        #pragma omp parallel for schedule(static)
        for (int i = 0; i < n; ++i) {
            const int* row = &list[row_at[i]];
            const Point here = point[i], v = velocity[i];
            Lanes xx{}, yy{}, zz{}, xy{}, yz{}, zx{}, ux{}, uy{}, uz{}, vx{}, vy{}, vz{}, tx{}, ty{}, tz{};
            for (int k = 0; k < fluid[i]; k += LANES) {
                const Near p = near(here, row + k);
                const Coordinates g = gather(velocity.data(), row + k);
                const Lanes part = above(1 - p.squared * by_h2), weight = part * part * part;
                const Lanes u = v.x - g.x, w = v.y - g.y, t = v.z - g.z;
                const Lanes wx = weight * p.x, wy = weight * p.y, wz = weight * p.z;
                xx += wx * p.x; yy += wy * p.y; zz += wz * p.z; xy += wx * p.y; yz += wy * p.z; zx += wz * p.x;
                ux += u * wx; uy += u * wy; uz += u * wz;
                vx += w * wx; vy += w * wy; vz += w * wz;
                tx += t * wx; ty += t * wy; tz += t * wz;
            }
            const Drag walls = drag_of_walls(i);
            const float length = std::sqrt(walls.x * walls.x + walls.y * walls.y + walls.z * walls.z);
            const float by = length > 0 ? 1 / length : 0, a = by * walls.x, b = by * walls.y, c = by * walls.z;
            // A wall counts as the volume that it cuts off, in particles.
            const float moment = wall_moment * h / v.w, far = moment * walls.far, near_walls = moment * walls.sticks;
            const float least = least_moment * h * h * h * h * h / v.w;
            const Symmetric fit{sum(xx) + far * a * a + least, sum(yy) + far * b * b + least,
                                sum(zz) + far * c * c + least, sum(xy) + far * a * b, sum(yz) + far * b * c,
                                sum(zx) + far * c * a};
            const Symmetric unfit = inverse_of(fit);
            const Point gx = times(unfit, {sum(ux) + near_walls * v.x * a, sum(uy) + near_walls * v.x * b,
                                           sum(uz) + near_walls * v.x * c, 0});
            const Point gy = times(unfit, {sum(vx) + near_walls * v.y * a, sum(vy) + near_walls * v.y * b,
                                           sum(vz) + near_walls * v.y * c, 0});
            const Point gz = times(unfit, {sum(tx) + near_walls * v.z * a, sum(ty) + near_walls * v.z * b,
                                           sum(tz) + near_walls * v.z * c, 0});
            const float ab = gx.y + gy.x, bc = gy.z + gz.y, ca = gz.x + gx.z;
            const float shear = std::sqrt(2 * (gx.x * gx.x + gy.y * gy.y + gz.z * gz.z) + ab * ab + bc * bc + ca * ca);
            const float at_wall = std::sqrt(dot(v, v)) * walls.sticks / std::max(walls.far, 1e-20f);
            guess[i].w = thin + per_viscosity * yield / slowed(shear);
            at_walls[i] = thin_at_walls + per_viscosity * yield / slowed(at_wall);
        }
    }
    void slow_down() override {
        for (int i = 0; i < n; ++i) {
            const Point last = velocity[i], old = earlier[i];
            guess[i] = {2 * last.x - old.x, 2 * last.y - old.y, 2 * last.z - old.z, guess[i].w};
            earlier[i] = last;
            velocity[i] = speed_of_way(i);
        }
        weigh_pairs();
        solve();
        // What pressure undid of much compression outlasts the viscosity.
        for (int i = 0; i < n; ++i) {
            const Point v = velocity[i], way = moved[i];
            const float stays = std::clamp((first_density[i] - last_density[i] - undone) / undone_range, 0.0f, 1.0f);
            const auto by = [&](float way, float v) { return step * v + stays * (way - step * v); };
            point[i] = before[i];
            move(i, {by(way.x, v.x), by(way.y, v.y), by(way.z, v.z), 0});
        }
    }
    // The matrix as links of pairs, each particle's own block inverted, and both residuals.
    void weigh_pairs() {
        const float by_h2 = 1 / (h * h);
        #pragma omp parallel for schedule(static)
        for (int i = 0; i < n; ++i) {
            const int* row = &list[row_at[i]];
            Half* out = &links[row_at[i] * 3];
            const Point here = point[i], v = velocity[i], g = guess[i];
            Lanes xx{}, yy{}, zz{}, xy{}, yz{}, zx{}, vx{}, vy{}, vz{}, gx{}, gy{}, gz{};
            for (int k = 0; k < fluid[i]; k += LANES, out += 3 * LANES) {
                const Near p = near(here, row + k);
                const Coordinates u = gather(velocity.data(), row + k), e = gather(guess.data(), row + k);
                const Lanes part = above(1 - p.squared * by_h2);
                const Lanes weight = 0.25f * along * (v.w + u.w) * (g.w + e.w) * part * part * part;
                const Lanes root = weight * inverse_root(larger(weight * p.squared, Lanes{} + 1e-30f));
                const Lanes x = p.x * root, y = p.y * root, z = p.z * root;
                store_halves(out, x); store_halves(out + LANES, y); store_halves(out + 2 * LANES, z);
                xx += x * x; yy += y * y; zz += z * z; xy += x * y; yz += y * z; zx += z * x;
                const Lanes still = (v.x - u.x) * x + (v.y - u.y) * y + (v.z - u.z) * z;
                vx += still * x; vy += still * y; vz += still * z;
                const Lanes moved = (g.x - e.x) * x + (g.y - e.y) * y + (g.z - e.z) * z;
                gx += moved * x; gy += moved * y; gz += moved * z;
            }
            const Drag walls = drag_of_walls(i);
            const float d = wall_drag[i] = drag * walls.plain + at_walls[i] * walls.sticks, own = 1 + d;
            inverse[i] = inverse_of({sum(xx) + own, sum(yy) + own, sum(zz) + own, sum(xy), sum(yz), sum(zx)});
            residual[i] = {-sum(vx) - d * v.x, -sum(vy) - d * v.y, -sum(vz) - d * v.z, 0};
            product[i] = {v.x - own * g.x - sum(gx), v.y - own * g.y - sum(gy), v.z - own * g.z - sum(gz), 0};
        }
    }
    // (I + A) times the scaled residual; returns the curvature along it.
    double apply_matrix() {
        double curvature = 0;
        #pragma omp parallel for schedule(static) reduction(+ : curvature)
        for (int i = 0; i < n; ++i) {
            const int* row = &list[row_at[i]];
            const Half* link = &links[row_at[i] * 3];
            const Point own = guess[i];
            Lanes sx{}, sy{}, sz{};
            for (int k = 0; k < fluid[i]; k += LANES, link += 3 * LANES) {
                const Coordinates g = gather(guess.data(), row + k);
                const Lanes x = load_halves(link), y = load_halves(link + LANES), z = load_halves(link + 2 * LANES);
                const Lanes pulls = (own.x - g.x) * x + (own.y - g.y) * y + (own.z - g.z) * z;
                sx += pulls * x; sy += pulls * y; sz += pulls * z;
            }
            const float d = 1 + wall_drag[i];
            product[i] = {d * own.x + sum(sx), d * own.y + sum(sy), d * own.z + sum(sz), 0};
            curvature += dot(own, product[i]);
        }
        return curvature;
    }
    void scale(int i) {
        const float viscosity = guess[i].w;
        guess[i] = times(inverse[i], residual[i]);
        guess[i].w = viscosity;
    }
    // Conjugate gradients as Chronopoulos and Gear arrange them, from the velocity or from the guess.
    void solve() {
        double right = 0, still = 0, moved = 0, holds = 0;
        for (int i = 0; i < n; ++i) {
            right += dot(velocity[i], times(inverse[i], velocity[i]));
            still += dot(residual[i], times(inverse[i], residual[i]));
            moved += dot(product[i], times(inverse[i], product[i]));
            holds += 1 + wall_drag[i];
        }
        const double goal = std::min(of_the_right * of_the_right * right, of_the_change * of_the_change * still);
        double error = std::min(still, moved), turn = 0, length = 0;
        for (int i = 0; i < n; ++i) {
            if (moved < still) {
                residual[i] = product[i];
                velocity[i] = {guess[i].x, guess[i].y, guess[i].z, velocity[i].w};
            }
            direction[i] = pull[i] = {};
            scale(i);
        }
        const auto more = [&] { return exactly < 0 ? error > goal && solves < ITERATIONS_AT_MOST : solves < exactly; };
        for (solves = 0; more(); ++solves) {
            const double whole_curvature = apply_matrix();
            double curvature = whole_curvature;
            if (turn > 0) curvature -= turn * error / length;
            // Where rounding takes what remains of the difference, the search begins anew.
            if (curvature < rounds * whole_curvature) { turn = 0; curvature = whole_curvature; }
            length = error / curvature;
            const float by = float(length), share = float(turn);
            double next = 0;
            #pragma omp parallel for schedule(static) reduction(+ : next)
            for (int i = 0; i < n; ++i) {
                Point &d = direction[i], &p = pull[i], &r = residual[i], &v = velocity[i];
                const Point &s = guess[i], &q = product[i];
                d = {s.x + share * d.x, s.y + share * d.y, s.z + share * d.z, 0};
                p = {q.x + share * p.x, q.y + share * p.y, q.z + share * p.z, 0};
                v = {v.x + by * d.x, v.y + by * d.y, v.z + by * d.z, v.w};
                r = {r.x - by * p.x, r.y - by * p.y, r.z - by * p.z, 0};
                scale(i);
                next += dot(r, guess[i]);
            }
            turn = next / error;
            error = next;
        }
        double x = 0, y = 0, z = 0;
        for (int i = 0; i < n; ++i) { x += residual[i].x; y += residual[i].y; z += residual[i].z; }
        for (int i = 0; i < n; ++i) {
            Point& v = velocity[i];
            v = {v.x + float(x / holds), v.y + float(y / holds), v.z + float(z / holds), v.w};
        }
    }
};
