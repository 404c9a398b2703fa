"""One sample during an ingest: its files and settings, the questions about it, and the trial that is made of them."""

import hashlib
import json
from collections.abc import Mapping, Set
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path, PurePath
from typing import Any, Literal

from digitise.settings import LARGEST_FILE_BYTES, NO_SCALE
from sealtwin.core import files
from sealtwin.core.doubts import Doubt
from sealtwin.core.errors import InputError
from sealtwin.core.settings import checked
from sealtwin.lab.files import DEFAULTS, NAMED_FILES, PICTURES, Role
from sealtwin.lab.notes import (
    ALTERNATIVES,
    DEPTH,
    OF_READINGS,
    OWN,
    SCALE,
    Note,
    read_note,
)
from sealtwin.lab.pairing import PAIRING, SETTINGS, RowQuestion, SampleFiles, note_of_answers
from sealtwin.lab.sheets import doubts_in, look_at, read_fill
from sealtwin.trial.job import LARGEST_SHEET_BYTES
from sealtwin.trial.quick_trial import ASSUMED, toml_value
from sealtwin.trial.trial_file import Trial, names_in, with_settings
from validate.readings.grid import ReadSheet
from validate.settings import Declared

INPUTS = Path("inputs")
ANGLE, FILL = "crack.wall_angle_deg", "crack.fill"
STARTER = ASSUMED | {"crack.tilt": "lean", ANGLE: 11.0, "path.fill": 1.0, "path.trim_mm": 10.0}
"""Settings that are used if no note gives them: those of fluid and solver are of 'sealtwin init', which let the sealant
settle before its level is measured; the others are the defaults of a trial."""
EXCLUDED = {
    "path.plan": "path.",
    "path.weighed": "path.volume_ml",
    "solver.model": "solver.",  # The fast model has neither particles nor a rest.
    "fluid.freeze_after_s": "fluid.yield_stress_pa",
    FILL: ANGLE,
}
"""Beginnings of settings of the starter that a given setting excludes."""
ORIGIN = 'write data = "measured" (or "reconstructed", "synthetic")'


NEEDED: Mapping[str, tuple[Role, Any, str]] = {
    "photo.data": ("photo", "synthetic", ORIGIN),
    DEPTH: ("photo", 16.0, "no photo shows it: write [crack] depth_mm = 16.0"),
    "crack.tilt": (
        "fill",
        "funnel",
        "the steps of a fill need it: write [crack] tilt = 'funnel' or, for walls that open downward, 'undercut' if "
        "the photo shows the mouth's width, 'flare' if it shows the floor's",
    ),
    "readings.data": ("readings", "synthetic", ORIGIN),
    "readings.role": (
        "readings",
        "held-out",
        'write [readings] role = "held-out", or "calibrated-on" if they were used to choose the fluid',
    ),
    SCALE: ("photo", 0.1, NO_SCALE),
}
"""Required settings that no photo shows: role of the file that requires it, value with which the rest is checked, and
what to write."""
SCALES = frozenset[str]().union(*ALTERNATIVES[0])


@dataclass(frozen=True)
class KeptFile:
    """A file of the lab, and its copy in a trial's folder."""

    role: Role
    original: str  # Path in the lab's folder
    kept_as: str  # Path of the identical copy in the trial's folder
    sha256: str
    size_bytes: int


@dataclass
class SampleOutcome:
    """A sample and the result of its ingest; only a sample without faults becomes a trial."""

    folder: Path  # The lab's
    sample: SampleFiles
    fate: Literal["new", "revised", "unchanged", "failed", "bug"] = "failed"
    raw: list[KeptFile] = field(default_factory=list)
    note: Note = field(default_factory=Note)
    faults: list[RowQuestion] = field(default_factory=list)  # Faults and doubts
    remarks: list[str] = field(default_factory=list)
    settings: Trial | None = None  # None if they cannot be used
    stand_ins: Set[str] = frozenset()  # Required settings that were not given and have a stand-in
    is_read: bool = False  # True if readings were read, however doubtful
    dialect: str | None = None  # Format of the sheet of readings, as a sentence
    understood: ReadSheet | None = None  # The sheet of readings as it was understood
    trial: str | None = None  # Folder of its trial; in a dry run there is none yet
    revision: int | None = None

    def ask(self, *about: Doubt | str, file: PurePath | None = None) -> None:
        """Add faults, each to the row of ``file``, else of the file that it names, else of the photo."""
        every = [file for files in self.sample.files.values() for file in files]
        for one in about:
            sentence, columns = (one, (SETTINGS,)) if isinstance(one, str) else (one.in_words("pairing"), one.columns)
            sentence = sentence.replace(f"{self.folder}/", "")
            begin = sentence.removeprefix(f"{PAIRING}, ")
            named = (each for each in every if begin.startswith((f"{each}:", f"{each},")))
            question = RowQuestion(sentence, file or next(named, every[0]), columns)
            self.faults += [question] if question not in self.faults else []

    @property
    def sheet_in_question(self) -> ReadSheet | None:
        """The sheet of readings as it was understood, if a question is about it."""
        asked = {fault.file for fault in self.faults}
        return self.understood if self.sample.file("readings") in asked else None

    @property
    def content(self) -> str:
        """Hash of files and settings, which changes with any of them."""
        settings = sorted((key, entry.value) for key, entry in self.note.entries.items())
        parts = [settings, [*self.sample.answers.values()], [(raw.role, raw.sha256) for raw in self.raw]]
        return hashlib.sha256(json.dumps(parts, sort_keys=True, default=str).encode()).hexdigest()


