"""A paste by a cone, a rheometer's table and a pump by a scale, each emulated: errors, intervals, and their widths.

    python -m benchmarks.material_by_scale [--spreads 200] [--seed 0]

Nothing here was measured. A spread's truth is the slump of a mini-cone in particles (``slumps.csv``, of finer particles
than a replay's), with surface tension's term in full; its photo is drawn with perspective, lens, gradient, noise, a rim
that is not round, and an edge that lies elsewhere than half the contrast. Volume, density and weight of surface tension
are off by what the command takes for their standard uncertainties. Seven minutes of one core.
"""

import csv
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from datetime import date
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
from typer import Option

from benchmarks.slumps import DENSITY_KG_M3, MINI_CONE, replayed, true_pa, truth
from benchmarks.table import Row, run_benchmark
from digitise.robots.pump import Pump, PumpTable, read_pump
from digitise.settings import PhotoInput
from digitise.spread import measure_spread
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats
from sealtwin.material.by_rheometer import material_of_table
from sealtwin.material.by_spread import CONE_ERROR_MM, MASS_ERROR_G, Heap, PasteEstimate, estimate
from sealtwin.material.flow_law import TORQUE
from sealtwin.material.paste import DENSITY_ERROR, EDGE_ERROR_N_M, EDGE_N_M, PasteOnPlate
from simulate.material_file import Material
from simulate.slump import SlumpCurve
from simulate.spread_law import Cone, spread_radius_mm
from tests.spreads import BOARD, FACE_MM, Blob

LEAST_PA, MOST_PA = 3.0, 60.0
OFF = 0.1
HELD = 0.92
BANDS = ((3.0, 6.0), (6.0, 15.0), (15.0, 60.0))
PUMPS, CURVES = 400, 400
WEIGHINGS, FLOWS = 3, (100, 200, 300, 400, 500)


class Case(NamedTuple):
    """A quantity, what was said of it, and its interval."""

    true: float
    found: float
    low: float
    high: float

    @property
    def off(self) -> float:
        return abs(self.found / self.true - 1)

    @property
    def held(self) -> bool:
        return self.low <= self.true <= self.high

    @property
    def half_width(self) -> float:
        return (self.high - self.low) / 2 / self.found


def radius_at_rest_mm(stress_pa: float, volume_mm3: float, density_kg_m3: float) -> float:
    """Return the radius of a slump; below the least that was recorded the closed form's, in its ratio to that one."""
    least = min(true_pa())
    if stress_pa >= least:
        return truth(stress_pa, volume_mm3, density_kg_m3)
    ratio = truth(least, volume_mm3, density_kg_m3) / spread_radius_mm(least, volume_mm3, density_kg_m3)
    return ratio * spread_radius_mm(stress_pa, volume_mm3, density_kg_m3)


def spreads(count: int, seed: int) -> Iterator[Case]:
    """Yield emulated spreads, their stresses even in the logarithm."""
    random = np.random.default_rng(seed)
    # Computed beforehand, as a replay would find them.
    curve = replayed()
    with tempfile.TemporaryDirectory() as folder:
        for number in range(count):
            stress_pa = LEAST_PA * (MOST_PA / LEAST_PA) ** ((number + random.uniform()) / count)
            yield spread_of(stress_pa, number, random, curve, Path(folder))


def spread_of(stress_pa: float, number: int, random: np.random.Generator, curve: SlumpCurve, folder: Path) -> Case:
    """Emulate the photographed spread of a paste, and its yield stress as the command finds it."""
    one = spread_out(stress_pa, number, random, curve, folder)
    return Case(stress_pa, one.found.value, *one.found.interval)


class Spread(NamedTuple):
    """A spread that was emulated: what its paste has in truth, and what is found of it."""

    held_pa: float  # Yield stress with surface tension's share, which ends the spread
    volume_mm3: float
    density_kg_m3: float
    heap: Heap
    found: PasteEstimate


