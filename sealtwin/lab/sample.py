"""One sample during an ingest: its files and settings, the questions about it, and the trial that is made of them."""

import hashlib
import json
import tomllib
from collections.abc import Mapping, Set
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
    DATA,
    DEPTH,
    OF_READINGS,
    OWN,
    SCALE,
    Note,
    read_note,
)
from sealtwin.lab.pairing import PAIRING, SETTINGS, Question, SampleFiles, note_of_answers
from sealtwin.lab.sheets import doubts_in, look_at, read_fill
from sealtwin.trial.job import LARGEST_SHEET_BYTES
from sealtwin.trial.quick_trial import ASSUMED, toml_value
from sealtwin.trial.starter_files import TRIAL
from sealtwin.trial.trial_file import Trial, with_settings
from validate.readings.grid import ReadSheet
from validate.settings import Declared

INPUTS = Path("inputs")
STARTER = tomllib.loads(TRIAL)
ANGLE, FILL = "crack.wall_angle_deg", "crack.fill"
UNSEEN = {"crack.tilt": "lean", ANGLE: 11.0}
"""Settings of the crack's walls that no photo shows, with the values that are used if no note gives any."""
SOLVER = {f"solver.{key}": STARTER["solver"][key] for key in ("radius_mm", "settle_s")}
ORIGIN = 'write data = "measured" (or "reconstructed", "synthetic")'


@dataclass(frozen=True)
class Needed:
    """A required setting that no photo shows."""

    stand_in: Any  # Value with which the rest is checked
    remedy: str  # What to write, as the end of a sentence
    role: Role = "photo"  # Role of the file that requires it
    others: frozenset[str] = frozenset()  # Settings that can replace it


NEEDED = {
    "photo.data": Needed("synthetic", ORIGIN, others=frozenset({DATA})),
    DEPTH: Needed(16.0, "no photo shows it: write [crack] depth_mm = 16.0"),
    "crack.tilt": Needed(
        "funnel",
        "the steps of a fill need it: write [crack] tilt = 'funnel' or, for walls that open downward, 'undercut' if the "
        "photo shows the mouth's width, 'flare' if it shows the floor's",
        "fill",
    ),
    "readings.data": Needed("synthetic", ORIGIN, "readings", frozenset({DATA})),
    "readings.role": Needed(
        "held-out",
        'write [readings] role = "held-out", or "calibrated-on" if they were used to choose the fluid',
        "readings",
    ),
    SCALE: Needed(0.1, NO_SCALE, others=frozenset[str]().union(*ALTERNATIVES[0])),
}


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
    faults: list[Question] = field(default_factory=list)  # Faults and doubts
    remarks: list[str] = field(default_factory=list)
    settings: Trial | None = None  # None if they cannot be used
    stand_ins: frozenset[str] = frozenset()  # Required settings that were not given and have a stand-in
    is_read: bool = False  # True if readings were read, however doubtful
    dialect: str | None = None  # Format of the sheet of readings, as a sentence
    understood: ReadSheet | None = None  # The sheet of readings as it was understood
    trial: str | None = None  # Folder of its trial; in a dry run there is none yet
    revision: int | None = None

    def ask(self, *about: Doubt | str, file: PurePath | None = None) -> None:
        """Add faults, each to the row of ``file``, else of the file that it names, else of the photo."""
        of_sample = self.sample.files
        every = [*of_sample.values(), *self.sample.notes, *self.sample.rivals]
        for one in about:
            sentence = self.relative(one.in_words("pairing") if isinstance(one, Doubt) else one)
            begin = sentence.removeprefix(f"{PAIRING}, ")
            named = (each for each in every if begin.startswith((f"{each}:", f"{each},")))
            row = file or next(named, of_sample.get("photo", every[0]))
            question = Question(sentence, row, one.columns if isinstance(one, Doubt) else (SETTINGS,))
            self.faults += [question] if question not in self.faults else []

    def relative(self, text: str) -> str:
        """Return a text with files named relative to the lab's folder."""
        return text.replace(f"{self.folder}/", "")

    def original(self, role: Role) -> PurePath | None:
        return self.sample.files.get(role)

    @property
    def content(self) -> str:
        """Hash of files and settings, which changes with any of them."""
        settings: dict[str, Any] = {key: entry.value for key, entry in sorted(self.note.entries.items())}
        answers = [dict(self.sample.answers.get(file, {})) for file in self.sample.files.values()]
        parts = [settings, answers, [(raw.role, raw.sha256) for raw in self.raw]]
        return hashlib.sha256(json.dumps(parts, sort_keys=True, default=str).encode()).hexdigest()


