"""Readings that a study or a calibration of a lab used to choose by."""

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from sealtwin.core.errors import InputError
from sealtwin.core.records import Profile
from sealtwin.core.run_folder import holding
from sealtwin.lab.catalogue import Catalogue, is_lab
from sealtwin.study.study_file import load_study
from sealtwin.trial.trial_file import load_trial
from validate.readings.read_readings import read_readings

TRIAL = "trial.toml"
LEVELS = 3  # Folders from a run's or a sheet's own up to the lab's: lab/P01/run
DECIMALS = 6  # Of a millimetre, as of a profile's file; no sheet has as many


def uses(catalogue: Catalogue) -> tuple[dict[str, list[str]], list[str]]:
    """Return the studies and calibrated trials of a lab by the hash of their readings, and cautions on unread ones."""
    names_by_hash = {digest: sorted(names) for digest, names in catalogue.content.uses.items()}
    cautions = list[str]()
    for record in catalogue.records:
        path = catalogue.lab / record.folder / TRIAL
        try:
            readings = load_trial(path).readings if path.is_file() else None
            if readings is None or readings.role != "calibrated-on":
                continue
            digest = readings_hash(read_readings(path.parent / readings.file, readings))
        except InputError as fault:
            # Another sample's sheet must not keep this one from its run.
            why = str(fault).partition("\n")[0]
            cautions.append(f"caution: sample '{record.name}' may be calibrated on these readings: {why}")
            continue
        names_by_hash.setdefault(digest, []).append(
            f"calibration of sample '{record.name}', revision {record.revision},"
        )
    return names_by_hash, cautions


def readings_hash(readings: Profile) -> str:
    """Return the hash of the levels and their stations; file format and order of the repeats do not change it."""
    repeats_mm = readings.level_mm[:, None] if readings.repeats_mm is None else readings.repeats_mm
    # Missing readings come last, and a column of nothing else is none.
    repeats_mm = np.sort(repeats_mm, axis=1)
    repeats_mm = repeats_mm[:, ~np.isnan(repeats_mm).all(axis=0)]
    table = np.round(np.column_stack([readings.s_mm, repeats_mm]), DECIMALS) + 0.0
    return hashlib.sha256(table.astype("<f8").tobytes()).hexdigest()


def note_study(file: Path, settings: Mapping[str, Any] | None = None) -> None:
    """Write a study into the catalogue of the lab by whose readings it ranked its runs, if there is one.

    ``settings`` by dotted name replaced those of its trial. Raises InputError if the study, its trial or the catalogue
    cannot be read.
    """
    study = load_study(file)
    base = file.parent / study.trial
    trial = load_trial(base, settings)
    if trial.readings is not None:
        sheet = base.parent / trial.readings.file
        note_use(sheet, read_readings(sheet, trial.readings), f"study '{study.name}'")


def note_use(sheet: Path, readings: Profile, what: str) -> None:
    """Write into the catalogue of the sheet's lab, if there is one, what ranked its runs by these readings."""
    if (lab := lab_of(sheet.parent)) is not None:
        with holding(lab, lambda _: None):
            catalogue = Catalogue(lab)
            uses = catalogue.content.uses.setdefault(readings_hash(readings), [])
            if what not in uses:
                uses.append(what)
                catalogue.save()


def lab_of(folder: Path) -> Path | None:
    """Return the lab that a folder lies in, or None."""
    folder = folder.resolve()
    return next((above for above in (folder, *folder.parents)[:LEVELS] if is_lab(above)), None)
