"""A block of oil that is let go in a slot, by this package and by other programs: time and error of each.

    python -m benchmarks.peers          (make benchmark-peers)

0.5 Pa s, 1200 kg/m3, 12 x 16 mm in a slot of 3.2 mm; particles of 0.8 mm, four abreast; one thread. Peers run if they
are installed ('pip install sealtwin[peers]'): SPlisHSPlasH, and ``peer_taichi``, position-based fluids that we wrote in
taichi, which has no solver of viscous fluid in 3-D. Each has walls that drag like the fluid, and walls with the drag
that came closest of those tried. Fronts, and the way of the centre at last, are over a 1-D solve of the current:
hydrostatic pressure, no slip on sides and floor, no vertical drag, so that it is ahead of any fluid at first. Time is
the processor's for a simulated second, without set-up; a first run compiles kernels in it. All takes two minutes.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from benchmarks.loose_fluid import substep_s
from benchmarks.machine import ONE_CORE, processor
from benchmarks.table import Row, run_benchmark
from sealtwin.core.records import Floats
from tests.support.paths import ROOT
from tests.support.small_fluids import sealant
from tests.support.tanks import GRAVITY_MM_S2, Pit, Tank, settled_mm

RADIUS_MM, LENGTH_MM, WIDTH_MM, HEIGHT_MM = 0.4, 12.0, 3.2, 16.0
PIT = Pit(50.0, WIDTH_MM, 24.0)
VISCOSITY_PA_S, DENSITY_KG_M3 = 0.5, 1200.0
VISCOSITY_MM2_S = 1e6 * VISCOSITY_PA_S / DENSITY_KG_M3
TIMES_S = (0.3, 0.6, 1.2)
CELLS_MM = (0.2, 0.1)  # Of the 1-D solve, which is judged by what the finer ones change
PROGRAMS = {"pysplishsplash": "SPlisHSPlasH", "taichi": "taichi"}
PEERS = (
    ("pysplishsplash", "DFSPH", 1e-3, 1.0),
    ("pysplishsplash", "DFSPH", 1e-3, 10.0),
    ("pysplishsplash", "PBF", 1e-3, 1.0),
    ("pysplishsplash", "PBF", 1e-3, 10.0),
    ("pysplishsplash", "PBF", 2e-3, 10.0),
    ("taichi", "PBF", 1e-3, 1.0),
    ("taichi", "PBF", 1e-3, 3.0),
    ("taichi", "PBF", 2e-3, 3.0),
)
"""Module, method, step in s, and viscosity of the walls over the fluid's."""


@dataclass(frozen=True)
class Flow:
    program: str
    particles: int
    set_up_s: float
    time_s: float  # For a simulated second
    front_mm: Floats  # At TIMES_S: 98 % of the volume is behind it
    centre_mm: Floats

    def over(self, exact: "Flow") -> tuple[Floats, float]:
        """Fronts over those of another flow, and the way of the centre at last."""
        way = (self.centre_mm[-1] - LENGTH_MM / 2) / (exact.centre_mm[-1] - LENGTH_MM / 2)
        return self.front_mm / exact.front_mm, float(way)


def current(cell_mm: float) -> Flow:
    """The 1-D solve: dh/dt = d/dx (m(h) dh/dx), where m is that of half a rectangular duct, of height 2 h."""
    odd = np.arange(1, 40, 2)[:, None]
    height_mm = np.linspace(1e-6, HEIGHT_MM, 4000)
    corners_mm = 96 * WIDTH_MM / np.pi**5 * (np.tanh(odd * np.pi * height_mm / WIDTH_MM) / odd**5).sum(axis=0)
    mobility = GRAVITY_MM_S2 / VISCOSITY_MM2_S * WIDTH_MM**2 / 12 * (height_mm - corners_mm)
    edge_mm = np.arange(round(PIT.length_mm / cell_mm) + 1) * cell_mm
    middle_mm = (edge_mm[1:] + edge_mm[:-1]) / 2

    def rate(_: float, h: Floats) -> Floats:
        flow = -np.interp((h[1:] + h[:-1]) / 2, height_mm, mobility) * np.diff(h) / cell_mm
        return -np.diff(flow, prepend=0.0, append=0.0) / cell_mm

    block = np.where(middle_mm < LENGTH_MM, HEIGHT_MM, 0.0)
    how: dict[str, Any] = {"method": "LSODA", "lband": 1, "uband": 1, "rtol": 1e-6, "atol": 1e-6}
    share = solve_ivp(rate, (0, TIMES_S[-1]), block, t_eval=TIMES_S, **how).y.T * cell_mm / LENGTH_MM / HEIGHT_MM
    behind = np.pad(np.cumsum(share, axis=1), ((0, 0), (1, 0)))
    front_mm = np.array([np.interp(0.98, each, edge_mm) for each in behind])
    return Flow("1-D solve", len(middle_mm), 0.0, 0.0, front_mm, share @ middle_mm)


