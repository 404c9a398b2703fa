"""Caliper readings for a trial: the face of ``validate.sheets`` for the pipeline."""

from pathlib import Path

import numpy as np

from sealtwin.records import Profile
from validate.settings import Readings
from validate.sheets.possible import Crack
from validate.sheets.sheet import read_sheet


def read_readings(path: Path, settings: Readings, length_mm: float, depth_mm: float) -> Profile:
    """The mean level of each station and its repeats, relative to the sample's surface, in the order of s.

    A blank field is a missing reading; a station without any reading is left out. ``length_mm`` and ``depth_mm`` are
    the crack's: a station outside it, or a level that no filling of it can have, is refused.

    Raises SheetFaults, an InputError, where the sheet cannot be read without guessing.
    """
    sheet = read_sheet(path, settings, Crack(length_mm, depth_mm))
    repeats_mm = sheet.levels_mm
    return Profile(
        s_mm=sheet.s_mm,
        level_mm=np.nanmean(repeats_mm, axis=1),
        repeats_mm=repeats_mm,
        data=settings.data,
        source=path.name,
        dialect=sheet.dialect.sentence,
    )
