"""One sample's files as a trial that is ready to run; or all that keeps it from being one."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from digitise.settings import DEEPEST_MM
from sealtwin.errors import InputError
from sealtwin.lab.prepared import PICTURES, Prepared, RawFile
from sealtwin.lab.starting import remarks_on_fluid
from sealtwin.lab.tables import origin_of, tables_of
from sealtwin.store.settings_file import checked
from sealtwin.trials.trial import Trial


def prepare(folder: Path, prepared: Prepared) -> None:
    """Look at what ``gather`` found: give ``prepared`` its trial and its dialect, or its faults."""
    content = tables_of(prepared)
    try:
        trial = checked(Trial, folder, content, lambda key: origin_of(folder, prepared, key))
    except InputError as fault:
        trial = None
        prepared.faults += str(fault).splitlines()
    for raw in prepared.raw:
        if raw.role in PICTURES:
            _look_at_picture(raw, prepared)
        elif raw.role == "readings":
            _read_readings(raw, content, prepared)
    if prepared.faults or trial is None:
        return
    prepared.trial = trial
    if trial.fluid is not None:
        prepared.remarks += remarks_on_fluid(prepared.note.entries.keys(), trial.fluid)
    if trial.photo is not None and trial.photo.ends_px is None and trial.photo.mask is None:
        prepared.remarks.append("no ends_px: the crack is searched for; 'sealtwin trace' lets you click its ends.")


def _look_at_picture(raw: RawFile, prepared: Prepared) -> None:
    from digitise.pictures.decoding import read_photo

    try:
        read_photo(raw.path, PICTURES[raw.role])
    except InputError as fault:
        prepared.faults.append(str(fault))


def _read_readings(raw: RawFile, content: Mapping[str, Any], prepared: Prepared) -> None:
    """By the pipeline's own reader, whatever else is wrong; how long the crack is, is not known yet."""
    from validate.settings import Declared
    from validate.sheets.possible import Crack
    from validate.sheets.sheet import read_sheet

    readings = content["readings"]
    try:
        # How it is written; what else is said of the readings may be wrong, and keeps no fault of the sheet back.
        declared = checked(Declared, raw.path, {key: readings[key] for key in Declared.model_fields if key in readings})
    except InputError:
        # Told of already, by the key that is at fault.
        return
    try:
        prepared.dialect = read_sheet(raw.path, declared, Crack(None, _depth_mm(content))).dialect.sentence
    except InputError as fault:
        prepared.faults += str(fault).splitlines()


def _depth_mm(content: Mapping[str, Any]) -> float:
    """The deepest that is said; where nothing usable is, the deepest that any sample is."""
    from digitise.settings import CrackShape

    try:
        return checked(CrackShape, Path(), dict(content["crack"])).deepest_mm
    except InputError:
        return DEEPEST_MM
