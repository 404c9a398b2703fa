"""Heaps of liquid that collapse in a slot, over a second solver's; ``python -m benchmarks.channels --only fronts``."""

import csv
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from benchmarks.interfoam.cases import CREEP, HEAP_MM, SIZE_MM, TABLES, WIDTH_MM
from benchmarks.physics_tanks import Pit, Tank, settled_mm
from benchmarks.table import Row
from sealtwin.core.records import Floats
from simulate.loose_fluid import substep_s
from simulate.settings import Fluid, Solver
from tests.fluids import sealant

DEEP_MM, AFTER_S = 40.0, 0.5
BURSTS = "local pressure holds the heap compressed by a tenth, which bursts out by 0.9 mm as the gate opens"


def fronts() -> Iterator[Row]:
    """How far heaps of liquid run in a slot, over what interFoam says; those of thin liquid over finer particles.

    The fall of the centre is not judged: interFoam's own hangs on its mesh by a tenth, and ours on the volume kept,
    which is measured with particles that stick to the walls above the others.
    """
    thin = sealant(viscosity_pa_s=0.055)
    coarse, fine = (_collapse(thin, (0.0, AFTER_S), radius_mm=radius_mm) for radius_mm in (Solver().size_mm, 0.25))
    advance = _between(coarse)[0]
    yield Row("front, 0.055 Pa s: advance over R 0.25 mm's", advance / _between(fine)[0], "", 0.9, 1.1, "1")
    reached = [advance]
    for viscosity_pa_s, creep in CREEP.items():
        fluid = sealant(viscosity_pa_s=viscosity_pa_s)
        times_s = sorted({0.0, AFTER_S, creep.end_s})
        for pressure in ("local", "two-level"):
            ours = _collapse(fluid, times_s, radius_mm=Solver().size_mm, pressure=pressure)
            theirs = _between(_of_foam(viscosity_pa_s, times_s))
            name = f"{viscosity_pa_s:g} Pa s, {pressure}"
            because = BURSTS if pressure == "local" else ""
            front, centre = (here / there for here, there in zip(_between(ours), theirs, strict=True))
            yield Row(f"front, {name}: advance over interFoam's", front, "", 0.9, 1.1, "1", because=because)
            yield Row(f"front, {name}: fall of the centre over interFoam's", centre, "")
            if pressure == "local":
                reached.append(_between(ours[: times_s.index(AFTER_S) + 1])[0])
    yield Row("fronts: least lead over the next thicker", float(-np.diff(reached).max()), "mm", 0.01, 100.0, "> 0")


def _collapse(fluid: Fluid, times_s: Sequence[float], *, radius_mm: float, **solver: Any) -> Floats:
    """Front, and depth of the centre of all liquid below the start's top, at times after the gate opens; (n, 2), mm."""
    step_s = substep_s(radius_mm)
    how: dict[str, Any] = {"radius_mm": radius_mm, "step_s": step_s, "keeps_volume": True, **solver}
    packed = settled_mm(Pit(HEAP_MM[0], WIDTH_MM, DEEP_MM), height_mm=HEAP_MM[1], **how)
    tank = Tank.of(Pit(70.0, WIDTH_MM, DEEP_MM), packed, fluid=fluid, **how)
    seen = []
    for waits_s in np.diff([0.0, *times_s]):
        tank.wait(float(waits_s))
        seen.append([tank.front_mm(), HEAP_MM[1] - tank.place_mm[:, 2].mean()])
    return np.array(seen)


def _of_foam(viscosity_pa_s: float, times_s: Sequence[float]) -> Floats:
    with (TABLES / "liquids.csv").open(newline="") as file:
        rows = [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]
    of = {(row["viscosity_pa_s"], row["mesh_mm"], row["t_s"]): row for row in rows}
    seen = [of[viscosity_pa_s, SIZE_MM, t_s] for t_s in times_s]
    return np.array([[row["front_mm"], HEAP_MM[1] - row["centre_mm"]] for row in seen])


def _between(seen: Floats) -> Floats:
    """Advance of the front and fall of the centre from the first time to the last, mm."""
    return seen[-1] - seen[0]
