"""What an ingest left: its files, its catalogue's rows, its questions; and the command that makes it."""

import csv
import hashlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from sealtwin.core.progress import Progress
from sealtwin.lab.catalogue import Catalogue
from sealtwin.lab.ingest import Ingested
from sealtwin.trial.trial_file import load_trial
from tests.support.processes import sealtwin as sealtwin
from validate.readings.read_readings import read_readings

QUIET = Progress()


def hashes_of(folder: Path) -> dict[str, str]:
    """Of all files below, by relative name, without the lock."""
    files = (path for path in folder.rglob("*") if path.is_file() and path.name != ".lock")
    return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def rows_of(lab: Path) -> list[tuple[Any, ...]]:
    """What the catalogue says, without times."""
    records = Catalogue.of(lab).records
    return [(record.name, record.revision, record.folder, record.said, record.files) for record in records]


def fates(ingested: Ingested) -> dict[str, str]:
    return {outcome.name: outcome.fate for outcome in ingested.samples}


def levels_mm(lab: Path, sample: str) -> list[float]:
    """Mean level at each station of a trial's readings."""
    trial = load_trial(lab / sample / "trial.toml")
    assert trial.readings is not None
    return read_readings(lab / sample / trial.readings.file, trial.readings).level_mm.tolist()


def pairing_rows(lab: Path) -> list[dict[str, str]]:
    return list(csv.DictReader((lab / "pairing.csv").read_text(encoding="utf-8").splitlines()))


def question(lab: Path, file: str) -> str:
    return next(row["question"] for row in pairing_rows(lab) if row["file"] == file)


def answer(lab: Path, answers: Mapping[str, Mapping[str, str]]) -> Path:
    """Write answers, by file and column, into the lab's pairing file; return it."""
    rows = pairing_rows(lab)
    for row in rows:
        row.update(answers.get(row["file"], {}))
    return _write_pairing(lab, rows)


def add_rows(lab: Path, *rows: Mapping[str, str]) -> Path:
    """Write rows of sheets into the lab's pairing file, in place of those of their files; return it."""
    others = [row for row in pairing_rows(lab) if row["file"] not in {each["file"] for each in rows}]
    return _write_pairing(lab, [*others, *({"role": "readings", **row} for row in rows)])


def _write_pairing(lab: Path, rows: Sequence[Mapping[str, str]]) -> Path:
    with (lab / "pairing.csv").open("w", encoding="utf-8", newline="") as pairing:
        # A user may add columns that no question asks for.
        writer = csv.DictWriter(pairing, list(dict.fromkeys(name for row in rows for name in row)))
        writer.writeheader()
        writer.writerows(rows)
    return lab / "pairing.csv"


def edit(path: Path, old: str, new: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert old in text, f"{path.name} has no {old!r}"
    path.write_text(text.replace(old, new), encoding="utf-8")