def gather(folder: Path, sample: SampleFiles, defaults: Note, of_table: Note) -> SampleOutcome:
    """Read a sample's notes and hash its files; does not read photos and sheets.

    ``defaults`` are settings of all samples, ``of_table`` those of this one in a table of the folder.
    """
    outcome, own = SampleOutcome(folder, sample), of_table
    outcome.ask(*sample.questions)
    notes: list[tuple[Role, PurePath]] = [("note", file) for file in sample.notes]
    for role, file in (*sorted(sample.files.items()), *notes):
        path = folder / file
        limit = LARGEST_FILE_BYTES if role in PICTURES else LARGEST_SHEET_BYTES
        if path.is_symlink() or not path.is_file():
            outcome.ask(f"{path}: not a plain file; links are not followed: copy the file itself.")
        elif (size := path.stat().st_size) > limit:
            outcome.ask(f"{path}: {size / 1e6:,.0f} MB; the limit for such a file is {limit / 1e6:,.0f} MB.")
        else:
            number = f"-{notes.index((role, file)) + 1}" if role == "note" and len(notes) > 1 else ""
            kept_as = (INPUTS / f"{role}{number}{file.suffix.lower()}").as_posix()
            outcome.raw.append(KeptFile(role, file.as_posix(), kept_as, files.sha256(path), size))
            own = own.beside(_note(outcome, path, file)) if role == "note" else own
    if "readings" not in sample.files and not sample.is_held:
        # The folder's settings of readings are for other samples.
        defaults = defaults.without(*OF_READINGS)
        lost = sorted((key, entry.origin) for key, entry in own.entries.items() if key.startswith(OF_READINGS))
        remedy = "but the sample has no readings; add its sheet, or delete"
        outcome.ask(*(f"{origin}: {key} is given, {remedy} {key}." for key, origin in lost if sample.has_photo))
    if "fill" in sample.files:
        defaults = defaults.without(ANGLE)
    outcome.remarks += [
        f"{entry.origin}: {key} = {toml_value(entry.value)}, in place of {toml_value(theirs.value)} in {DEFAULTS}."
        for key, entry in own.entries.items()
        if (theirs := defaults.entries.get(key)) is not None and theirs.value != entry.value
    ]
    outcome.note = own.over(defaults)
    for file, answers in sample.answers.items():
        of_fill = file == sample.files.get("fill")
        given = {SETTINGS: answers.get(SETTINGS, "")} if of_fill else answers
        outcome.note = note_of_answers(given, f"{PAIRING}, {file}").over(outcome.note)
    outcome.ask(*outcome.note.faults)
    return outcome


def _note(outcome: SampleOutcome, path: Path, file: PurePath) -> Note:
    """Return the settings of a note. Ask about one that is not read, unless its row has settings."""
    try:
        note = None if file.suffix.lower() not in (".toml", ".txt", ".md") else read_note(path, outcome.sample.key)
    except InputError as fault:
        return Note(faults=str(fault).splitlines())
    if note is None and not outcome.sample.answers.get(file, {}).get(SETTINGS):
        example = {SETTINGS: f"{DEPTH} = 9.0"}
        remedy = "If it has settings, write them into its row; if not, set its role to ignore."
        finding = "is not read, since not each of its lines is key = value with a key of a trial."
        outcome.ask(Doubt("note", str(path), finding, remedy, example))
    return note or Note()


def prepare(outcome: SampleOutcome) -> None:
    """Look at the sheet of an outcome of ``gather``, and set its settings; add all faults."""
    sample, folder = outcome.sample, outcome.folder
    _look_at_sheets(outcome)
    if not sample.has_photo:
        return
    content = _tables_of(outcome)
    try:
        trial = checked(Trial, folder, content, lambda key: _origin_of(outcome, key))
    except InputError as fault:
        outcome.ask(*str(fault).splitlines())
        return
    if any(raw.role == "photo" for raw in outcome.raw):
        outcome.settings = trial
    if assumed := _assumed_of(outcome):
        outcome.remarks.append(f"{assumed} Write your own values, best into {DEFAULTS}.")
    if trial.fluid is not None and trial.fluid.freeze_after_s == "never" and trial.fluid.most_yield_stress_pa == 0:
        outcome.remarks.append("without fluid.yield_stress_pa and fluid.freeze_after_s the sealant ends level.")
    if trial.photo is not None and not (trial.photo.ends_px or trial.photo.mask or trial.photo.crack):
        outcome.remarks.append(
            "no ends_px: the crack is searched for automatically; 'sealtwin trace' lets you click its ends."
        )


def _look_at_sheets(outcome: SampleOutcome) -> None:
    """Read the sheets of readings, even if their sample is open, so that all questions come at once."""
    sample, entries = outcome.sample, outcome.note.entries
    depths = entries[DEPTH].value if DEPTH in entries else None
    depth_mm = max((row[1] for row in depths), default=None) if isinstance(depths, list) else depths
    fields = {f"readings.{name}" for name in Declared.model_fields}
    given = {key: entry.value for key, entry in entries.items() if ".".join(key.split(".")[:2]) in fields}
    readings = [raw.original for raw in outcome.raw if raw.role == "readings"]
    rivals = [str(file) for file, role in sample.rivals.items() if role == "readings"]
    for file in (*readings, *rivals):
        path = outcome.folder / file
        try:
            declared = checked(Declared, path, with_settings({}, given).get("readings", {}))
        except InputError:
            declared = Declared()  # Reported as a fault of its key.
        profile, doubts, understood = look_at(path, declared, depth_mm)
        outcome.ask(*doubts, file=PurePath(file))
        outcome.understood = understood
        if profile is not None:
            outcome.is_read, outcome.dialect = True, profile.dialect


