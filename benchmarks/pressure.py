"""What a column of 16 mm is compressed to at rest, with local and with two-level pressure, straight and curved.

    python benchmarks/pressure.py [--only straight|bent|trial|runs] [--radius-mm 0.4]

The fluid drags nowhere and has no viscosity: what moves at the end is what the pressure cannot calm. Densities are
those of all particles, corners and surface included. ``--only runs`` pours the paper's trial with both instead, which
takes some three minutes; the radius is for that.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from benchmarks.stiffening import WAYS, Bed, Sample, bins_mm, pour, trace
from benchmarks.table import Row, one_of, run_benchmark
from digitise.settings import CrackShape
from digitise.solid.build_solid import build_solid
from sealtwin.core.records import Floats, Outline, Solid
from simulate.settings import TWO_LEVEL, Solver, particle_volume
from simulate.setup.signed_distance import CLEARANCE
from tests.fluids import FRAME_S, engine_with, positions_mm
from tests.shapes import arc_slot, straight_slot

RADIUS_MM = 0.4
COLUMN_MM, DEPTH_MM = 16.0, 24.0
SUBSTEPS = 4
SHAKEN = 0.05
"""Of a block's layers, over their spacing."""
THICK_U, THICK_S = 30.0, 0.4
"""The trial's sealant, let slip along the walls: the levels of a crack of 80 mm even out."""
REST_S = 0.6
WATCHED = 30
"""Frames at the end."""
DENSE_PERCENT = 2.0
CALM_CM_S = 1.0
EXTRA_COST = 1.15
"""Over as many local iterations."""
TURNS = 301  # Frames of each of two columns whose time is compared
BEND_MM = 12.0
"""Radius of the curved slot: four times its width."""
SCATTER_MM = 0.2
"""Between two runs of the trial whose start differs by nothing that counts (prototype)."""


def straight() -> tuple[Solid, Outline]:
    return _upright(straight_slot(6.0, 3.1))


def bent() -> tuple[Solid, Outline]:
    return _upright(arc_slot(BEND_MM, 50.0, 3.1))


def trial() -> tuple[Solid, Outline]:
    """The paper's crack as its photo was traced."""
    return _upright(trace().outline)


CRACKS: dict[str, Callable[[], tuple[Solid, Outline]]] = {"straight": straight, "bent": bent, "trial": trial}


def _upright(outline: Outline) -> tuple[Solid, Outline]:
    return build_solid(outline, CrackShape(depth_mm=DEPTH_MM, tilt="vertical", wall_angle_deg=0.0)), outline


@dataclass(frozen=True)
class Column:
    """At rest."""

    compression_percent: Floats
    """Of each particle, (n,)."""
    speed_cm_s: float
    """Mean over particles and the last frames."""
    leaked: int
    engine: Any
    """The fluid at rest, for further frames."""

    @property
    def p99_percent(self) -> float:
        return float(np.quantile(self.compression_percent, 0.99))

    @property
    def median_percent(self) -> float:
        return float(np.median(self.compression_percent))


def settle(crack: tuple[Solid, Outline], seed: int = 0, **solver: Any) -> Column:
    """Let a column go as a thick fluid, which finds its level, and then wait without any viscosity."""
    solver = {"substeps": SUBSTEPS, **solver}
    factor = Solver.model_validate(solver).scheme.volume_factor
    thick = engine_with(_block_mm(crack, seed, factor), crack, weights=(THICK_U, 0.0), **solver)
    for _ in range(SUBSTEPS * round(THICK_S / FRAME_S)):
        thick.step()
    engine = engine_with(positions_mm(thick), crack, **solver)
    speeds = []
    for _ in range(round(REST_S / FRAME_S)):
        for _ in range(SUBSTEPS):
            engine.step()
        speeds.append(float(np.linalg.norm(engine.state.velocity.numpy(), axis=1).mean()))
    engine.faults.look(engine.rows)
    assert engine.faults.found() == {}
    leaked = int((engine.barrier.exact_mm(positions_mm(engine)) < 0).sum())
    # Where the last substep left the particles, and not before its last correction.
    engine.find_neighbours()
    engine.pressure.measure_density(engine.rows)
    compression = 100 * (engine.state.density.numpy().astype(float) - 1)
    return Column(compression, float(np.mean(speeds[-WATCHED:])), leaked, engine)


