"""The baseline of ``pbf_step.py``: ``simulate.fluid.solver``'s substep in numba, parallel and with fast math.

The same equations in the same order on the same data: predict, lists, pressure iterations, walls, one explicit pass of
viscosity. Coordinates lie in arrays of their own, which numba runs fastest.
"""

import math
from dataclasses import dataclass

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from simulate.fluid.pressure import LONGEST_CORRECTION
from simulate.fluid.solver import FluidSolver

Array = NDArray[np.float32]
SLOTS, WALL_SLOTS = 128, 96


@dataclass
class NumbaStep:
    """The state of ``engine`` at one time, copied; all of its particles move."""

    x: Array
    y: Array
    z: Array
    velocity: Array
    engine: FluidSolver

    @classmethod
    def copy_of(cls, engine: FluidSolver) -> "NumbaStep":
        x, y, z = (np.ascontiguousarray(axis) for axis in engine.state.position.numpy()[:, :3].T.copy())
        return cls(x, y, z, engine.state.velocity.numpy().copy(), engine)

    def __post_init__(self) -> None:
        engine, count = self.engine, len(self.x)
        self._wall = np.ascontiguousarray(engine.walls.position_and_share.numpy().T)
        cells = engine.fluid_cells.cells
        self._corner = np.array([*cells.corner], dtype=np.float32)
        self._size = np.float32(cells.size)
        self._cells = np.array([*cells.count], dtype=np.int32)
        self._wall_start, self._wall_number = _sort(*self._wall[:3], self._corner, self._size, self._cells)
        grid = engine.barrier.grid
        self._grid = (
            np.array([*grid.corner], dtype=np.float32),
            np.float32(grid.spacing),
            np.array([*grid.blocks], dtype=np.int32),
            grid.row.numpy(),
            grid.centre.numpy(),
            grid.nodes.numpy(),
            np.array([*grid.face], dtype=np.float32),
        )
        self._listed, self._count = np.zeros((count, SLOTS), np.int32), np.zeros(count, np.int32)
        self._walls, self._wall_count = np.zeros((count, WALL_SLOTS), np.int32), np.zeros(count, np.int32)
        self._multiplier, self.density = np.zeros(count, np.float32), np.ones(count, np.float32)
        self._wall_slope = np.zeros((count, 3), np.float32)
        self._correction = np.zeros((count, 3), np.float32)
        self._start = np.zeros((count, 3), np.float32)

    def step(self) -> None:
        engine = self.engine
        s, step_s, clearance = engine.pressure.smoothing, engine.step_s, np.float32(engine.barrier.clearance)
        place = (self.x, self.y, self.z)
        damping = engine.settings.damping_per_s
        _predict(*place, self.velocity, self._start, step_s, damping, clearance, *self._grid)
        start, number = _sort(*place, self._corner, self._size, self._cells)
        reach = np.float32(s.support)
        box = (self._corner, self._size, self._cells)
        _list(*place, *place, start, number, *box, reach, True, self._listed, self._count)
        walls = self._wall[:3]
        _list(*place, *walls, self._wall_start, self._wall_number, *box, reach, False, self._walls, self._wall_count)
        numbers = tuple(
            np.float32(value) for value in (s.support, s.density, s.slope, s.wall_density, s.wall_slope, s.relaxation)
        )
        lists = (self._listed, self._count, self._walls, self._wall_count)
        for _ in range(engine.scheme.iterations):
            _measure(*place, self._wall, *lists, *numbers, self.density, self._multiplier, self._wall_slope)
            longest = np.float32(LONGEST_CORRECTION * s.support)
            _correct(
                *place,
                self._listed,
                self._count,
                numbers[0],
                numbers[2],
                longest,
                self._multiplier,
                self._wall_slope,
                self._correction,
            )
            _shift(*place, self._correction, clearance, *self._grid)
        _update(*place, self._start, self.velocity, step_s)
        thin, drag = explicit_weights(engine)
        mass = np.float32(s.mass)
        self.velocity = _viscosity(
            *place, self._wall, *lists, numbers[0], mass, thin, drag, self.density, self.velocity
        )