def flow_of(program: str, set_up_s: float, time_s: float, places_mm: list[Floats]) -> Flow:
    x_mm = np.array([place_mm[:, 0] for place_mm in places_mm])
    front_mm = np.quantile(x_mm, 0.98, axis=1)
    return Flow(program, x_mm.shape[1], set_up_s, time_s / TIMES_S[-1], front_mm, x_mm.mean(axis=1))


def ours() -> Flow:
    began_s = time.process_time()
    how: dict[str, Any] = {"radius_mm": RADIUS_MM, "step_s": substep_s(RADIUS_MM), "keeps_volume": True}
    block_mm = settled_mm(Pit(LENGTH_MM, WIDTH_MM, PIT.depth_mm), height_mm=HEIGHT_MM, **how)
    fluid = sealant(viscosity_pa_s=VISCOSITY_PA_S, density_kg_m3=DENSITY_KG_M3)
    tank, places_mm = Tank.of(PIT, block_mm, fluid=fluid, **how), list[Floats]()
    ready_s = time.process_time()
    for t_s in tank.run(TIMES_S[-1] + tank.step_s):
        if len(places_mm) < len(TIMES_S) and t_s >= TIMES_S[len(places_mm)] - tank.step_s / 2:
            places_mm.append(tank.place_mm)
    return flow_of("sealtwin", ready_s - began_s, time.process_time() - ready_s, places_mm)


def theirs(module: str, method: str, step_s: float, wall_share: float) -> Flow | None:
    """Run a peer in a process of its own; None if it is not installed, or fails."""
    name = f"{PROGRAMS[module]} {method}, {1e3 * step_s:g} ms, walls {wall_share:g}"
    if find_spec(module) is None:
        print(f"{name}: not installed")
        return None
    axes = [(np.arange(round(side / 2 / RADIUS_MM)) + 0.5) * 2 * RADIUS_MM for side in (LENGTH_MM, WIDTH_MM, HEIGHT_MM)]
    block_mm = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3) - [0, WIDTH_MM / 2, 0]
    case = {"method": method, "step_s": step_s, "wall_share": wall_share, "times_s": TIMES_S, "radius_mm": RADIUS_MM}
    case |= {"pit_mm": (PIT.length_mm, PIT.width_mm, PIT.depth_mm), "gravity_mm_s2": GRAVITY_MM_S2}
    case |= {"viscosity_mm2_s": VISCOSITY_MM2_S, "density_kg_m3": DENSITY_KG_M3, "place_mm": block_mm.tolist()}
    with tempfile.TemporaryDirectory() as folder:
        answer = Path(folder) / "answer.json"
        command = [sys.executable, ROOT / "benchmarks" / f"peer_{module}.py", answer]
        child = subprocess.run(
            command, cwd=folder, env=os.environ | ONE_CORE, input=json.dumps(case), text=True, capture_output=True
        )
        if child.returncode:
            print(f"{name}: failed with {child.returncode}: {child.stderr.strip()[-300:]}")
            return None
        seen = json.loads(answer.read_text())
    return flow_of(name, seen["set_up_s"], seen["time_s"], [np.array(each) for each in seen["place_mm"]])


def main() -> list[Row]:
    coarse, exact = (current(cell_mm) for cell_mm in CELLS_MM)
    first, peers, last = ours(), [flow for peer in PEERS if (flow := theirs(*peer))], ours()
    print(f"{processor()}, load {os.getloadavg()[0]:.1f}\n")
    moments = ", ".join(f"{t_s:g}" for t_s in TIMES_S)
    print(f"| program | particles | set-up, s | time, s | front at {moments} s | way |")
    print("|---|---|---|---|---|---|")
    for flow in (first, *peers, last):
        fronts, way = flow.over(exact)
        shown = ", ".join(f"{front:.2f}" for front in fronts)
        print(f"| {flow.program} | {flow.particles} | {flow.set_up_s:.1f} | {flow.time_s:.1f} | {shown} | {way:.2f} |")
    off = float(np.abs(coarse.front_mm / exact.front_mm - 1).max())
    fronts, _ = first.over(exact)
    rows = [Row(f"1-D solve: front in cells of {CELLS_MM[0]:g} mm, off", 100 * off, "%", 0, 0.5)]
    for t_s, front, low in zip(TIMES_S, fronts, (0.0, 0.9, 0.9), strict=True):
        rows.append(Row(f"sealtwin: front at {t_s:g} s", float(front), "", low, 1.05 if low else np.inf, "1"))
    slower_s = max(first.time_s, last.time_s)
    for program in PROGRAMS.values():
        if times_s := [flow.time_s for flow in peers if flow.program.startswith(program)]:
            rows.append(Row(f"time over the fastest of {program}", slower_s / min(times_s), "", 0, 0.5))
    return rows


if __name__ == "__main__":
    run_benchmark(main)