def gather(folder: Path, sample: SampleFiles, defaults: Note, of_table: Note) -> SampleOutcome:
    """Read a sample's notes and hash its files; does not read photos and sheets.

    ``defaults`` are settings of all samples, ``of_table`` those of this one in a table of the folder.
    """
    outcome, own = SampleOutcome(folder, sample), of_table
    for question, file in sample.questions:
        outcome.ask(question, file=file)
    counted: list[tuple[Role, PurePath]]
    counted = [(role, file) for role, files in sample.files.items() for file in files]
    for number, (role, file) in enumerate(counted):
        path, limit = folder / file, LARGEST_FILE_BYTES if role in PICTURES else LARGEST_SHEET_BYTES
        if path.is_symlink() or not path.is_file():
            outcome.ask(f"{path}: not a plain file; links are not followed: copy the file itself.")
        elif (size := path.stat().st_size) > limit:
            outcome.ask(f"{path}: {size / 1e6:,.0f} MB; the limit for such a file is {limit / 1e6:,.0f} MB.")
        else:
            name = role if sample.file(role) else f"{role}-{number}"
            kept_as = (INPUTS / f"{name}{file.suffix.lower()}").as_posix()
            outcome.raw.append(KeptFile(role, file.as_posix(), kept_as, files.sha256(path), size))
            if role == "note" and "photo" in sample.files:
                own = own.beside(read_note(path, sample.key, answered=bool(sample.answers[role, file].get(SETTINGS))))
    if "readings" not in sample.files and not sample.is_held:
        # The folder's settings of readings, as those of fills, are for other samples.
        lost = [key for key in own.entries if key.startswith(OF_READINGS) and key != "readings.data"]
        if lost and "photo" in sample.files:
            remedy = "but the sample has no readings; add its sheet, or delete the setting."
            outcome.ask(f"{own.entries[lost[0]].origin}: {lost[0]} is given, {remedy}")
        own, defaults = own.without(*OF_READINGS), defaults.without(*OF_READINGS)
    outcome.note = own.over(defaults.without(ANGLE if "fill" in sample.files else FILL))
    for (role, file), answers in sample.answers.items():
        if role == "note" or sample.file(role):
            given = {SETTINGS: answers.get(SETTINGS, "")} if role == "fill" else answers
            outcome.note = note_of_answers(given, f"{PAIRING}, {file}").over(outcome.note)
    outcome.ask(*outcome.note.faults)
    return outcome


def prepare(outcome: SampleOutcome) -> None:
    """Look at the sheets of an outcome of ``gather`` and set its settings, even if it has questions; add all faults."""
    from digitise.photo import offering_markers

    sample, folder = outcome.sample, outcome.folder
    for raw in (raw for raw in outcome.raw if raw.role == "readings"):
        _look_at(outcome, PurePath(raw.original))
    if "photo" not in sample.files:
        return
    settings = _settings_of(outcome)
    _weigh(outcome, settings)
    roles = {*sample.files, "photo", *(["readings"] if sample.is_held else [])}
    missing = {key for key, (role, *_) in NEEDED.items() if role in roles} - settings.keys()
    outcome.stand_ins = missing - {SCALE} if settings.keys() & SCALES else missing
    for key in (key for key in NEEDED if key in outcome.stand_ins):
        _, settings[key], remedy = NEEDED[key]
        fault = f"{key} is missing: {remedy} in {DEFAULTS}, or in the sample's note (NAME.toml)."
        outcome.ask(offering_markers(fault, folder / sample.files["photo"][0]) if key == SCALE else fault)
    if sample.is_held:
        settings = {key: value for key, value in settings.items() if not key.startswith(OF_READINGS)}
    excluded = tuple(begin for key, begin in EXCLUDED.items() if key in settings)
    left = names_in(with_settings(with_settings({}, STARTER), settings)) - settings.keys()
    assumed = {key: value for key, value in STARTER.items() if key in left and not key.startswith(excluded)}
    if assumed:
        listed = ", ".join(f"{key} = {toml_value(value)}" for key, value in assumed.items())
        sentence = f"Assumed, since no note of the lab gives it: {listed}."
        settings = {"note": sentence} | settings
        outcome.remarks.append(f"{sentence} Write your own values, best into {DEFAULTS}.")
    content = with_settings({}, {key: assumed[key] for key in assumed if key.startswith(("fluid.", "solver."))})
    try:
        trial = checked(Trial, folder, with_settings(content, settings), lambda key: _origin_of(outcome, key))
        outcome.settings = trial if sample.file("photo") else None
    except InputError as fault:
        outcome.ask(*str(fault).splitlines())


