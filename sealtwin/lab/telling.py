"""What an ingest says at its end: a table for people, one object for programs."""

from collections.abc import Sequence
from typing import Any

from sealtwin.errors import InputError
from sealtwin.lab.catalogue import Fault
from sealtwin.lab.finding import plain
from sealtwin.lab.ingest import Ingested
from sealtwin.lab.pairing_file import PAIRING
from sealtwin.lab.pieces import Piece
from sealtwin.lab.taking import Outcome
from sealtwin.photos.batch import BUG, SOME_FAILED
from sealtwin.trials.result import shown

RUN = "run"
"""Beside a trial's files, where the catalogue looks for the results of its run."""
BROADEST = 36
"""Letters of a column of names on a terminal."""
MOST_NAMED = 3
MOST_TOLD = 200
"""Faults on a terminal, which keeps some thousand lines."""


def exit_code(ingested: Ingested) -> int:
    """0 where all is taken in; else whether it was some that failed, all, or a bug of ours."""
    if any(outcome.fate == "bug" for outcome in ingested.outcomes):
        return BUG
    if not ingested.faults:
        return 0
    return SOME_FAILED if any(outcome.fate != "failed" for outcome in ingested.outcomes) else InputError.exit_code


def content(ingested: Ingested) -> dict[str, Any]:
    """The --json object."""
    return {
        "version": 1,
        "lab": shown(ingested.lab),
        "dry_run": ingested.dry_run,
        "samples": [
            {
                "name": outcome.sample.name,
                "state": outcome.fate,
                "files": {role: file.as_posix() for role, file in outcome.sample.files.items()},
                "part": outcome.sample.part and str(outcome.sample.part),
                "questions": outcome.sample.questions,
                "faults": outcome.faults,
                "remarks": outcome.remarks,
                "dialect": outcome.dialect,
                "folder": outcome.trial,
                "revision": outcome.revision,
            }
            for outcome in ingested.outcomes
        ],
        "left_out": [{"file": left.file, "reason": left.reason} for left in ingested.left_out],
        "faults": [{"name": fault.name, "sentence": fault.sentence} for fault in ingested.faults],
        "exit_code": exit_code(ingested),
    }


def lines(ingested: Ingested) -> list[str]:
    """The pairing as a table; the dialects that were read; what is in doubt or wrong; what to do next."""
    told = [*_table(ingested.outcomes)]
    told += [f"{outcome.sample.name}: read as {outcome.dialect}." for outcome in ingested.outcomes if outcome.dialect]
    told += _together([Fault(o.sample.name, remark) for o in ingested.outcomes for remark in o.remarks], "note: ")
    passed = [left.file for left in ingested.left_out if not left.lost]
    if passed:
        told.append(f"Left out: {_few(passed)}, neither photos, sheets nor notes.")
    failed = _together(ingested.faults, "failed: ")
    told += failed[:MOST_TOLD]
    if len(failed) > MOST_TOLD:
        told.append(f"and {len(failed) - MOST_TOLD:,} more like these; --json and 'sealtwin lab list' tell them all.")
    return [plain(line) for line in (*told, *_ending(ingested))]


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Columns as wide as their widest cell, within bounds."""
    cells = [[_clipped(cell) for cell in row] for row in (head, *rows)]
    widths = [max(len(row[column]) for row in cells) for column in range(len(head))]
    return ["  ".join(f"{cell:<{width}}" for cell, width in zip(row, widths, strict=True)).rstrip() for row in cells]


def _table(outcomes: Sequence[Outcome]) -> list[str]:
    def named(outcome: Outcome) -> list[str]:
        files, none = outcome.sample.files, "?" if outcome.sample.questions else "-"
        return [
            outcome.sample.name or "?",
            str(files.get("photo", none)),
            str(Piece(files["readings"], outcome.sample.part)) if "readings" in files else none,
            str(files.get("note", none)),
            outcome.fate if outcome.fate != "revised" or outcome.revision is None else f"revision {outcome.revision}",
        ]

    return table(("sample", "photo", "readings", "note", "state"), [named(outcome) for outcome in outcomes])


def _together(faults: Sequence[Fault], begins: str) -> list[str]:
    """What holds for several samples is said once: a fault of lab.toml is of them all."""
    names: dict[str, list[str]] = {}
    for fault in faults:
        of = names.setdefault(fault.sentence, [])
        if fault.name not in of:
            of.append(fault.name)
    return [
        f"{begins}{_few(of)}: {sentence}" if sentence.partition(":")[0] != of[0] else f"{begins}{sentence}"
        for sentence, of in names.items()
    ]


def _ending(ingested: Ingested) -> list[str]:
    fates = [outcome.fate for outcome in ingested.outcomes]
    sound = [fate for fate in fates if fate in ("new", "revised", "unchanged", "restored")]
    fresh, known = fates.count("new") + fates.count("revised"), fates.count("unchanged") + fates.count("restored")
    told = [f"{len(sound)} of {len(fates)} samples are sound: {fresh} new or revised, {known} known."]
    if ingested.dry_run:
        return [*told, "Nothing was written: a dry run."]
    lab = shown(ingested.lab)
    if any(outcome.sample.questions for outcome in ingested.outcomes):
        told.append(f"To answer questions, edit {lab}/{PAIRING} and give it back: --pairing {lab}/{PAIRING}")
    first = next((outcome.trial for outcome in ingested.outcomes if outcome.trial), None)
    if first is not None:
        told.append(f"Catalogue: sealtwin lab list {lab}")
        told.append(f"A trial: sealtwin run {lab}/{first}/trial.toml --out {lab}/{first}/{RUN}")
    return told


def _few(names: Sequence[str]) -> str:
    more = len(names) - MOST_NAMED
    return ", ".join(names[:MOST_NAMED]) + (f" and {more} more" if more > 0 else "")


def _clipped(text: str) -> str:
    return text if len(text) <= BROADEST else f"...{text[-BROADEST + 3 :]}"
