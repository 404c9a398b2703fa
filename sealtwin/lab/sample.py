"""Samples of a lab's folder during an ingest, with their files, settings, trials and questions."""

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
from sealtwin.core.settings import SettingsFaults, checked, without_none
from sealtwin.lab.catalogue import Record
from sealtwin.lab.files import (
    DEFAULTS,
    NAMED_FILES,
    PAIRING,
    TABLES,
    KeptFile,
    Placed,
    Role,
    rows_of,
)
from sealtwin.lab.sample_settings import (
    ALTERNATIVES,
    DEPTH,
    OF_READINGS,
    OWN,
    SCALE,
    SampleSettings,
    settings_of_answers,
)
from sealtwin.scan.points_file import MAPS
from sealtwin.scan.settings import DIRECTION
from sealtwin.trial.job import LARGEST_SHEET_BYTES
from sealtwin.trial.starter_files import begun
from sealtwin.trial.trial_file import Trial, with_settings
from validate.readings.grid import SheetFaults, listed
from validate.readings.read_readings import read_readings
from validate.readings.words import sample_key
from validate.settings import Declared

Fate = Literal["new", "revised", "unchanged", "failed", "bug"]
"""State of a sample's trial after an ingest. It is "failed" if there were questions before the photo was traced."""
FAULT = "fault"  # Kind of a doubt about a file that cannot be used
ANGLE, FILL = "crack.wall_angle_deg", "crack.fill"
ORIGIN = 'write data = "measured" (or "reconstructed", "synthetic")'
NEEDED = {
    "photo.data": ("photo", "synthetic", ORIGIN),
    DEPTH: ("photo", 16.0, "a photo does not show it: write [crack] depth_mm = 16.0"),
    "crack.tilt": (
        "fill",
        "funnel",
        "the steps of a fill require it: write [crack] tilt = 'funnel' if the crack is narrower at the floor. If it is "
        "wider at the floor, write 'undercut' if the photo shows the width of the mouth, or 'flare' if it shows the "
        "width of the floor",
    ),
    "readings.data": ("readings", "synthetic", ORIGIN),
    "readings.role": (
        "readings",
        "held-out",
        'write [readings] role = "held-out", or "calibrated-on" if the readings were used to choose the fluid',
    ),
    SCALE: ("photo", 0.1, SCALES),
    "readings.placement.units": ("scan", "mm", 'no format states the unit: write "mm", "m" or "inch"'),
    "readings.placement.up": ("scan", "z", DIRECTION),
    "readings.placement.step_mm": ("scan", 0.1, "write the distance between the pixels of the height map in mm"),
    "readings.placement.count_mm": (
        "scan",
        -1.0,
        "write the height of one count in mm, negative if counts grow away from the sensor. If they grow out of the "
        'face, also write readings.placement.up = "z"',
    ),
}
"""Required settings that a photo does not show, by key.

Each has the role of the file that requires it, the value with which the other settings are checked, and what to
write."""
SHEET_ALONE = (
    "Write its sample into the column sample. If it has several samples, add a row with this file for each, and give "
    "each row another range, sheet or levels. If it has no sample, set the role to ignore."
)
ONE_OF_SEVERAL = "Keep one, and set the role of the others to ignore."


@dataclass(frozen=True)
class SampleQuestion:
    """Files in whose rows of the pairing file a question is written, and whether a file cannot be used at all."""

    rows: frozenset[PurePath]
    is_fault: bool


