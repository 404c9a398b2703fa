"""The tables of a trial from what a sample's notes say: settings that are needed, given by a file, or assumed."""

import tomllib
from collections.abc import Mapping, Set
from pathlib import Path, PurePath
from typing import Any

from sealtwin.core.errors import InputError
from sealtwin.core.settings import checked
from sealtwin.lab.found_files import DEFAULTS, Role
from sealtwin.lab.note_words import ALTERNATIVES, COLUMNS, DATA, OF_READINGS, OWN, SCALE
from sealtwin.lab.pairing import as_columns
from sealtwin.lab.sample_outcome import SampleOutcome, kept_as, note_of
from sealtwin.lab.sheets import read_fill
from sealtwin.study.study_file import with_settings
from sealtwin.trial.quick_trial import ASSUMED, toml_value
from sealtwin.trial.starter_files import TRIAL
from sealtwin.trial.trial_file import Trial
from validate.readings.sheet import SheetFaults
from validate.settings import Declared

PICTURES: Mapping[Role, str] = {"photo": "photo.file", "second_photo": "photo.second_photo", "mask": "photo.mask"}
"""Settings that name a file."""
STARTER = tomllib.loads(TRIAL)
NAMED_FILES: Mapping[Role, str] = {**PICTURES, "readings": "readings.file"}
SCALES = set[str]().union(*ALTERNATIVES[0])
ANGLE, FILL = "crack.wall_angle_deg", "crack.fill"
UNSEEN = {"crack.tilt": "lean", ANGLE: 11.0}
"""Settings of the walls that hold where nobody says them, and that no photo shows."""
ORIGIN = ': where they come from; write data = "measured" (or "reconstructed", "synthetic")'
NEEDED: Mapping[str, tuple[Any, str]] = {
    "photo.data": ("synthetic", ORIGIN),
    "crack.depth_mm": (16.0, ", and no photo shows it: write [crack] depth_mm = 16.0, or 'Depth [mm]' and 16.0"),
    "crack.tilt": (
        "funnel",
        ", and the steps of a fill need it: write [crack] tilt = 'funnel' or, for walls that open downward, "
        "'undercut' if the photo shows the mouth's width, 'flare' if it shows the floor's",
    ),
    "readings.data": ("synthetic", ORIGIN),
    "readings.role": (
        "held-out",
        ': write [readings] role = "held-out", or "calibrated-on" where they helped to choose the fluid',
    ),
    SCALE: (
        0.1,
        ", nor any other scale: write [photo] mm_per_px, face_mm, ruler_px or markers, or 'Scale [mm/px]'",
    ),
}
"""Required settings that no photo shows: a stand-in with which the rest is checked, and what to write."""
OF_ROLE: Mapping[str, Role] = {"crack.tilt": "fill"}
"""Settings that are required with a file of another role than the name of their table."""
SAME: Mapping[str, set[str]] = {
    SCALE: SCALES,
    "photo.data": {"photo.data", DATA},
    "readings.data": {"readings.data", DATA},
}
"""Other settings by which a needed one is said."""


def tables_of(folder: Path, outcome: SampleOutcome) -> dict[str, Any]:
    """Return the tables of a trial. What must be said and is not is a fault, and here a stand-in.

    What nobody says of the solver and the fluid is the starter's: without a rest the jet, still falling, would be taken
    for the sealant's level; and no one radius fits all cracks of a lab.
    """
    said = _said(outcome)
    _weigh(folder, outcome, said)
    said = {"note": assumed_of(outcome)} | _solver() | _fluid(said.keys()) | said
    meant, roles = outcome.note.meant, {"photo", "crack", *outcome.sample.files.keys()}
    needed = [
        key
        for key in NEEDED
        if OF_ROLE.get(key, key.partition(".")[0]) in roles and not said.keys() & SAME.get(key, {key})
    ]
    outcome.stand_ins = frozenset(needed)
    for key in needed:
        said[key], remedy = NEEDED[key]
        if not meant & SAME.get(key, {key}):
            outcome.faults.append(f"{key} is not said{remedy} in {DEFAULTS}, or in the sample's note (NAME.toml).")
    columns = {key: said.pop(key) for key in list(said) if key.startswith(f"{COLUMNS}.")}
    content = with_settings({}, said)
    if columns:
        content["readings"]["columns"] = {key.rpartition(".")[2]: value for key, value in columns.items()}
    return content


def _said(outcome: SampleOutcome) -> dict[str, Any]:
    """Return the settings of a trial by dotted key: as its notes say them, its files, and its part of a shared one.

    A note may give a file or a part, too, if it is the same.
    """
    sample, entries = outcome.sample, outcome.note.entries
    said: dict[str, Any] = {"name": sample.name}
    if DATA in entries:
        said |= dict.fromkeys(("photo.data", "readings.data"), entries[DATA].value)
    said |= {key: entry.value for key, entry in entries.items() if key not in OWN}
    if "readings" not in sample.files:
        said = {key: value for key, value in said.items() if not key.startswith(OF_READINGS)}
    given: dict[str, tuple[str, str, str]] = {}  # What a note may call it, where it is, and what the trial calls it
    for role, key in NAMED_FILES.items():
        if (file := sample.files.get(role)) is not None:
            given[key] = file.name, str(file), kept_as(role, file)
        elif key in said:
            given[key] = "", f"no {role.replace('_', ' ')}", ""
    if (part := sample.part) is not None:
        place = f"{sample.files['readings']}, {part},"
        parts = {"readings.sheet": part.sheet, "readings.sample": part.rows_of}
        given |= {key: (value, place, value) for key, value in parts.items() if value is not None}
    for key, (name, place, value) in given.items():
        if key in entries:
            _hold_against(outcome, key, entries[key].value, name, place)
        said[key] = value
    return {key: value for key, value in said.items() if value or key not in given}


