"""Whether a renovation moved a number: 35 runs of the command, recorded once and compared exactly afterwards.

    python -m benchmarks.golden record DIR                   before the renovation
    python -m benchmarks.golden compare DIR [--look DIR]     after each step of it
    python -m benchmarks.golden compare DIR --only 'trace-*'

The command line and the trial file's format stay, modules do not: everything goes through ``python -m sealtwin``, and
nothing of the packages is imported. Every number, key, word and vertex must be identical, apart from what ``VOLATILE``
lists; renamed keys and files stand in ``RENAMED``, numbers that moved on purpose in ``MOVED``. Prose, pictures and
reports are not compared number by number: those that differ are named, and ``--look`` lays old beside new.
"""

import csv
import fnmatch
import io
import itertools
import json
import math
import re
import shutil
import sys
import tempfile
import threading
import tomllib
import zlib
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from decimal import Decimal
from pathlib import Path
from typing import Annotated, Literal

import trimesh
from typer import Argument, BadParameter, Option

from benchmarks.golden_cases import CASES, ROOT, Bench, Case
from benchmarks.table import run_benchmark

OF_RUN: dict[str, str] = {
    **{name: f"sample/{name}" for name in (
        "data", "length_mm", "mean_width_mm", "width_source", "width_95_mm", "cavity_volume_mm3",
        "cavity_volume_95_mm3", "weighed", "sealant_mm3", "path_source", "scale_source", "mm_per_px",
        "scale_uncertainty", "scale_residual_mm", "camera_tilt_deg", "warnings",
    )},
    **{name: f"fluid/{name}" for name in (
        "particles", "escaped_particles", "spilled_particles", "volume_ratio", "device",
    )},
    **{name: f"comparison/{name}" for name in (
        "mean_error_mm", "worst_error_mm", "worst_at_mm", "flat_level_error_mm", "beats_flat_level", "baselines",
        "beats_baseline", "outcome", "headline", "findings",
    )},
    "fluid_warnings": "fluid/warnings",
    "gate_passed": "comparison/passed",
    "readings_role": "comparison/role",
    "readings_fitted": "comparison/fitted",
    "mean_error_95_mm": "comparison/uncertainty/mean_error_interval_mm",
    "mean_level": "comparison/uncertainty/mean_level",
    "worst_at_a_station": "comparison/uncertainty/worst_at_a_station",
}  # fmt: skip
"""Keys of run.json, old to new."""
RENAMED: dict[str, str] = {
    **{f"run.json#/{old}": f"/{new}" for old, new in OF_RUN.items()},
    "comparison.json#/readings": "/scatter",
    "comparison.json#uncertainty/mean_error_mm": "uncertainty/mean_error_interval_mm",
    "comparison.json#uncertainty/bias_mm": "uncertainty/bias_interval_mm",
    **{f"comparison.json#/{name}": f"/volumes/{name}" for name in (
        "volume_balance_level_mm", "volume_balance_error_mm", "beats_volume_balance", "mass_balance",
    )},
    **{f"report.json#/verdict/{name}": f"/{name}" for name in ("headline", "outcome", "edited", "photo_data")},
    **{f"report.json#/verdict/{name}": f"/comparison/{name}" for name in ("findings", "fitted", "role")},
    "report.json#/verdict/readings_data": "/readings/data",
    "report.json#/verdict/gate_reason": "/comparison/gate/reason",
    "report.json#/verdict/mean_error_limit_mm": "/comparison/gate/mean_error_mm",
    "report.json#/baselines": "/comparison/baselines",
    "report.json#/error_by_bin": "/comparison/error_by_bin",
    "report.json#/shifts": "/comparison/uncertainty/alignment/shifts",
    **{f"report.json#/uncertainty/{name}": f"/comparison/uncertainty/budget/{name}" for name in ("parts", "missing")},
    **{f"report.json#/uncertainty/{name}": f"/comparison/uncertainty/mean_level/{name}" for name in (
        "error_mm", "volume_level_mm", "data_mm", "numerics_mm", "inputs_mm", "validation_mm", "resolved",
    )},
}  # fmt: skip
"""Old to new. ``"health.csv": "record.csv"`` renames a file in any folder. ``"FILE#a/b": "a/c"`` renames a key, or a
run of keys, at any depth of each file whose name fits the pattern FILE; with a leading slash, ``"*.json#/a": "/b"``,
at its root only. Columns of a CSV are keys.
"""


