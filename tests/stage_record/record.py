"""Record of small outputs of each stage beside its number: a test fails if outputs move and the number does not.

``digitise`` is in two parts, as in ``PARTS``.

``python -m tests.stage_record`` remakes the record. It refuses while an output moved and its stage's number did not.

The tolerance of an output is ``MARGIN`` times what it moves by if every input moves by a rounding of float32. Another
processor rounds otherwise, and stays far below it in so few frames; a changed constant or kernel moves some output by
more. A change that is too small for the record, or outside it, raises the number just the same.
"""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sealtwin.core.files import write_text
from sealtwin.core.records import Floats
from tests.stage_record import outputs
from tests.stage_record.outputs import Nudge, Outputs

RECORD = Path(__file__).with_name("record.json")
STAGES: dict[str, Callable[[Nudge], Outputs]] = {
    "tracing": outputs.traced,
    "solids": outputs.solids,
    "simulate": outputs.simulated,
    "validate": outputs.validated,
}
ROUNDING, NUDGES = 1e-7, 4
MARGIN = 20.0
"""Without AVX-512, without AVX, with Warp's kernels compiled for debugging, other OpenBLAS kernels, NumPy or OpenCV
without AVX2, no output moves by more than a tenth of its tolerance.
"""
LEAST, ROUND_OFF = 1e-6, 1e-9  # Least tolerance, over the output's largest value, and of one that is about 0
MOST = 0.02  # An output whose tolerance is a larger share of it says too little: give it fewer frames


@dataclass(frozen=True)
class Recorded:
    """An output with its tolerance, in the output's unit."""

    values: Floats
    tolerance: float

    def moved(self, now: Floats | None) -> str:
        """Return by how much an output moved, in words; empty if by less than the tolerance."""
        if now is None or len(now) != len(self.values):
            return f"{0 if now is None else len(now)} values, and {len(self.values)} in the record"
        largest = float(np.abs(now - self.values).max())
        return "" if largest <= self.tolerance else f"by {largest:.3g}, tolerance {self.tolerance:.1g}"


@dataclass(frozen=True)
class StageRecord:
    number: int
    outputs: Mapping[str, Recorded]

    def moved(self, now: Outputs) -> list[str]:
        """Return a line for each output of the record that moved beyond its tolerance, or is there no more."""
        lines = ((name, recorded.moved(now.get(name))) for name, recorded in self.outputs.items())
        return [f"{name}: {words}" for name, words in lines if words]


def outputs_of(stage: str) -> Outputs:
    return STAGES[stage](lambda values: np.asarray(values, dtype=float))


def measured(stage: str, number: int) -> StageRecord:
    """Return the outputs of a stage as they are now, each with its tolerance.

    Raises ValueError for an output that amplifies rounding so much that its record would say nothing.
    """
    exact = outputs_of(stage)
    nudged = [STAGES[stage](_nudge(seed)) for seed in range(NUDGES)]
    outputs_now: dict[str, Recorded] = {}
    for name, values in exact.items():
        size = float(np.abs(values).max())
        off = max(float(np.abs(other[name] - values).max()) for other in nudged)
        tolerance = float(f"{max(ROUND_OFF, LEAST * size, MARGIN * off):.1g}")
        if tolerance > max(ROUND_OFF, MOST * size):
            raise ValueError(f"{stage}, {name}: rounding moves it by {off:.2g} of {size:.3g}")
        outputs_now[name] = Recorded(values, tolerance)
    return StageRecord(number, outputs_now)


def _nudge(seed: int) -> Nudge:
    random = np.random.default_rng(seed)
    return lambda values: np.asarray(values, dtype=float) * (1 + ROUNDING * random.standard_normal(np.shape(values)))


def read(path: Path = RECORD) -> dict[str, StageRecord]:
    """Return the record by stage; nothing if there is none."""
    content: dict[str, Any] = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}
    return {
        stage: StageRecord(
            one["number"],
            {name: Recorded(np.array(it["values"]), it["tolerance"]) for name, it in one["outputs"].items()},
        )
        for stage, one in content.items()
    }


def write(record: Mapping[str, StageRecord], path: Path = RECORD) -> None:
    """Write a record, an output a line."""
    stages = []
    for stage, one in record.items():
        lines = ",\n".join(f"  {json.dumps(name)}: {_as_line(it)}" for name, it in one.outputs.items())
        stages.append(f' "{stage}": {{"number": {one.number}, "outputs": {{\n{lines}\n }}}}')
    write_text(path, "{\n" + ",\n".join(stages) + "\n}\n")


def _as_line(output: Recorded) -> str:
    return json.dumps({"tolerance": output.tolerance, "values": [float(f"{one:.9g}") for one in output.values]})


def fault_of(stage: str, recorded: StageRecord | None, number: int, now: Outputs) -> str:
    """Return what is wrong between a stage's number, its outputs now and the record, with the remedy; or nothing."""
    remake = "then 'python -m tests.stage_record'"
    if recorded is None:
        return f"{stage}: no record. Call 'python -m tests.stage_record'."
    if number < recorded.number:
        return f"{stage}: its number is {number}, and the record is of {recorded.number}: a number never falls."
    moved = recorded.moved(now)
    if number == recorded.number and moved:
        lines = "\n  ".join(moved)
        return (
            f"{stage}: {len(moved)} of {len(recorded.outputs)} outputs moved, and its number is still {number}. "
            f"If that is meant, write {number + 1} in the __init__.py of its stage, {remake}.\n  {lines}"
        )
    return ""


def out_of_date(recorded: StageRecord, number: int, now: Outputs) -> str:
    """Return why a record is to be remade although nothing is wrong with the number; or nothing."""
    if number != recorded.number:
        return f"the record is of number {recorded.number}, and this is {number}"
    if now.keys() != recorded.outputs.keys():
        return f"outputs came or went: {', '.join(sorted(now.keys() ^ recorded.outputs.keys()))}"
    return ""
