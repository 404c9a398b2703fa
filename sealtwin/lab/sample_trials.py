"""Make the trial of a sample from its notes and files, or list the faults that prevent it."""

import re
import tomllib
from collections.abc import Mapping, Set
from dataclasses import dataclass
from pathlib import Path, PurePath
from typing import Any

from digitise.settings import DEEPEST_MM, LARGEST_FILE_BYTES, NO_SCALE
from sealtwin.core import files
from sealtwin.core.errors import InputError
from sealtwin.core.settings import checked
from sealtwin.lab.file_parts import Piece, without_name
from sealtwin.lab.found_files import DEFAULTS, NAMED_FILES, PICTURES, Role
from sealtwin.lab.notes import (
    ALTERNATIVES,
    DATA,
    DEPTH,
    OF_READINGS,
    OWN,
    SCALE,
    Note,
    NoteEntry,
    lines_of_readings,
    of_columns,
    read_cell,
)
from sealtwin.lab.pairing import PAIRING, SampleFiles
from sealtwin.lab.pairing_columns import as_columns
from sealtwin.lab.sample_outcome import KeptFile, SampleOutcome, kept_as, note_of
from sealtwin.lab.sheet_depths import LEVELS, RANGE, ask_for_depths
from sealtwin.lab.sheets import read_fill
from sealtwin.trial.job import LARGEST_SHEET_BYTES
from sealtwin.trial.quick_trial import ASSUMED, toml_value
from sealtwin.trial.starter_files import TRIAL
from sealtwin.trial.trial_file import Trial, with_settings
from validate.readings.read_readings import read_readings
from validate.readings.samples import read_cells
from validate.readings.sheet import SheetFaults
from validate.settings import Declared

MARKDOWN = "|"  # Separator of a table in Markdown
IN_NAME = re.compile(r"\d+(?:[.,]\d+)?[ _]?(?:mm|cm|in|inch|deg|ml|pa)(?![^\W\d_])", re.IGNORECASE)
"""Number with a unit in the names of a file and its folders."""


@dataclass(frozen=True)
class Needed:
    """A required setting that no photo shows."""

    stand_in: Any  # Value with which the rest is checked
    remedy: str  # What to write, as the end of a sentence
    role: str = "photo"  # Role of the file that requires it
    others: frozenset[str] = frozenset()  # Settings that can replace it


STARTER = tomllib.loads(TRIAL)
ANGLE, FILL = "crack.wall_angle_deg", "crack.fill"
UNSEEN = {"crack.tilt": "lean", ANGLE: 11.0}
"""Settings of the crack's walls that no photo shows, with the values that are used if no note gives any."""
SOLVER = {f"solver.{key}": STARTER["solver"][key] for key in ("radius_mm", "settle_s")}
ORIGIN = ': write data = "measured" (or "reconstructed", "synthetic")'
NEEDED = {
    "photo.data": Needed("synthetic", ORIGIN, others=frozenset({DATA})),
    DEPTH: Needed(16.0, ", and no photo shows it: write [crack] depth_mm = 16.0"),
    "crack.tilt": Needed(
        "funnel",
        ", and the steps of a fill need it: write [crack] tilt = 'funnel' or, for walls that open downward, "
        "'undercut' if the photo shows the mouth's width, 'flare' if it shows the floor's",
        "fill",
    ),
    "readings.data": Needed("synthetic", ORIGIN, "readings", frozenset({DATA})),
    "readings.role": Needed(
        "held-out",
        ': write [readings] role = "held-out", or "calibrated-on" if they were used to choose the fluid',
        "readings",
    ),
    SCALE: Needed(
        0.1,
        f": {NO_SCALE}",
        others=frozenset[str]().union(*ALTERNATIVES[0]),
    ),
}