def spread_out(stress_pa: float, number: int, random: np.random.Generator, curve: SlumpCurve, folder: Path) -> Spread:
    """Let a paste spread and take its photo."""
    sizes = np.array([MINI_CONE.bottom_mm, MINI_CONE.top_mm, MINI_CONE.height_mm])
    volume = Cone(*(sizes + random.normal(0, CONE_ERROR_MM, 3)).tolist()).volume_mm3
    density = DENSITY_KG_M3 * (1 + random.normal(0, DENSITY_ERROR))
    edge = max(0.0, random.normal(EDGE_N_M, EDGE_ERROR_N_M))
    radius = radius_at_rest_mm(stress_pa, volume, density)
    held_pa = stress_pa
    for _ in range(20):
        held_pa = stress_pa + edge * (1e-3 * radius) ** 2 / (1e-9 * volume)
        radius = radius_at_rest_mm(held_pa, volume, density)
    photo = photo_of(radius, number, random, folder)
    known_of: dict[str, float] = {"density_kg_m3": DENSITY_KG_M3}
    if number % 2:
        known_of["mass_g"] = 1e-6 * volume * density + random.normal(0, MASS_ERROR_G)
    heap = Heap.model_validate({**known_of, "cone_mm": tuple(sizes.tolist())})
    return Spread(held_pa, volume, density, heap, estimate(heap, measure_spread(photo, folder), curve=curve))


def photo_of(radius_mm: float, number: int, random: np.random.Generator, folder: Path) -> PhotoInput:
    """Draw the photo of a spread with a rim that is not round and a camera that is not square."""
    mm_per_px = random.uniform(0.22, 0.4)
    blob = Blob(
        # The rim that a camera sees is not where paste ends.
        radius_mm + random.normal(0, 0.4 * mm_per_px),
        middle_mm=(75 + random.uniform(-4, 4), 75 + random.uniform(-4, 4)),
        unround=tuple(random.normal(0, 0.01, 3).tolist()),
        turn=random.uniform(0, 6.28),
        dark=bool(number % 3),
        mm_per_px=mm_per_px,
        tilt_deg=random.uniform(0, 7),
        lens_k1=random.uniform(-0.05, 0.02),
        gradient=random.uniform(-0.4, 0.4),
        noise=random.uniform(0.002, 0.03),
        seed=number,
    )
    return PhotoInput(file=blob.write(folder / "spread.png"), data="synthetic", markers=BOARD, face_mm=FACE_MM)


class PumpOfPower(NamedTuple):
    """A pump that gives a power of what it is asked for."""

    scale: float
    power: float

    def gives(self, asked: Floats | float) -> Floats:
        return self.scale * 300 * (np.asarray(asked) / 300) ** self.power


def weighed(
    pump: PumpOfPower,
    scatter: float,
    density_kg_m3: float,
    density_error: float,
    random: np.random.Generator,
    folder: Path,
    flows: Sequence[float] = FLOWS,
) -> PumpTable:
    """Return a pump's table, weighed thrice at each flow; the density is off by its relative error."""
    path = folder / "pump.csv"
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["asked_mm3_s", "weighed_g", "time_s", "delay_s"])
        for asked in flows:
            for _ in range(WEIGHINGS):
                caught = 20 * pump.gives(asked) * density_kg_m3 * 1e-6 * (1 + random.normal(0, scatter))
                writer.writerow([asked, f"{float(caught):.4f}", 20, f"{random.normal(0.3, 0.02):.3f}"])
    settings = Pump(file=path, density_kg_m3=DENSITY_KG_M3, density_error_kg_m3=density_error * DENSITY_KG_M3)
    return read_pump(settings, folder)