Change = Literal["came", "went", "rounded", "moved"]
"""A new key, one that is gone, a number with more figures than before, or another value."""


@dataclass(frozen=True)
class Rule:
    """Keys, by patterns of case, file and key, and why they may differ. A key is its path: ``stages/digitise/key``."""

    file: str
    key: str
    reason: str
    case: str = "*"
    changes: tuple[Change, ...] = ("moved",)  # Of a rule in MOVED, as few as can be: a wide rule hides a difference

    def covers(self, case: str, file: str, key: str) -> bool:
        return (
            fnmatch.fnmatchcase(case, self.case)
            and fnmatch.fnmatchcase(file, self.file)
            and fnmatch.fnmatchcase(key, self.key)
        )


OF_A_TRIAL = "[mst]*-*"  # Cases whose answer is run.json: mesh-, sheet-, trace-, trial-
MOVED: tuple[Rule, ...] = (
    Rule("sweep/runs/*", "*health/volume_ratio", "a study's run records it as a trial's does", "sweep", ("came",)),
    Rule("*.json", "*health/kernels_a_frame", "CPUs solve the viscosity with two launches fewer"),
    Rule("*run.json", "version", "parts of a result are records of their own, with all their figures, not rounded"),
    Rule("*run.json", "sample/*", "likewise", changes=("rounded",)),
    Rule("*run.json", "fluid*", "likewise", changes=("came", "rounded")),
    Rule("*run.json", "comparison*", "likewise", changes=("came", "rounded")),
    Rule("*run.json", "prediction", "likewise", changes=("came",)),
    Rule("*run.json", "earlier_trials", "likewise", changes=("came",)),
    Rule("*run.json", "report", "null before there is one", changes=("came",)),
    Rule("*run.json", "verdict", "its sentences are those of the headline", changes=("went",)),
    Rule("*run.json", "particle_sizes", "they are comparison/uncertainty/numerics", changes=("went",)),
    Rule("*run.json", "inputs_m*", "they are comparison/uncertainty/inputs", changes=("went",)),
    Rule("answer-*.json", "answer/version", "the answer is run.json", OF_A_TRIAL),
    *(
        Rule("answer-*.json", f"answer/{part}*", "likewise", OF_A_TRIAL, ("came",))
        for part in ("sample", "fluid", "comparison", "prediction", "earlier_trials", "report")
    ),
    *(
        Rule("answer-*.json", f"answer/{key}*", "likewise", OF_A_TRIAL, ("went",))
        for key in (*OF_RUN, "verdict", "particle_sizes", "inputs_m")
    ),
    Rule("*comparison.json", "verdict", "its sentences are those of the headline", changes=("went",)),
    Rule("*comparison.json", "uncertainty/worst_at_a_station*", "it was in run.json alone", changes=("came",)),
    Rule("*report.json", "schema_version", "report.json has the comparison as comparison.json has it"),
    Rule("*report.json", "comparison*", "likewise", changes=("came",)),
    Rule("*report.json", "uncertainty/*", "likewise; its sentences are all that is left", changes=("came", "went")),
    *(
        Rule("*report.json", key, "likewise", changes=("went",))
        for key in ("metrics/*", "settled/*", "verdict/sentence", "sizes", "inputs", "*/interval_95")
    ),
)
"""Numbers that moved, came or went on purpose since the record was made; the changelog has them too."""

VOLATILE = (
    Rule("*.json", "*wall_time_s", "a duration"),
    Rule("*.json", "*wall_s", "a duration"),
    Rule("*runs.csv", "wall_s/*", "a duration"),
    Rule("*simulation.json", "*/setup_s", "a duration"),
    Rule("*simulation.json", "*/frames_s", "a duration"),
    Rule("*summary.json", "*/setup_s", "a duration"),
    Rule("*summary.json", "*/frames_s", "a duration"),
    Rule("*outcome.json", "*/setup_s", "a duration"),
    Rule("*outcome.json", "*/frames_s", "a duration"),
    Rule("sweep/*.json", "*_unix_s", "a point in time"),
    Rule("*report.json", "*/setup_s/value", "a duration"),
    Rule("*report.json", "*/frames_s/value", "a duration"),
    Rule("*.json", "*left_s", "an estimate of a duration"),
    Rule("*.json", "*eta_s", "an estimate of a duration"),
    Rule("*health.csv", "ms_a_frame/*", "a duration"),
    Rule("*manifest.json", "*/versions/*", "versions of packages"),
    Rule("*record.json", "sealtwin", "the package's version"),
    Rule("*catalogue.json", "checked/*", "the package's version"),
    Rule("*record.json", "files/*/size_bytes", "size of a workbook, whose compression may change"),
    Rule("*robot.json", "made_by", "the package's version"),
    Rule("answer-*.json", "answer/made_by", "the package's version"),
)
"""Hashes and points in time are volatile too, wherever they stand in a word or a text: see ``_settled``."""

