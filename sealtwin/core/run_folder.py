"""Run folder with its lock and its manifest, which lists the finished stages, their keys, inputs and outputs.

The key of a result is a hash of everything that the result depends on, including the stage numbers. Each stage defines
a stage number, and raises it whenever the same input gives a different result.
"""

import hashlib
import json
import os
import platform
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import version
from itertools import chain, count
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout

from sealtwin.core.errors import BusyError, InputError, as_text
from sealtwin.core.files import hashes, is_temporary, read_json, sha256, write_json, write_text

MANIFEST = "manifest.json"
LOCK = ".lock"
HOLDER = ".holder.json"

ENTRY = {
    "key": str,
    "settings": dict,
    "inputs": dict,
    "given": list,
    "outputs": dict,
    "wall_time_s": int | float,
    "finished_utc": str,
    "versions": dict,
    "stage_numbers": dict,
}
"""Keys of a finished stage's entry in the manifest, with the types of their values."""
BEGUN = ("from", "sha256", "trial")
"""Keys of the manifest's entry "begun": path of the file to which the folder belongs, hash of the file that shows the
crack, and hash of the trial file as it was written."""
PACKAGES = (
    *("sealtwin", "numpy", "scipy", "opencv-python-headless", "scikit-image", "trimesh", "manifold3d", "warp-lang"),
    *("similaritymeasures", "matplotlib"),
)
UNNUMBERED = 0
"""Stage number that stands for a stage without a recorded number, such as validate in a study without readings."""


@dataclass
class RunFolder:
    """Run folder that ``open_folder`` has locked for this process, or that ``look_into`` has opened for reading."""

    path: Path
    manifest: dict[str, Any]

    def entry_of(self, stage: str) -> dict[str, Any]:
        """Return the entry of ``stage`` in the manifest. The entry is empty if the stage is not finished."""
        return self.manifest["stages"].get(stage, {})

    def is_current(self, stage: str, key: str) -> bool:
        """Return True if ``stage`` is finished with this key and its output files are unchanged."""
        entry = self.entry_of(stage)
        return entry.get("key") == key and not self._changed(entry["outputs"])

    def settings_of(self, stage: str) -> dict[str, Any] | None:
        """Return the settings of ``stage``, or None if the stage is not finished."""
        return self.entry_of(stage).get("settings")

    def numbers_of(self, stage: str) -> dict[str, int]:
        """Return the stage numbers with which ``stage`` was computed. Empty if the stage is not finished."""
        return self.entry_of(stage).get("stage_numbers", {})

    def edited(self, stage: str) -> list[str]:
        """Return the output files of ``stage`` that were changed after the stage wrote them."""
        return [name for name in self._changed(self.entry_of(stage).get("outputs", {})) if (self.path / name).is_file()]

    def changed_since(self, stage: str) -> list[str]:
        """Return the input files of a finished ``stage`` that are missing or were changed."""
        return self._changed(self.entry_of(stage)["inputs"])

    def clear(self, stage: str) -> list[str]:
        """Remove ``stage`` from the manifest and delete its output files, so that nobody takes them for new ones.

        An edited file is not deleted but renamed. Returns the new names.
        """
        renamed = list[str]()
        for path in (self.path / name for name in self.edited(stage)):
            names = (path.with_name(f"{path.stem}.changed{number}{path.suffix}") for number in chain([""], count(2)))
            renamed.append(path.replace(next(free for free in names if not free.exists())).name)
        if entry := self.manifest["stages"].pop(stage, None):
            self.save()
            for name in entry["outputs"]:
                (self.path / name).unlink(missing_ok=True)
        return renamed

    def record(
        self,
        stage: str,
        key: str,
        settings: Mapping[str, Any],
        inputs: Mapping[str, str],
        outputs: Sequence[str],
        wall_time_s: float,
        *,
        numbers: Mapping[str, int],
        from_user: Sequence[str] = (),
        **facts: Any,
    ) -> None:
        """Record a finished ``stage``: its key, settings, hashes of inputs and outputs, and other facts.

        ``numbers`` are the stage numbers that are part of the key. ``from_user`` names the inputs from the user; an
        earlier stage wrote the other inputs.
        """
        self.manifest["stages"][stage] = {
            "key": key,
            "settings": settings,
            "inputs": inputs,
            "given": from_user,
            "outputs": hashes(self.path, outputs),
            "wall_time_s": round(wall_time_s, 3),
            "finished_utc": datetime.now(UTC).isoformat(timespec="seconds"),
            "versions": versions(),
            "stage_numbers": numbers,
            **facts,
        }
        self.save()

    def finished(self) -> list[str]:
        """Return the finished stages whose inputs and outputs are in the folder, in the order of the pipeline."""
        # A stage that was repeated is last in the manifest. Alphabetical order equals the order of the pipeline.
        stages = sorted(self.manifest["stages"].items())
        return [stage for stage, entry in stages if self._is_complete(entry)]

    def save(self) -> None:
        write_json(self.path / MANIFEST, self.manifest)

    def _is_complete(self, entry: Mapping[str, Any]) -> bool:
        from_stages = {name: digest for name, digest in entry["inputs"].items() if name not in entry["given"]}
        return all((self.path / name).is_file() for name in entry["outputs"]) and not self._changed(from_stages)

    def _changed(self, hashes: Mapping[str, str]) -> list[str]:
        """Return the files that are missing or have a different hash."""
        paths = {name: self.path / name for name in hashes}
        return [name for name, path in paths.items() if not (path.is_file() and sha256(path) == hashes[name])]