@dataclass
class LabSample:
    """A photo and its files, or files with the same name that belong to no photo. It is sound without questions."""

    folder: Path  # Path of the lab's folder
    name: str
    files: dict[Role, list[PurePath]] = field(default_factory=dict)
    """Files by role. Several files of one role raise a question. If the list of readings is empty, the
    sheet may be one of the files that belong to no photo."""
    answers: dict[tuple[Role, PurePath], Mapping[str, str]] = field(default_factory=dict)  # Answers in the pairing file
    questions: dict[str, SampleQuestion] = field(default_factory=dict)  # Questions by their sentence
    asked: dict[tuple[Any, ...], str] = field(default_factory=dict)  # Sentences by their kind, file and cells
    columns: set[str] = field(default_factory=set)  # Columns of the pairing file for the answers
    fate: Fate = "failed"
    raw: list[KeptFile] = field(default_factory=list)
    settings: SampleSettings = field(default_factory=SampleSettings)
    remarks: dict[str, None] = field(default_factory=dict)
    """Remarks on the sheet of readings, each once and in their order. They hold nothing up."""

    assumed: str = ""  # Sentence with what was assumed
    trial: Trial | None = None  # None if the settings cannot be used
    stand_ins: dict[str, Any] = field(default_factory=dict)  # Temporary values of required settings that are missing
    dialect: str | None = None  # How the sheet of readings was interpreted, as a sentence. None if it was not read
    understood: ReadSheet | None = None  # Interpretation of the sheet of readings
    record: Record | None = None  # Record of the sample's trial in the lab. None for a new sample in a dry run
    trial_folder: Path = Path()  # Folder of the sample's trial in the lab

    @property
    def key(self) -> str:
        return sample_key(self.name)

    def has(self, role: Role) -> bool:
        """Return True if there is a file with a role. A scan counts as readings too."""
        return role in self.files or (role == "readings" and "scan" in self.files)

    def file(self, role: Role) -> PurePath | None:
        """Return the file with a role. Returns None if there is no such file, or if there are several."""
        files = self.files.get(role, [])
        return files[0] if len(files) == 1 else None

    def ask(self, *doubts: Doubt, rows: Iterable[PurePath] = ()) -> None:
        """Add remarks and questions. A question is written to the row of its file in the pairing file, or to ``rows``.

        If the file has no row, the question is written to the row of the first file: the photo, if there is one.
        """
        files = [*chain(*self.files.values())]
        paths = {self.folder / file: file for file in files}
        paths |= {self.trial_folder / raw.kept_as: PurePath(raw.original) for raw in self.raw}
        for doubt in doubts:
            file = paths.get(Path(doubt.where.file), doubt.where.file)
            if doubt.is_remark:
                self.remarks[doubt.in_words("pairing", f"{file}")] = None
                continue
            of_doubt = frozenset(rows) or frozenset([file if file in files else files[0]])
            # A question about the same cells was asked before the crack was traced.
            about, words = (doubt.kind, file, doubt.cells), doubt.in_words("pairing", f"{file}")
            if doubt.cells:
                self.questions.pop(self.asked.get(about, ""), None)
            self.asked[about] = words
            self.questions[words] = SampleQuestion(of_doubt, doubt.kind == FAULT)
            self.columns |= {*doubt.columns}

    def fault(self, finding: str, remedy: str = "", file: PurePath | None = None) -> None:
        """Add a question about a fault of a file. Default: the photo, or the first file if there is no photo."""
        file = file or next(chain(*self.files.values()))
        self.ask(Doubt(FAULT, Location(file), finding, remedy))

    def refuse(self, fault: InputError, file: PurePath | None = None) -> None:
        """Add questions about an error.

        An error in a sheet or in settings gives a question for each fault. Any other error gives one question about
        ``file``.
        """
        match fault:
            case SheetFaults():
                self.understood = fault.understood or self.understood
                self.ask(*fault.doubts)
            case SettingsFaults():
                self.ask(*(Doubt("setting", _origin_of(self, key), sentence) for key, sentence in fault.faults))
            case _:
                self.fault(f"{fault}", file=file)

    def is_in_question(self, role: Role) -> bool:
        """Return True if there is a question about the file with a role."""
        return any(self.file(role) in question.rows for question in self.questions.values())

    @property
    def state(self) -> str:
        """State of the sample for a reader: "asked" with questions alone, "failed" if a file cannot be used."""
        if self.fate == "bug" or not self.questions:
            return self.fate
        return "failed" if any(question.is_fault for question in self.questions.values()) else "asked"

    @property
    def sheet_in_question(self) -> ReadSheet | None:
        """Interpretation of the sheet of readings, if there is a question about the sheet."""
        return self.understood if self.is_in_question("readings") else None

    @property
    def said(self) -> Mapping[str, Any]:
        """Settings of the sample by dotted key, with values converted to JSON types."""
        return json.loads(json.dumps(self.settings.values, default=str))