def pumps(seed: int) -> Iterator[Case]:
    """Yield emulated pumps, and the flow that each gives where one is wanted."""
    random = np.random.default_rng([seed, 1])
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(PUMPS):
            pump = PumpOfPower(random.uniform(0.7, 1.15), random.uniform(0.88, 1.12))
            scatter, density_error = random.uniform(0.003, 0.03), random.uniform(0, 0.01)
            density = DENSITY_KG_M3 * (1 + random.normal(0, density_error))
            table = weighed(pump, scatter, density, density_error, random, Path(folder))
            low, high = table.range_mm3_s
            wanted = float(random.uniform(low, high))
            given = float(pump.gives(table.asked_for(np.array([wanted]))[0]))
            half = wanted * table.error_95(wanted)
            yield Case(given, wanted, wanted - half, wanted + half)


def curves(seed: int) -> Iterator[Case]:
    """Yield flow curves of Bingham fluids on a rheometer that is off by its torque."""
    random = np.random.default_rng([seed, 2])
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(CURVES):
            stress_pa, viscosity = LEAST_PA * (MOST_PA / LEAST_PA) ** random.uniform(), 10 ** random.uniform(-1, 0.3)
            paste = flow_curve(stress_pa, viscosity, random, Path(folder))
            yield Case(stress_pa, paste.yield_stress_pa, *paste.yield_stress_95_pa)


def flow_curve(stress_pa: float, viscosity_pa_s: float, random: np.random.Generator, folder: Path) -> Material:
    """Emulate a flow curve, and the paste as the command finds it. A curve that is refused is measured again."""
    rate = np.geomspace(1, random.uniform(50, 100), int(random.integers(8, 25)))
    stresses_pa = (stress_pa + viscosity_pa_s * rate) * (1 + random.normal(0, TORQUE))
    stresses_pa = stresses_pa * (1 + random.normal(0, random.uniform(0.005, 0.04), len(rate)))
    lines = [f"{x:.6g},{y:.6g}" for x, y in zip(rate, stresses_pa, strict=True)]
    path = folder / "curve.csv"
    path.write_text("\n".join(["shear_rate_per_s,stress_pa", *lines]) + "\n", encoding="utf-8")
    with suppress(InputError):
        return material_of_table(
            path, PasteOnPlate(density_kg_m3=DENSITY_KG_M3), "synthetic", date(2026, 11, 21)
        ).material
    return flow_curve(stress_pa, viscosity_pa_s, random, folder)


def judged(name: str, cases: list[Case]) -> Iterator[Row]:
    """Yield errors, share held and widths of cases."""
    off = np.array([case.off for case in cases])
    width = np.array([case.half_width for case in cases])
    yield Row(f"{name}: RMS error", 100 * float(np.sqrt(np.mean(off**2))), "%", 0, 100 * OFF, "0")
    yield Row(f"{name}: error that 95 % stay below", 100 * float(np.quantile(off, 0.95)), "%", goal="10")
    yield Row(f"{name}: within 10 %", 100 * float(np.mean(off <= OFF)), "%", goal="100")
    yield Row(f"{name}: held by 95 % intervals", 100 * float(np.mean([case.held for case in cases])), "%", 100 * HELD)
    yield Row(f"{name}: half-width of the interval, median", 100 * float(np.median(width)), "%")
    yield Row(f"{name}: half-width of the interval, 95 % below", 100 * float(np.quantile(width, 0.95)), "%")


def main(count: Annotated[int, Option("--spreads")] = 200, seed: int = 0) -> list[Row]:
    print("All readings are emulated; nothing was measured.")
    spread = list(spreads(count, seed))
    rows = [*judged("spread", spread)]
    for low, high in BANDS:
        band = [case for case in spread if low <= case.true < high]
        rows += judged(f"spread, {low:g} to {high:g} Pa", band)
    sources: dict[str, Callable[[int], Iterator[Case]]] = {"rheometer": curves, "pump": pumps}
    for name, of in sources.items():
        rows += judged(name, list(of(seed)))
    return rows


if __name__ == "__main__":
    run_benchmark(main)
