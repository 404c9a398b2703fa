"""An SQLite file of ours: every change one transaction, every fault of disk or file a sentence."""

import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, ClassVar, Self

from sealtwin.errors import InputError

WAIT_S = 60.0
"""For another process to finish its write, which takes milliseconds; a slow disk gets its time."""
FACTS = "CREATE TABLE IF NOT EXISTS facts (name TEXT PRIMARY KEY, value TEXT NOT NULL);"


class Database:
    """An open file. A process that is killed leaves it as before a transaction or as after it."""

    called: ClassVar[str]
    """What people call such a file."""
    remedy: ClassVar[str] = "Give another --out."
    """Where it is damaged, or of another version."""

    def __init__(self, path: Path, tables: str, version: int, *, create: bool, readers_wait: bool) -> None:
        """Open ``path``, and where ``create`` says so make it first.

        Args:
            path: The file; the caller has made sure that it is there where it is not to be made.
            tables: SQL that makes what is missing of its tables.
            version: Of the tables; another one is refused.
            create: Make it where it is missing.
            readers_wait: For a writer's milliseconds; otherwise a log beside the file spares them that, which needs a
                disk of this machine.

        Raises:
            InputError: it cannot be read or written, or is of another version.
        """
        self.path = path
        with self._told():
            self._base = sqlite3.connect(path, timeout=WAIT_S, isolation_level=None)
        try:
            with self._told():
                if create:
                    self._base.execute(f"PRAGMA journal_mode = {'DELETE' if readers_wait else 'WAL'}")
                    self._base.executescript(FACTS + tables)
                    self._base.execute("INSERT OR IGNORE INTO facts VALUES ('version', ?)", [str(version)])
            if self.fact("version") != str(version):
                raise InputError(f"{path}: written by another version. {self.remedy}")
        except BaseException:
            # Whatever it was, Ctrl-C too, nobody else holds this connection.
            self._base.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._base.close()

    def fact(self, name: str) -> str | None:
        """What is true of the whole."""
        with self._told():
            row = self._base.execute("SELECT value FROM facts WHERE name = ?", [name]).fetchone()
        return None if row is None else row[0]

    def state_fact(self, name: str, value: str) -> None:
        self._write("INSERT OR REPLACE INTO facts VALUES (?, ?)", [name, value])

    def _rows(self, statement: str, values: Sequence[Any] = ()) -> list[tuple[Any, ...]]:
        with self._told():
            return self._base.execute(statement, values).fetchall()

    def _write(self, statement: str, values: Sequence[Any]) -> int:
        with self._told():
            return self._base.execute(statement, values).rowcount

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        self._base.execute("BEGIN IMMEDIATE")
        try:
            yield
        except BaseException:
            # Ctrl-C too: half of a transaction must not be kept.
            self._base.execute("ROLLBACK")
            raise
        self._base.execute("COMMIT")

    @contextmanager
    def _told(self) -> Iterator[None]:
        """What is wrong with disk or file is the user's to mend."""
        try:
            yield
        except sqlite3.OperationalError as fault:
            if str(fault).startswith("no such"):
                # Table or column: a sound database, and another program's.
                raise self._unreadable(fault) from fault
            raise InputError(
                f"{self.path}: {fault}. The folder must be writable, not full, and on a disk of this machine; then "
                "give the same command again."
            ) from fault
        except sqlite3.DatabaseError as fault:
            if type(fault) is not sqlite3.DatabaseError:
                raise
            raise self._unreadable(fault) from fault

    def _unreadable(self, fault: sqlite3.Error) -> InputError:
        return InputError(f"{self.path}: no {self.called} that can be read ({fault}). {self.remedy}")
