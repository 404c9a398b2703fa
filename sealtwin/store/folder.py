"""One run folder: who holds it, which stage made which file from what, and what may be kept."""

import hashlib
import json
import os
import platform
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from importlib.metadata import version
from itertools import chain, count
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout

from sealtwin.errors import BusyError, InputError, as_text
from sealtwin.store.files import sha256, write_json, write_text

MANIFEST = "manifest.json"
LOCK = ".lock"
HOLDER = ".holder.json"
TEMPORARY = re.compile(r"\.\.?[^.]+\.\d+\.\w+")
"""What ``files.replacing`` leaves when its process is killed, of a hidden file too."""

ENTRY = {
    "key": str,
    "settings": dict,
    "inputs": dict,
    "given": list,
    "outputs": dict,
    "wall_time_s": int | float,
    "versions": dict,
}
"""What the manifest says of each finished stage."""
PACKAGES = (
    "sealtwin",
    "numpy",
    "scipy",
    "opencv-python-headless",
    "scikit-image",
    "trimesh",
    "manifold3d",
    "warp-lang",
    "similaritymeasures",
    "matplotlib",
)


class RunFolder:
    """A folder that this process holds. Made by ``open_folder``."""

    def __init__(self, path: Path, manifest: dict[str, Any]) -> None:
        self.path = path
        self.manifest = manifest

    def is_current(self, stage: str, key: str) -> bool:
        """Whether ``stage`` was finished with this key and its files are still as it wrote them."""
        entry = self.manifest["stages"].get(stage)
        return entry is not None and entry["key"] == key and not self._changed(entry)

    def settings_of(self, stage: str) -> dict[str, Any] | None:
        """What ``stage`` was finished with; None where it is not finished."""
        entry = self.manifest["stages"].get(stage)
        return None if entry is None else entry["settings"]

    def edited(self, stage: str) -> list[str]:
        """Files of ``stage`` that are there, but not as it wrote them."""
        entry = self.manifest["stages"].get(stage)
        return [name for name in self._changed(entry) if (self.path / name).is_file()] if entry else []

    def changed_since(self, stage: str) -> list[str]:
        """Files that a finished ``stage`` was made from, and that are now gone or another."""
        inputs = self.manifest["stages"][stage]["inputs"].items()
        return [
            name for name, digest in inputs if not (self.path / name).is_file() or sha256(self.path / name) != digest
        ]

    def clear(self, stage: str) -> list[str]:
        """``stage`` is no longer finished, and its files go: killed half way, nothing old passes for new.

        Files that somebody edited since are set aside. Returns the names under which they were kept.
        """
        kept = []
        for name in self.edited(stage):
            path = self.path / name
            copy = _free_name(path)
            path.replace(copy)
            kept.append(copy.name)
        entry = self.manifest["stages"].pop(stage, None)
        if entry is not None:
            self.save()
            for name in entry["outputs"]:
                (self.path / name).unlink(missing_ok=True)
        return kept

    def record(
        self,
        stage: str,
        key: str,
        settings: Mapping[str, Any],
        inputs: Mapping[str, str],
        outputs: Sequence[str],
        wall_time_s: float,
        *,
        given: Sequence[str] = (),
        **facts: Any,
    ) -> None:
        """``stage`` is finished: its key, its settings, the hashes of what it read and wrote, and other facts.

        ``given`` names the inputs that came from the user and not from an earlier stage.
        """
        self.manifest["stages"][stage] = {
            "key": key,
            "settings": dict(settings),
            "inputs": dict(inputs),
            "given": list(given),
            "outputs": {name: sha256(self.path / name) for name in outputs},
            "wall_time_s": round(wall_time_s, 3),
            "finished_utc": datetime.now(UTC).isoformat(timespec="seconds"),
            "versions": versions(),
            **facts,
        }
        self.save()

    def finished(self) -> list[str]:
        """Stages whose results still rest on what lies in the folder, in the order of the pipeline."""
        # Redone, a stage stands last in the manifest; the alphabet happens to know where it belongs.
        stages = sorted(self.manifest["stages"].items())
        return [stage for stage, entry in stages if self._rests_on_what_is_here(entry)]

    def wall_time_s(self) -> float:
        """Of all finished stages, each when it was last done."""
        return sum(self.manifest["stages"][stage]["wall_time_s"] for stage in self.finished())

    def save(self) -> None:
        write_json(self.path / MANIFEST, self.manifest)

    def _rests_on_what_is_here(self, entry: Mapping[str, Any]) -> bool:
        from_stages = {name: digest for name, digest in entry["inputs"].items() if name not in entry["given"]}
        return all((self.path / name).is_file() for name in (*from_stages, *entry["outputs"])) and all(
            sha256(self.path / name) == digest for name, digest in from_stages.items()
        )

    def _changed(self, entry: Mapping[str, Any]) -> list[str]:
        return [
            name
            for name, digest in entry["outputs"].items()
            if not (self.path / name).is_file() or sha256(self.path / name) != digest
        ]