def explicit_weights(engine: FluidSolver) -> tuple[np.float32, np.float32]:
    """U and D of Eq. 5 in a substep, over h sqrt(pi), of the first run's fluid when fresh."""
    paste = engine.paste
    return np.float32(paste.by_age.numpy()[0, 0, 0]), np.float32(paste.drag.numpy()[0])


@njit(cache=True, fastmath=True)
def _sort(x, y, z, corner, size, cells):
    total = cells[0] * cells[1] * cells[2]
    key = np.empty(len(x), np.int32)
    start = np.zeros(total + 1, np.int32)
    for i in range(len(x)):
        a = min(max(int((x[i] - corner[0]) / size), 0), cells[0] - 1)
        b = min(max(int((y[i] - corner[1]) / size), 0), cells[1] - 1)
        c = min(max(int((z[i] - corner[2]) / size), 0), cells[2] - 1)
        key[i] = a + cells[0] * (b + cells[1] * c)
        start[key[i] + 1] += 1
    for k in range(total):
        start[k + 1] += start[k]
    number = np.empty(len(x), np.int32)
    at = start[:-1].copy()
    for i in range(len(x)):
        number[at[key[i]]] = i
        at[key[i]] += 1
    return start, number


@njit(parallel=True, cache=True, fastmath=True)
def _list(x, y, z, px, py, pz, start, number, corner, size, cells, reach, same, listed, count):
    for i in prange(len(x)):
        a = min(max(int((x[i] - corner[0]) / size), 0), cells[0] - 1)
        b = min(max(int((y[i] - corner[1]) / size), 0), cells[1] - 1)
        c = min(max(int((z[i] - corner[2]) / size), 0), cells[2] - 1)
        neighbours = 0
        for cc in range(max(c - 1, 0), min(c + 2, cells[2])):
            for bb in range(max(b - 1, 0), min(b + 2, cells[1])):
                line = cells[0] * (bb + cells[1] * cc)
                for k in range(start[line + max(a - 1, 0)], start[line + min(a + 1, cells[0] - 1) + 1]):
                    j = number[k]
                    dx, dy, dz = px[j] - x[i], py[j] - y[i], pz[j] - z[i]
                    if dx * dx + dy * dy + dz * dz < reach * reach and not (same and j == i):
                        if neighbours < listed.shape[1]:
                            listed[i, neighbours] = j
                        neighbours += 1
        count[i] = min(neighbours, listed.shape[1])


@njit(parallel=True, cache=True, fastmath=True)
def _measure(
    x,
    y,
    z,
    wall,
    listed,
    count,
    walls,
    wall_count,
    h,
    density,
    slope,
    wall_density,
    wall_slope,
    eps,
    rho,
    lam,
    by,
):
    h2 = h * h
    for i in prange(len(x)):
        total, gx, gy, gz, squares = h2 * h2 * h2, np.float32(0), np.float32(0), np.float32(0), np.float32(0)
        for s in range(count[i]):
            j = listed[i, s]
            dx, dy, dz = x[i] - x[j], y[i] - y[j], z[i] - z[j]
            d2 = dx * dx + dy * dy + dz * dz
            left = max(h2 - d2, np.float32(0))
            total += left * left * left
            d = math.sqrt(max(d2, np.float32(1e-30)))
            short = max(h - d, np.float32(0))
            spike = short * short / d
            gx += spike * dx
            gy += spike * dy
            gz += spike * dz
            squares += spike * spike * d2
        wtotal, wx, wy, wz = np.float32(0), np.float32(0), np.float32(0), np.float32(0)
        for s in range(wall_count[i]):
            j = walls[i, s]
            dx, dy, dz = x[i] - wall[0, j], y[i] - wall[1, j], z[i] - wall[2, j]
            d2 = dx * dx + dy * dy + dz * dz
            left = max(h2 - d2, np.float32(0))
            wtotal += wall[3, j] * left * left * left
            d = math.sqrt(max(d2, np.float32(1e-30)))
            short = max(h - d, np.float32(0))
            spike = wall[3, j] * short * short / d
            wx += spike * dx
            wy += spike * dy
            wz += spike * dz
        by[i, 0], by[i, 1], by[i, 2] = wall_slope * wx, wall_slope * wy, wall_slope * wz
        ox, oy, oz = slope * gx + by[i, 0], slope * gy + by[i, 1], slope * gz + by[i, 2]
        rho[i] = density * total + wall_density * wtotal
        above = max(rho[i] - np.float32(1), np.float32(0))
        lam[i] = -above / (ox * ox + oy * oy + oz * oz + slope * slope * squares + eps)


