"""Answers about folders: a batch of photos, the ingest of a lab's folder, the catalogue of a lab."""

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from sealtwin.cli.answer import BAD_INPUT, BUG, GATE_FAILED, SOME_FAILED, Answer
from sealtwin.core.errors import InputError
from sealtwin.lab.catalogue import (
    RUN,
    Catalogue,
    Record,
    SampleRun,
    latest_trials,
    progress_of,
    read_run,
)
from sealtwin.lab.files import PAIRING, TRIAL, CatalogueFault, plain
from sealtwin.lab.ingest import Ingested
from sealtwin.lab.sample import LabSample
from sealtwin.study.photos import CSV, SHEET, Batch
from sealtwin.trial.job import shown
from validate.readings.grid import letters, listed
from validate.readings.words import sample_key
from validate.units import counted

BROADEST = 36  # Letters of a column of names on a terminal


def batch_answer(batch: Batch) -> Answer:
    """Answer with a table of the digitised photos, and the reason for each failed photo."""
    broad = max((len(row.folder) for row in batch.rows), default=0)
    lines = [
        f"{row.folder:<{broad}}  {_or_dash(row.mean_width_mm, 8)} {row.length_mm:9.1f} {_or_dash(row.cavity_ml, 9)} "
        f"{_or_dash(row.sealant_ml, 10)}  {row.path_source}"
        for row in batch.done
    ]
    if lines:
        lines.insert(0, f"{'photo':<{broad}}  width mm length mm cavity ml sealant ml  path")
    sheet, table = batch.out / SHEET, batch.out / CSV
    lines.append(f"{len(batch.done)} of {len(batch.listed)} photos digitised. Check {sheet}; table: {table}")
    if proposals := sum(row.path_source == "automatic" for row in batch.done):
        lines.append(f"{proposals} cracks were found automatically: check these proposals.")
    if undeclared := sum(row.data == "undeclared" for row in batch.done):
        origins = "photo.data declares it (measured, reconstructed, synthetic)"
        lines.append(f"{counted(undeclared, 'photo')} of undeclared origin; {origins}.")
    lines += [f"failed: {row.folder}: {row.reason}" for row in batch.failed]
    return Answer(batch.content(), lines, batch.exit_code)


def _or_dash(value: float | None, broad: int) -> str:
    """Return a number with two decimals, or a dash for None: a path without walls has no width and no volumes."""
    return f"{'-':>{broad}}" if value is None else f"{value:{broad}.2f}"


def ingest_answer(ingested: Ingested) -> Answer:
    """Answer with the pairing as a table, how the sheets were read, doubts and faults, and what to do next."""
    samples, traced = ingested.samples, ingested.traced or Batch(ingested.lab)
    lines = _table(("sample", "photo", "readings", "note", "state"), [*map(_pairing_row, samples)])
    for sample in samples:
        lines += _understood(sample)
    lines += _together(
        [CatalogueFault(sample.name, remark) for sample in samples for remark in sample.remarks], "note: "
    )
    lines += _together(ingested.unused, "Not used: ")
    lines += [*_together(ingested.faults), *_ending(ingested)]
    # The run folder of a sample is in that of its trial.
    warned = [CatalogueFault(row.folder.split("/")[-2], text) for row in traced.done for text in row.warnings]
    lines += [*_together(warned, "note: "), *([f"All walls: {traced.out / SHEET}"] if traced.done else [])]
    fates = {sample.fate for sample in samples}
    code = SOME_FAILED if fates - {"failed"} else BAD_INPUT
    code = BUG if "bug" in fates or traced.exit_code == BUG else code if ingested.faults else 0
    content = {
        "version": 1,
        "lab": shown(ingested.lab),
        "dry_run": ingested.dry_run,
        "samples": [*map(_sample, samples)],
        "left_out": [
            {"file": each.name, "reason": each.sentence} for each in sorted((*ingested.unused, *ingested.lost))
        ],
        "faults": [*map(asdict, ingested.faults)],
        "exit_code": code,
        **({} if ingested.traced is None else {"traced": traced.content()}),
    }
    return Answer(content, [*map(plain, lines)], code)


