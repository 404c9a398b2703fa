"""Cavities from EMULATED weighed fills: how often the truth lies within the stated intervals, and how wide these are.

    python -m benchmarks.weighing [--fills N] [--first SEED]

Each fill is that of a random crack, whose walls flare or funnel. The truth is the liquid between the slices of its
solid, with the meniscus that it has there; scale, levels, density, wetting, the photo's width and the gauge's depth are
in error by draws of the size that the fit is told. Nothing was tuned on these draws.
"""

import time
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from typer import Option

from benchmarks.outlines import Kind, odd_outline
from benchmarks.table import Row, run_benchmark
from digitise.settings import CrackShape, Tilt
from digitise.solid.footprint import lay_out
from digitise.solid.sections import Slicer
from digitise.solid.wedges import wall_shifts_mm
from digitise.weighing.fill import WeighedFill
from digitise.weighing.fit_cavity import DENSITY_SD, MENISCUS_SD, NORMAL_95, weigh
from digitise.weighing.moved_walls import widened
from sealtwin.core.records import Floats, Outline
from sealtwin.core.regime import capillary_length_mm, mean_level_mm
from sealtwin.core.solid_figures import WeighedCavity

KINDS: tuple[Kind, ...] = ("plain", "tapered", "pinched")
WIDTH_SD_MM, DEPTH_SD_MM = 0.1, 0.5
MOST_CLOSED = 0.6  # Largest share of its width that a crack loses on the way down
MOST_OPEN_DEG = 8.0
SLICES = 60
STEPS = (4, 9)  # Least and largest number of steps of a fill that is poured in steps


@dataclass(frozen=True)
class Emulated:
    """Width, angle, depth and volume of a cavity, and what a fill tells of them with half of each interval."""

    truth: Floats
    found: Floats
    half: Floats
    named: bool  # A contradiction was named, although there is none
    time_s: float


def main(
    count: Annotated[int, Option("--fills", help="how many of each form: in steps, and to the brim alone")] = 200,
    first: Annotated[int, Option(help="first seed")] = 0,
    tilt: Annotated[Tilt | None, Option(help="of all walls; left out, they flare or funnel")] = None,
) -> list[Row]:
    rows: list[Row] = []
    forms: tuple[tuple[str, Literal["steps", "brim"]], ...] = (("in steps", "steps"), ("to the brim", "brim"))
    for form, poured in forms:
        seeds = range(first, first + count)
        rows += judged(form, [emulate(seed, poured, tilt) for seed in seeds])
    return rows


def judged(form: str, fills: list[Emulated]) -> list[Row]:
    truth, estimate, half = (np.array([getattr(one, name) for one in fills]) for name in ("truth", "found", "half"))
    names, units = ("width", "angle", "depth", "volume"), ("mm", "deg", "mm", "ml")
    rows: list[Row] = []
    for index, (name, unit) in enumerate(zip(names, units, strict=True)):
        share = float((np.abs(estimate - truth) <= half)[:, index].mean())
        rows.append(Row(f"{form}: {name} within its 95 % interval", 100 * share, "%", 92, 100, "95"))
        rows.append(Row(f"{form}: half of that interval, median", float(np.median(half[:, index])), unit))
    rows.append(Row(f"{form}: a contradiction named", 100 * float(np.mean([one.named for one in fills])), "%", 0, 8))
    rows.append(Row(f"{form}: processor time, median", float(np.median([one.time_s for one in fills])), "s", 0, 2))
    return rows


