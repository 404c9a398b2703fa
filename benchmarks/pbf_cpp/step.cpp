// The contestant of pbf_step.py: simulate.fluid.solver's substep, by hand in C++ with OpenMP.
//
// Predict, sort by cell in memory, list neighbours, pressure iterations (PBF eqs 1 to 3), velocity; then one explicit
// pass of viscosity, or the implicit solve of a paste. Lengths are in cm. Walls stop particles as planes, which costs
// less than a grid of distances.
#include <cstring>
#include <numeric>
#include "paste.h"

extern "C" {
// ``numbers`` as in Numbers; ``wall`` has the position and the share of each wall particle.
Tank* make_tank(int n, int walls, const Point* wall, const float* numbers, const int* cells, int iterations, int paste,
                int threads) {
    omp_set_num_threads(threads);
    Tank* t = paste ? new Paste : new Tank;
    std::memcpy(static_cast<Numbers*>(t), numbers, sizeof(Numbers));
    std::memcpy(t->cells, cells, sizeof t->cells);
    t->n = n; t->walls = walls; t->iterations = iterations;
    const int points = n + walls + 1;
    for (auto* values : {&t->point, &t->velocity, &t->change}) values->resize(points);
    for (auto* values : {&t->before, &t->moved, &t->earlier, &t->pressed}) values->resize(n);
    std::copy(wall, wall + walls, t->point.begin() + n);
    t->point[n + walls] = {1e6f, 1e6f, 1e6f, 0};
    for (auto* each : {&t->first_density, &t->last_density}) each->resize(n);
    for (auto* each : {&t->order, &t->fluid, &t->all}) each->resize(n);
    t->list.resize(size_t(n) * SLOTS);
    t->row_at.resize(n);
    for (auto* axis : {&t->x, &t->y, &t->z}) axis->resize(points + LANES);
    std::vector<int> number;
    t->sort(n, walls, t->wall_start, number);
    t->reorder(t->point, n, number);
    t->prepare();
    return t;
}
// ``place``, ``velocity`` (w is the volume), ``earlier`` and ``pressed`` have n points each.
void set_tank(Tank* t, const Point* place, const Point* velocity, const Point* earlier, const Point* pressed) {
    std::copy(place, place + t->n, t->point.begin()); std::copy(velocity, velocity + t->n, t->velocity.begin());
    std::copy(earlier, earlier + t->n, t->earlier.begin()); std::copy(pressed, pressed + t->n, t->pressed.begin());
    std::iota(t->order.begin(), t->order.end(), 0);
}
// ``exactly`` is the number of iterations of an implicit solve; -1 takes as many as it needs. Returns that number, or
// -1 if a list of neighbours had too little room.
int step_tank(Tank* t, int exactly) {
    t->exactly = exactly;
    t->advance();
    return t->full ? -1 : t->solves;
}
void read_tank(const Tank* t, float* place) {
    for (int i = 0; i < t->n; ++i) std::memcpy(place + 3 * t->order[i], &t->point[i], 3 * sizeof(float));
}
void free_tank(Tank* t) { delete t; }
}