@contextmanager
def open_folder(path: Path, *, create: bool) -> Iterator[RunFolder]:
    """Hold a run folder until the block ends; a killed process lets go at once.

    Args:
        path: The folder.
        create: Make it where it is missing or empty; otherwise it must be a run folder already.

    Raises:
        InputError: it is a file, is no run folder, or holds files that no run wrote.
        BusyError: another process holds it.
    """
    _check_usable(path, create)
    with holding(path):
        for stale in path.iterdir():
            if TEMPORARY.fullmatch(stale.name):
                stale.unlink()
        yield RunFolder(path, _read_manifest(path))


def look_into(path: Path) -> RunFolder:
    """A run folder to read from, whoever holds it; nothing in it is changed.

    Raises InputError where it is none, or its manifest is damaged.
    """
    _check_usable(path, create=False)
    return RunFolder(path, _read_manifest(path))


@contextmanager
def holding(path: Path, waiting: Callable[[str], None] | None = None) -> Iterator[None]:
    """Make a folder and keep other processes of ours out of it.

    Raises BusyError where one is in it; or, where ``waiting`` is given, tells it so and waits for that process to end.
    """
    require_folder(path)
    path.mkdir(parents=True, exist_ok=True)
    lock = FileLock(path / LOCK)
    try:
        lock.acquire(timeout=0)
    except Timeout:
        if waiting is None:
            raise BusyError(
                f"{path}: in use by {_holder(path)}. Wait for it, stop it, or give another --out."
            ) from None
        waiting(f"{path}: in use by {_holder(path)}; waiting for it.")
        lock.acquire()
    try:
        since = datetime.now().astimezone().strftime("%H:%M:%S")
        write_text(path / HOLDER, json.dumps({"process": os.getpid(), "host": platform.node(), "since": since}))
        yield
    finally:
        (path / HOLDER).unlink(missing_ok=True)
        lock.release()


def require_folder(path: Path) -> None:
    """Raises InputError where ``path``, or a folder on the way to it, is a file, or has a name that no JSON takes."""
    if as_text(path) != str(path):
        raise InputError(f"{as_text(path)}: a name that is not UTF-8; give --out another folder, or rename it.")
    for part in (path, *path.parents):
        if part.exists() and not part.is_dir():
            raise InputError(f"{part}: this is a file; --out must name a folder, new or made by an earlier run.")


def stage_key(inputs: Mapping[str, str], settings: Mapping[str, Any]) -> str:
    """What a stage's result depends on, as one hash: its inputs, its settings and the package version."""
    content = {"inputs": dict(inputs), "settings": dict(settings), "version": version("sealtwin")}
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def versions() -> dict[str, str]:
    """Of Python and of each package that shapes a result."""
    return {"python": platform.python_version(), **{name: version(name) for name in PACKAGES}}


def _check_usable(path: Path, create: bool) -> None:
    require_folder(path)
    is_run = (path / MANIFEST).is_file()
    if not create and not is_run:
        raise InputError(f"{path}: no run folder (it has no {MANIFEST}). 'sealtwin run TRIAL' makes one.")
    if create and path.is_dir() and not is_run:
        # Killed before its first file, a run leaves only these.
        foreign = [found.name for found in path.iterdir() if found.name not in {LOCK, HOLDER} and not _stale(found)]
        if foreign:
            raise InputError(
                f"{path}: holds files that no run wrote ({', '.join(sorted(foreign)[:3])}); "
                "nothing of yours is overwritten: give --out another folder."
            )


def _free_name(path: Path) -> Path:
    """Where an edited file is kept; what was kept before stays too."""
    tries = (path.with_name(f"{path.stem}.changed{number}{path.suffix}") for number in chain([""], count(2)))
    return next(name for name in tries if not name.exists())


def _stale(path: Path) -> bool:
    return TEMPORARY.fullmatch(path.name) is not None


def _holder(path: Path) -> str:
    try:
        holder = json.loads((path / HOLDER).read_text(encoding="utf-8"))
        return f"process {holder['process']} on {holder['host']} since {holder['since']}"
    except (OSError, ValueError, KeyError):
        return "another process that has just started"


def _read_manifest(path: Path) -> dict[str, Any]:
    if not (path / MANIFEST).is_file():
        write_json(path / MANIFEST, {"version": 1, "stages": {}})
    try:
        manifest = json.loads((path / MANIFEST).read_text(encoding="utf-8"))
        if manifest["version"] == 1 and all(_is_entry(entry) for entry in manifest["stages"].values()):
            _refuse_outside(path, [name for entry in manifest["stages"].values() for name in entry["outputs"]])
            return manifest
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        pass  # Damaged or of another form: one sentence for all of it.
    raise InputError(
        f"{path / MANIFEST}: damaged, or written by another version. Give another --out, or delete {path}."
    )


def _is_entry(entry: Mapping[str, Any]) -> bool:
    return all(isinstance(entry[part], kind) for part, kind in ENTRY.items())


def _refuse_outside(path: Path, outputs: Sequence[str]) -> None:
    """Raises InputError where an output lies outside the folder: a stage that is redone moves or removes its outputs.

    ``record`` writes no such name; a run folder from somebody else may hold one, or a link that leads out.
    """
    home = path.resolve()
    for name in outputs:
        file = path / name
        if file == path or "\0" in name or file.name == ".." or not file.parent.resolve().is_relative_to(home):
            raise InputError(
                f"{path / MANIFEST}: names {name!r:.80} as made by a stage, which lies outside {path}; nothing is done "
                "there. Give another --out, or delete that folder."
            )