@contextmanager
def open_folder(path: Path, *, create: bool) -> Iterator[RunFolder]:
    """Lock a run folder until the block ends or the process is killed.

    If the folder is missing or empty, ``create`` makes it. Raises InputError if ``path`` is a file, is not a run
    folder, or has files that no run wrote. Raises BusyError if another process has locked it.
    """
    _check_usable(path, create)
    with holding(path):
        refuse_links(path)  # First, since the manifest of a folder with a link names files elsewhere
        yield RunFolder(path, _read_manifest(path))


def look_into(path: Path) -> RunFolder:
    """Open a run folder for reading, even if another process has locked it.

    Raises InputError if ``path`` is not a run folder, or if the manifest is damaged.
    """
    _check_usable(path, create=False)
    return RunFolder(path, _read_manifest(path))


@contextmanager
def holding(path: Path, waiting: Callable[[str], None] | None = None) -> Iterator[None]:
    """Make a folder if necessary, lock it until the block ends, and remove unfinished files of a killed process.

    Run folders below ``path`` have their own lock, so their files are not removed. If another process has locked
    ``path``, calls ``waiting`` with a message and waits. Without ``waiting``, raises BusyError.
    """
    require_folder(path)
    path.mkdir(parents=True, exist_ok=True)
    lock = FileLock(path / LOCK)
    try:
        lock.acquire(timeout=0)
    except Timeout:
        busy = f"{path}: in use by {_holder(path)}"
        if waiting is None:
            raise BusyError(f"{busy}. Wait for that process, stop it, or give another --out.") from None
        waiting(f"{busy}; waiting for that process.")
        lock.acquire()
    try:
        since = datetime.now().astimezone().strftime("%H:%M:%S")
        for name, folders, names in os.walk(path):
            folders[:] = [folder for folder in folders if not Path(name, folder, MANIFEST).exists()]
            for stale in filter(is_temporary, map(Path(name).joinpath, names)):
                stale.unlink()
        write_text(path / HOLDER, json.dumps({"process": os.getpid(), "host": platform.node(), "since": since}))
        yield
    finally:
        (path / HOLDER).unlink(missing_ok=True)
        lock.release()


def require_folder(path: Path) -> None:
    """Raise InputError if ``path`` or one of its parents is a file, or if the path is not UTF-8."""
    if as_text(path) != str(path):
        raise InputError(f"{as_text(path)}: the name is not UTF-8. Rename the folder, or give another --out.")
    for part in (path, *path.parents):
        if part.exists() and not part.is_dir():
            raise InputError(f"{part}: is a file, but should be a new folder or the folder of an earlier run.")


def refuse_links(path: Path) -> None:
    """Raise InputError if ``path`` contains a link to a folder elsewhere, since files would be written there."""
    for part in path.iterdir():
        if part.is_symlink() and part.is_dir() and not part.resolve().is_relative_to(path.resolve()):
            raise InputError(
                f"{part}: is a link to a folder elsewhere, so files would be written there. Replace the link by a real "
                "folder."
            )


