"""The samples of a lab's folder during an ingest: their files, settings and trials, and their questions."""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path, PurePath
from typing import Any, Literal

from digitise.settings import LARGEST_FILE_BYTES, SCALES
from sealtwin.core import files
from sealtwin.core.doubts import Doubt, Location, ReadSheet
from sealtwin.core.errors import InputError
from sealtwin.core.settings import SettingsFaults, checked
from sealtwin.lab.catalogue import Record
from sealtwin.lab.files import (
    ANSWERS,
    DEFAULTS,
    NAMED_FILES,
    PAIRING,
    SETTINGS,
    TABLES,
    KeptFile,
    Placed,
    Role,
    rows_of,
)
from sealtwin.lab.notes import ALTERNATIVES, DEPTH, OF_READINGS, OWN, SCALE, Note, note_of_answers, read_note
from sealtwin.trial.job import LARGEST_SHEET_BYTES
from sealtwin.trial.starter_files import ASSUMED, toml_value
from sealtwin.trial.trial_file import Trial, names_in, with_settings
from validate.readings.grid import SheetFaults, listed
from validate.readings.read_readings import read_readings
from validate.readings.words import sample_key
from validate.settings import Declared

Fate = Literal["new", "revised", "unchanged", "failed", "bug"]
"""State of a sample's trial after an ingest; "failed" if its files raise questions."""
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
NEEDED = {
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
    SCALE: ("photo", 0.1, SCALES),
}
"""Required settings that no photo shows: role of the file that requires it, value with which the rest is checked, and
what to write."""
SHEET_ALONE = (
    "Write its sample into the column sample; if it has several, add a row of this file for each, with its own range, "
    "sheet or levels; if it has none, set the role to ignore."
)
NOTE_ALONE = (
    "Write its sample into the column sample, and settings that are not lines key = value into the column settings; if "
    "it has readings, set its role to readings; if it has no sample, to ignore."
)
ONE_OF_SEVERAL = "Keep one, and set the role of the others to ignore."


@dataclass(frozen=True)
class SampleQuestion:
    """A question in the rows of its files in the pairing file."""

    rows: frozenset[PurePath]
    can_be_confirmed: bool


@dataclass
class LabSample:
    """A photo and its files, or files of one name that belong to no photo. It is sound if it has no questions."""

    folder: Path  # The lab's
    name: str
    files: dict[Role, list[PurePath]] = field(default_factory=dict)
    """Files by role. Several of one role but notes are in question. An empty list of readings waits for a sheet."""
    answers: dict[tuple[Role, PurePath], Mapping[str, str]] = field(default_factory=dict)  # Of the pairing file
    questions: dict[str, SampleQuestion] = field(default_factory=dict)  # By sentence
    columns: set[str] = field(default_factory=set)  # Of the pairing file, for the answers
    fate: Fate = "failed"
    raw: list[KeptFile] = field(default_factory=list)
    note: Note = field(default_factory=Note)
    remarks: list[str] = field(default_factory=list)
    trial: Trial | None = None  # None if the settings cannot be used
    stand_ins: dict[str, Any] = field(default_factory=dict)  # Of required settings that were not given
    dialect: str | None = None  # Format of the sheet of readings, as a sentence; None if it could not be read
    understood: ReadSheet | None = None  # The sheet of readings as it was understood
    record: Record | None = None  # Of its trial in the lab; None for a new one in a dry run
    trial_folder: Path = Path()  # Folder of its trial in the lab

    @property
    def key(self) -> str:
        return sample_key(self.name)

    def file(self, role: Role) -> PurePath | None:
        """Return the file of a role; None if there is none, or several."""
        files = self.files.get(role, [])
        return files[0] if len(files) == 1 else None

    def ask(self, *doubts: Doubt, rows: Iterable[PurePath] = ()) -> None:
        """Add questions, each to the row of the file that it is about, else to that of the photo; or to ``rows``."""
        files = [*chain(*self.files.values())]
        paths = {self.folder / file: file for file in files}
        paths |= {self.trial_folder / raw.kept_as: PurePath(raw.original) for raw in self.raw}
        for doubt in doubts:
            file = paths.get(Path(doubt.where.file), doubt.where.file)
            of_doubt = frozenset(rows) or frozenset([file if file in files else files[0]])
            self.questions[doubt.in_words("pairing", f"{file}")] = SampleQuestion(of_doubt, doubt.can_be_confirmed)
            self.columns |= {column if column in ANSWERS else SETTINGS for column in doubt.columns or (SETTINGS,)}

    def fault(self, finding: str, remedy: str = "", file: PurePath | None = None) -> None:
        """Ask about a fault of a file. Default: of the photo, or the first file without one."""
        file = file or next(chain(*self.files.values()))
        self.ask(Doubt("fault", Location(file), finding, remedy))

    def refuse(self, fault: InputError, file: PurePath | None = None) -> None:
        """Add the questions of an error: those of a sheet, those of settings, or one about a file."""
        match fault:
            case SheetFaults():
                self.understood = fault.understood or self.understood
                self.ask(*fault.doubts)
            case SettingsFaults():
                self.ask(*(Doubt("setting", _origin_of(self, key), sentence) for key, sentence in fault.faults))
            case _:
                self.fault(f"{fault}", file=file)

    def is_in_question(self, role: Role) -> bool:
        """Return True if a question is about the file of a role."""
        return any(self.file(role) in question.rows for question in self.questions.values())

    @property
    def sheet_in_question(self) -> ReadSheet | None:
        """The sheet of readings as it was understood, if a question is about it."""
        return self.understood if self.is_in_question("readings") else None

    @property
    def said(self) -> Mapping[str, Any]:
        """Settings in its notes, by dotted key, as JSON has them."""
        return json.loads(json.dumps(self.note.values, default=str))