def gather(folder: Path, sample: SampleFiles, defaults: Note) -> SampleOutcome:
    """Read a sample's notes and hash its files; does not read photos and sheets."""
    outcome = SampleOutcome(sample, faults=[*sample.questions, *sample.awaits])
    own = _read_notes(folder, outcome)
    if sample.questions:
        return outcome
    texts: list[tuple[Role, PurePath]] = [("text", text) for text in sample.texts]
    for role, file in (*sorted(sample.files.items()), *texts):
        path = folder / file
        if path.is_symlink() or not path.is_file():
            outcome.faults.append(f"{path}: not a plain file; links are not followed: copy the file itself.")
            continue
        limit = LARGEST_FILE_BYTES if role in PICTURES else LARGEST_SHEET_BYTES
        size = path.stat().st_size
        if size > limit:
            outcome.faults.append(f"{path}: {size / 1e6:,.0f} MB; the limit for such a file is {limit / 1e6:,.0f} MB.")
        else:
            name = kept_as(role if role != "text" else f"text-{1 + texts.index((role, file))}", file)
            outcome.raw.append(KeptFile(role, file.as_posix(), name, files.sha256(path), size))
    if "readings" not in sample.files:
        # The folder's settings of readings are for other samples.
        defaults = defaults.without(*OF_READINGS)
        outcome.faults += [
            f"{entry.origin}: {key} is given, but the sample has no readings; add its sheet, or delete {key}."
            for key, entry in sorted(own.entries.items())
            if key.startswith(OF_READINGS)
        ]
    if "fill" in sample.files:
        defaults = defaults.without(ANGLE)
    outcome.note = own.over(defaults)
    outcome.remarks += [
        f"{entry.origin}: {key} = {toml_value(entry.value)}, in place of {toml_value(theirs.value)} in {DEFAULTS}."
        for key, entry in own.entries.items()
        if (theirs := defaults.entries.get(key)) is not None and theirs.value != entry.value
    ]
    outcome.remarks += [
        f"{file}: its name has {', '.join(numbers)}; settings are not read from names."
        for file in sample.files.values()
        if (numbers := IN_NAME.findall(file.with_suffix("").as_posix()))
    ]
    for file, given in _answers(sample).items():
        outcome.note = read_cell(given.get("settings", ""), f"{PAIRING}, {file}").over(outcome.note)
    for role, given in sample.answers.items():
        outcome.note.entries |= _answered(role, given, f"{PAIRING}, {sample.files[role]}")
    ask_for_depths(folder, outcome)
    outcome.faults += outcome.note.faults
    outcome.remarks += [*outcome.note.remarks, *outcome.unread]
    return outcome


def look_at_sheets(folder: Path, outcome: SampleOutcome, defaults: Note) -> None:
    """Ask about the content of sheets that may be a sample's, so that no round is needed for their sample alone."""
    texts = {Piece(text): dict[str, str]() for text in outcome.sample.texts if _may_be_readings(folder / text, outcome)}
    for piece, answers in {**texts, **outcome.sample.sheets}.items():
        sheet = SampleFiles(
            outcome.sample.name, {"readings": piece.file}, (), piece.part, answers={"readings": answers}
        )
        alone = gather(folder, sheet, defaults)
        if alone.raw:
            try:
                _look_at(folder / piece.file, "readings", tables_of(folder, alone), DEEPEST_MM, alone)
            except InputError as fault:
                alone.faults += str(fault).splitlines()
        outcome.of_sheets |= {} if piece in texts else {piece: alone.faults}
        outcome.faults += [fault for fault in alone.faults if fault not in outcome.faults]


def _may_be_readings(path: Path, outcome: SampleOutcome) -> bool:
    """Return whether a text of a sample without readings is a note of readings, or a table in Markdown."""
    if "readings" in outcome.sample.files or outcome.sample.questions or path.is_symlink():
        return False
    try:
        grid = read_cells(path, Declared())
        return bool(lines_of_readings(path)) and (grid.is_note or grid.separator == MARKDOWN)
    except InputError:
        return False


def _answered(role: Role, given: Mapping[str, str], origin: str) -> dict[str, NoteEntry]:
    """Return the settings in the answers about a file. Those about a fill's sheet apply to that sheet only."""
    if role == "fill":
        return {}
    settings = of_columns(as_columns(given))
    if "crack" in given:
        settings["photo.crack"] = int(given["crack"]) if given["crack"].isdecimal() else given["crack"]
    return {key: NoteEntry(value, origin) for key, value in settings.items()}


