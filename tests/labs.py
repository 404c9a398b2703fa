"""What an ingest left: its files, its catalogue's rows; and the command that makes it."""

import hashlib
from pathlib import Path
from typing import Any

from typer.testing import CliRunner, Result

from sealtwin.cli.app import app
from sealtwin.core.progress import Progress
from sealtwin.lab.catalogue import Catalogue

QUIET = Progress()


def sealtwin(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def hashes_of(folder: Path) -> dict[str, str]:
    """Of all files below, by relative name, without the lock."""
    files = (path for path in folder.rglob("*") if path.is_file() and path.name != ".lock")
    return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def rows_of(lab: Path) -> list[tuple[Any, ...]]:
    """What the catalogue says, without times."""
    records = Catalogue.of(lab).records
    return [(record.name, record.revision, record.folder, record.content, record.files) for record in records]