NOT_RECORDED = {
    "*.lock": "empty",
    "*.sqlite": "a database of an earlier version",
    "*.xlsx": "a copy of what this benchmark wrote, with its time",
    "inputs/*": "copies of what this benchmark wrote",
    "*/inputs/*": "copies of what this benchmark wrote",
}
"""Patterns of files that are left out, and why."""

HASH = re.compile(r"\b(?=[0-9]*[a-f])[0-9a-f]{12,64}\b")
"""Hashes hold versions, settings' names or the text of files whose numbers are compared anyway."""
MOMENT = re.compile(r"\b\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d(\.\d+)?(Z|[+-]\d\d:\d\d)?")
DURATION = re.compile(r"\b\d+(\.\d+)? (ms|s|min|h)\b")
"""In a sentence or a report, where it may be the computer's."""
PROGRESS = re.compile(r"^[A-Z][\w ]*: \d+%.*\n", re.MULTILINE)
"""A line of progress on standard error: how many come depends on the clock."""
CLOCKED = {
    "*health.png": "plots the computing time of each frame",
    "*report.pdf": "prints points in time and durations, compressed; report.html says the same",
}
"""Patterns of pictures and reports that differ on every run, and why; only ``--look`` shows them."""
NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
COMMENTS = {".prg": "'", ".gcode": ";", ".script": "#", ".txt": "#"}
"""Programs and waypoints, compared as words and numbers without what follows these marks."""
MESHES = {".stl", ".ply", ".glb"}
LOOKED_AT = {".html", ".md", ".pdf", ".png", ".jpg", ".stderr", ".svg"}
TEXTS = {".csv", ".html", ".json", ".md", ".stderr", ".svg", ".toml", *COMMENTS}
LINES_A_FILE = 8
"""Differences that are printed of one file; the others are counted."""

Value = float | bool | str | None
Numbered = int | float


class Missing:
    """No value under this key."""

    def __repr__(self) -> str:
        return "-"


MISSING = Missing()


@dataclass(frozen=True)
class Difference:
    case: str
    file: str
    key: str
    old: object
    new: object

    @property
    def change(self) -> Change:
        if self.old is MISSING or self.new is MISSING:
            return "came" if self.old is MISSING else "went"
        if isinstance(self.old, float) and isinstance(self.new, float) and math.isfinite(self.old):
            decimals = -int(Decimal(repr(self.old)).as_tuple().exponent)
            return "rounded" if round(self.new, decimals) == self.old else "moved"
        return "moved"

    def __str__(self) -> str:
        return f"  {self.case}  {self.file}  {self.key}: {self.old!r} -> {self.new!r}"


@dataclass
class Findings:
    """What a comparison of one case, or of one file, came to."""

    case: str = ""
    numbers: int = 0
    """Compared, identical or not."""
    differing: list[Difference] = field(default_factory=list)
    moved: list[Difference] = field(default_factory=list)
    look: dict[str, str] = field(default_factory=dict)
    """Files that somebody should look at, by their new names, and why."""
    clocked: set[str] = field(default_factory=set)
    """Files that differ, as on every run."""

    def add(self, other: "Findings") -> None:
        self.numbers += other.numbers
        self.differing += other.differing
        self.moved += other.moved
        self.look |= other.look
        self.clocked |= other.clocked


