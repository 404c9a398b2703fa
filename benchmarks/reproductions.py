"""Small inputs that were answered wrongly once: each by the command itself, a line each.

    python -m benchmarks.reproductions ../shared/review3/repro [--only NAME ...]

The inputs are another's, in a folder each, and stay where they are. An answer is sound if it refuses with exit code 3,
or is right with exit code 0, and prints the words that say so. Files written go to a temporary folder.
"""

import os
import resource
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Annotated

from typer import Option

from benchmarks import reproduced_folders as folders
from benchmarks.table import Row, leave, run_benchmark

LIMIT_S = 120
MEMORY_BYTES = 4_000_000_000
IN_PYTHON = """import sys, sealtwin as st
try:
    print({})
except st.InputError as fault:
    sys.exit(print(fault) or 3)"""


@dataclass(frozen=True)
class Answer:
    """A command on the files of a folder, and what a sound answer to it has."""

    name: str
    command: str
    """Words after ``sealtwin``, or an expression with ``st``; {out} is an empty folder to write to."""
    says: tuple[str, ...]
    """Words of the answer, in small letters."""
    exit_codes: tuple[int, ...] = (3,)
    lacks: tuple[str, ...] = ()
    files: str = ""
    """Folder of the inputs, if it is not that of ``name``."""
    prepare: Callable[[Path], None] = lambda _: None
    """Adds to the copy of the inputs, in which the command runs."""
    environment: Mapping[str, str] = field(default_factory=dict)
    largest_file_bytes: int = resource.RLIM_INFINITY
    """Size at which writing a file fails, as on a full disk."""


DXF = "--depth-mm 10 --out {out}/run"
LINE = f"--line CENTRELINE --width-mm 3 {DXF}"
PHOTO = "--depth-mm 10 --mm-per-px 0.2 --out {out}/run"
RHEOMETER = "--data measured --density-kg-m3 1690 --out {out}/m.toml"

