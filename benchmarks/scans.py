"""Level and volume of the sealant, read from 40 emulated scans whose surfaces are known, and six scans to be refused.

    python -m benchmarks.scans [--first N] [--scans N] [--tool] [--faults]

No scan was taken: cracks, sealant and the faults of the scanner are drawn (``scan_cases``, ``scan_files``). The truth
is the drawn surface. The level is compared at the stations that were read. A scan that is refused counts as one whose
interval misses the truth. With ``--tool``, Open3D fits every other scan to its surface, and the level is its mean
between the walls.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from math import inf
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import get_args

import numpy as np

from benchmarks.scan_cases import Sealed, sealed_crack
from benchmarks.scan_files import Fault, write_scan
from benchmarks.scan_tool import mean_along_mm, mean_by_icp_mm, written_mm
from benchmarks.table import Row, rms, run_benchmark
from sealtwin.core.errors import InputError, present
from sealtwin.core.records import Floats, Profile
from sealtwin.core.scan_figures import ScanFigures
from sealtwin.scan.settings import Placement
from validate.readings.scan import read_scan
from validate.settings import Readings

FIRST, SCANS, LEAST_INSIDE = 400, 40, 36  # Cases before the first were tuned on
LEAST_MM3 = 50.0  # Smallest volume above the face whose relative error is judged
FAULT_OF = 28  # Number of the case with all faults: its sound scan is read
CAUSES: dict[Fault, str] = {
    "mirrored": r"mirror",
    "metres": r"units?\b",
    "inches": r"units?\b",
    "far": r"\bfar|1e\+?0?6|large|offset|shift",
    "exchanged": r"mark [12]",
    "mouth only": r"(no|without|little|few|missing|not|only)\b[^.]*\bface|face\b[^.]*\b(missing|not scanned|covered)",
}
"""Word of the cause that the message of a refusal must contain."""


@dataclass(frozen=True)
class Outcome:
    """Errors of what was read from a scan."""

    number: int
    errors_mm: Floats  # Errors of the level at the stations, (n,)
    mean_error_mm: float
    half_mm: float  # Half-width of the 95 % interval of the mean level
    volume_mm3: float  # True volume above the face
    volume_error_mm3: float
    volume_half_mm3: float
    seconds: float
    apart_mm: float | None  # Difference of the mean level from that of Open3D


def readings(path: Path, placement: Placement) -> Readings:
    # Heaps are confirmed.
    return Readings(scan=path, data="synthetic", role="held-out", placement=placement, as_written=("sign",))


def read(sealed: Sealed, path: Path, placement: Placement) -> tuple[Profile, ScanFigures, float]:
    """Return the profile, the figures of the scan, and the seconds that reading took. Raises InputError if refused."""
    begun = perf_counter()
    profile = read_scan(path, readings(path, placement), sealed.outline, sealed.solid)
    return profile, present(profile.scan, "the scan").figures, perf_counter() - begun


def outcome_of(number: int, folder: Path, tool: bool) -> Outcome | None:
    """Return the errors of a scan, and print them. None if the scan was refused."""
    sealed = sealed_crack(number)
    path, placement = write_scan(sealed, number, folder)
    try:
        profile, figures, seconds = read(sealed, path, placement)
    except InputError as refusal:
        print(f"{path.name}: refused: {refusal.fault}", flush=True)
        return None
    finally:
        if not tool:
            path.unlink()
    truth_mm, truth_mm3 = sealed.level_at_mm(profile.s_mm), sealed.over_face_mm3()
    outcome = Outcome(
        number,
        profile.level_mm - truth_mm,
        figures.mean_level_mm - mean_along_mm(profile.s_mm, truth_mm),
        figures.mean_level_95_mm,
        truth_mm3,
        figures.over_face_mm3 - truth_mm3,
        figures.over_face_95_mm3,
        seconds,
        figures.mean_level_mm - mean_by_icp_mm(sealed, written_mm(path, placement, number), profile.s_mm)
        if tool
        else None,
    )
    print(
        f"{path.name}: {len(profile.s_mm)} stations, mean {outcome.mean_error_mm:+.3f} (± {outcome.half_mm:.3f}), RMS "
        f"{rms(outcome.errors_mm):.3f} mm; volume {outcome.volume_error_mm3:+.1f} (± {outcome.volume_half_mm3:.1f}) of "
        f"{truth_mm3:.0f} mm³; {'points' if placement.points else 'mouth'}; {sealed.solid.tilt}; {seconds:.1f} s"
        + (f"; Open3D {outcome.apart_mm:+.3f} mm" if tool else ""),
        flush=True,
    )
    return outcome


def refusals(folder: Path) -> Iterator[Row]:
    """Read a scan with each fault, and print the messages."""
    sealed, named, refused = sealed_crack(FAULT_OF), 0, 0
    for fault in get_args(Fault):
        path, placement = write_scan(sealed, FAULT_OF, folder, fault)
        try:
            _, figures, _ = read(sealed, path, placement)
            print(f"{fault}: not refused, mean level {figures.mean_level_mm:.3f} mm")
        except InputError as refusal:
            refused += 1
            named += bool(re.search(CAUSES[fault], refusal.fault, re.IGNORECASE))
            print(f"{fault}: {refusal.fault}", flush=True)
    yield Row("faulty scans refused", refused, "of 6", 6, 6)
    yield Row("refusals that name the cause", named, "of 6", 6, 6)


def main(first: int = FIRST, scans: int = SCANS, tool: bool = False, faults: bool = True) -> list[Row]:
    if tool and find_spec("open3d") is None:
        print("Open3D is not installed, so its rows are skipped.")
        tool = False
    with TemporaryDirectory() as name:
        seen = [outcome_of(number, Path(name), tool and number % 2 == 0) for number in range(first, first + scans)]
        table = list(_rows([outcome for outcome in seen if outcome is not None], scans))
        return [*table, *refusals(Path(name))] if faults else table


def _rows(outcomes: Sequence[Outcome], scans: int) -> Iterator[Row]:
    errors_mm = np.abs([outcome.mean_error_mm for outcome in outcomes])
    halves_mm = np.array([outcome.half_mm for outcome in outcomes])
    inside = float((errors_mm <= halves_mm).sum())
    yield Row("scans read", len(outcomes), f"of {scans}")
    yield Row("error of the mean level: mean over scans", float(errors_mm.mean()), "mm", 0.0, 0.05)
    yield Row("error of the mean level: largest", float(errors_mm.max()), "mm")
    yield Row("level along the crack: RMS error", rms(np.concatenate([o.errors_mm for o in outcomes])), "mm", 0.0, 0.15)
    least, most = (LEAST_INSIDE, SCANS) if scans == SCANS else (0, inf)  # A part of the scans has no target
    yield Row("mean level in its 95 % interval", inside, f"of {scans}", least, most)
    yield Row("half-width of that interval: largest", float(halves_mm.max()), "mm", 0.0, 0.1)
    yield Row("half-width of that interval: median", float(np.median(halves_mm)), "mm")
    heaps = [outcome for outcome in outcomes if outcome.volume_mm3 >= LEAST_MM3]
    if heaps:
        percent = [100 * abs(heap.volume_error_mm3) / heap.volume_mm3 for heap in heaps]
        inside = sum(abs(heap.volume_error_mm3) <= heap.volume_half_mm3 for heap in heaps)
        yield Row("volume above the face: median error", float(np.median(percent)), "%", 0.0, 3.0)
        yield Row("volume above the face: largest error", max(percent), "%")
        yield Row("volume in its 95 % interval", inside, f"of {len(heaps)}")
    apart_mm = np.abs([outcome.apart_mm for outcome in outcomes if outcome.apart_mm is not None])
    if len(apart_mm):
        yield Row(f"mean level, apart from Open3D: largest of {len(apart_mm)}", float(apart_mm.max()), "mm", 0.0, 0.03)
    yield Row("slowest scan", max(outcome.seconds for outcome in outcomes), "s")


if __name__ == "__main__":
    run_benchmark(main)
