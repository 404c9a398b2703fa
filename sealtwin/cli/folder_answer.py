"""Output of the commands for many samples: the ingest of a lab's folder, the runs of a lab."""

from collections.abc import Iterable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from sealtwin.cli.answer import BAD_INPUT, BUG, GATE_FAILED, SOME_FAILED, Answer
from sealtwin.lab.catalogue import RUN, TABLE, SampleRun
from sealtwin.lab.files import PAIRING, CatalogueFault, plain
from sealtwin.lab.ingest import Ingested
from sealtwin.lab.sample import LabSample
from sealtwin.lab.tracing import SHEET
from sealtwin.trial.job import display_path
from validate.readings.grid import listed
from validate.units import counted

BROADEST = 36  # Largest width of a table's column on a terminal, in characters
Named = Iterable[tuple[str, str]]
"""Pairs of a sample's or file's name and a sentence about it."""


def ingest_answer(ingested: Ingested) -> Answer:
    """Return the table of paired files, how the sheets were read, doubts and faults, and what to do next."""
    lab, samples, traced = ingested.lab, ingested.samples, ingested.traced
    code = 0
    if ingested.faults:
        code = SOME_FAILED if {sample.fate for sample in samples} - {"failed"} else BAD_INPUT
    if "bug" in {row.status for row in traced} | {sample.fate for sample in samples}:
        code = BUG
    lines = [
        *_table(("sample", "photo", "readings", "state"), [*map(_pairing_row, samples)]),
        *(f"{sample.name}: read as {sample.dialect}." for sample in samples if sample.dialect),
        *_together("note", ((sample.name, sample.assumed) for sample in samples if sample.assumed)),
        *_together("remark", ((sample.name, remark) for sample in samples for remark in sample.remarks)),
        *_together("Not used", ((file.name, file.sentence) for file in ingested.unused)),
        *_faults(ingested.faults),
        *_ending(ingested),
        # A sample's run folder is in the folder of its trial.
        *_together(
            "note",
            ((Path(row.folder).parent.name, fact.text) for row in traced if row.sample for fact in row.sample.warnings),
        ),
        *([f"All walls: {lab / SHEET}"] if traced else []),
    ]
    content = {
        "dry_run": ingested.dry_run,
        "samples": [*map(_sample, samples)],
        "left_out": [
            {"file": file.name, "reason": file.sentence} for file in sorted((*ingested.unused, *ingested.lost))
        ],
        "faults": [*map(asdict, ingested.faults)],
        "exit_code": code,
    }
    rows = [asdict(row) | {"sample": row.sample and row.sample.model_dump(mode="json")} for row in traced]
    return _lab_answer(lab, lines, content | {"traced": rows}, code)


def samples_answer(lab: Path, results: Sequence[SampleRun]) -> Answer:
    """Return the output of 'sealtwin lab': a row for each sample, warnings, and reasons for missing results."""
    rows = [
        [
            run.name,
            run.state,
            "-" if run.mean_error_mm is None else f"{run.mean_error_mm:.2f}",
            "-" if run.report is None else f"{run.folder}/{RUN}/{Path(run.report).name}",
        ]
        for run in results
    ]
    states = [run.state for run in results]
    counts = ", ".join(f"{states.count(state)} {state}" for state in dict.fromkeys(states))
    lines = [
        *_table(("sample", "state", "mean error mm", "report"), rows),
        *_together("note", ((run.name, text) for run in results for text in run.warnings)),
        *(
            line
            for state in ("failed", "left out")
            for line in _together(state, ((run.name, f"{run.reason}") for run in results if run.state == state))
        ),
        f"{counted(len(results), 'sample')}: {counts or 'none'}. Catalogue: {display_path(lab)}/{TABLE}",
    ]
    code = GATE_FAILED if any(run.passed is False for run in results) else 0
    code = SOME_FAILED if {"failed", "left out"} & {*states} else code
    code = BUG if any(run.bug for run in results) else code
    return _lab_answer(lab, lines, {"samples": [*map(asdict, results)], "exit_code": code}, code)


def _lab_answer(lab: Path, lines: Sequence[str], content: dict[str, Any], code: int = 0) -> Answer:
    return Answer({"lab": display_path(lab), **content}, [*map(plain, lines)], code)


def _sample(sample: LabSample) -> dict[str, Any]:
    return {
        "name": sample.name,
        "state": sample.state,
        "sound": not sample.questions,
        "files": {role: [file.as_posix() for file in files] for role, files in sample.files.items()},
        "faults": [*sample.questions],
        "remarks": [*sample.remarks],
        "assumed": sample.assumed,
        "dialect": sample.dialect,
        "columns": dict(sample.understood.roles) if sample.understood else {},
        "folder": sample.record and sample.record.folder,
        "revision": sample.record and sample.record.revision,
    }


def _pairing_row(sample: LabSample) -> list[str]:
    lacking = ["?" if sample.questions else "-"]
    return [
        sample.name if "photo" in sample.files else "?",
        listed([*map(str, sample.files.get("photo", []))] or lacking, 1),
        listed([f"{file}" for role in ("readings", "scan") for file in sample.files.get(role, [])] or lacking, 1),
        sample.state,
    ]


def _state(fault: CatalogueFault) -> str:
    return "failed" if fault.is_fault else "asked"


def _faults(faults: Sequence[CatalogueFault]) -> list[str]:
    states = dict.fromkeys(map(_state, faults))
    of_state = {state: [(fault.name, fault.sentence) for fault in faults if _state(fault) == state] for state in states}
    return [line for state, named in of_state.items() for line in _together(state, named)]


def _together(state: str, named: Named) -> list[str]:
    """Return one line for each sentence, with the names of all samples to which it applies."""
    names = dict[str, dict[str, None]]()
    for name, sentence in named:
        names.setdefault(sentence, {})[name] = None
    return [f"{state}: {listed([*together])}: {sentence}" for sentence, together in names.items()]


def _ending(ingested: Ingested) -> list[str]:
    samples = [sample for sample in ingested.samples if "photo" in sample.files]
    sound = [sample.fate for sample in samples if not sample.questions]
    unchanged, lab = sound.count("unchanged"), display_path(ingested.lab)
    count = f"{len(sound)} of {counted(len(samples), 'sample')} {'is' if len(samples) == 1 else 'are'} sound"
    lines = [f"{count}: {len(sound) - unchanged} new or revised, {unchanged} unchanged."]
    if ingested.dry_run:
        lines.append(f"This was a dry run: nothing was written. Without --dry-run, {lab}/{PAIRING} is written.")
    if any(sample.questions for sample in ingested.samples):
        lines.append(f"To answer the questions, edit {lab}/{PAIRING} and repeat the command.")
    if not ingested.dry_run:
        lines += [f"Catalogue: {lab}/{TABLE}", *([f"To run them: sealtwin lab {lab}"] if sound else [])]
    return lines


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Return the lines of a table. Each column is as wide as its widest cell, but at most ``BROADEST``."""
    cells = [
        [cell if len(cell) <= BROADEST else f"...{cell[-BROADEST + 3 :]}" for cell in row] for row in (head, *rows)
    ]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    return ["  ".join(f"{cell:<{width}}" for cell, width in zip(row, widths, strict=True)).rstrip() for row in cells]