ANSWERS = (
    Answer("crack_brighter_than_ground", f"digitise photo.jpg {PHOTO} --ends 43,132 407,160", ("bright",)),
    Answer("dxf_drawn_in_xz", f"import-dxf xz.dxf {LINE}", ("centreline", "mm")),
    Answer("dxf_duplicate_line", f"import-dxf twice.dxf {DXF}", ("twice",), (0, 3), ("0 mm2",)),
    Answer("dxf_gap_without_place", f"import-dxf gap.dxf {LINE}", ("0.004 mm",), (0, 3)),
    Answer("dxf_hidden_layer_taken", f"import-dxf hidden.dxf {DXF}", ("outline", "off"), (0, 3)),
    Answer("dxf_in_block", f"import-dxf block.dxf {LINE}", ("block",), (0, 3)),
    Answer("dxf_inch_by_default", f"import-dxf inch.dxf {LINE}", ("inch",), (0,)),
    Answer(
        "dxf_inch_by_default --units mm", f"import-dxf inch.dxf {LINE} --units mm", ("states inch", "20.4 mm"), (0, 3)
    ),
    Answer("dxf_other_layer_spoils", f"import-dxf polyface.dxf {DXF}", (), (0,)),
    Answer("dxf_other_layer_spoils far", f"import-dxf far.dxf {DXF}", (), (0,)),
    Answer("dxf_side_arm_without_nozzle", f"import-dxf y.dxf {DXF}", ("arm",), (0,)),
    Answer("dxf_spline_fit_frame", f"import-dxf curve.dxf {LINE}", ("60.4 mm",), (0,)),
    Answer("dxf_two_outlines", f"import-dxf two.dxf {DXF}", ("outline", "beside"), (0, 3)),
    Answer("dxf_wrapper_messages", f"import-dxf disc.dxf {DXF}", ("face",), lacks=("check up",)),
    Answer("mask_labels_0_1", f"digitise photo.jpg --mask mask.png {PHOTO}", ("1 of 255",)),
    Answer("mask_line", "digitise photo.jpg --mask mask.png --depth-mm 10 --mm-per-px 0.1 --out {out}/run", ("line",)),
    Answer("mask_misplaced turned", f"digitise photo.jpg --mask mask_turned_180.png {PHOTO}", ("dark",), (0, 3)),
    Answer("mask_misplaced low", f"digitise photo.jpg --mask mask_45px_low.png {PHOTO}", ("dark",), (0, 3)),
    Answer("mask_misplaced right", f"digitise photo.jpg --mask mask_right.png {PHOTO}", (), (0,), ("darker",)),
    Answer("mask_rgba_opaque", f"digitise photo.jpg --mask mask.png {PHOTO}", (), (0,)),
    Answer(
        "mesh_pocket_no_crack", "import-mesh pocket.stl --units mm --out {out}/run", ("long",), lacks=("px", "--ends")
    ),
    Answer(
        "path_jumps_to_joint",
        "digitise photo.jpg --set photo.path_only=true --mm-per-px 0.2 --ends 202,7 213,412 --out {out}/run",
        ("--via",),
        (0, 3),
    ),
    Answer("photo_linear_gamma", f"digitise linear.png {PHOTO} --ends 43,132 407,160", ("gamma",), (0, 3)),
    Answer("stl_far_from_origin", "import-mesh far.stl --units mm --out {out}/run", ("0.5 mm",), (0, 3)),
    Answer("stl_trailing_bytes", "import-mesh m.stl --units mm --out {out}/run", ("3 bytes",), (0, 3)),
    Answer(
        "wide_crack_at_border",
        "digitise wedge.png --ends 14,129 540,363 --depth-mm 10 --mm-per-px 0.1 --out {out}/run",
        ("border",),
        (0, 3),
        ("inside --roi",),
    ),
    Answer(
        "wide_dark_crack_in_coarse_ground_refused",
        f"digitise photo.jpg {PHOTO} --ends 12,250 628,240",
        ("--mask",),
        (0, 3),
    ),
    Answer(
        "r1 plateau", f"material rheometer plateau3.csv {RHEOMETER}", ("plateau3.csv", "viscosity"), files="files/r1"
    ),
    Answer("r1 flat", f"material rheometer flat.csv {RHEOMETER}", ("flat.csv", "viscosity"), files="files/r1"),
    Answer("r1 flat12", f"material rheometer flat12.csv {RHEOMETER}", ("flat12.csv", "viscosity"), files="files/r1"),
    Answer("s1 tenths", 'st.read_readings("tenth_mm.csv").level_mm', ("2.15",), (0,), files="files/s1"),
    Answer("s1 0.1 mm", 'st.read_readings("a02c.csv").level_mm', ("a02c.csv", "0.1 mm"), files="files/s1"),
    Answer("s2", 'st.read_readings("unit_column.csv", unit="mm")', ("unit_column.csv", "inch"), files="files/s2"),
    Answer("s3", 'st.read_readings("excel_error.ods")', ("excel_error.ods", "error"), files="files/s3"),
    Answer("s4", 'st.read_readings("xlsxwriter_zero.xlsx")', ("xlsxwriter_zero.xlsx", "formula"), files="files/s4"),
    Answer("c1 catalogue", "lab list .", ("catalogue.json", "faults"), files="files/c1"),
    Answer(
        "k1 cache",
        "doctor",
        ("kernels compiled, run and recorded",),
        (0,),
        files="files/k1",
        prepare=folders.damaged_kernels,
        environment={"WARP_CACHE_PATH": folders.CACHE},
    ),
    Answer("o1 film", "film RUN --out x.gif", ("frames", "device"), files="files/o1", prepare=folders.filmed),
    Answer(
        "o1 film pipe", "film RUN --out x.gif", ("frames", "pipe"), files="files/o1", prepare=folders.filmed_by_a_pipe
    ),
    Answer(
        "o1 loop",
        "loop PLAN --replay PLAN/loop-1.jsonl",
        ("loop.json", "device"),
        files="files/o1",
        prepare=folders.looped,
    ),
    Answer(
        "f1 outcome",
        "sweep status STUDY",
        ("outcome.json", "wall_s"),
        files="files/f1",
        prepare=folders.outcome_of_a_list,
    ),
    Answer(
        "e1 cp1252",
        "digitise trial.toml --out p\u0142yta",
        ("p\\u0142yta",),
        (0,),
        files="files/o1",
        prepare=folders.digitised,
        environment={"PYTHONIOENCODING": "cp1252"},
    ),
    Answer(
        "e2 home",
        "simulate RUN --device cpu",
        ("warp_cache_path",),
        files="files/o1",
        prepare=folders.digitised,
        environment={"HOME": "/dev/null"},
    ),
    Answer(
        "e3 full disk",
        "simulate RUN --device cpu",
        ("warp_cache_path", "cache"),
        files="files/k1",
        prepare=folders.digitised,
        environment={"WARP_CACHE_PATH": folders.CACHE},
        largest_file_bytes=300_000,
    ),
)