def _answers(sample: SampleFiles) -> dict[PurePath, Mapping[str, str]]:
    """Return the answers in the pairing file by the files of a sample, its texts included."""
    return {sample.files[role]: given for role, given in sample.answers.items()} | {**sample.texts}


def _read_notes(folder: Path, outcome: SampleOutcome) -> Note:
    """Return the settings of a sample's note and texts. Ask about other numbers, unless their row has settings."""
    sample, note = outcome.sample, Note()
    for file in (*(sample.files[role] for role in sample.files if role == "note"), *sample.texts):
        if (folder / file).is_symlink() or not (folder / file).is_file():
            continue
        if not (unread := note.read(folder / file, sample.name)):
            continue
        if _answers(sample).get(file, {}).get("settings"):
            outcome.unread.append(f"{file}: not read: {unread}.")
            continue
        question = (
            f"{file}: not read: {unread}. Write settings among these into the column settings of {PAIRING}, such as "
            f"{DEPTH} = 9.0. If there are none, set the role of the file to ignore; if they are readings, to readings."
        )
        outcome.faults.append(question)
        outcome.ask([question])
    return note


def prepare(folder: Path, outcome: SampleOutcome) -> None:
    """Check an outcome of ``gather``: set its settings and its sheet's dialect, and add the faults."""
    content = tables_of(folder, outcome)
    try:
        trial = checked(Trial, folder, content, lambda key: origin_of(folder, outcome, key))
    except InputError as fault:
        trial = None
        outcome.faults += str(fault).splitlines()
    deepest_mm = trial.crack.deepest_mm if trial is not None and trial.crack is not None else DEEPEST_MM
    for raw in outcome.raw:
        try:
            _look_at(folder / raw.original, raw.role, content, deepest_mm, outcome)
        except InputError as fault:
            outcome.faults += str(fault).splitlines()
            if raw.role in PICTURES:
                trial = None
    outcome.settings = trial if any(raw.role == "photo" for raw in outcome.raw) else None
    if outcome.faults or trial is None:
        return
    if assumed := assumed_of(outcome):
        outcome.remarks.append(f"{assumed} Write your own values, best into {DEFAULTS}.")
    if trial.fluid is not None and trial.fluid.freeze_after_s == "never" and trial.fluid.most_yield_stress_pa == 0:
        outcome.remarks.append("without fluid.yield_stress_pa and fluid.freeze_after_s the sealant ends level.")
    if trial.photo is not None and not (trial.photo.ends_px or trial.photo.mask or trial.photo.crack):
        outcome.remarks.append(
            "no ends_px: the crack is searched for automatically; 'sealtwin trace' lets you click its ends."
        )


def _look_at(path: Path, role: Role, content: Mapping[str, Any], deepest_mm: float, outcome: SampleOutcome) -> None:
    """Decode a picture, or read readings as a run does, but without comparing stations with the crack's length."""
    if role in PICTURES:
        from digitise.image.decoding import read_photo

        read_photo(path, PICTURES[role])
    elif role == "readings":
        readings = content["readings"]
        try:
            # Only the sheet's dialect is checked here, so that other wrong settings do not hide faults of the sheet.
            keys = Declared.model_fields.keys() & readings.keys()
            declared = checked(Declared, path, {key: readings[key] for key in keys})
        except InputError:
            return  # Already reported as a fault of its key.
        try:
            profile = read_readings(path, declared, None, deepest_mm)
        except SheetFaults as fault:
            outcome.columns["readings"] = fault.columns
            raise
        outcome.dialect, outcome.columns["readings"] = profile.dialect, profile.columns
        outcome.faults += _other_sample(path, outcome)
        # Doubts are reliable only with the crack's own depth.
        if DEPTH in outcome.note.entries:
            outcome.faults += [
                f"{doubt} Write it into {note_of(outcome)}, or into {PAIRING}." for doubt in profile.doubts
            ]


