"""A small trial with everything a report needs, without a fluid run."""

from pathlib import Path
from typing import Any

import cv2
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, FigureBase, SubFigure
from matplotlib.lines import Line2D

from digitise.settings import CrackShape, NozzlePath
from digitise.solid.build_solid import build_solid
from digitise.trajectory import plan_trajectory
from sealtwin.core.arc_length import arc_length_at
from sealtwin.core.facts import doubt
from sealtwin.core.records import DataKind, Floats, Outline, Profile, Run, Solid
from sealtwin.core.run_figures import FastFill, RunHealth
from tests.support.shapes import straight_slot
from validate.compare import compare
from validate.comparison import Baseline
from validate.metrics.curve_distances import level_difference
from validate.metrics.verdict import POOL
from validate.metrics.volumes import balance_profile
from validate.result import Evidence, SeedRuns
from validate.settings import Gate

FAST_FILL = FastFill(
    dispensed_mm3=600.0,
    in_crack_mm3=590.0,
    above_face_mm3=10.0,
    in_flight_mm3=0.0,
    held_slope=0.1,
    mound_mm=0.5,
    fill=0.5,
    above_mm=0.0,
    unfit=(),
)
"""What marks a run as the fast model's."""
STATIONS_MM = np.arange(0.0, 41.0, 5.0)
RADIUS_MM = 0.5


def make_evidence(
    folder: Path,
    *,
    name: str = "trial",
    note: str = "",
    readings_data: DataKind | None = "measured",
    photo_data: DataKind = "measured",
    source: str = "caliper.csv",
    gate: Gate | None = None,
    error_mm: float = 0.5,
    **changes: Any,
) -> Evidence:
    """A 40 mm slot, filled along a slope; ``error_mm`` is what the simulation stands too high."""
    outline = straight_slot(length_mm=40.0)
    solid = build_solid(outline, CrackShape(depth_mm=10.0, tilt="vertical"))
    trajectory = plan_trajectory(outline, NozzlePath(volume_ml="cavity", trim_mm=5.0), solid.cavity_volume_mm3)
    s_mm = np.linspace(0, outline.length_mm, 201)
    profile = Profile(s_mm, slope(s_mm) + error_mm, source="simulation")
    run = changes.get("run", make_run(outline, solid))
    readings = comparison = None
    if readings_data is not None:
        # In another order at each station, as of repeats that are no passes.
        off_mm = np.random.default_rng(0).permuted(np.tile([-0.1, 0.0, 0.1], (len(STATIONS_MM), 1)), axis=1)
        repeats_mm = slope(STATIONS_MM)[:, None] + off_mm
        readings = Profile(STATIONS_MM, slope(STATIONS_MM), repeats_mm, readings_data, source)
        pool = balance_profile(run.dispensed_volume_mm3, outline, solid)
        comparison = compare(
            profile,
            readings,
            outline,
            solid,
            role="held-out",
            photo_data=photo_data,
            gate=gate,
            escaped_particles=run.escaped_particles,
            unseen=[Baseline(POOL, 0, level_difference(pool, readings).mean_error)],
        )
    overlay = folder / "overlay.png"
    straight = folder / "straight.png"
    for picture in (overlay, straight):
        cv2.imwrite(str(picture), np.full((60, 120, 3), 128, np.uint8))
    content: dict[str, Any] = {
        "name": name,
        "note": note,
        "outline": outline,
        "solid": solid,
        "trajectory": trajectory,
        "run": run,
        "profile": profile,
        "readings": readings,
        "comparison": comparison,
        "volume_ratio": 0.987,
        "overlay_path": overlay,
        "straight_path": straight,
        "photo_data": photo_data,
        "provenance": {"sealtwin": "0.1.0", "seed": "0"},
        "commands": ("sealtwin run trial.toml",),
    }
    return Evidence(**content | changes)


LOST = doubt("fluid.volume", "1 of 3 runs: lost.")
SEEDS = SeedRuns(seeds=(0, 1, 2), mean_level_mm=-3.5, scatter_mm=0.33, band_95_mm=0.75, warnings=(LOST,))


def slope(s_mm):
    return -8.0 + 0.2 * s_mm


def make_run(outline: Outline, solid: Solid) -> Run:
    """Spheres on a lattice below the slope; the last one is over the edge."""
    low, high = outline.outline_mm.min(axis=0) + RADIUS_MM, outline.outline_mm.max(axis=0) - RADIUS_MM
    axes = [np.arange(a, b + 1e-9, 2 * RADIUS_MM) for a, b in zip(low, high, strict=True)]
    axes.append(np.arange(-solid.depth_mm + RADIUS_MM, 1.0, 2 * RADIUS_MM))
    point = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    point = point[point[:, 2] < slope(arc_length_at(point[:, :2], outline.centreline_mm))]
    count = len(point)
    return Run(
        position_mm=point,
        velocity_mm_s=np.zeros((count, 3)),
        age_s=np.linspace(10, 0, count),
        spilled=np.arange(count) == count - 1,
        radius_mm=RADIUS_MM,
        particle_volume_mm3=1.0,
        escaped_particles=0,
        device="cpu",
        settings={
            "fluid": {"U": 30.0, "density_kg_m3": 1690.0, "freeze_after_s": 2.58},
            "solver": {"settle_s": 0.0},
            "nozzle": {"diameter_mm": 2.4},
            "seed": 0,
        },
        health=RunHealth(density_error_mean=0.02, viscosity_m2_s=3.26e-5, frame_s=0.00714, bond=2.2),
    )


def axes_of(figure: FigureBase) -> list[Axes]:
    assert isinstance(figure, Figure | SubFigure)
    return list(figure.axes)


def heights(line: Line2D) -> Floats:
    return np.array(line.get_ydata(), dtype=float)