def list_answer(lab: Path) -> Answer:
    """Answer of 'sealtwin lab list': the latest trial of each sample, and the faults."""
    rows, faults = latest_trials(lab)
    head = ("sample", "revision", "date", "taken in", "data", "depth_mm", "readings", "result")
    cells = [[_text({**row, "taken in": row["ingested_utc"][:10]}[column]) for column in head] for row in rows]
    lines = [*_table(head, cells), *_together(faults)]
    return _lab_answer(lab, rows, faults, lines)


def samples_answer(lab: Path, results: Sequence[SampleRun]) -> Answer:
    """Answer of 'sealtwin lab run': a row for each sample, warnings, and why samples failed or were left out."""
    head = ("sample", "state", "mean error mm", "report")
    rows = [
        [
            one.name,
            one.state,
            "-" if one.mean_error_mm is None else f"{one.mean_error_mm:.2f}",
            "-" if one.report is None else f"{one.folder}/{RUN}/{Path(one.report).name}",
        ]
        for one in results
    ]
    lines = _table(head, rows)
    lines += _together([CatalogueFault(one.name, text) for one in results for text in one.warnings], "note: ")
    states = [one.state for one in results]
    for state in ("failed", "left out"):
        faults = [CatalogueFault(one.name, f"{one.reason}") for one in results if one.state == state]
        lines += _together(faults, f"{state}: ")
    counts = ", ".join(f"{states.count(state)} {state}" for state in dict.fromkeys(states))
    lines.append(f"{counted(len(results), 'sample')}: {counts or 'none'}. Catalogue: sealtwin lab list {shown(lab)}")
    code = GATE_FAILED if any(one.passed is False for one in results) else 0
    code = SOME_FAILED if {"failed", "left out"} & {*states} else code
    code = BUG if any(one.bug for one in results) else code
    content = {"version": 1, "lab": shown(lab), "samples": [*map(asdict, results)], "exit_code": code}
    return Answer(content, [*map(plain, lines)], code)


def show_answer(lab: Path, sample: str) -> Answer:
    """Answer of 'sealtwin lab show': all revisions of a sample, and its faults. Raises InputError without a sample."""
    catalogue = Catalogue.of(lab)
    key = sample_key(sample)
    records, faults = [each for each in catalogue.records if each.key == key], catalogue.faults().get(key, [])
    if not records and not faults:
        raise InputError(f"{lab}: has no sample {sample!r:.80}. List its samples with 'sealtwin lab list {lab}'.")
    rows = [{**asdict(record), "result": read_run(lab, record)} for record in records]
    lines = [line for record in reversed(records) for line in _revision(lab, record)]
    lines += [f"{_begin(fault)}{fault.sentence}" for fault in faults]
    return _lab_answer(lab, rows, faults, lines)


def _lab_answer(lab: Path, trials: object, faults: Sequence[CatalogueFault], lines: Sequence[str]) -> Answer:
    content = {"version": 1, "lab": shown(lab), "trials": trials, "failed": [*map(asdict, faults)]}
    return Answer(content, [*map(plain, lines)])


def _revision(lab: Path, record: Record) -> list[str]:
    place = f"{shown(lab)}/{record.folder}"
    return [
        f"{record.name}, revision {record.revision}, taken in {record.ingested_utc} from {record.source}",
        f"  trial: {place}/{TRIAL}; results: sealtwin run {place}/{TRIAL} --out {place}/{RUN}",
        *(f"  {file.role}: {file.original}, {file.size_bytes:,} bytes, sha256 {file.sha256}" for file in record.files),
        *([] if record.dialect is None else [f"  read as {record.dialect}"]),
        *(f"  given: {key} = {value!r}" for key, value in record.said.items()),
        *(f"  note: {remark}" for remark in record.remarks),
        f"  result: {progress_of(read_run(lab, record))}",
    ]


