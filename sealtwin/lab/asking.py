"""What a lab's catalogue holds, for people, programs and spreadsheets; nothing is changed by asking."""

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from sealtwin.errors import InputError
from sealtwin.lab.catalogue import Catalogue, Fault, Record
from sealtwin.lab.finding import plain
from sealtwin.lab.telling import RUN, table
from sealtwin.store import files
from sealtwin.store.tables import write_sheet
from sealtwin.trials.result import shown
from validate.sheets.samples import sample_key

COLUMNS = (
    "sample", "revision", "state", "date", "operator", "data", "depth_mm", "photo", "photo_sha256", "readings",
    "readings_sha256", "dialect", "result", "mean_error_mm", "ingested_utc", "folder", "reason",
)  # fmt: skip
GONE = "its folder is gone"


def list_lab(lab: Path) -> tuple[dict[str, Any], list[str]]:
    """The --json object and the lines of 'sealtwin lab list': the latest trial of each sample, and what failed."""
    with Catalogue.of(lab) as catalogue:
        records, faults = _latest(catalogue.records()), catalogue.faults()
    rows = [_row(lab, record) for record in records]
    content = {"version": 1, "lab": shown(lab), "trials": rows, "failed": [asdict(fault) for fault in faults]}
    head = ("sample", "revision", "date", "data", "depth_mm", "readings", "result")
    told = table(head, [[_text(row[column]) for column in head] for row in rows]) if rows else ["No trials yet."]
    told += [f"failed: {fault.name}: {fault.sentence}" for fault in faults]
    return content, [plain(line) for line in told]


def show_sample(lab: Path, sample: str) -> tuple[dict[str, Any], list[str]]:
    """All revisions of one sample, and what failed. Raises InputError where the lab knows no such sample."""
    with Catalogue.of(lab) as catalogue:
        records = catalogue.records(sample_key(sample))
        faults = [fault for fault in catalogue.faults() if sample_key(fault.name) == sample_key(sample)]
        if not records and not faults:
            raise InputError(f"{lab}: no sample {sample!r:.80}; 'sealtwin lab list {lab}' names those that there are.")
    content = {
        "version": 1,
        "lab": shown(lab),
        "trials": [{**asdict(record), "result": _result(lab, record)} for record in records],
        "failed": [asdict(fault) for fault in faults],
    }
    told = [line for record in reversed(records) for line in _told(lab, record)]
    told += [f"failed: {fault.sentence}" for fault in faults]
    return content, [plain(line) for line in told]


def export(lab: Path, out: Path) -> int:
    """A CSV with a row for each sample, taken in or not; returns how many. Raises InputError where ``out`` exists."""
    if out.exists():
        raise InputError(f"{out}: is there already and is not overwritten; give another name, or move it away.")
    with Catalogue.of(lab) as catalogue:
        records, faults = _latest(catalogue.records()), catalogue.faults()
    rows = [_row(lab, record) for record in records] + [_failed(fault) for fault in faults]
    write_sheet(out, COLUMNS, ([row[column] for column in COLUMNS] for row in rows))
    return len(rows)


def _latest(records: Sequence[Record]) -> list[Record]:
    return list({record.sample: record for record in records}.values())


def _row(lab: Path, record: Record) -> dict[str, Any]:
    photo, readings, result = record.file("photo"), record.file("readings"), _result(lab, record)
    depth = record.said.get("crack.depth_mm")
    return {
        "sample": record.name,
        "revision": record.revision,
        "state": "taken in",
        "date": record.date,
        "operator": record.operator,
        "data": record.said.get("data", record.said.get("photo.data")),
        "depth_mm": depth if isinstance(depth, int | float) else "along the crack",
        "photo": photo and photo.original,
        "photo_sha256": photo and photo.sha256,
        "readings": readings and readings.original,
        "readings_sha256": readings and readings.sha256,
        "dialect": record.dialect,
        "result": _state(result) if (lab / record.folder).is_dir() else GONE,
        "mean_error_mm": result and result.get("mean_error_mm"),
        "ingested_utc": record.ingested_utc,
        "folder": record.folder,
        "reason": None,
    }


def _failed(fault: Fault) -> dict[str, Any]:
    return {**dict.fromkeys(COLUMNS), "sample": fault.name, "state": "failed", "reason": fault.sentence}


def _result(lab: Path, record: Record) -> dict[str, Any] | None:
    """What a run of the trial said at its end; None where it has none."""
    path = lab / record.folder / RUN / "run.json"
    if not path.is_file():
        return None
    with files.understood(path):
        return dict(files.read_json(path))


def _state(result: dict[str, Any] | None) -> str:
    if result is None:
        return "not run"
    if "mean_error_mm" in result:
        return f"mean error {result['mean_error_mm']:.2f} mm"
    return f"{', '.join(result.get('stages', ())) or 'nothing'} done"


def _told(lab: Path, record: Record) -> list[str]:
    place = f"{shown(lab)}/{record.folder}"
    kept = [f"{file.role}: {file.original}, {file.size_bytes:,} bytes, sha256 {file.sha256}" for file in record.files]
    said = [f"{key} = {value!r}" for key, value in record.said.items()]
    told = [
        f"{record.name}, revision {record.revision}, taken in {record.ingested_utc} from {record.source}",
        f"  trial: {place}/trial.toml; results: sealtwin run {place}/trial.toml --out {place}/{RUN}",
        *(f"  {line}" for line in kept),
    ]
    if record.dialect is not None:
        told.append(f"  read as {record.dialect}")
    told += [f"  said: {line}" for line in said]
    told += [f"  note: {remark}" for remark in record.remarks]
    return [*told, f"  result: {_state(_result(lab, record)) if (lab / record.folder).is_dir() else GONE}"]


def _text(value: Any) -> str:
    return "-" if value is None else f"{value:g}" if isinstance(value, float) else str(value)