def _block_mm(crack: tuple[Solid, Outline], seed: int, factor: float) -> Floats:
    """Particles that fill the crack to the column's height, (n, 3): even layers between the walls, a little disturbed.

    Each fills ``factor`` of its volume by Eq. 6. Exactly even rows stack up on top of each other.
    """
    solid, outline = crack
    volume_mm3, kept_mm = factor * particle_volume(RADIUS_MM), CLEARANCE * RADIUS_MM
    side = float(np.cbrt(volume_mm3))
    along, across = round(outline.length_mm / side), round(outline.mean_width_mm / side)
    up = round(solid.cavity_volume_mm3 * COLUMN_MM / DEPTH_MM / volume_mm3 / along / across)
    s_mm = np.linspace(kept_mm, outline.length_mm - kept_mm, along)
    left, right = (
        np.column_stack([np.interp(s_mm, outline.s_mm, column) for column in wall.T])
        for wall in (outline.left_wall_mm, outline.right_wall_mm)
    )
    edge = kept_mm / np.linalg.norm(left - right, axis=1)[:, None]
    share = edge + (1 - 2 * edge) * np.linspace(0, 1, across)
    place = right[:, None] + share[..., None] * (left - right)[:, None]
    z_mm = np.linspace(kept_mm, COLUMN_MM - kept_mm, up) - DEPTH_MM
    block = np.concatenate([np.broadcast_to(place, (up, along, across, 2)), np.empty((up, along, across, 1))], axis=-1)
    block[..., 2] = z_mm[:, None, None]
    return block.reshape(-1, 3) + np.random.default_rng(seed).uniform(-SHAKEN, SHAKEN, (block.size // 3, 3)) * side


def main(only: Annotated[str | None, one_of([*CRACKS, "runs"])] = None, radius_mm: float = RADIUS_MM) -> list[Row]:
    if only == "runs":
        sample = trace()
        return [row for way in ("freezing", "yield") for row in _poured(sample, way, radius_mm)]
    return [row for name in ([only] if only else CRACKS) for row in _at_rest(name)]


def _at_rest(name: str) -> list[Row]:
    crack = CRACKS[name]()
    ways: tuple[dict[str, Any], ...] = ({}, {"iterations": TWO_LEVEL.iterations}, {"pressure": "two-level"})
    usual, local, two = (settle(crack, **way) for way in ways)
    many = SUBSTEPS * TWO_LEVEL.iterations
    rows = []
    for way, column in (("local, 16 iterations a frame", usual), (f"local, {many}", local)):
        rows.append(Row(f"{name}, {way}: 99th percentile", column.p99_percent, "%"))
        rows.append(Row(f"{name}, {way}: median", column.median_percent, "%"))
    return [
        *rows,
        Row(f"{name}, two-level, {many}: 99th percentile", two.p99_percent, "%", 0, DENSE_PERCENT),
        Row(f"{name}, two-level, {many}: median", two.median_percent, "%", -0.3, 0.3),
        Row(f"{name}, two-level: speed left", two.speed_cm_s, "cm/s", 0, CALM_CM_S),
        Row(f"{name}, two-level: in the walls", two.leaked, "", 0, 0),
        Row(f"{name}, two-level: cost over local, {many}", _cost(two, local), "", 0, EXTRA_COST),
    ]


def _cost(one: Column, other: Column) -> float:
    """Processor time of a frame over another's: the median of the ratios of frames that take turns."""
    ratios = []
    for _ in range(TURNS):
        took_s = []
        for column in (one, other):
            began = time.process_time()
            for _ in range(SUBSTEPS):
                column.engine.step()
            took_s.append(time.process_time() - began)
        ratios.append(took_s[0] / took_s[1])
    return float(np.median(ratios))


def _poured(sample: Sample, way: str, radius_mm: float) -> list[Row]:
    local, two = (pour(sample, WAYS[way], radius_mm, pressure=pressure) for pressure in ("local", "two-level"))
    return [
        Row(f"trial, {way}, local: mean error", local.errors_mm[0], "mm"),
        Row(f"trial, {way}, two-level: mean error", two.errors_mm[0], "mm", 0, local.errors_mm[0] + SCATTER_MM),
        Row(f"trial, {way}, two-level: levels apart from local", _apart_mm(local, two), "mm"),
        Row(f"trial, {way}, local: volume kept", local.volume_ratio, "", 0.95, 1.05),
        Row(f"trial, {way}, two-level: volume kept", two.volume_ratio, "", 0.95, 1.05),
        Row(f"trial, {way}, two-level: escaped", two.escaped, "", 0, 0),
        Row(f"trial, {way}, two-level: CPU over local's", two.cpu_s / local.cpu_s, ""),
    ]


def _apart_mm(one: Bed, other: Bed) -> float:
    """Mean over bins of 10 mm, when the nozzle stops."""
    return float(np.abs(bins_mm(one.levels[0]) - bins_mm(other.levels[0])).mean())


if __name__ == "__main__":
    run_benchmark(main)