def _sample(sample: LabSample) -> dict[str, Any]:
    return {
        "name": sample.name,
        "state": sample.fate,
        "sound": not sample.questions,
        "files": {role: [file.as_posix() for file in files] for role, files in sample.files.items()},
        "faults": [*sample.questions],
        "remarks": sample.remarks,
        "dialect": sample.dialect,
        "columns": dict(sample.understood.roles) if sample.understood else {},
        "folder": sample.record and sample.record.folder,
        "revision": sample.record and sample.record.revision,
    }


def _pairing_row(sample: LabSample) -> list[str]:
    is_unsound = sample.questions and sample.fate not in ("failed", "bug")
    return [
        sample.name if "photo" in sample.files else "?",
        *(
            listed([*map(str, sample.files.get(role, []))] or ["?" if sample.questions else "-"], 1)
            for role in ("photo", "readings", "note")
        ),
        f"{sample.fate}, not sound" if is_unsound else sample.fate,
    ]


def _begin(fault: CatalogueFault) -> str:
    """Return the words that begin the line of a fault: "in doubt" if the readings can be confirmed, else "failed"."""
    return "in doubt: " if fault.can_be_confirmed else "failed: "


def _together(faults: Sequence[CatalogueFault], begins: str = "") -> list[str]:
    """Merge equal faults of several samples, such as a fault of lab.toml, into one line."""
    names = dict[tuple[str, str], dict[str, None]]()
    for fault in faults:
        names.setdefault((begins or _begin(fault), fault.sentence), {})[fault.name] = None
    return [f"{begin}{listed([*of])}: {sentence}" for (begin, sentence), of in names.items()]


def _understood(sample: LabSample) -> list[str]:
    """Return how a sheet was read: a sentence; if it is in question, its first rows with unused cells in brackets."""
    name, sheet = sample.name, sample.sheet_in_question
    lines = [f"{name}: read as {sample.dialect}."] if sample.dialect else []
    if sheet is None:
        return lines
    roles, broad = dict(sheet.roles), range(max((len(texts) for _, texts in sheet.rows), default=0))
    head = ["row", *(": ".join(filter(None, (letters(at), roles.get(letters(at))))) for at in broad)]
    rows = [
        [f"{row}", *(text if (row, at) in sheet.read or not text else f"({text})" for at, text in enumerate(texts))]
        for row, texts in sheet.rows
    ]
    rows = [[*row, *[""] * (len(head) - len(row))] for row in rows]
    return [*lines, f"{name}: its sheet as it was understood; cells in brackets are not read:", *_table(head, rows)]


def _ending(ingested: Ingested) -> list[str]:
    samples = [each for each in ingested.samples if "photo" in each.files]
    sound = [each.fate for each in samples if not each.questions]
    unchanged, lab = sound.count("unchanged"), shown(ingested.lab)
    verb = "is" if len(samples) == 1 else "are"
    count = f"{len(sound)} of {counted(len(samples), 'sample')} {verb} sound"
    lines = [f"{count}: {len(sound) - unchanged} new or revised, {unchanged} unchanged."]
    if ingested.dry_run:
        lines.append(f"Dry run: nothing was written. Without --dry-run, the command writes {lab}/{PAIRING}.")
    if any(each.questions for each in ingested.samples):
        lines.append(f"To answer the questions, edit {lab}/{PAIRING} and repeat the command.")
    if not ingested.dry_run:
        lines.append(f"Catalogue: sealtwin lab list {lab}")
        lines += [f"To run them: sealtwin lab run {lab}"] if sound else []
    return lines


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Return the lines of a table. Columns are as wide as their widest cell, but at most ``BROADEST``."""
    cells = [
        [cell if len(cell) <= BROADEST else f"...{cell[-BROADEST + 3 :]}" for cell in row] for row in (head, *rows)
    ]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    return ["  ".join(f"{cell:<{width}}" for cell, width in zip(row, widths, strict=True)).rstrip() for row in cells]


def _text(value: Any) -> str:
    return "-" if value is None else f"{value:g}" if isinstance(value, float) else str(value)