def emulate(seed: int, poured: Literal["steps", "brim"], only: Tilt | None = None) -> Emulated:
    rng = np.random.default_rng([seed, poured == "brim"])
    outline = odd_outline(KINDS[seed % len(KINDS)], seed, length_mm=float(rng.uniform(60, 200)), points=600)
    tilt: Tilt = "flare" if rng.random() < 0.5 else "funnel"
    tilt = only or tilt
    real, depth_mm = widened(outline, float(rng.normal(0, WIDTH_SD_MM))), float(rng.uniform(8, 30))
    closing_deg = np.degrees(np.arctan(MOST_CLOSED * real.mean_width_mm / depth_mm / 2))
    steepest_deg = MOST_OPEN_DEG if tilt == "undercut" else min(MOST_OPEN_DEG, closing_deg)
    truth = CrackShape(depth_mm=depth_mm, tilt=tilt, wall_angle_deg=float(rng.uniform(0.3, 1) * steepest_deg))
    fill, volume_mm3 = poured_into(rng, real, truth, poured)
    gauged = CrackShape(depth_mm=depth_mm + float(rng.normal(0, DEPTH_SD_MM)), tilt=tilt)
    began = time.process_time()
    _, _, weighed = weigh(outline, gauged, fill, WIDTH_SD_MM, DEPTH_SD_MM)
    time_s = time.process_time() - began
    wanted = [real.mean_width_mm, truth.wall_angles_deg[0], depth_mm, volume_mm3 / 1e3]
    estimate, half = _stated(weighed)
    return Emulated(np.array(wanted), estimate, half, bool(weighed.findings), time_s)


def _stated(weighed: WeighedCavity) -> tuple[Floats, Floats]:
    sd = np.sqrt((np.array(weighed.steps) ** 2).sum(axis=1))
    low_mm3, high_mm3 = weighed.volume_95_mm3
    estimate = [weighed.width_mm, weighed.wall_angle_deg, weighed.depth_mm, (low_mm3 + high_mm3) / 2e3]
    return np.array(estimate), np.array([*(NORMAL_95 * sd), (high_mm3 - low_mm3) / 2e3])


def poured_into(
    rng: np.random.Generator, outline: Outline, shape: CrackShape, poured: Literal["steps", "brim"]
) -> tuple[WeighedFill, float]:
    """Return a fill as a lab would weigh it, and the volume of the cavity."""
    slicer = Slicer(lay_out(outline, shape, max(wall_shifts_mm(shape))), shape)
    depths_mm = np.linspace(0, shape.deepest_mm, SLICES)
    areas_mm2 = np.array([slicer.cavity(depth_mm).area() for depth_mm in depths_mm])
    slabs_mm3 = np.diff(depths_mm) * (areas_mm2[1:] + areas_mm2[:-1]) / 2
    under_mm3 = slabs_mm3.sum() - np.concatenate([[0.0], np.cumsum(slabs_mm3)])
    fill = WeighedFill(mass_g=(1.0,), level_mm=(0.0,))
    lowest_mm = np.zeros(1)
    if poured == "steps":
        steps = int(rng.integers(STEPS[0], STEPS[1] + 1))
        lowest_mm = np.append(-shape.deepest_mm * np.linspace(0.85, 0.15, steps - 1), 0.0)
    capillary_mm = capillary_length_mm(fill.surface_tension_n_m, fill.density_kg_m3)
    wetting = 1 + rng.normal(0, MENISCUS_SD)
    lift_mm = mean_level_mm(lowest_mm, outline.mean_width_mm, capillary_mm) - lowest_mm
    volume_mm3 = np.interp(-(lowest_mm + wetting * lift_mm), depths_mm, under_mm3)
    mass_g = volume_mm3 * fill.density_kg_m3 / 1e6 * (1 + rng.normal(0, DENSITY_SD))
    mass_g = mass_g + rng.normal(0, fill.mass_sd_g, len(mass_g))
    off_mm = rng.normal(0, np.where(lowest_mm < 0, fill.level_sd_mm, fill.flush_sd_mm))
    # At the brim the lab writes 0, whatever the surface is.
    volume_off_mm3 = off_mm[-1] * np.interp(0.0, depths_mm, areas_mm2)
    read_mm = np.append(lowest_mm[:-1] + off_mm[:-1], 0.0)
    mass_g[-1] += volume_off_mm3 * fill.density_kg_m3 / 1e6
    in_order = np.concatenate([[True], (np.diff(read_mm) > 0) & (np.diff(mass_g) > 0)])
    columns = {"mass_g": tuple(mass_g[in_order].tolist()), "level_mm": tuple(np.minimum(read_mm[in_order], 0).tolist())}
    return WeighedFill(**columns), float(under_mm3[0])


if __name__ == "__main__":
    run_benchmark(main)