def main(
    verb: Annotated[str, Argument(help="record or compare", metavar="VERB")],
    folder: Annotated[Path, Argument(help="the record: a folder for each case", metavar="DIR")],
    only: Annotated[list[str] | None, Option(help="cases by name or pattern; may be given again")] = None,
    look: Annotated[Path | None, Option(help="gets old and new copies of what is to be looked at")] = None,
) -> None:
    patterns = only or ["*"]
    chosen = [case for case in CASES if any(fnmatch.fnmatchcase(case.name, pattern) for pattern in patterns)]
    if not chosen:
        raise BadParameter(f"--only {' '.join(patterns)}: no such case; there are {', '.join(it.name for it in CASES)}")
    if verb == "record":
        sys.exit(_record(chosen, folder))
    if verb != "compare" or not folder.is_dir():
        raise BadParameter(f"{verb} {folder}: no such record; make it: python -m benchmarks.golden record {folder}")
    sys.exit(_compare(chosen, folder, look))


def _record(chosen: Sequence[Case], folder: Path) -> int:
    with tempfile.TemporaryDirectory() as scratch:
        failures = _run(chosen, Path(scratch))
        for case in chosen:
            old = folder / case.name
            if old.exists():
                shutil.rmtree(old)
            store(Path(scratch) / case.name / "out", old, Path(scratch))
    for failure in itertools.chain.from_iterable(failures.values()):
        print(failure)
    sound = sum(not failures[case.name] for case in chosen)
    print(f"{sound} of {len(chosen)} cases recorded")
    return 0 if sound == len(chosen) else 1


def _compare(chosen: Sequence[Case], folder: Path, look: Path | None) -> int:
    with tempfile.TemporaryDirectory() as scratch:
        failures = _run(chosen, Path(scratch))
        results = []
        for case in chosen:
            new = Path(scratch) / "stored" / case.name
            store(Path(scratch) / case.name / "out", new, Path(scratch))
            results.append(compare_case(case.name, folder / case.name, new))
            if look is not None:
                _lay_out({*results[-1].look, *results[-1].clocked}, folder / case.name, new, look / case.name)
    for case, result in zip(chosen, results, strict=True):
        for failure in failures[case.name]:
            print(f"{case.name}: {failure}")
        _print_differences(result)
    print(f"{'case':<24} {'numbers':>9} {'differing':>9} {'moved':>9} {'to be looked at':>16}")
    for case, result in zip(chosen, results, strict=True):
        counts = (result.numbers, len(result.differing), len(result.moved), len(result.look))
        print(f"{case.name:<24} {counts[0]:>9} {counts[1]:>9} {counts[2]:>9} {counts[3]:>16}")
    identical = sum(not result.differing for result in results)
    print(f"{identical} of {len(chosen)} cases identical")
    return 0 if identical == len(chosen) else 1


def _run(chosen: Sequence[Case], scratch: Path) -> dict[str, list[str]]:
    """Run the cases and those that they need, two at a time; returns what failed in each."""
    wanted = {name for case in chosen for name in (case.name, *case.needs)}
    started: dict[str, Future[list[str]]] = {}
    lock = threading.Lock()

    def work(case: Case) -> list[str]:
        for name in case.needs:
            started[name].result()
        given, out = scratch / case.name / "given", scratch / case.name / "out"
        given.mkdir(parents=True)
        out.mkdir()
        bench = Bench(given, out, {name: scratch / name / "out" for name in case.needs})
        case.run(bench)
        with lock:
            print(f"ran {case.name}", file=sys.stderr)
        return bench.failures

    with ThreadPoolExecutor(max_workers=2) as pool:
        for case in CASES:
            if case.name in wanted:
                started[case.name] = pool.submit(work, case)
        return {name: future.result() for name, future in started.items()}


def store(out: Path, to: Path, scratch: Path) -> None:
    """Copy what is to be recorded, with words in place of this call's absolute paths."""
    to.mkdir(parents=True)
    for path in sorted(path for path in out.rglob("*") if path.is_file()):
        name = path.relative_to(out).as_posix()
        if any(fnmatch.fnmatchcase(name, pattern) for pattern in NOT_RECORDED):
            continue
        content = path.read_bytes()
        if path.suffix in TEXTS:
            content = content.replace(bytes(scratch), b"SCRATCH").replace(bytes(ROOT), b"ROOT")
        (to / name).parent.mkdir(parents=True, exist_ok=True)
        (to / name).write_bytes(content)


