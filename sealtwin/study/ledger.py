"""The ledger of a study: a row for each run, what it was made with, what became of it. SQLite, safe against kill -9."""

import json
import os
import platform
import time
import uuid
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from sealtwin.errors import InputError
from sealtwin.store.database import Database

LEDGER = "ledger.sqlite"
PROFILE = "profile.csv"
VERSION = 1

State = Literal["waiting", "running", "done", "failed"]
STATES: tuple[State, ...] = ("waiting", "running", "done", "failed")

TABLES = """
CREATE TABLE IF NOT EXISTS runs (
    key TEXT PRIMARY KEY,       -- hash of all that the result depends on
    number INTEGER,             -- in the study; none: of an earlier form of it, kept
    settings TEXT NOT NULL,     -- JSON of what varies
    trial TEXT NOT NULL,        -- JSON of all settings
    sample TEXT NOT NULL,       -- folder under samples/ that holds its outline, solid and path
    kin TEXT NOT NULL,          -- equal where runs differ in the fluid alone
    work_s REAL NOT NULL,       -- expected
    state TEXT NOT NULL DEFAULT 'waiting' CHECK (state IN ('waiting', 'running', 'done', 'failed')),
    tries INTEGER NOT NULL DEFAULT 0,
    claim TEXT, host TEXT, pid INTEGER, heartbeat_unix_s REAL, frame INTEGER, frames INTEGER,
    started_unix_s REAL, finished_unix_s REAL, wall_s REAL,
    reason TEXT, trace TEXT,    -- of a failure
    figures TEXT                -- JSON of the result
) WITHOUT ROWID;
CREATE INDEX IF NOT EXISTS next_run ON runs (state, number);
"""


@dataclass(frozen=True)
class Entry:
    """A run as it is planned."""

    key: str
    number: int
    settings: Mapping[str, Any]
    trial: str
    """JSON of all settings."""
    sample: str
    kin: str
    work_s: float


@dataclass(frozen=True)
class Claim:
    """Runs that one process computes; nobody else can finish them while it holds them."""

    token: str
    entries: tuple[Entry, ...]


@dataclass(frozen=True)
class StudyRun:
    """What is known of one run of a study."""

    number: int
    key: str
    settings: dict[str, Any]
    """What varies, by dotted name, for example {"fluid.U": 30.0, "fluid.D_cm": 0.3}."""
    sample: str
    state: State
    work_s: float
    """As expected, on the machine that the estimate's constants are from."""
    tries: int
    host: str | None
    pid: int | None
    heartbeat_unix_s: float | None
    frame: int | None
    frames: int | None
    started_unix_s: float | None
    finished_unix_s: float | None
    wall_s: float | None
    reason: str | None
    """Of a failure, in a sentence."""
    trace: str | None
    """Of a bug."""
    figures: dict[str, Any] | None
    """Of a run that is done, else None: mean_error_mm, worst_error_mm and worst_at_mm where the trial has readings;
    volume_ratio, spilled_particles, particles, profile_sha256, and health, which is that of the whole launch where
    several runs shared one.
    """


def read_study(folder: Path) -> list[StudyRun]:
    """All runs of a study in its order, finished or not; safe while they are computed, from any process.

    The profile of a run that is done is ``profile_path(folder, run.key)``, a CSV of s_mm and level_mm.

    Raises:
        InputError: the folder holds no study.
    """
    with Ledger(folder) as ledger:
        return ledger.runs()


def profile_path(folder: Path, key: str) -> Path:
    """Where the level along the crack of a run that is done lies."""
    return run_path(folder, key) / PROFILE


def run_path(folder: Path, key: str) -> Path:
    return folder / "runs" / key[:16]


