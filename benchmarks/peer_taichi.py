# pyright: basic, reportMissingImports=false
"""Position-based fluids (Macklin and Mueller 2013) in taichi, on the block of ``benchmarks.peers``, which starts this.

Walls are one layer of particles half a spacing beyond their place, with the volumes of Akinci et al. (2012); viscosity
is Mueller et al.'s (2003), in as many explicit passes as are stable. Millimetres and seconds.
"""

import json
import sys
import time
from pathlib import Path

import numpy as np
import taichi as ti
from scipy.spatial.distance import cdist

case = json.load(sys.stdin)
step_s, spacing, gravity = case["step_s"], 2 * case["radius_mm"], case["gravity_mm_s2"]
ti.init(arch=ti.cpu, cpu_max_num_threads=1, log_level=ti.ERROR)
H = 2 * spacing
EPSILON = 1.5 / H**2
PI = float(np.pi)
ROOM, IN_LIST, ITERATIONS = 64, 128, 5
length, width, height = case["pit_mm"]
LOW = (-2 * H, -2 * H - width / 2, -2 * H)
xs, ys, zs = (np.arange(-spacing / 2, end + spacing, spacing) for end in (length, width, height))
box = np.stack(np.meshgrid(xs, ys - width / 2, zs, indexing="ij"), axis=-1)
inner = np.zeros(box.shape[:3], dtype=bool)
inner[1:-1, 1:-1, 1:] = True
walls = box[~inner]
place = np.vstack([case["place_mm"], walls])
fluid, count = len(case["place_mm"]), len(place)
cells = tuple(int(end / H) + 5 for end in (length, width, height))

x, before, change, v, push = (ti.Vector.field(3, ti.f32, count) for _ in range(5))
volume, multiplier = ti.field(ti.f32, count), ti.field(ti.f32, count)
number, listed = ti.field(ti.i32, count), ti.field(ti.i32, (count, IN_LIST))
in_cell, cell_list = ti.field(ti.i32, cells), ti.field(ti.i32, (*cells, ROOM))


@ti.func
def poly6(r):
    return 315 / (64 * PI * H**9) * (H * H - r * r) ** 3


@ti.func
def spiky(d, r):
    return -45 / (PI * H**6) * (H - r) ** 2 / ti.max(r, 1e-6) * d


@ti.func
def cell_of(p):
    return ti.math.clamp(ti.cast((p - ti.Vector(LOW)) / H, ti.i32), 1, ti.Vector(cells) - 2)


@ti.kernel
def find_neighbours():
    in_cell.fill(0)
    for i in x:
        cell = cell_of(x[i])
        slot = ti.atomic_add(in_cell[cell], 1)
        cell_list[cell, ti.min(slot, ROOM - 1)] = i
    for i in range(fluid):
        cell, entries = cell_of(x[i]), 0
        for near in ti.static(ti.grouped(ti.ndrange((-1, 2), (-1, 2), (-1, 2)))):
            for slot in range(ti.min(in_cell[cell + near], ROOM)):
                j = cell_list[cell + near, slot]
                if j != i and entries < IN_LIST and (x[i] - x[j]).norm() < 1.05 * H:
                    listed[i, entries] = j
                    entries += 1
        number[i] = entries


@ti.kernel
def predict():
    for i in range(fluid):
        before[i] = x[i]
        v[i].z -= gravity * step_s
        x[i] += v[i] * step_s


@ti.kernel
def correct():
    for i in range(fluid):
        total, own, squares = volume[i] * poly6(0.0), ti.Vector([0.0, 0.0, 0.0]), 0.0
        for slot in range(number[i]):
            j = listed[i, slot]
            d = x[i] - x[j]
            r = d.norm()
            if r < H:
                total += volume[j] * poly6(r)
                gradient = volume[j] * spiky(d, r)
                own += gradient
                squares += gradient.dot(gradient)
        multiplier[i] = -ti.max(total - 1, 0.0) / (squares + own.dot(own) + EPSILON)
    for i in range(fluid):
        moved = ti.Vector([0.0, 0.0, 0.0])
        for slot in range(number[i]):
            j = listed[i, slot]
            d = x[i] - x[j]
            r = d.norm()
            if r < H:
                moved += (multiplier[i] + multiplier[j]) * volume[j] * spiky(d, r)
        change[i] = moved
    for i in range(fluid):
        x[i] += change[i]
        v[i] = (x[i] - before[i]) / step_s


@ti.kernel
def drag(weight: float, wall: float):
    for i in range(fluid):
        total = ti.Vector([0.0, 0.0, 0.0])
        for slot in range(number[i]):
            j = listed[i, slot]
            r = (x[i] - x[j]).norm()
            if r < H:
                share = wall if j >= fluid else 1.0
                total += share * volume[j] * (H - r) * (v[j] - v[i])
        push[i] = weight * 45 / (PI * H**6) * total
    for i in range(fluid):
        v[i] += push[i]


def advance():
    predict()
    find_neighbours()
    for _ in range(ITERATIONS):
        correct()
    for _ in range(passes):
        drag(case["viscosity_mm2_s"] * step_s / passes, case["wall_share"])


# The largest eigenvalue of a pass is 15 nu dt / h^2 in the fluid, and more at walls that drag more.
passes = int(np.ceil(15 * case["viscosity_mm2_s"] * step_s / H**2 * max(1.0, case["wall_share"] / 2) / 0.9))
x.from_numpy(place.astype(np.float32))
apart = np.minimum(cdist(walls, walls), H)
weights = 315 / (64 * PI * H**9) * (H**2 - apart**2) ** 3
volume.from_numpy(np.append(np.full(fluid, spacing**3), 1 / weights.sum(axis=1)).astype(np.float32))
advance()
x.from_numpy(place.astype(np.float32))
v.fill(0.0)
set_up_s, spent_s, moments, steps = time.process_time(), 0.0, [], 0
for end_s in case["times_s"]:
    began = time.process_time()
    while steps * step_s < end_s - step_s / 2:
        advance()
        steps += 1
    spent_s += time.process_time() - began
    moments.append(x.to_numpy()[:fluid].tolist())
Path(sys.argv[1]).write_text(json.dumps({"place_mm": moments, "set_up_s": set_up_s, "time_s": spent_s}))
