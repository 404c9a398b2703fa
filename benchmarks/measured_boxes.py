"""One box calibrates, the other predicts: dam breaks of seven materials without a flow curve, both ways.

    python -m benchmarks.measured_boxes [--record] [--only island] [--jobs 2]

Yield stress, K and n are calibrated on the fronts of one box by the search and the posterior of 'sealtwin calibrate'.
The other box's front at outline 8 is predicted with a 90 % band from runs of posterior draws. Nothing else is fitted:
the shift of the clock and the scatter of a computed front are those of the materials with a flow curve
(``measured/measured.toml``). The plain way beside it scales the first box's front by the height of the block.

``benchmarks/measured_boxes`` keeps the runs. ``--record`` computes those that are missing, in 40 minutes on both cores.
"""

import json
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from scipy.special import stdtrit

from benchmarks.kept_runs import KeptRuns
from benchmarks.measured import computed_mm, course_of
from benchmarks.table import Row, one_of, processes, run_benchmark
from sealtwin.calibration.search import Setting, Source, search, settings_at
from sealtwin.core.errors import SealtwinError
from sealtwin.core.files import write_json
from sealtwin.core.records import Floats
from simulate.settings import Fluid, Solver
from tests.support.dam_breaks import DamBreak, content, dam_breaks, with_curve
from tests.support.paths import ROOT
from validate.calibration.posterior import Free, ReadLevels

BOXES = Path(__file__).with_suffix("")
KEPT = KeptRuns(BOXES, "python -m benchmarks.measured_boxes --record", ("simulate", "validate"))
MATERIALS = [name for name in content()["materials"] if name not in with_curve()]


def frees() -> list[Free]:
    return [Free(name, *ends) for name, ends in content()["calibrated"]["ranges"].items()]


def front_mm(box: DamBreak, run: tuple[Setting, int]) -> Floats | None:
    """Return the fronts at the outlines that are calibrated on; None if the run failed."""
    table, (setting, seed) = content(), run
    fluid = {name.removeprefix("fluid."): value for name, value in setting.items()}
    fluid |= {"density_kg_m3": table["materials"][box.material]["density_kg_m3"], "freeze_after_s": "never"}
    shortest_mm = min(box.length_mm, box.height_mm, table["boxes"]["width_mm"])
    solver = Solver(radius_mm=shortest_mm / table["calibrated"]["diameters"] / 2)
    try:
        course = course_of(box, Fluid.model_validate(fluid), solver, seed)
    except SealtwinError:
        return None
    return computed_mm(course)[table["calibrated"]["outlines"]]


def evidence_of(box: DamBreak) -> ReadLevels:
    """Return the fronts of a box with their errors: of the outlines, and of computed fronts in general."""
    table = content()["calibrated"]
    seen_mm = box.measured_mm[table["outlines"]]
    common = table["outline_error_mm"] ** 2 + np.outer(seen_mm, seen_mm) * (table["model_percent"] / 100) ** 2
    own = np.eye(len(seen_mm)) * table["outline_scatter_mm"] ** 2
    # Outlines are stations of a profile; their distances matter only to a discrepancy, which one box has not.
    return ReadLevels(np.array(table["outlines"], dtype=float), seen_mm, common + own)


def calibrated(box: DamBreak, other: DamBreak, jobs: int) -> dict[str, Any]:
    """Calibrate on a box, and predict the front of the other one at the last outline."""
    table, runs = content()["calibrated"], dict[tuple[tuple[tuple[str, float], ...], int], Floats | None]()
    with processes(jobs) as pool:

        def run(wanted: Sequence[tuple[Setting, int]]) -> Sequence[Floats | None]:
            keys = [(tuple(setting.items()), seed) for setting, seed in wanted]
            new = [number for number, key in enumerate(keys) if key not in runs]
            for number, fronts in zip(new, pool.map(partial(front_mm, box), [wanted[at] for at in new]), strict=True):
                runs[keys[number]] = fronts
            return [runs[key] for key in keys]

        result = search(frees(), [Source(box.name, evidence_of(box), run)], table["budget"], print)
        if result.draws is None:
            return {"possible": False, "implausibility": result.least_implausibility}
        drawn = result.draws[np.linspace(0, len(result.draws) - 1, table["draws"]).astype(int)]
        wanted = [(settings_at(frees(), point), seed) for seed, point in enumerate(drawn)]
        fronts = [each for each in pool.map(partial(front_mm, other), wanted) if each is not None]
    values = {free.name: free.values(column) for free, column in zip(frees(), result.draws.T, strict=True)}
    return {
        "possible": True,
        "front_mm": [float(each[-1]) for each in fronts],
        "settings": {name: np.quantile(each, [0.05, 0.5, 0.95]).tolist() for name, each in values.items()},
    }