@njit(parallel=True, cache=True, fastmath=True)
def _correct(x, y, z, listed, count, h, slope, longest, lam, by, out):
    for i in prange(len(x)):
        sx, sy, sz = np.float32(0), np.float32(0), np.float32(0)
        for s in range(count[i]):
            j = listed[i, s]
            dx, dy, dz = x[i] - x[j], y[i] - y[j], z[i] - z[j]
            d = math.sqrt(max(dx * dx + dy * dy + dz * dz, np.float32(1e-30)))
            short = max(h - d, np.float32(0))
            pull = (lam[i] + lam[j]) * short * short / d
            sx += pull * dx
            sy += pull * dy
            sz += pull * dz
        sx = lam[i] * by[i, 0] + slope * sx
        sy = lam[i] * by[i, 1] + slope * sy
        sz = lam[i] * by[i, 2] + slope * sz
        length = math.sqrt(sx * sx + sy * sy + sz * sz)
        part = longest / length if length > longest else np.float32(1)
        out[i, 0], out[i, 1], out[i, 2] = part * sx, part * sy, part * sz


@njit(inline="always", fastmath=True)
def _distance(px, py, pz, corner, spacing, blocks, row, centre, nodes, face):
    u, v, w = (px - corner[0]) / spacing, (py - corner[1]) / spacing, (pz - corner[2]) / spacing
    a, b, c = math.floor(u / 4), math.floor(v / 4), math.floor(w / 4)
    none = np.float32(0)
    if a < 0 or b < 0 or c < 0 or a >= blocks[0] or b >= blocks[1] or c >= blocks[2]:
        if face[0] < px < face[2] and face[1] < py < face[3]:
            return none, none, np.float32(1), pz
        return none, none, none, np.float32(1e3)
    block = (a * blocks[1] + b) * blocks[2] + c
    if row[block] == -2:
        return none, none, np.float32(1), pz
    if row[block] == -1:
        middle = centre[block]
        left = abs(middle) - np.float32(0.8661) * 4 * spacing
        return none, none, none, (left if middle > 0 else -left)
    i, j, k = min(int(u) - 4 * a, 3), min(int(v) - 4 * b, 3), min(int(w) - 4 * c, 3)
    p, q, r = u - (4 * a + i), v - (4 * b + j), w - (4 * c + k)
    n = row[block] * 125 + (i * 5 + j) * 5 + k
    d000, d001, d010, d011 = nodes[n], nodes[n + 1], nodes[n + 5], nodes[n + 6]
    d100, d101, d110, d111 = nodes[n + 25], nodes[n + 26], nodes[n + 30], nodes[n + 31]
    d00, d01 = d000 + r * (d001 - d000), d010 + r * (d011 - d010)
    d10, d11 = d100 + r * (d101 - d100), d110 + r * (d111 - d110)
    d0, d1 = d00 + q * (d01 - d00), d10 + q * (d11 - d10)
    z0 = (d001 - d000) + q * ((d011 - d010) - (d001 - d000))
    z1 = (d101 - d100) + q * ((d111 - d110) - (d101 - d100))
    gx, gy, gz = d1 - d0, (d01 - d00) + p * ((d11 - d10) - (d01 - d00)), z0 + p * (z1 - z0)
    length = math.sqrt(gx * gx + gy * gy + gz * gz)
    if length > 0:
        gx, gy, gz = gx / length, gy / length, gz / length
    return gx, gy, gz, d0 + p * (d1 - d0)


