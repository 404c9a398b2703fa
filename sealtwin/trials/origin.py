"""Which sheet of readings a trial was given, who read it and when: for whoever signs its report."""

from pathlib import Path
from typing import Any

from sealtwin.store import files
from sealtwin.trials.job import Job
from validate.evidence import Sheet

RECORD = "record.json"
"""Beside a trial that was taken in from a lab's folder."""
ORIGIN = Path("inputs", "origin.json")
"""In a run folder, what of that record concerns the sheet: neither where the lab lies, nor what else its notes say."""


def sheet_of(job: Job) -> Sheet | None:
    """None without readings. Raises InputError where what the lab's record says cannot be understood."""
    if job.sheet is None or job.trial.readings is None:
        return None
    name, digest = job.trial.readings.file.name, files.sha256(job.sheet)
    said = _said(job.source)
    if said is None:
        return Sheet(name, digest)
    if said["sha256"] != digest:
        # What the lab noted speaks of the sheet that was taken in, and not of this one.
        return Sheet(f"{name}, not as the lab gave it", digest)
    return Sheet(**said)


def keep_origin(job: Job) -> None:
    """Beside the copy of the readings, so that the folder can be taken away and still says whose they are."""
    if job.source.resolve() != job.path.resolve() and (said := _said(job.source)) is not None:
        files.write_if_new(job.path / ORIGIN, files.as_json(said).encode())


def _said(source: Path) -> dict[str, Any] | None:
    """None where the trial comes from no lab's folder."""
    if (source / ORIGIN).is_file():
        with files.understood(source / ORIGIN):
            return _texts(files.read_json(source / ORIGIN))
    content = files.read_json(source / RECORD) if (source / RECORD).is_file() else None
    if not isinstance(content, dict) or "ingested_utc" not in content:
        return None
    with files.understood(source / RECORD):
        kept = next((file for file in content["files"] if file["role"] == "readings"), None)
        return None if kept is None else _texts(content | {"name": kept["original"], "sha256": kept["sha256"]})


def _texts(content: dict[str, Any]) -> dict[str, Any]:
    said = {key: content[key] for key in ("name", "sha256", "operator", "date")}
    if not all(isinstance(said[key], str) for key in ("name", "sha256")):
        raise ValueError("name and sha256 must be texts")
    return said | {key: None if said[key] is None else str(said[key]) for key in ("operator", "date")}