def _tables_of(outcome: SampleOutcome) -> dict[str, Any]:
    """Return the tables of a trial. A required setting that no note gives is a fault, and gets a stand-in.

    Other settings of solver and fluid are those of 'sealtwin init': they let the sealant settle before its level is
    measured, and choose the particle radius according to the crack.
    """
    from digitise.photo import offering_markers

    sample, entries = outcome.sample, outcome.note.entries
    has_readings = "readings" in sample.files or sample.is_held
    settings: dict[str, Any] = {"name": sample.name}
    if DATA in entries:
        settings |= dict.fromkeys(("photo.data", "readings.data"), entries[DATA].value)
    settings |= {key: entry.value for key, entry in entries.items() if key not in OWN}
    for role, key in NAMED_FILES.items():
        raw = next((raw for raw in outcome.raw if raw.role == role), None)
        name = PurePath(raw.original).name if raw is not None else f"no {role}"
        if key in entries and PurePath(str(entries[key].value)).name != name:
            outcome.ask(
                f"{entries[key].origin}: {key} = {str(entries[key].value)!r:.80}, but by its name {name} belongs to this "
                "sample; delete the key, and choose the file in the pairing file."
            )
        settings[key] = raw and raw.kept_as
    _weigh(outcome, settings)
    settings = {"note": _assumed_of(outcome)} | SOLVER | _fluid_settings(settings.keys()) | settings
    roles = {*sample.files, "photo", *(["readings"] if has_readings else [])}
    missing = {key: it for key, it in NEEDED.items() if it.role in roles and not settings.keys() & {key, *it.others}}
    outcome.stand_ins = frozenset(missing)
    for key, it in missing.items():
        settings[key] = it.stand_in
        fault = f"{key} is missing: {it.remedy} in {DEFAULTS}, or in the sample's note (NAME.toml)."
        photo = outcome.folder / sample.files.get("photo", "")
        outcome.ask(offering_markers(fault, photo) if key == SCALE else fault)
    if "readings" not in sample.files:
        settings = {key: value for key, value in settings.items() if not key.startswith(OF_READINGS)}
    return with_settings({}, {key: value for key, value in settings.items() if value is not None})


def _weigh(outcome: SampleOutcome, settings: dict[str, Any]) -> None:
    """Put the content of the fill's sheet into ``settings``, beside the settings of the liquid."""
    file, given = outcome.sample.files.get("fill"), settings.pop(FILL, {})
    table = dict(given) if isinstance(given, Mapping) else {"file": given}
    if file is None:
        # The folder's settings of liquids are for other samples.
        settings |= {FILL: table} if table.keys() & {"mass_g", "file"} else {}
        return
    answers = outcome.sample.answers.get(file, {})
    # "B g", or the name of a column.
    head, _, last = (mass := answers.get("mass", "")).rpartition(" ")
    mass, unit = (head, last) if head and last in ("g", "kg") else (mass, "")
    path = outcome.folder / file
    try:
        note = note_of_answers({**answers, "s": mass, SETTINGS: "", "as_written": ""}, PAIRING)
        content = with_settings({}, {key: entry.value for key, entry in note.entries.items()})
        columns, sentence = read_fill(path, checked(Declared, path, content.get("readings", {})), unit)
    except InputError as fault:
        outcome.ask(*doubts_in(fault), file=file)
        return
    outcome.remarks.append(outcome.relative(sentence))
    settings[FILL] = {**table, **columns}


def _origin_of(outcome: SampleOutcome, key: str) -> str:
    """Return the places that give a setting or a table's settings, otherwise the path of the sample's note."""
    entries = outcome.note.entries
    origins = [
        entry.origin
        for name, entry in entries.items()
        if f"{key}.".startswith(f"{name}.") or name.startswith(f"{key}.") or (name == DATA and key.endswith(".data"))
    ]
    photo = outcome.sample.files.get("photo", PurePath("NAME"))
    return ", ".join(dict.fromkeys(origins[::-1])) or str(photo.with_suffix(".toml"))


def _fluid_settings(settings: Set[str]) -> dict[str, Any]:
    """Return the fluid's settings as in 'sealtwin init', without those that are given or that a given one excludes."""
    given = {key: 0 for key in settings if key.startswith("fluid.")}
    remaining = with_settings({"fluid": STARTER["fluid"]}, given)["fluid"]
    if "fluid.freeze_after_s" in settings:
        remaining.pop("yield_stress_pa", None)
    return {f"fluid.{key}": value for key, value in remaining.items() if f"fluid.{key}" not in settings}


def _assumed_of(outcome: SampleOutcome) -> str:
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
        for key, value in (UNSEEN | _fluid_settings(settings) | rest | SOLVER).items()
        if key not in settings and not key.startswith(without)
    )
    return f"Assumed, since no note of the lab gives it: {listed}." if listed else ""