class Ledger(Database):
    """An open ledger. Every change is one transaction: a process that is killed leaves it as before or as after."""

    called = "ledger"

    def __init__(self, folder: Path, *, create: bool = False) -> None:
        path = folder / LEDGER
        if not create and not path.is_file():
            raise InputError(f"{folder}: no study (it has no {LEDGER}). 'sealtwin sweep STUDY.toml' makes one.")
        super().__init__(path, TABLES, VERSION, create=create, readers_wait=False)

    def plan(self, entries: Sequence[Entry]) -> None:
        """From here on the study is ``entries``. Runs that were finished with the same key stay so.

        No process may hold a run: what an earlier one left half done is waiting again.
        """
        with self._told(), self._transaction():
            self._base.execute("UPDATE runs SET number = NULL")
            self._base.execute("UPDATE runs SET state = 'waiting', claim = NULL WHERE state = 'running'")
            self._base.executemany(
                "INSERT INTO runs (key, number, settings, trial, sample, kin, work_s) VALUES (?, ?, ?, ?, ?, ?, ?) "
                "ON CONFLICT (key) DO UPDATE SET number = excluded.number, settings = excluded.settings, "
                "trial = excluded.trial, sample = excluded.sample, kin = excluded.kin, work_s = excluded.work_s",
                [(e.key, e.number, json.dumps(dict(e.settings)), e.trial, e.sample, e.kin, e.work_s) for e in entries],
            )

    def put_back(self, keys: Iterable[str]) -> None:
        """Those runs are to be computed once more."""
        with self._told(), self._transaction():
            self._base.executemany(
                "UPDATE runs SET state = 'waiting', claim = NULL, reason = NULL, trace = NULL, figures = NULL "
                "WHERE key = ?",
                [(key,) for key in keys],
            )

    def claim(self, most: int = 1) -> Claim | None:
        """The next waiting run, with up to ``most`` - 1 others that differ from it in the fluid alone.

        None where no run waits. They are this process's until it finishes them, or somebody puts them back.
        """
        token = uuid.uuid4().hex
        with self._told(), self._transaction():
            rows = self._base.execute(
                "SELECT key, number, settings, trial, sample, kin, work_s FROM runs "
                "WHERE state = 'waiting' AND number IS NOT NULL AND kin = "
                "(SELECT kin FROM runs WHERE state = 'waiting' AND number IS NOT NULL ORDER BY number LIMIT 1) "
                "ORDER BY number LIMIT ?",
                [most],
            ).fetchall()
            now = time.time()
            self._base.executemany(
                "UPDATE runs SET state = 'running', claim = ?, host = ?, pid = ?, tries = tries + 1, frame = 0, "
                "frames = NULL, heartbeat_unix_s = ?, started_unix_s = ? WHERE key = ?",
                [(token, platform.node(), os.getpid(), now, now, row[0]) for row in rows],
            )
        entries = tuple(Entry(row[0], row[1], json.loads(row[2]), *row[3:]) for row in rows)
        return Claim(token, entries) if entries else None

    def beat(self, claim: Claim, frame: int, frames: int) -> None:
        """Whoever holds ``claim`` is alive, and so far."""
        self._write(
            "UPDATE runs SET heartbeat_unix_s = ?, frame = ?, frames = ? WHERE claim = ?",
            [time.time(), frame, frames, claim.token],
        )

    def finish(self, claim: Claim, key: str, wall_s: float, figures: Mapping[str, Any]) -> bool:
        """The run is done and its files are written. False, and nothing changed, where it was taken away meanwhile."""
        return self._close(claim, key, "done", wall_s, figures=json.dumps(dict(figures), allow_nan=False))

    def fail(self, claim: Claim, key: str, wall_s: float, reason: str, trace: str | None = None) -> bool:
        """The run has no result, for ``reason``. False as in ``finish``."""
        return self._close(claim, key, "failed", wall_s, reason=reason, trace=trace)

    def held_by(self, pid: int) -> list[str]:
        """Keys of the runs that a process of this host computes."""
        with self._told():
            rows = self._base.execute(
                "SELECT key FROM runs WHERE state = 'running' AND pid = ? AND host = ?", [pid, platform.node()]
            ).fetchall()
        return [row[0] for row in rows]

    def silent_since(self, unix_s: float) -> set[int]:
        """Processes that hold runs of which they have said nothing since."""
        with self._told():
            rows = self._base.execute(
                "SELECT DISTINCT pid FROM runs WHERE state = 'running' AND heartbeat_unix_s < ? AND host = ?",
                [unix_s, platform.node()],
            ).fetchall()
        return {row[0] for row in rows}

    def give_up(self, key: str, reason: str) -> None:
        """A run that nobody holds is failed."""
        self._write(
            "UPDATE runs SET state = 'failed', claim = NULL, reason = ?, finished_unix_s = ? WHERE key = ?",
            [reason, time.time(), key],
        )

    def runs(self) -> list[StudyRun]:
        names = list(StudyRun.__dataclass_fields__)
        with self._told():
            rows = self._base.execute(
                f"SELECT {', '.join(names)} FROM runs WHERE number IS NOT NULL ORDER BY number"
            ).fetchall()
        runs = []
        for row in rows:
            values = dict(zip(names, row, strict=True))
            values["settings"] = json.loads(values["settings"])
            values["figures"] = None if values["figures"] is None else json.loads(values["figures"])
            runs.append(StudyRun(**values))
        return runs

    def entry(self, key: str) -> Entry:
        """A run of the study, as it was planned."""
        with self._told():
            row = self._base.execute(
                "SELECT key, number, settings, trial, sample, kin, work_s FROM runs WHERE key = ?", [key]
            ).fetchone()
        return Entry(row[0], row[1], json.loads(row[2]), *row[3:])

    def count(self, state: State) -> int:
        with self._told():
            (number,) = self._base.execute(
                "SELECT COUNT(*) FROM runs WHERE state = ? AND number IS NOT NULL", [state]
            ).fetchone()
        return number

    def progress_s(self) -> float:
        """Expected seconds of work that are behind: of what is done or failed, and of the frames that are."""
        with self._told():
            (work_s,) = self._base.execute(
                "SELECT TOTAL(CASE WHEN state IN ('done', 'failed') THEN work_s "
                "WHEN state = 'running' AND frames > 0 THEN work_s * frame / frames END) "
                "FROM runs WHERE number IS NOT NULL"
            ).fetchone()
        return work_s

    def _close(
        self,
        claim: Claim,
        key: str,
        state: State,
        wall_s: float,
        *,
        reason: str | None = None,
        trace: str | None = None,
        figures: str | None = None,
    ) -> bool:
        changed = self._write(
            "UPDATE runs SET state = ?, claim = NULL, wall_s = ?, reason = ?, trace = ?, figures = ?, "
            "finished_unix_s = ? WHERE key = ? AND claim = ?",
            [state, wall_s, reason, trace, figures, time.time(), key, claim.token],
        )
        return changed == 1