def _hold_against(outcome: SampleOutcome, key: str, told: Any, name: str, place: str) -> None:
    """Add a fault where a note calls a file or a part of this sample otherwise than its ``name``."""
    if name not in (told, PurePath(str(told)).name):
        outcome.faults.append(
            f"{outcome.note.entries[key].origin}: {key} = {str(told)!r:.80}, but {place} is of this sample by its "
            "name; leave it out, and say in the pairing file which is."
        )


def _weigh(folder: Path, outcome: SampleOutcome, said: dict[str, Any]) -> None:
    """Put the fill's sheet into ``said`` in place of what notes call it; what they say of the liquid stays."""
    file = outcome.sample.files.get("fill")
    given = said.pop(FILL, {})
    table = dict(given) if isinstance(given, Mapping) else {"file": given}
    if (named := table.pop("file", None)) is not None:
        _hold_against(outcome, FILL, named, "" if file is None else file.name, "no fill" if file is None else str(file))
    if file is None:
        # What the folder says of liquids concerns other samples.
        said |= {FILL: table} if "mass_g" in table else {}
        return
    # "B g", or the name of a column.
    said_of_it = outcome.sample.answers.get("fill", {})
    head, _, last = (mass := said_of_it.get("mass", "")).rpartition(" ")
    mass, unit = (head, last) if head and last in ("g", "kg") else (mass, "")
    try:
        answers = as_columns({**said_of_it, "s": mass} if mass else said_of_it)
        answers.pop("as_written", None)
        declared = checked(Declared, folder / file, {"columns": answers})
        columns, shown, outcome.columns["fill"] = read_fill(folder / file, declared, unit)
    except InputError as fault:
        outcome.columns["fill"] = fault.columns if isinstance(fault, SheetFaults) else ()
        outcome.faults += str(fault).splitlines()
        return
    outcome.remarks.append(shown)
    said[FILL] = {**table, **columns}


def _fluid(said: Set[str]) -> dict[str, Any]:
    """Return the starter's settings that nobody says: of the flow, and of what holds its slope, either of two ways."""
    fluid = {f"fluid.{key}": value for key, value in STARTER["fluid"].items()}
    if "fluid.viscosity_pa_s" in said:
        # D goes with it: the drag of the walls then follows from the viscosity.
        del fluid["fluid.U"], fluid["fluid.D_cm"]
    if "fluid.freeze_after_s" in said:
        del fluid["fluid.yield_stress_pa"]
    return {key: value for key, value in fluid.items() if key not in said}


def rest_of(outcome: SampleOutcome) -> dict[str, Any]:
    """Return the values of path, nozzle and solver that 'sealtwin quick' marks as assumed too, if nobody says them."""
    said = outcome.note.entries
    tables: dict[str, Any] = {table: Trial.model_fields[table].default for table in ("path", "nozzle", "solver")}
    values = {f"{table}.{key}": getattr(one, key) for table, one in tables.items() for key in ASSUMED[table]}
    values |= _solver()
    replaced = {
        "path.plan": "path.",
        "path.weighed": "path.volume_ml",
        "solver.model": "solver.",  # The fast model has neither particles nor a rest.
    }
    without = tuple(prefix for key, prefix in replaced.items() if key in said)
    return {key: value for key, value in values.items() if key not in said and not key.startswith(without)}


def _solver() -> dict[str, Any]:
    return {f"solver.{key}": STARTER["solver"][key] for key in ("radius_mm", "settle_s")}


def assumed_of(outcome: SampleOutcome) -> str:
    """The trial's note, which every report shows: the settings that nobody of the lab said."""
    said = {*outcome.note.entries, *([ANGLE] if "fill" in outcome.sample.files else [])}
    crack = {key: value for key, value in UNSEEN.items() if key not in said}
    taken = ", ".join(
        f"{key} = {toml_value(value)}" for key, value in {**crack, **_fluid(said), **rest_of(outcome)}.items()
    )
    return f"Assumed, since no note of the lab says it: {taken}." if taken else ""


def origin_of(folder: Path, outcome: SampleOutcome, key: str) -> str:
    """Return the place of a setting, or of those of a table, in the notes."""
    entries = outcome.note.entries
    told = [entry.origin for name, entry in entries.items() if f"{key}.".startswith(f"{name}.")]
    told += [entry.origin for name, entry in entries.items() if name.startswith(f"{key}.")]
    if key.endswith(".data") and DATA in entries:
        told.append(entries[DATA].origin)
    return ", ".join(dict.fromkeys(told[::-1])) if told else str(folder / note_of(outcome))