@njit(inline="always", fastmath=True)
def _move(px, py, pz, sx, sy, sz, clearance, corner, spacing, blocks, row, centre, nodes, face):
    length = math.sqrt(sx * sx + sy * sy + sz * sz)
    if length == 0:
        return px, py, pz
    pieces = min(int(length / (np.float32(0.45) * clearance)) + 1, 256)
    part = max(np.float32(pieces), length / (np.float32(0.45) * clearance))
    for _ in range(pieces):
        qx, qy, qz = px + sx / part, py + sy / part, pz + sz / part
        gx, gy, gz, there = _distance(qx, qy, qz, corner, spacing, blocks, row, centre, nodes, face)
        for _turn in range(8):
            if there >= np.float32(0.999) * clearance or there <= 0:
                break
            out = min(clearance - there, np.float32(0.9) * there)
            qx, qy, qz = qx + out * gx, qy + out * gy, qz + out * gz
            gx, gy, gz, there = _distance(qx, qy, qz, corner, spacing, blocks, row, centre, nodes, face)
        if there < np.float32(0.5) * clearance:
            break
        px, py, pz = qx, qy, qz
    return px, py, pz


@njit(parallel=True, cache=True, fastmath=True)
def _predict(x, y, z, v, start, step_s, damping, clearance, corner, spacing, blocks, row, centre, nodes, face):
    for i in prange(len(x)):
        start[i, 0], start[i, 1], start[i, 2] = x[i], y[i], z[i]
        slow = np.float32(1 - step_s * damping)
        sx, sy = np.float32(step_s) * slow * v[i, 0], np.float32(step_s) * slow * v[i, 1]
        sz = np.float32(step_s) * (slow * v[i, 2] - np.float32(981 * step_s))
        x[i], y[i], z[i] = _move(
            x[i], y[i], z[i], sx, sy, sz, clearance, corner, spacing, blocks, row, centre, nodes, face
        )


@njit(parallel=True, cache=True, fastmath=True)
def _shift(x, y, z, step, clearance, corner, spacing, blocks, row, centre, nodes, face):
    for i in prange(len(x)):
        sx, sy, sz = step[i, 0], step[i, 1], step[i, 2]
        x[i], y[i], z[i] = _move(
            x[i], y[i], z[i], sx, sy, sz, clearance, corner, spacing, blocks, row, centre, nodes, face
        )


@njit(parallel=True, cache=True, fastmath=True)
def _update(x, y, z, start, v, step_s):
    for i in prange(len(x)):
        v[i, 0] = (x[i] - start[i, 0]) / np.float32(step_s)
        v[i, 1] = (y[i] - start[i, 1]) / np.float32(step_s)
        v[i, 2] = (z[i] - start[i, 2]) / np.float32(step_s)


@njit(parallel=True, cache=True, fastmath=True)
def _viscosity(x, y, z, wall, listed, count, walls, wall_count, h, mass, thin, drag, rho, v):
    """One pass; as many as are stable are one here."""
    after = np.empty_like(v)
    h2 = h * h
    for i in prange(len(x)):
        total, px, py, pz = np.float32(0), np.float32(0), np.float32(0), np.float32(0)
        for s in range(count[i]):
            j = listed[i, s]
            dx, dy, dz = x[i] - x[j], y[i] - y[j], z[i] - z[j]
            d2 = dx * dx + dy * dy + dz * dz
            w = thin * mass / rho[j] * math.exp(-d2 / h2) if d2 < h2 else np.float32(0)
            total += w
            px += w * v[j, 0]
            py += w * v[j, 1]
            pz += w * v[j, 2]
        for s in range(wall_count[i]):
            j = walls[i, s]
            dx, dy, dz = x[i] - wall[0, j], y[i] - wall[1, j], z[i] - wall[2, j]
            d2 = dx * dx + dy * dy + dz * dz
            total += drag * wall[3, j] * math.exp(-d2 / h2) if d2 < h2 else np.float32(0)
        after[i, 0] = v[i, 0] - (total * v[i, 0] - px)
        after[i, 1] = v[i, 1] - (total * v[i, 1] - py)
        after[i, 2] = v[i, 2] - (total * v[i, 2] - pz)
    return after
