"""An SQLite file: every change is one transaction, every fault of disk or file one sentence."""

import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, ClassVar, Self

from sealtwin.core.errors import InputError

WAIT_S = 60.0  # Longest wait for another process to finish its write, which takes milliseconds on most disks
FACTS = "CREATE TABLE IF NOT EXISTS facts (name TEXT PRIMARY KEY, value TEXT NOT NULL);"


class Database:
    """An open file. A process that is killed leaves it as before a transaction or as after it."""

    called: ClassVar[str]  # Name of the kind of file, for messages
    remedy: ClassVar[str] = "Give another --out."  # Advice for a file that is damaged, or of another version

    def __init__(self, path: Path, tables: str, version: int, *, create: bool) -> None:
        """Open ``path``, or make it with ``tables``, SQL, if ``create`` is True.

        Raises InputError if it cannot be read or written, or if its tables are of another version.
        """
        self.path = path
        with self._faults():
            self._base = sqlite3.connect(path, timeout=WAIT_S, isolation_level=None)
        try:
            with self._faults():
                if create:
                    self._base.executescript(FACTS + tables)
                    self._base.execute("INSERT OR IGNORE INTO facts VALUES ('version', ?)", [str(version)])
            if self.fact("version") != str(version):
                raise InputError(f"{path}: written by another version. {self.remedy}")
        except BaseException:
            # Ctrl-C too: no caller has this connection to close it.
            self._base.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._base.close()

    def fact(self, name: str) -> str | None:
        rows = self._rows("SELECT value FROM facts WHERE name = ?", [name])
        return rows[0][0] if rows else None

    def state_fact(self, name: str, value: str) -> None:
        self._rows("INSERT OR REPLACE INTO facts VALUES (?, ?)", [name, value])

    def _rows(self, statement: str, values: Sequence[Any] = ()) -> list[tuple[Any, ...]]:
        with self._faults():
            return self._base.execute(statement, values).fetchall()

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        """Keep all changes of the block, or none. Raises InputError if they cannot be written."""
        with self._faults():
            self._base.execute("BEGIN IMMEDIATE")
            try:
                yield
            except BaseException:
                # Ctrl-C too: half of a transaction must not be kept.
                self._base.execute("ROLLBACK")
                raise
            self._base.execute("COMMIT")

    @contextmanager
    def _faults(self) -> Iterator[None]:
        """Raise an InputError for a fault of disk or file, which the user can mend."""
        try:
            yield
        except (sqlite3.IntegrityError, sqlite3.ProgrammingError):
            raise
        except sqlite3.DatabaseError as fault:
            # Without a table or a column it is a sound database, and another program's.
            if isinstance(fault, sqlite3.OperationalError) and not str(fault).startswith("no such"):
                raise InputError(
                    f"{self.path}: {fault}. The folder must be writable, not full, and on a disk of this machine; then "
                    "give the same command again."
                ) from fault
            raise InputError(f"{self.path}: no {self.called} that can be read ({fault}). {self.remedy}") from fault