def pair(folder: Path, placed: Placed, lost: Sequence[str]) -> list[LabSample]:
    """Return the samples sorted by name, followed by the files that belong to no photo. Ignored files are left out.

    ``lost`` names files that cannot be read. If there are lost files, or sheets that belong to no photo, each photo
    without a sheet gets a question, since one of these files may be its sheet.
    """
    samples = dict[str, LabSample]()
    for file, entry in rows_of(placed):
        if entry.role != "ignore":
            sample = samples.setdefault(entry.key, LabSample(folder, entry.sample))
            sample.files.setdefault(entry.role, []).append(file)
            sample.answers[entry.role, file] = entry.answers
    order = sorted(samples.values(), key=lambda sample: "photo" not in sample.files)
    lacking = [sample for sample in order if "photo" in sample.files and not sample.has("readings")]
    without = listed([f"{sample.files['photo'][0]}" for sample in lacking]) or "none"
    waiting = [*lost]
    for sample in order:
        for role, of_role in sample.files.items():
            if "photo" not in sample.files:
                remedy = f"Photos without a sheet: {without}. {SHEET_ALONE}"
                for file in of_role:
                    sample.fault(f"there is no photo with the name {sample.name!r}.", remedy, file)
                waiting += map(str, of_role if role in TABLES else ())
            elif len(of_role) > 1:
                where = Location(of_role[0], listed([*map(str, of_role[1:])]))
                doubt = Doubt("files", where, f"{len(of_role)} files have the role {role}.", ONE_OF_SEVERAL)
                sample.ask(doubt, rows=of_role)
    for sample in lacking if waiting else ():
        sample.files["readings"] = []
        finding = f"this photo has no sheet, but {listed(waiting)} may be its sheet, so the sample is left out."
        sample.ask(Doubt("files", Location(PurePath(PAIRING)), finding))
    return order


def gather(sample: LabSample, defaults: SampleSettings) -> None:
    """Set a sample's settings and hash its files, without reading photos and sheets.

    ``defaults`` are the settings of all samples.
    """
    for role, every in sample.files.items():
        for count, file in enumerate(every):
            path, limit = sample.folder / file, LARGEST_FILE_BYTES if role in ("photo", "mask") else LARGEST_SHEET_BYTES
            if path.is_symlink() or not path.is_file():
                sample.fault("this is a link or not a plain file. Replace it by a copy of the file.", file=file)
            elif (size := path.stat().st_size) > limit:
                sample.fault(f"has {size / 1e6:,.0f} MB, but at most {limit / 1e6:,.0f} MB are allowed.", file=file)
            else:
                copy = _copy_of(role, file, count)
                sample.raw.append(KeptFile(role, file.as_posix(), copy, files.sha256(path), size))
    # The folder's settings of readings, fills and walls may apply to other samples only.
    others = (ANGLE if "fill" in sample.files else FILL, *(() if sample.has("readings") else OF_READINGS))
    sample.settings = SampleSettings().over(defaults, others)
    for (role, file), answers in sample.answers.items():
        if sample.file(role):
            sample.settings = settings_of_answers(answers, file).over(sample.settings)
    sample.ask(*sample.settings.faults)


def _copy_of(role: Role, file: PurePath, count: int = 0) -> str:
    """Return the path of a file's copy, relative to the folder of the trial."""
    return f"inputs/{role}{f'-{count}' if count else ''}{file.suffix.lower()}"