def compare_case(case: str, old: Path, new: Path) -> Findings:
    """Compare two stored folders, file by file, under the new names."""
    findings = Findings(case)
    before, after = ({path.relative_to(at).as_posix(): path for path in _files(at)} for at in (old, new))
    before = {_renamed_file(name): path for name, path in before.items()}
    for name in sorted(before | after):
        if name in before and name in after:
            findings.add(compare_files(case, name, before[name], after[name]))
        else:
            there, gone = ("recorded", MISSING) if name in before else (MISSING, "made")
            findings.add(_sorted_out(case, name, {"the file": there}, {"the file": gone}))
    if not before:
        findings.differing.append(Difference(case, "all files", "the record", MISSING, "made"))
    return findings


def _files(folder: Path) -> list[Path]:
    return [path for path in folder.rglob("*") if path.is_file()]


def _renamed_file(name: str) -> str:
    folder, _, last = name.rpartition("/")
    last = RENAMED.get(last, last)
    return f"{folder}/{last}" if folder else last


def compare_files(case: str, name: str, old: Path, new: Path) -> Findings:
    """Compare one file by its kind, which the ending of its new name says."""
    suffix = Path(name).suffix
    if suffix in LOOKED_AT:
        if _settled_bytes(old) == _settled_bytes(new):
            return Findings()
        if any(fnmatch.fnmatchcase(name, pattern) for pattern in CLOCKED):
            return Findings(clocked={name})
        return Findings(look={name: "differs"})
    if suffix in MESHES:
        return _sorted_out(case, name, _mesh_values(old), _mesh_values(new))
    if suffix in {".json", ".toml", ".csv"} or suffix in COMMENTS:
        return _sorted_out(case, name, _renamed_keys(Path(name).name, values_of(old)), values_of(new))
    return _sorted_out(case, name, {"checksum": _checksum(old)}, {"checksum": _checksum(new)})


def _checksum(path: Path) -> int:
    """Of a file of no kind that is known here: its bytes must be the same."""
    return zlib.crc32(path.read_bytes())


def _settled_bytes(path: Path) -> bytes | str:
    if path.suffix in TEXTS:
        return _settled_prose(path.read_text(encoding="utf-8"))
    return path.read_bytes()


def _settled_prose(text: str) -> str:
    return DURATION.sub("DURATION", PROGRESS.sub("", _settled(text)))


def _settled(text: str) -> str:
    """The text with words in place of hashes and points in time."""
    return HASH.sub("HASH", MOMENT.sub("MOMENT", text))


def values_of(path: Path) -> dict[str, Value]:
    """Every value of a JSON, TOML or CSV file or of a program, by its key's path; empty tables and lists by theirs."""
    text = path.read_text(encoding="utf-8-sig")
    if path.suffix == ".json":
        return dict(_leaves(json.loads(text)))
    if path.suffix == ".toml":
        return dict(_leaves(tomllib.loads(text)))
    if path.suffix == ".csv":
        return _cells(text)
    return _words(text, COMMENTS[path.suffix])


def _leaves(value: object, key: str = "") -> list[tuple[str, Value]]:
    inner: list[tuple[str, object]] = []
    if isinstance(value, Mapping):
        inner = [(str(name), part) for name, part in value.items()]
    elif isinstance(value, Sequence) and not isinstance(value, str):
        inner = [(str(number), part) for number, part in enumerate(value)]
    elif value is None or isinstance(value, bool | float | int | str):
        return [(key, value)]
    else:
        return [(key, str(value))]
    if not inner:
        return [(key, f"empty-{type(value).__name__}")]
    return [leaf for name, part in inner for leaf in _leaves(part, f"{key}/{name}" if key else name)]


def _cells(text: str) -> dict[str, Value]:
    """Every cell by its column and the number of its row."""
    header, *rows = list(csv.reader(io.StringIO(text))) or [[]]
    values: dict[str, Value] = {"rows": len(rows)}
    for number, row in enumerate(rows, 1):
        for column, cell in itertools.zip_longest(header, row, fillvalue=""):
            values[f"{column}/{number}"] = _number_or_word(cell)
    return values


def _number_or_word(cell: str) -> Value:
    try:
        return float(cell)
    except ValueError:
        return cell


def _words(text: str, comment: str) -> dict[str, Value]:
    """The code of each line of a program without its numbers, and its numbers one by one."""
    lines = [line.split(comment)[0].strip() for line in text.splitlines()]
    lines = [line for line in lines if line]
    values: dict[str, Value] = {"lines": len(lines)}
    for number, line in enumerate(lines, 1):
        values[f"{number}/code"] = "".join(NUMBER.sub("#", line).split())
        values |= {f"{number}/{place}": float(it) for place, it in enumerate(NUMBER.findall(line), 1)}
    return values