def _other_sample(path: Path, outcome: SampleOutcome) -> list[str]:
    """Return a fault if the column of samples in a sheet names another sample than that of the file."""
    files, part, sample = outcome.sample.files, outcome.sample.part, outcome.sample.name
    if "photo" not in files or "readings.sample" in outcome.note.entries or (part and part.rows_of):
        return []
    return [
        f"{path}: column {one.name} names sample {one.first!r}, but by its name the file is of {sample}. If they are "
        f"the same, write readings.sample = {one.first!r} into the column settings of {PAIRING}; else correct it."
        for one in outcome.columns["readings"]
        if one.role == "sample" and without_name(one.first, sample).strip()
    ]


def tables_of(folder: Path, outcome: SampleOutcome) -> dict[str, Any]:
    """Return the tables of a trial. A required setting that no note gives is a fault, and gets a stand-in.

    Other settings of solver and fluid are those of 'sealtwin init': they let the sealant settle before its level is
    measured, and choose the particle radius according to the crack.
    """
    from digitise.photo import offering_markers

    settings = _settings_of(outcome)
    _weigh(folder, outcome, settings)
    settings = {"note": assumed_of(outcome)} | SOLVER | fluid_settings(settings.keys()) | settings
    files = outcome.sample.files
    missing = {key: it for key, it in NEEDED.items() if it.role in files and not settings.keys() & {key, *it.others}}
    outcome.stand_ins = frozenset(missing)
    for key, it in missing.items():
        settings[key] = it.stand_in
        if not outcome.note.meant & {key, *it.others}:
            outcome.faults.append(f"{key} is missing{it.remedy} in {DEFAULTS}, or in the sample's note (NAME.toml).")
    if SCALE in missing:
        photo = folder / next((raw.original for raw in outcome.raw if raw.role == "photo"), "")
        outcome.faults = [offering_markers(fault, photo) for fault in outcome.faults]
    return with_settings({}, settings)


def _settings_of(outcome: SampleOutcome) -> dict[str, Any]:
    """Return the settings of a trial by dotted key, from its notes, its files, and its part of a shared file.

    If a note names a file or a part of another sample, a fault is added.
    """
    sample, entries = outcome.sample, outcome.note.entries
    settings: dict[str, Any] = {"name": sample.name}
    if DATA in entries:
        settings |= dict.fromkeys(("photo.data", "readings.data"), entries[DATA].value)
    settings |= {key: entry.value for key, entry in entries.items() if key not in OWN}
    if "readings" not in sample.files:
        settings = {key: value for key, value in settings.items() if not key.startswith(OF_READINGS)}
    given: dict[str, tuple[str, str, str]] = {}  # Name that a note may give, place, and name in the trial
    for role, key in NAMED_FILES.items():
        if (file := sample.files.get(role)) is not None:
            given[key] = file.name, str(file), kept_as(role, file)
        elif key in settings:
            given[key] = "", f"no {role.replace('_', ' ')}", ""
    if (part := sample.part) is not None:
        place = f"{sample.files['readings']}, {part},"
        levels = as_columns({"levels": part.levels})["levels"] if part.levels else None
        parts = {"readings.sheet": part.sheet, "readings.sample": part.rows_of, RANGE: part.cells, LEVELS: levels}
        # An answer about the part itself is narrower than the part.
        parts = {
            key: value
            for key, value in parts.items()
            if not (key in entries and entries[key].origin.startswith(PAIRING))
        }
        given |= {key: (value, place, value) for key, value in parts.items() if value is not None}
    for key, (name, place, value) in given.items():
        if key in entries:
            _require_same(outcome, key, entries[key].value, name, place)
        settings[key] = value
    return {key: value for key, value in settings.items() if value or key not in given}


