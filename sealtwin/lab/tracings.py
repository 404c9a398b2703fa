"""Tracings that a lab already has: each photo is traced once, however many rounds of questions there are."""

from functools import cached_property
from pathlib import Path

from sealtwin.core.errors import InputError
from sealtwin.core.run_folder import MANIFEST, RunFolder, look_into, open_folder
from sealtwin.core.stage_keys import content_key
from sealtwin.lab.catalogue import RUN
from sealtwin.lab.found_files import TRIAL
from sealtwin.trial.digitise_stage import tracing_key
from sealtwin.trial.trial_file import load_trial

WAITING = ".traced"  # Folder in a lab with the tracings of samples that have no trial yet


def waiting_folder(lab: Path, source: str) -> Path:
    """Return the folder for tracings of samples in doubt. Each source has its own, since names may be the same."""
    return lab / WAITING / content_key({"source": source})[:8]


class Tracings:
    """Finished tracings in a lab, by the key of their photo and settings."""

    def __init__(self, lab: Path) -> None:
        self._lab = lab

    def give(self, trial_folder: Path, run: Path) -> None:
        """Copy the tracing of a trial's photo into its run folder, if the lab has it and no stage has run there.

        Raises InputError if the trial cannot be read, or the run folder cannot be used.
        """
        if not self._folders or ((run / MANIFEST).is_file() and look_into(run).manifest["stages"]):
            return
        key = tracing_key(load_trial(trial_folder / TRIAL), trial_folder)
        if (traced := self._folders.get(key)) is not None:
            with open_folder(run, create=True) as folder:
                folder.copy_stage("digitise", traced)

    @cached_property
    def _folders(self) -> dict[str, RunFolder]:
        folders: dict[str, RunFolder] = {}
        for path in sorted([*self._lab.glob(f"{WAITING}/*/*/{MANIFEST}"), *self._lab.glob(f"*/{RUN}/{MANIFEST}")]):
            try:
                folder = look_into(path.parent)
            except InputError:
                continue  # Whoever uses that folder reports it.
            if (entry := folder.manifest["stages"].get("digitise")) is not None:
                folders[entry["key"]] = folder
        return folders
