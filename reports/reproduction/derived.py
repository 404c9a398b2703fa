"""Small studies that follow from that of all pairs: seeds, damping, freezing, times; and two straight cracks."""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from digitise.settings import CrackShape, NozzlePath
from digitise.solid.build_solid import build_solid
from digitise.trajectory import plan_trajectory
from reports.reproduction.extra_claims import D_CM, ETA_PER_S, FREEZE_AFTER_S
from reports.reproduction.scatter import SEEDS, deciding_pairs
from reports.reproduction.surface import CHOSEN
from sealtwin.core import files
from sealtwin.study.runner import Bench
from sealtwin.study.study_file import Study
from sealtwin.trial.trial_file import Trial
from simulate.settings import Nozzle, Solver
from tests.shapes import straight_slot
from validate.figures.chart import Chart

Row = tuple[Any, ...]
LETTERED = ("seed", "fluid.U", "fluid.D_cm")
TIMED_SEEDS = SEEDS[:3]
PASSES, SOLVED = "explicit", "implicit"
WIDE_MM, NARROWER = 3.1, 3
"""The paper's crack, and how many times narrower the other one is."""
LENGTH_MM, DEPTH_MM, VOLUME_ML, NOZZLE_MM = 80.0, 16.0, 4.8, 2.4
"""The paper's, for the wide crack."""


@dataclass(frozen=True)
class Kind:
    """A small study, by the end of its name."""

    name: str
    told: str
    columns: tuple[str, ...]
    rows: tuple[Row, ...] | None
    """None: they follow from the runs of all pairs."""


SEEDED = Kind("seeds", "other seeds of the deciding pairs", LETTERED, rows=None)
DAMPED = Kind(
    "damping",
    "damping eta",
    (*LETTERED, "solver.damping_per_s"),
    tuple((seed, *CHOSEN, eta) for eta in ETA_PER_S for seed in SEEDS),
)
FROZEN = Kind(
    "freezing",
    "age of freezing",
    (*LETTERED, "fluid.freeze_after_s"),
    tuple((seed, *CHOSEN, age_s) for age_s in FREEZE_AFTER_S for seed in SEEDS),
)
TIMED = Kind(
    "times",
    "processor times",
    (*LETTERED, "solver.viscosity_solve"),
    tuple((seed, CHOSEN[0], d, way) for way in (PASSES, SOLVED) for d in D_CM for seed in TIMED_SEEDS),
)
KINDS = (SEEDED, DAMPED, FROZEN, TIMED)


def seeded_rows(chart: Chart) -> list[Row]:
    """Return the runs of ``SEEDED``, by the chart of all pairs."""
    return [(seed, *pair) for pair in deciding_pairs(chart) for seed in SEEDS]


def write_study(path: Path, grid: Study, home: Path, kind: Kind, rows: Sequence[Row]) -> None:
    """Write the study file of a small study that starts as ``grid`` does, which lies in ``home``."""
    fixed = {name: value for name, value in grid.fixed.items() if name not in kind.columns}
    files.write_text(path, study_text(f"{grid.name}-{kind.name}", home / grid.trial, fixed, kind.columns, rows))


def study_text(name: str, trial: Path, fixed: Mapping[str, Any], columns: Sequence[str], rows: Iterable[Row]) -> str:
    """Return a study file in which each run is a row."""
    # Strings, numbers and lists are written in TOML as in JSON.
    lines = [f"name = {json.dumps(name)}", f"trial = {json.dumps(trial.resolve().as_posix())}", "", "[fixed]"]
    lines += [f"{json.dumps(key)} = {json.dumps(value)}" for key, value in fixed.items()]
    lines += ["", "[list]", f"columns = {json.dumps(list(columns))}", "rows = ["]
    lines += [f"  {json.dumps(list(row))}," for row in rows]
    return "\n".join([*lines, "]", ""])


def straight_crack(trial: Trial, narrower: int) -> tuple[Bench, Trial]:
    """Return a straight crack of the paper's length and depth and a trial for it, so many times narrower than 3.1 mm.

    Sealant and nozzle shrink with the width, and four particles are abreast at any.
    """
    width_mm = WIDE_MM / narrower
    outline = straight_slot(LENGTH_MM, width_mm)
    solid = build_solid(outline, CrackShape(depth_mm=DEPTH_MM, tilt="vertical", wall_angle_deg=0.0))
    path = NozzlePath(volume_ml=VOLUME_ML / narrower, speed_mm_s=4.0, trim_mm=10.0)
    trajectory = plan_trajectory(outline, path, solid.cavity_volume_mm3, solid.sections)
    solver = Solver(preset="paper", radius_mm=width_mm / 8)
    changed = {"solver": solver, "nozzle": Nozzle(diameter_mm=NOZZLE_MM / narrower), "readings": None}
    return Bench(outline, solid, trajectory, None), trial.model_copy(update=changed)
