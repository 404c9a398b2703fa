"""What became of a case: its exit code, its time, its resident memory, and the files that it must not lose."""

import random
import shutil
import signal
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

from benchmarks.fuzz_kinds import KINDS, READ_BY, Case
from benchmarks.fuzz_lab import ACCEPTED, MINE
from benchmarks.fuzz_process import LONGEST_S, in_a_process

AS_IT_IS = -1  # Number of the case of a kind whose input is left as it is
LARGEST_GB = 1.0
FAILURES = ("traceback", "too long", "too large", "file lost")


@dataclass(frozen=True)
class Ending:
    """How a command ended. ``outcome`` is one of ``FAILURES``, or accepted, usage, one sentence."""

    outcome: str
    report: str  # Command with what it printed, or with its traceback
    peak_gb: float  # Largest resident memory of its process, or of one that it started


def judged(kind: str, number: int, seed: int, sound: Path, lab: Path) -> Ending:
    """Make a case in the folder ``lab``, call its command there, and return how it ended."""
    shutil.copytree(sound, lab)
    case = Case(random.Random(f"{kind} {number} {seed}"), lab, sound=number == AS_IT_IS)
    return called(KINDS[kind](case), f"{kind} {number}", lab)


def called(arguments: list[str], name: str, lab: Path) -> Ending:
    before = written_by_user(lab)
    exit_code, output, peak_gb = in_a_process(arguments, lab)
    if exit_code == signal.SIGALRM:
        outcome, output = "too long", f"over {LONGEST_S} s"
    elif exit_code in (1, 130) or exit_code < 0:
        outcome = "traceback"
    elif peak_gb > LARGEST_GB:
        outcome, output = "too large", f"{peak_gb:.2f} GB resident"
    elif lost := lost_files(before, lab):
        outcome, output = "file lost", f"lost {', '.join(lost)}"
    else:
        outcome = "accepted" if exit_code in ACCEPTED else "usage" if exit_code == 2 else "one sentence"
    line = " ".join(repr(word)[:80] for word in arguments)
    return Ending(outcome, f"{name}: sealtwin {line}\n{output}", peak_gb)


def written_by_user(lab: Path) -> dict[str, str]:
    """Return hashes of what must be on the disk afterwards under any name: all but what commands wrote, and may renew.

    A file of the user's in a folder of a command's is among them.
    """
    made = {"twin", *READ_BY}
    names = {str(path.relative_to(lab)) for path in lab.rglob("*") if path.is_file()}
    return {name: _sha256(lab / name) for name in names if name in MINE or Path(name).parts[0] not in made}


def lost_files(before: dict[str, str], lab: Path) -> list[str]:
    """Return names of files whose bytes are on no disk any more."""
    after = {_sha256(path) for path in lab.rglob("*") if path.is_file()}
    return [name for name, digest in before.items() if digest not in after]


def _sha256(path: Path) -> str:
    return sha256(path.read_bytes()).hexdigest()