def prepare(sample: LabSample) -> None:
    """Read the sheets of a sample, make its trial even if there are questions, and add all questions.

    Missing settings get a temporary value, so that all other settings are checked at the same time.
    """
    from digitise.photo import offer_of_markers

    read_sheets(sample)
    if "photo" not in sample.files:
        return
    settings, photo = _settings_of(sample), sample.folder / sample.files["photo"][0]
    sample.stand_ins = {
        key: stand_in
        for key, (role, stand_in, _) in NEEDED.items()
        if sample.has(role) and _value(settings, key) is None
    }
    # A height map has counts and steps in place of a unit.
    is_map = any(file.suffix.lower() in MAPS for file in sample.files.get("scan", ()))
    for name in ("units", "up") if is_map else ("step_mm", "count_mm"):
        sample.stand_ins.pop(f"readings.placement.{name}", None)
    if any(way & settings.keys() for way in ALTERNATIVES[0]):
        sample.stand_ins.pop(SCALE, None)
    for key in sample.stand_ins:
        finding = f"{key} is missing: {NEEDED[key][2]} in {DEFAULTS}, or answer in this row."
        finding += offer_of_markers(photo) if key == SCALE else ""
        sample.ask(Doubt("setting", Location(PurePath(DEFAULTS)), finding, answers={key: None}))
    content = begun({}, sample.stand_ins | settings)
    if not (sample.files.get("readings") or "scan" in sample.files):
        content = {name: value for name, value in content.items() if name not in ("readings", "gate")}
    try:
        trial = checked(Trial, sample.folder, content)
    except InputError as fault:
        sample.refuse(fault)
        return
    if assumed := ", ".join(trial.assumed_words):
        sample.assumed = f"Assumed: {assumed}. Write your values into {DEFAULTS}, or into columns of {PAIRING}."
    if trial.crack is not None and trial.crack.fill is not None and (file := sample.file("fill")):
        try:
            trial.crack.fill.model_copy(update={"file": Path(file)}).loaded(sample.folder)
        except InputError as fault:
            sample.refuse(fault, file)
    sample.trial = trial if [raw.role for raw in sample.raw].count("photo") == 1 else None


def _value(settings: Mapping[str, Any], key: str) -> Any:
    """Return the value that settings by dotted name give a key, by itself or in a table. None if there is none."""
    table, _, name = key.rpartition(".")
    return settings.get(key, settings.get(table, {}).get(name))


def read_sheets(sample: LabSample, length_mm: float | None = None) -> None:
    """Read the sheets of readings as a run does, and add questions about them.

    ``length_mm`` is the length of the crack, or None if it is unknown.
    """
    depth_mm = sample.settings.values.get(DEPTH)
    # Without a photo, the sample's name is open too.
    name = sample.name if "photo" in sample.files else None
    settings = with_settings({"readings": {"sample": name}}, sample.settings.values)["readings"]
    try:
        declared = checked(Declared, sample.folder, {key: settings.get(key) for key in Declared.model_fields})
    except InputError:
        return  # There is a question about the settings. Reading with a wrong one would add wrong questions.
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
    """Return the settings of a sample's trial by dotted key, with its files."""
    answers = sample.settings
    settings = {key: value for key, value in answers.values.items() if key not in OWN}
    settings |= {"name": sample.name, **({} if "scan" in sample.files else {"readings.sample": sample.name})}
    for role, key in NAMED_FILES.items():
        file = next(iter(sample.files.get(role, ())), None)
        if key in answers.values and PurePath(f"{settings[key]}").name != (file and file.name):
            finding = f"{key} = {str(settings[key])!r:.80}, but the sample's {role} is {file or 'no file'}."
            remedy = "Delete the key, and choose the file in the pairing file."
            sample.ask(Doubt("setting", answers.origins[key], finding, remedy))
        settings[key] = file and _copy_of(role, file)
    return without_none(settings)


def _origin_of(sample: LabSample, key: str) -> Location:
    """Return the locations that give a setting or the settings of a table.

    If there are none, return the pairing file.
    """
    settings = sample.settings.origins.items()
    origins = {origin for name, origin in settings if f"{key}.".startswith(f"{name}.") or name.startswith(key)}
    if not origins:
        return Location(PurePath(PAIRING))
    first, *others = sorted(origins, key=Location.named)
    return first._replace(part=", ".join(filter(None, (first.part, *map(Location.named, others)))))
