"""A lab's folder of ten trials in ten dialects, and all that was spoilt in it: what is read, what is found, how long.

``python benchmarks/ingest.py`` makes the folder, takes it in, takes it in again, and then one with faults planted.
"""

import re
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.table import Row, finish
from sealtwin.cli.folder_answer import ingest_answer
from sealtwin.core.progress import Progress
from sealtwin.lab.ingest import ingest
from tests.lab_folder import FAULTS, HANDS, make_lab_folder

FEWEST_DIALECTS, FEWEST_FAULTS = 6, 12
SLOWEST_S = 1.0
"""A sample: a hundred of them in the time of a coffee."""


def main(scratch: Path) -> None:
    """Prints what was read and what was found; exits as every benchmark does."""
    folder = make_lab_folder(scratch / "sound")
    ingest(folder, scratch / "warm", Progress())
    began = time.perf_counter()
    first = ingest(folder, scratch / "lab", Progress())
    took_s = time.perf_counter() - began
    began = time.perf_counter()
    again = ingest(folder, scratch / "lab", Progress())
    again_s = time.perf_counter() - began

    spoilt = make_lab_folder(scratch / "spoilt")
    for fault in FAULTS:
        fault.plant(spoilt)
    told = "\n".join(ingest_answer(ingest(spoilt, scratch / "lab-of-spoilt", Progress())).lines)
    found = [re.search(f"^failed: .*{fault.says}.*$", told, flags=re.MULTILINE) for fault in FAULTS]

    print("Read as:")
    for outcome in first.outcomes:
        print(f"  {outcome.sample.name}  {outcome.dialect}")
    print("Planted, and what was said of it:")
    for fault, said in zip(FAULTS, found, strict=True):
        print(f"  {fault.what}\n    {'NOT NAMED' if said is None else said[0].removeprefix('failed: ')}")
    dialects = len({outcome.dialect for outcome in first.outcomes})
    finish(
        [
            Row("trials taken in", _count(first, "new"), "of 10", len(HANDS), len(HANDS)),
            Row("dialects", dialects, "", FEWEST_DIALECTS, len(HANDS)),
            Row("planted faults", len(FAULTS), "", FEWEST_FAULTS, 1000),
            Row("of these named", sum(said is not None for said in found), "", len(FAULTS), len(FAULTS)),
            Row("taken in again: new or revised", len(HANDS) - _count(again, "unchanged"), "", 0, 0),
            Row("time a sample", took_s / len(HANDS), "s", 0, SLOWEST_S),
            Row("time a sample that is known", again_s / len(HANDS), "s", 0, SLOWEST_S / 10),
        ]
    )


def _count(ingested, fate: str) -> int:
    return sum(outcome.fate == fate for outcome in ingested.outcomes)


if __name__ == "__main__":
    if len(sys.argv) != 1:
        sys.exit("usage: python benchmarks/ingest.py")
    with tempfile.TemporaryDirectory() as scratch:
        main(Path(scratch))