def _require_same(outcome: SampleOutcome, key: str, named: Any, name: str, place: str) -> None:
    """Add a fault if a note names the file or part ``named``, but that of this sample is ``name``."""
    if name not in (named, PurePath(str(named)).name):
        outcome.faults.append(
            f"{outcome.note.entries[key].origin}: {key} = {str(named)!r:.80}, but by its name {place} belongs to this "
            "sample; delete the key, and choose the file in the pairing file."
        )


def _weigh(folder: Path, outcome: SampleOutcome, settings: dict[str, Any]) -> None:
    """Replace the name of the fill's sheet in ``settings`` by the sheet's content. Keep the liquid's settings."""
    file = outcome.sample.files.get("fill")
    given = settings.pop(FILL, {})
    table = dict(given) if isinstance(given, Mapping) else {"file": given}
    if (named := table.pop("file", None)) is not None:
        _require_same(outcome, FILL, named, "" if file is None else file.name, "no fill" if file is None else str(file))
    if file is None:
        # The folder's settings of liquids are for other samples.
        settings |= {FILL: table} if "mass_g" in table else {}
        return
    # "B g", or the name of a column.
    answers = outcome.sample.answers.get("fill", {})
    head, _, last = (mass := answers.get("mass", "")).rpartition(" ")
    mass, unit = (head, last) if head and last in ("g", "kg") else (mass, "")
    try:
        table_columns = as_columns({**answers, "s": mass} if mass else answers)
        table_columns.pop("as_written", None)
        declared = checked(Declared, folder / file, {"columns": table_columns})
        columns, shown, outcome.columns["fill"] = read_fill(folder / file, declared, unit)
    except InputError as fault:
        outcome.columns["fill"] = fault.columns if isinstance(fault, SheetFaults) else ()
        outcome.faults += str(fault).splitlines()
        return
    outcome.remarks.append(shown)
    settings[FILL] = {**table, **columns}


def origin_of(folder: Path, outcome: SampleOutcome, key: str) -> str:
    """Return the places that give a setting or a table's settings, otherwise the path of the sample's note."""
    entries = outcome.note.entries
    origins = [entry.origin for name, entry in entries.items() if f"{key}.".startswith(f"{name}.")]
    origins += [entry.origin for name, entry in entries.items() if name.startswith(f"{key}.")]
    if key.endswith(".data") and DATA in entries:
        origins.append(entries[DATA].origin)
    return ", ".join(dict.fromkeys(origins[::-1])) if origins else str(folder / note_of(outcome))


def fluid_settings(settings: Set[str]) -> dict[str, Any]:
    """Return the fluid's settings as in 'sealtwin init', without those that are given or that a given one excludes."""
    given = {key: 0 for key in settings if key.startswith("fluid.")}
    remaining = with_settings({"fluid": STARTER["fluid"]}, given)["fluid"]
    if "fluid.freeze_after_s" in settings:
        remaining.pop("yield_stress_pa", None)
    return {f"fluid.{key}": value for key, value in remaining.items() if f"fluid.{key}" not in settings}


def assumed_of(outcome: SampleOutcome) -> str:
    """Return the trial's note for the report. It lists settings that no note of the lab gives; "" if there are none.

    Of path, nozzle and solver these are the ones that 'sealtwin quick' marks as assumed.
    """
    settings = {*outcome.note.entries, *([ANGLE] if "fill" in outcome.sample.files else [])}
    defaults: dict[str, Any] = {table: Trial.model_fields[table].default for table in ("path", "nozzle", "solver")}
    names = [name.partition(".") for name in ASSUMED]
    rest = {f"{table}.{key}": getattr(defaults[table], key) for table, _, key in names if table in defaults}
    # The fast model has neither particles nor a rest.
    replaced = {"path.plan": "path.", "path.weighed": "path.volume_ml", "solver.model": "solver."}
    without = tuple(prefix for key, prefix in replaced.items() if key in settings)
    listed = ", ".join(
        f"{key} = {toml_value(value)}"
        for key, value in (UNSEEN | fluid_settings(settings) | rest | SOLVER).items()
        if key not in settings and not key.startswith(without)
    )
    return f"Assumed, since no note of the lab gives it: {listed}." if listed else ""