def pair(folder: Path, placed: Placed, lost: Sequence[str]) -> list[LabSample]:
    """Return the samples, sorted by name, and behind them the files without a photo. Ignored files are omitted.

    ``lost`` names files that cannot be read. While a sheet has no photo, or one of these may be a sheet, photos without
    a sheet are held back.
    """
    samples = dict[str, LabSample]()
    for file, entry in rows_of(placed):
        if entry.role != "ignore":
            sample = samples.setdefault(entry.key, LabSample(folder, entry.sample))
            sample.files.setdefault(entry.role, []).append(file)
            sample.answers[entry.role, file] = entry.answers
    order = sorted(samples.values(), key=lambda sample: "photo" not in sample.files)
    lacking = [sample for sample in order if "photo" in sample.files and "readings" not in sample.files]
    without = listed([f"{sample.files['photo'][0]}" for sample in lacking]) or "none"
    waiting = [*lost]
    for sample in order:
        for role, of_role in sample.files.items():
            if "photo" not in sample.files:
                remedy = f"Photos without a sheet: {without}. {SHEET_ALONE}" if role in TABLES else NOTE_ALONE
                for file in of_role:
                    sample.fault(f"no photo is called {sample.name!r}.", remedy, file)
                waiting += map(str, of_role if role in TABLES else ())
            elif len(of_role) > 1 and role != "note":
                where = Location(of_role[0], listed([*map(str, of_role[1:])]))
                doubt = Doubt("files", where, f"{len(of_role)} files are its {role}.", ONE_OF_SEVERAL)
                sample.ask(doubt, rows=of_role)
    for sample in lacking if waiting else ():
        sample.files["readings"] = []
        finding = f"{listed(waiting)} may be the sheet of a photo that has none, so these photos wait."
        sample.ask(Doubt("files", Location(PurePath(PAIRING)), finding))
    return order


def gather(sample: LabSample, defaults: Note) -> None:
    """Read a sample's notes and hash its files; does not read photos and sheets.

    ``defaults`` are settings of all samples.
    """
    note = Note()
    for role, every in sample.files.items():
        for count, file in enumerate(every):
            path, limit = sample.folder / file, LARGEST_FILE_BYTES if role in ("photo", "mask") else LARGEST_SHEET_BYTES
            if path.is_symlink() or not path.is_file():
                sample.fault("not a plain file; links are not followed: copy the file itself.", file=file)
            elif (size := path.stat().st_size) > limit:
                sample.fault(f"{size / 1e6:,.0f} MB; the limit for such a file is {limit / 1e6:,.0f} MB.", file=file)
            else:
                copy = _copy_of(role, file, count)
                sample.raw.append(KeptFile(role, file.as_posix(), copy, files.sha256(path), size))
                if role == "note" and "photo" in sample.files:
                    read_note(sample.folder, file, sample.key, note, answered=SETTINGS in sample.answers[role, file])
    # The folder's settings of readings, fills and walls may be for other samples.
    others = (ANGLE if "fill" in sample.files else FILL, *(() if "readings" in sample.files else OF_READINGS))
    sample.note = note.over(defaults, others)
    for (role, file), answers in sample.answers.items():
        if role == "note" or sample.file(role):
            sample.note = note_of_answers(answers, file).over(sample.note)
    sample.ask(*sample.note.faults)


def _copy_of(role: Role, file: PurePath, count: int = 0) -> str:
    """Return the path of the copy of a sample's file in the folder of its trial."""
    return f"inputs/{role}{f'-{count}' if count else ''}{file.suffix.lower()}"