def both_ways(material: str, jobs: int) -> dict[str, Any]:
    """Return both predictions of a material, kept or, with ``jobs`` processes, computed."""
    path = BOXES / f"{material}.json"
    if path.is_file():
        return json.loads(path.read_text(encoding="utf-8"))
    if not jobs:
        raise SystemExit(f"{path.relative_to(ROOT)}: no such file; '{KEPT.command}' computes it.")
    one, other = dam_breaks([material])
    print(f"{material}: {one.name} -> {other.name}, and back", flush=True)
    kept = {first.name: calibrated(first, second, jobs) for first, second in ((one, other), (other, one))}
    BOXES.mkdir(exist_ok=True)
    write_json(path, kept)
    return kept


def main(
    *, only: Annotated[list[str] | None, one_of(MATERIALS)] = None, jobs: int = 2, record: bool = False
) -> list[Row]:
    if record:
        KEPT.begin()
    KEPT.require()
    return list(_rows(only or MATERIALS, jobs if record else 0))


def _rows(materials: Sequence[str], jobs: int) -> Iterator[Row]:
    table, inside, ours, plain = content()["calibrated"], [], [], []
    for material in materials:
        kept, pair = both_ways(material, jobs), dam_breaks([material])
        for box, other in (pair, pair[::-1]):
            outcome, seen_mm = kept[box.name], float(other.measured_mm[-1])
            scaled = float(box.measured_mm[-1]) * other.height_mm / box.height_mm / seen_mm
            plain.append(np.log(scaled))
            if not outcome["possible"]:
                yield Row(f"{box.name}: implausibility of the best setting", outcome["implausibility"], "")
                continue
            fronts = np.array(outcome["front_mm"])
            error = evidence_of(other).covariance_mm2[-1, -1]
            half = stdtrit(len(fronts) - 1, 0.95) * np.sqrt(fronts.var(ddof=1) * (1 + 1 / len(fronts)) + error)
            inside.append(abs(fronts.mean() - seen_mm) <= half)
            ours.append(np.log(fronts.mean() / seen_mm))
            name = f"{other.name}: {seen_mm:g} mm, from the box of {box.height_mm:g} mm"
            yield Row(f"{name}: predicted", float(fronts.mean()), "mm")
            yield Row(f"{name}: half-width, 90 %", float(half), "mm")
            yield Row(f"{name}: scaled by the height, over measured", scaled, "")
        low, high = (kept[box.name].get("settings") for box in pair)
        if low and high:
            for setting in low:
                ratio = low[setting][1] / high[setting][1]
                # Both posteriors are near lognormal, and independent.
                factor = np.exp(np.hypot(*(np.log(each[setting][2] / each[setting][0]) / 2 for each in (low, high))))
                of = f"{material}: {setting}, of one box over the other's"
                yield Row(of, ratio, "")
                yield Row(f"{of}: 90 %, from", ratio / factor, "")
                yield Row(f"{of}: 90 %, to", ratio * factor, "")
    whole = len(ours) == 2 * len(MATERIALS)
    yield Row("fronts in their 90 % band", float(sum(inside)), "of 14", table["least_inside"] if whole else 0.0)
    yield Row("predicted over measured: bias", float(np.exp(np.mean(ours))), "")
    yield Row("predicted over measured: scatter", 100 * float(np.std(ours)), "%")
    yield Row("scaled by the height over measured: scatter", 100 * float(np.std(plain)), "%")


if __name__ == "__main__":
    run_benchmark(main)