def refuse_foreign(path: Path, maker: str, names: Sequence[str]) -> None:
    """Raise InputError if ``names`` is not empty. These are the files in the folder that ``maker`` did not write."""
    if names:
        raise InputError(f"{path}: has files that no {maker} wrote ({', '.join(names[:3])}). Give another --out.")


def require_own(path: Path, marker: str, maker: str) -> None:
    """Raise InputError if ``path`` is not a folder, or is a folder with files that ``maker`` did not write.

    A folder with the file ``marker`` was written by ``maker``. The lock and temporary files, which a killed process may
    have left, are ignored.
    """
    require_folder(path)
    if path.is_dir() and not (path / marker).exists():
        foreign = (file.name for file in path.iterdir() if not is_temporary(file))
        refuse_foreign(path, maker, sorted({*foreign} - {LOCK, HOLDER}))


@cache
def versions() -> dict[str, str]:
    """Return the versions of Python and of the packages. They are cached, because a study may compute 20,000 keys."""
    return {"python": platform.python_version(), **{name: version(name) for name in PACKAGES}}


def _check_usable(path: Path, create: bool) -> None:
    require_folder(path)
    if create:
        require_own(path, MANIFEST, "run")
    elif not (path / MANIFEST).is_file():
        raise InputError(f"{path}: is not a run folder, since it has no {MANIFEST}. 'sealtwin run TRIAL' makes one.")


def _holder(path: Path) -> str:
    try:
        holder = read_json(path / HOLDER)
        return f"process {holder['process']} on {holder['host']} since {holder['since']}"
    except (InputError, OSError, KeyError, TypeError):
        return "another process that has just started"


def _read_manifest(path: Path) -> dict[str, Any]:
    if not (path / MANIFEST).is_file():
        write_json(path / MANIFEST, {"version": 1, "stages": {}})
    try:
        manifest = read_json(path / MANIFEST)
        begun = manifest.get("begun") or dict.fromkeys(BEGUN, "")
        is_known = manifest["version"] == 1 and all(isinstance(begun[key], str) for key in BEGUN)
        if is_known and all(_is_entry(path, entry) for entry in manifest["stages"].values()):
            return manifest
    except (InputError, KeyError, TypeError, AttributeError, ValueError):
        pass  # The message below is for a damaged manifest and for a manifest of another form.
    raise InputError(
        f"{path / MANIFEST}: is damaged, or another version of sealtwin wrote it. Delete {path}, and make it again "
        f"with 'sealtwin run TRIAL --out {path}'."
    )


def _is_entry(folder: Path, entry: Mapping[str, Any]) -> bool:
    """Return True if the entry of a stage is valid.

    Its outputs must be inside the folder, because they are deleted when the stage is cleared.
    """
    home = folder.resolve()
    files = [Path(os.path.normpath(home / name)) for name in entry["outputs"]]
    below = all(home in file.parents and file.parent.resolve().is_relative_to(home) for file in files)
    return below and all(isinstance(entry[part], kind) for part, kind in ENTRY.items())


def stage_key(inputs: Mapping[str, str], settings: Mapping[str, Any], numbers: Mapping[str, int]) -> str:
    """Return the key of a result: a hash of its inputs, its settings, the package version and the stage numbers."""
    return content_key({"inputs": inputs, "settings": settings, "version": versions()["sealtwin"], "numbers": numbers})


def content_key(content: Mapping[str, Any]) -> str:
    """Return a hash of JSON content. A hash without stage numbers is only for comparison within one call."""
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def number_words(numbers: Mapping[str, int]) -> str:
    """Return stage numbers in words, such as "digitise 1, simulate 2". A number that is not recorded is "unknown"."""
    return ", ".join(f"{stage} {number or 'unknown'}" for stage, number in numbers.items()) or "unknown"


def other_numbers(recorded: Mapping[str, int], current: Mapping[str, int]) -> str:
    """Return how ``recorded`` stage numbers differ from ``current``, or "" if they are equal.

    The text continues a sentence after "computed by".
    """
    numbers = {stage: recorded.get(stage, UNNUMBERED) for stage in current}
    before = {stage: number for stage, number in numbers.items() if number != current[stage]}
    now = {stage: current[stage] for stage in before}
    return f"{number_words(before)}, while this version has {number_words(now)}" if before else ""