def prepare(sample: LabSample) -> None:
    """Read the sheets of a sample and make its trial, even if it has questions; add all others.

    Settings that are missing have a stand-in, so that the rest is checked at the same time.
    """
    from digitise.photo import offer_of_markers

    read_sheets(sample)
    if "photo" not in sample.files:
        return
    settings, photo = _settings_of(sample), sample.folder / sample.files["photo"][0]
    sample.stand_ins = {
        key: stand_in for key, (role, stand_in, _) in NEEDED.items() if role in sample.files and key not in settings
    }
    if any(way & settings.keys() for way in ALTERNATIVES[0]):
        sample.stand_ins.pop(SCALE, None)
    for key in sample.stand_ins:
        finding = f"{key} is missing: {NEEDED[key][2]} in {DEFAULTS}, or in the sample's note (NAME.toml)."
        finding += offer_of_markers(photo) if key == SCALE else ""
        sample.ask(Doubt("setting", Location(PurePath(DEFAULTS)), finding))
    names = names_in(with_settings({}, settings))
    excluded = tuple(begin for key, begin in EXCLUDED.items() if key in names)
    starter = {key: value for key, value in STARTER.items() if not key.startswith(excluded)} | sample.stand_ins
    content = with_settings(with_settings({}, starter), settings)
    if not sample.files.get("readings"):
        content = {name: value for name, value in content.items() if name not in ("readings", "gate")}
    if assumed := [f"{key} = {toml_value(starter[key])}" for key in starter if key in names_in(content) - names]:
        sentence = f"Assumed, since no note of the lab gives it: {', '.join(assumed)}."
        content["note"] = f"{sentence} {settings.get('note', '')}".strip()
        sample.remarks.append(f"{sentence} Write your own values, best into {DEFAULTS}.")
    try:
        trial = checked(Trial, sample.folder, content)
    except InputError as fault:
        sample.refuse(fault)
        return
    if trial.crack is not None and trial.crack.fill is not None and (file := sample.file("fill")):
        try:
            trial.crack.fill.model_copy(update={"file": Path(file)}).loaded(sample.folder)
        except InputError as fault:
            sample.refuse(fault, file)
    sample.trial = trial if [raw.role for raw in sample.raw].count("photo") == 1 else None


def read_sheets(sample: LabSample, length_mm: float | None = None) -> None:
    """Read the sheets of readings as a run does, and ask about them. ``length_mm`` is of the crack, None if unknown."""
    depth_mm = sample.note.values.get(DEPTH)
    # Without a photo, the name of the file is in question too.
    name = sample.name if "photo" in sample.files else None
    settings = with_settings({"readings": {"sample": name}}, sample.note.values)["readings"]
    try:
        declared = checked(Declared, sample.folder, {key: settings.get(key) for key in Declared.model_fields})
    except InputError:
        return  # A fault of its key. With a wrong answer, all others would be asked about again.
    for file in (PurePath(raw.original) for raw in sample.raw if raw.role == "readings"):
        try:
            single_mm = depth_mm if isinstance(depth_mm, int | float) else None
            profile = read_readings(sample.folder / file, declared, length_mm, single_mm)
        except InputError as fault:
            sample.refuse(fault, file)
        else:
            sample.ask(*profile.questions)
            sample.understood = profile.understood
            sample.dialect = profile.dialect if sample.file("readings") else None


def _settings_of(sample: LabSample) -> dict[str, Any]:
    """Return the settings of a trial by dotted key, from its notes and its files."""
    note = sample.note
    settings = {key: value for key, value in note.values.items() if key not in OWN}
    settings |= {"name": sample.name, "readings.sample": sample.name}
    for role, key in NAMED_FILES.items():
        file = next(iter(sample.files.get(role, ())), None)
        if key in note.values and PurePath(f"{settings[key]}").name != (file and file.name):
            finding = f"{key} = {str(settings[key])!r:.80}, but the sample's {role} is {file or 'no file'};"
            remedy = "delete the key, and choose the file in the pairing file."
            sample.ask(Doubt("setting", note.origins[key], finding, remedy))
        settings[key] = file and _copy_of(role, file)
    return {key: value for key, value in settings.items() if value is not None}


def _origin_of(sample: LabSample, key: str) -> Location:
    """Return the places that give a setting or a table's settings, otherwise a note of the sample."""
    notes = sample.note.origins.items()
    origins = {origin for name, origin in notes if f"{key}.".startswith(f"{name}.") or name.startswith(key)}
    if not origins:
        return Location(sample.files["photo"][0].with_suffix(".toml"))
    first, *others = sorted(origins, key=Location.named)
    return first._replace(part=", ".join(filter(None, (first.part, *map(Location.named, others)))))
