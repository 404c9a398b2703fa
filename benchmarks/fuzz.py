"""Damaged inputs: each command ends with an exit code and a sentence, and no file of the user's is lost. Linux only.

    python -m benchmarks.fuzz [--cases 1000] [--seed 0] [--only KIND] [--keep DIR]

A case takes a sound input of its kind, mutates it, and calls one command on it in a copy of a small lab, in a process
of its own. It fails by a traceback (or exit code 1, a bug; or a signal that ends it), by taking over a minute of
processor time or over 1 GB of resident memory, or if bytes that the user wrote are on no disk any more. Cases follow
from seed and number alone; --keep leaves the folders of those that failed. Every command is first called with its
input as it is, which must be accepted: mutating what is refused anyway would find nothing.
"""

import shlex
import shutil
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import Annotated

from benchmarks.fuzz_endings import AS_IT_IS, FAILURES, LARGEST_GB, Ending, called, judged
from benchmarks.fuzz_kinds import KINDS, READ_BY
from benchmarks.fuzz_lab import sound_lab
from benchmarks.fuzz_process import import_all
from benchmarks.table import Row, one_of, run_benchmark


def fuzz(cases: int, seed: int, kinds: list[str], keep: Path | None) -> dict[str, list[Ending]]:
    """Run cases of each kind in turn; return their endings by kind, and print failures as they come."""
    endings: dict[str, list[Ending]] = {kind: [] for kind in kinds}
    with tempfile.TemporaryDirectory(prefix="sealtwin-fuzz-") as home:
        sound, lab = Path(home) / "sound", Path(home) / "case"
        sound_lab(sound)
        require_sound(seed, kinds, sound, lab)
        for number in range(cases):
            kind = kinds[number % len(kinds)]
            ending = judged(kind, number, seed, sound, lab)
            endings[kind].append(ending)
            if ending.outcome in FAILURES:
                print(f"{ending.outcome}: {ending.report}", file=sys.stderr, flush=True)
                if keep is not None:
                    shutil.copytree(lab, keep / f"{number}", dirs_exist_ok=True)
            shutil.rmtree(lab)
    return endings


def require_sound(seed: int, kinds: list[str], sound: Path, lab: Path) -> None:
    """Call every command with its input as it is. Raises RuntimeError if one is refused."""
    folders = [folder for folder in READ_BY if f"{folder} folder" in kinds]
    for name in [*kinds, *(line for folder in folders for line in READ_BY[folder])]:
        if name in KINDS:
            ending = judged(name, AS_IT_IS, seed, sound, lab)
        else:
            shutil.copytree(sound, lab)
            ending = called(shlex.split(name), name, lab)
        if ending.outcome != "accepted":
            raise RuntimeError(f"a sound input ended with: {ending.outcome}; {ending.report}")
        shutil.rmtree(lab)


def main(
    cases: int = 1000, seed: int = 0, only: Annotated[list[str] | None, one_of(KINDS)] = None, keep: Path | None = None
) -> list[Row]:
    began = time.monotonic()
    import_all()
    endings = fuzz(cases, seed, only or list(KINDS), keep)
    for kind, some in endings.items():
        outcomes = Counter(each.outcome for each in some)
        counts = ", ".join(f"{count} {name}" for name, count in outcomes.most_common())
        print(f"{kind:<15} {len(some):4d}: {counts}; {max((each.peak_gb for each in some), default=0):.2f} GB")
    everything = [each for some in endings.values() for each in some]
    print(f"{len(everything)} cases in {time.monotonic() - began:.0f} s")
    outcomes = Counter(each.outcome for each in everything)
    peak_gb = max((each.peak_gb for each in everything), default=0.0)
    # A file lost is one case, however many it lost.
    return [
        *(Row(f"mutated inputs that end with: {name}", outcomes[name], "", high=0) for name in FAILURES),
        Row("largest resident memory of a case", peak_gb, "GB", high=LARGEST_GB),
    ]


if __name__ == "__main__":
    run_benchmark(main)