def _mesh_values(path: Path) -> dict[str, Value]:
    """Vertices and faces in the file's order, and the volume."""
    mesh = trimesh.load_mesh(path, process=False)
    values: dict[str, Value] = {"vertices": len(mesh.vertices), "faces": len(mesh.faces), "volume": float(mesh.volume)}
    for kind, table in (("vertex", mesh.vertices.tolist()), ("face", mesh.faces.tolist())):
        values |= {f"{kind} {i}/{k}": value for i, row in enumerate(table) for k, value in enumerate(row)}
    return values


def _renamed_keys(file: str, values: Mapping[str, Value]) -> dict[str, Value]:
    """The old values under their new keys."""
    for entry, new in RENAMED.items():
        pattern, mark, old = entry.partition("#")
        if mark and any(fnmatch.fnmatchcase(name, pattern) for name in (file, _old_name(file))):
            values = {_renamed_key(key, old, new): value for key, value in values.items()}
    return dict(values)


def _old_name(file: str) -> str:
    return next((old for old, new in RENAMED.items() if new == file and "#" not in old), file)


def _renamed_key(key: str, old: str, new: str) -> str:
    if old.startswith("/"):
        whole = f"/{key}/"
        return f"{new}/{whole.removeprefix(f'{old}/')}".strip("/") if whole.startswith(f"{old}/") else key
    return f"/{key}/".replace(f"/{old}/", f"/{new}/").strip("/")


def _sorted_out(case: str, file: str, old: Mapping[str, object], new: Mapping[str, object]) -> Findings:
    """Compare value by value, and sort what differs into volatile, moved, prose and the rest."""
    found = Findings()
    volatile = [rule for rule in VOLATILE if fnmatch.fnmatchcase(file, rule.file)]
    for key in dict.fromkeys([*old, *new]):
        before, after = old.get(key, MISSING), new.get(key, MISSING)
        if any(rule.covers(case, file, key) for rule in volatile) and MISSING not in (before, after):
            continue
        found.numbers += any(isinstance(it, Numbered) and not isinstance(it, bool) for it in (before, after))
        if _same(before, after):
            continue
        difference = Difference(case, file, key, before, after)
        if any(rule.covers(case, file, key) and difference.change in rule.changes for rule in MOVED):
            found.moved.append(difference)
        elif isinstance(before, str) and isinstance(after, str) and _prose(before) and _prose(after):
            if _settled_prose(before) != _settled_prose(after):
                found.look.setdefault(file, f"sentences differ, the first at {key}")
        else:
            found.differing.append(difference)
    return found


def _same(old: object, new: object) -> bool:
    if isinstance(old, str) and isinstance(new, str):
        return _settled(old) == _settled(new)
    if isinstance(old, bool) != isinstance(new, bool):
        return False
    both_nan = isinstance(old, float) and isinstance(new, float) and math.isnan(old) and math.isnan(new)
    return old == new or both_nan


def _prose(value: str) -> bool:
    """A sentence for people and no word that a program acts on."""
    return " " in value.strip()


def _print_differences(result: Findings) -> None:
    of_file: Counter[str] = Counter()
    for difference in result.differing:
        of_file[difference.file] += 1
        if of_file[difference.file] <= LINES_A_FILE:
            print(difference)
    for file, count in of_file.items():
        if count > LINES_A_FILE:
            print(f"  {result.case}  {file}  and {count - LINES_A_FILE} more")
    for difference in result.moved:
        print(f"{difference}  (moved on purpose)")
    for file, reason in result.look.items():
        print(f"  look at {result.case}  {file}: {reason}")


def _lay_out(files: Iterable[str], old: Path, new: Path, look: Path) -> None:
    """Old beside new: ``report.old.html`` and ``report.new.html``."""
    before = {_renamed_file(path.relative_to(old).as_posix()): path for path in _files(old)}
    for name in files:
        target = look / name
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(before[name], target.with_suffix(f".old{target.suffix}"))
        shutil.copy(new / name, target.with_suffix(f".new{target.suffix}"))


if __name__ == "__main__":
    run_benchmark(main)