def _declared(path: Path, note: Note) -> Declared:
    """Return what a note declares about a sheet. A wrong value is reported as a fault of its key."""
    of_sheets = tuple(f"readings.{name}" for name in Declared.model_fields)
    given = {key: entry.value for key, entry in note.entries.items() if key.startswith(of_sheets)}
    with suppress(InputError):
        return checked(Declared, path, with_settings({"readings": {}}, given)["readings"])
    return Declared()


def _look_at(outcome: SampleOutcome, file: PurePath) -> None:
    """Read a sheet of readings."""
    path, note = outcome.folder / file, outcome.note
    depth = note.entries[DEPTH].value if DEPTH in note.entries else None
    rows = depth if isinstance(depth, list) else [[depth]]
    depths = (row[-1] for row in rows if isinstance(row, list) and row)
    depth_mm = max((one for one in depths if isinstance(one, int | float)), default=None)
    declared = _declared(path, note)
    # Without a photo, the name of the file is in question too.
    name = outcome.sample.name if "photo" in outcome.sample.files else None
    declared = declared.model_copy(update={"sample": declared.sample or name})
    profile, doubts, outcome.understood = look_at(path, declared, depth_mm)
    outcome.ask(*doubts, file=file)
    if profile is not None:
        outcome.is_read, outcome.dialect = outcome.sample.file("readings") is not None, profile.dialect


def _settings_of(outcome: SampleOutcome) -> dict[str, Any]:
    """Return the settings of a trial by dotted key, from its notes and its files."""
    entries = outcome.note.entries
    settings: dict[str, Any] = {"name": outcome.sample.name}
    settings |= {"readings.sample": outcome.sample.name} if "readings" in outcome.sample.files else {}
    settings |= {key: entry.value for key, entry in entries.items() if key not in OWN}
    # Without a photo, the other settings are checked.
    kept = {role: (f"{every[0]}", "photo.png") for role, every in outcome.sample.files.items()}
    kept |= {raw.role: (raw.original, raw.kept_as) for raw in outcome.raw}
    for role, key in NAMED_FILES.items():
        original, kept_as = kept.get(role, ("", None))
        if key in entries and PurePath(f"{settings[key]}").name != PurePath(original).name:
            outcome.ask(
                f"{entries[key].origin}: {key} = {str(settings[key])!r:.80}, but the sample's {role} is "
                f"{original or 'no file'}; delete the key, and choose the file in the pairing file."
            )
        settings[key] = kept_as
    return {key: value for key, value in settings.items() if value is not None}


def _weigh(outcome: SampleOutcome, settings: dict[str, Any]) -> None:
    """Put the content of the fill's sheet into ``settings``, beside the settings of the liquid."""
    if (file := outcome.sample.file("fill")) is None:
        return
    path, answers = outcome.folder / file, outcome.sample.answers["fill", file]
    declared = _declared(path, note_of_answers({**answers, SETTINGS: ""}, PAIRING))
    try:
        columns, sentence = read_fill(path, declared, answers.get("mass", ""))
    except InputError as fault:
        settings.pop(FILL, None)
        outcome.ask(*doubts_in(fault), file=file)
        return
    outcome.remarks.append(sentence.replace(f"{outcome.folder}/", ""))
    table = settings.get(FILL)
    settings[FILL] = {**(table if isinstance(table, Mapping) else {}), **columns}


def _origin_of(outcome: SampleOutcome, key: str) -> str:
    """Return the places that give a setting or a table's settings, otherwise the path of a note of the sample."""
    entries = outcome.note.entries.items()
    origins = [entry.origin for name, entry in entries if f"{key}.".startswith(f"{name}.") or name.startswith(key)]
    return ", ".join(dict.fromkeys(origins[::-1])) or str(outcome.sample.files["photo"][0].with_suffix(".toml"))