def main(
    inputs: Path, only: Annotated[list[str] | None, Option(help="beginning of a name; may be given again")] = None
) -> list[Row]:
    rows = []
    for answer in ANSWERS:
        if not only or any(answer.name.startswith(name) for name in only):
            line, sound = judge(answer, inputs.resolve())
            print(f"{'sound' if sound else 'WRONG':<6}{answer.name}: {line}", flush=True)
            rows.append(Row(answer.name, float(sound), "", 1, 1))
    return rows


def judge(answer: Answer, inputs: Path) -> tuple[str, bool]:
    """Return the exit code and the last words of an answer, and whether it is sound."""
    with tempfile.TemporaryDirectory() as scratch:
        given, out = Path(scratch) / "given", Path(scratch) / "out"
        shutil.copytree(inputs / (answer.files or answer.name.split()[0]), given)
        out.mkdir()
        answer.prepare(given)
        ended = run_in(given, out, answer.command, answer.environment, answer.largest_file_bytes)
    if ended is None:
        return f"not done in {LIMIT_S} s", False
    printed = f"{ended.stdout}\n{ended.stderr}"
    small = printed.lower()
    lacking = [word for word in answer.says if word not in small] + [word for word in answer.lacks if word in small]
    sound = ended.returncode in answer.exit_codes and not lacking and "Traceback" not in printed
    return f"exit {ended.returncode}{f', lacking {lacking}' if lacking else ''}: {last_words(ended)}", sound


def run_in(
    given: Path,
    out: Path,
    command: str,
    environment: Mapping[str, str] = MappingProxyType({}),
    largest_file_bytes: int = resource.RLIM_INFINITY,
) -> "subprocess.CompletedProcess[str] | None":
    """Run a command in the folder of its inputs, in bounded time and memory. Return None if it is not done in time."""
    words = ["-m", "sealtwin", *(word.format(out=out) for word in command.split())]
    if command.startswith("st."):
        words = ["-c", IN_PYTHON.format(command)]
    try:
        return subprocess.run(
            [sys.executable, *words],
            cwd=given,
            env={**os.environ, **environment},
            capture_output=True,
            text=True,
            timeout=LIMIT_S,
            preexec_fn=lambda: _bound(largest_file_bytes),
            check=False,
        )
    except subprocess.TimeoutExpired:
        return None


def last_words(ended: "subprocess.CompletedProcess[str]") -> str:
    return " ".join((ended.stderr.strip() or ended.stdout.strip()).split())[-300:]


def _bound(largest_file_bytes: int) -> None:
    resource.setrlimit(resource.RLIMIT_FSIZE, (largest_file_bytes, largest_file_bytes))
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))


if __name__ == "__main__":
    run_benchmark(main, leave)
