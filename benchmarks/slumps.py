"""Slumps of a mini-cone in particles: the closed form of a flat heap, and the replay, against finer ones.

    python -m benchmarks.slumps [--record]

The yield stress that each says of the radius at which another slump came to rest, over the one that it had. Slumps
stand in ``slumps.csv``; ``--record`` computes those that are not there, about 25 minutes of one core. A finer slump has
2.2 times as many particles. No paste was measured for any of this.
"""

import csv
import math
from functools import cache
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
from typer import Option

from benchmarks.kept_runs import KeptRuns
from benchmarks.table import Row, run_benchmark
from simulate.slump import STEP, SlumpCurve, slump
from simulate.spread_law import (
    FLATTEST,
    GRAVITY_M_S2,
    Cone,
    flat_stress_pa,
    heap_height_mm,
    spread_radius_mm,
    stretched_stress_pa,
)

MINI_CONE = Cone(38.0, 19.0, 57.0)
DENSITY_KG_M3 = 1690.0
UNIT_PA = DENSITY_KG_M3 * GRAVITY_M_S2 * MINI_CONE.volume_mm3 ** (1 / 3) * 1e-3
TABLE = Path(__file__).with_name("slumps.csv")
KEPT = KeptRuns(TABLE, "python -m benchmarks.slumps --record", ("simulate",))
TRUE_PA = {4.0: 1.0, 7.0: 1.3, 20.0: 1.375, 60.0: 1.375}
"""Yield stresses that slumps have, and how many times finer their particles are than those of a replay; those of 4 Pa
judge the closed form, which has none."""
POWERS = range(-11, -2)
OFF = 0.1
COLUMNS = ("kind", "stress_over_weight", "radius_over_length")
KINDS = ("truth", "replay")


class Known(NamedTuple):
    """A slump without units: tau / (rho g V^(1/3)) and R / V^(1/3)."""

    stress: float
    radius: float


@cache
def recorded() -> dict[str, list[Known]]:
    """Return all slumps by what they are for. Leaves if another solver computed them."""
    KEPT.require()
    slumps: dict[str, list[Known]] = {kind: [] for kind in KINDS}
    if TABLE.is_file():
        with TABLE.open(newline="", encoding="utf-8") as file:
            for row in csv.DictReader(file):
                slump_of = Known(float(row["stress_over_weight"]), float(row["radius_over_length"]))
                slumps[row["kind"]].append(slump_of)
    return slumps


def replayed() -> SlumpCurve:
    """Return the curve of the product's own slumps, known beforehand."""
    radii = {round(math.log(one.stress) / math.log(STEP)): one.radius for one in recorded()["replay"]}
    return SlumpCurve(MINI_CONE, DENSITY_KG_M3, radii)


def truth(stress_pa: float, volume_mm3: float, density_kg_m3: float) -> float:
    """Return the radius at rest in mm by the finer slumps, between which its logarithm is cubic in the stress'."""
    from scipy.interpolate import PchipInterpolator

    finer = sorted(recorded()["truth"])
    length_mm = volume_mm3 ** (1 / 3)
    asked = stress_pa / (density_kg_m3 * GRAVITY_M_S2 * length_mm * 1e-3)
    along = PchipInterpolator(np.log([one.stress for one in finer]), np.log([one.radius for one in finer]))
    return float(np.exp(along(np.log(asked)))) * length_mm


def true_pa() -> list[float]:
    """Return the yield stresses of the mini-cone's slumps that are recorded."""
    return [round(one.stress * UNIT_PA, 6) for one in recorded()["truth"]]


def record() -> None:
    """Compute what is not in the table yet, one slump after the other."""
    KEPT.begin()
    wanted = [("truth", stress / UNIT_PA, finer) for stress, finer in TRUE_PA.items()]
    wanted += [("replay", STEP**power, 1.0) for power in POWERS]
    # Stiff paste first, which takes least.
    wanted.sort(key=lambda one: -one[1])
    done = {(kind, round(math.log(one.stress), 6)) for kind, all_ in recorded().items() for one in all_}
    if not TABLE.is_file():
        TABLE.write_text(",".join(COLUMNS) + "\n", encoding="utf-8")
    for kind, asked, finer in wanted:
        if (kind, round(math.log(asked), 6)) in done:
            continue
        rest = slump(MINI_CONE, asked * UNIT_PA, DENSITY_KG_M3, finer=finer)
        with TABLE.open("a", newline="", encoding="utf-8") as file:
            length_mm = rest.volume_mm3 ** (1 / 3)
            # The volume that the particles keep is a little off the cone's.
            csv.writer(file).writerow([kind, f"{asked:.9g}", f"{rest.at_rest_mm / length_mm:.6g}"])


def rows() -> list[Row]:
    """Return the figures by yield stress."""
    table, volume, density = [], np.array([MINI_CONE.volume_mm3]), np.array([DENSITY_KG_M3])
    curve = replayed()
    for stress_pa in sorted(true_pa()):
        radius = np.array([truth(stress_pa, MINI_CONE.volume_mm3, DENSITY_KG_M3)])
        closed = stretched_stress_pa(volume, radius, density)
        high = float(heap_height_mm(closed, radius, density)[0] / radius[0])
        flat = float(flat_stress_pa(volume, radius, density)[0]) / stress_pa
        flat_enough = high <= FLATTEST
        how, stress = ("closed form", closed) if flat_enough else ("replay", curve.stress_pa(volume, radius, density))
        name = f"{stress_pa:g} Pa, H/R {high:.3f}"
        table.append(Row(f"{name}: {how} over the slump's", float(stress[0]) / stress_pa, "", 1 - OFF, 1 + OFF, "1"))
        table.append(Row(f"{name}: flat formula alone", flat, ""))
        if how == "replay":
            table.append(Row(f"{name}: closed form", float(closed[0]) / stress_pa, ""))
        law_mm = spread_radius_mm(stress_pa, MINI_CONE.volume_mm3, DENSITY_KG_M3)
        table.append(Row(f"{name}: radius over the closed form's", float(radius[0]) / law_mm, ""))
    wanted = len(TRUE_PA) + len(POWERS)
    table.append(Row("slumps that --record has yet to compute", wanted - sum(map(len, recorded().values())), ""))
    return table


def main(compute: Annotated[bool, Option("--record")] = False) -> list[Row]:
    if compute:
        record()
        recorded.cache_clear()
    return rows()


if __name__ == "__main__":
    run_benchmark(main)
