"""One sample's files as a trial that is ready to run; or all that keeps it from being one."""

import hashlib
import json
import tomllib
from collections.abc import Mapping, Set
from dataclasses import dataclass, field
from pathlib import Path, PurePath
from typing import Any

from digitise.settings import DEEPEST_MM, LARGEST_FILE_BYTES
from sealtwin import files
from sealtwin.errors import InputError
from sealtwin.job import LARGEST_SHEET_BYTES
from sealtwin.lab.keys import ALTERNATIVES, DATA, OF_READINGS, OWN
from sealtwin.lab.naming import Role
from sealtwin.lab.notes import Note, read_note
from sealtwin.lab.pairing import LONGEST_NAME, Sample
from sealtwin.settings_file import checked
from sealtwin.starter import TRIAL
from sealtwin.trial import Trial

INPUTS = Path("inputs")
PICTURES: Mapping[Role, str] = {"photo": "photo.file", "second_photo": "photo.second_photo", "mask": "photo.mask"}
"""Settings that name a file."""
STARTER = tomllib.loads(TRIAL)
NAMED_FILES: Mapping[Role, str] = {**PICTURES, "readings": "readings.file"}


@dataclass(frozen=True)
class RawFile:
    """A file of the lab's, and how it is kept."""

    role: Role
    path: Path
    original: str
    """Where it lay, relative to the lab's folder."""
    sha256: str
    size_bytes: int

    @property
    def kept_as(self) -> str:
        return kept_as(self.role, self.path)


@dataclass
class Prepared:
    """What a sample is found to be; a trial only where nothing is wrong with it."""

    sample: Sample
    raw: list[RawFile] = field(default_factory=list)
    note: Note = field(default_factory=Note)
    faults: list[str] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)
    trial: Trial | None = None
    dialect: str | None = None
    """Of the sheet of readings, in a sentence."""

    @property
    def content(self) -> str:
        """Hash of what was measured and of what was said about it: equal where nothing has changed."""
        said = {key: entry.value for key, entry in sorted(self.note.entries.items())}
        hashes = {raw.role: raw.sha256 for raw in self.raw}
        if self.sample.part is not None and "readings" in hashes:
            # Of a sheet that others share, only what is this sample's.
            hashes["readings"] = self.sample.part.sha256
        return hashlib.sha256(json.dumps([said, hashes], sort_keys=True, default=str).encode()).hexdigest()

    def said(self, key: str) -> str | None:
        entry = self.note.entries.get(key)
        return None if entry is None else str(entry.value)


def kept_as(role: Role, file: PurePath) -> str:
    """In the trial's folder, by its role: a lab's names may be anything, and two of one folder alike."""
    return (INPUTS / f"{role}{file.suffix.lower()}").as_posix()


def gather(folder: Path, sample: Sample, defaults: Note) -> Prepared:
    """A sample's notes, and the hashes of its files; their content is not looked at yet."""
    prepared = Prepared(sample, faults=[*sample.questions, *sample.lost])
    if sample.questions:
        return prepared
    if len(sample.name) > LONGEST_NAME:
        prepared.faults.append(f"{sample.name[:20]}...: a name of {len(sample.name)} letters; at most {LONGEST_NAME}.")
    for role, file in sorted(sample.files.items()):
        path = folder / file
        limit = LARGEST_FILE_BYTES if role in PICTURES else LARGEST_SHEET_BYTES
        size = path.stat().st_size
        if size > limit:
            prepared.faults.append(
                f"{path}: {size / 1e6:,.0f} MB; at most {limit / 1e6:,.0f} MB of such a file are read."
            )
        else:
            prepared.raw.append(RawFile(role, path, file.as_posix(), files.sha256(path), size))
    own = next((read_note(raw.path) for raw in prepared.raw if raw.role == "note"), Note())
    if "readings" in sample.files:
        prepared.note = own.over(defaults)
    else:
        prepared.note = own.over(defaults.without_readings())
        of_readings = sorted(key for key in own.entries if key.startswith(OF_READINGS))
        prepared.faults += [
            f"{own.entries[key].origin}: {key} of a sample without readings; add its sheet, or leave {key} out."
            for key in of_readings
        ]
    prepared.faults += own.faults
    prepared.remarks += prepared.note.remarks
    return prepared


def faults_of_values(note: Note, path: Path) -> list[str]:
    """What no sample of a folder could hold of what lab.toml says."""
    said = _started({"name": "all", "photo.file": "photo.jpg", "photo.data": "synthetic", "crack.depth_mm": 16.0})
    said |= {"readings.file": "readings.csv", "readings.data": "synthetic", "readings.role": "held-out"}
    said |= {key: entry.value for key, entry in note.entries.items() if key not in OWN}
    if not set[str]().union(*ALTERNATIVES[0]) & said.keys():
        said["photo.mm_per_px"] = 0.1
    try:
        checked(Trial, path, _tables(said))
    except InputError as fault:
        return str(fault).splitlines()
    return []


def prepare(folder: Path, prepared: Prepared) -> None:
    """Look at what ``gather`` found: give ``prepared`` its trial and its dialect, or its faults."""
    content = _content(prepared)
    try:
        trial = checked(Trial, folder, content, lambda key: _origin(folder, prepared, key))
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
    prepared.remarks += _remarks_on_fluid(prepared.note.entries.keys(), trial)
    if trial.photo is not None and trial.photo.ends_px is None and trial.photo.mask is None:
        prepared.remarks.append("no ends_px: the crack is searched for; 'sealtwin trace' lets you click its ends.")


def _remarks_on_fluid(said: Set[str], trial: Trial) -> list[str]:
    fluid = trial.fluid
    if fluid is None:
        return []
    if fluid.freeze_after_s == "never" and fluid.most_yield_stress_pa == 0:
        return [
            "nothing holds the sealant's slope, neither fluid.yield_stress_pa nor fluid.freeze_after_s: it ends level."
        ]
    taken = ", ".join(f"{key} = {value}" for key, value in _started_fluid(dict.fromkeys(said)).items())
    return [f"{taken}: the starter's, since no note says it. Write your own, best into lab.toml."] if taken else []


def _content(prepared: Prepared) -> dict[str, Any]:
    """Tables of a trial. What must be said and is not is a fault, and here a stand-in, so that the rest is checked."""
    said = _started(_said(prepared))
    where, meant = _where_to_say(prepared), prepared.note.meant
    for key, stand_in, remedy in _needed("readings" in prepared.sample.files):
        if key not in said:
            said[key] = stand_in
            if key not in meant and not (key.endswith(".data") and DATA in meant):
                prepared.faults.append(f"{where}: {key} is not said{remedy}")
    scales = set[str]().union(*ALTERNATIVES[0])
    if not scales & said.keys():
        said["photo.mm_per_px"] = 0.1
        if not scales & meant:
            prepared.faults.append(
                f"{where}: no scale is said; write [photo] mm_per_px, face_mm, ruler_px or markers, or 'Scale [mm/px]'."
            )
    return _tables(said)


def _tables(said: Mapping[str, Any]) -> dict[str, Any]:
    """Of dotted keys."""
    content: dict[str, Any] = {}
    for key, value in said.items():
        table, _, name = key.rpartition(".")
        (content.setdefault(table, {}) if table else content)[name] = value
    return content


def _said(prepared: Prepared) -> dict[str, Any]:
    """What notes say of a trial, by dotted key, and its files."""
    present = prepared.sample.files
    said = {"name": prepared.sample.name[:LONGEST_NAME]}
    said |= {key: entry.value for key, entry in prepared.note.entries.items() if key not in OWN}
    if (data := prepared.said(DATA)) is not None:
        said = {"photo.data": data, "readings.data": data} | said
    if "readings" not in present:
        said = {key: value for key, value in said.items() if not key.startswith(OF_READINGS)}
    if prepared.sample.part is not None and "readings" in present:
        said |= _part_of_readings(prepared, said)
    for role, key in NAMED_FILES.items():
        if role in present:
            said[key] = _confirmed(prepared, role, present[role])
        elif key in said:
            prepared.faults.append(
                f"{prepared.note.entries[key].origin}: {key} = {str(said.pop(key))!r:.80}, which is not of this sample "
                f"by its name; give it the sample's name, or the role {role} in the pairing file."
            )
    return said


def _part_of_readings(prepared: Prepared, said: Mapping[str, Any]) -> dict[str, str]:
    """Which part of a file that others share; a note may say it too, if it means the same one."""
    part = prepared.sample.part
    assert part is not None, "asked for a shared file only"
    settings = {"readings.sheet": part.sheet, "readings.sample": part.rows_of}
    settings = {key: value for key, value in settings.items() if value is not None}
    for key, value in settings.items():
        if said.get(key, value) != value:
            prepared.faults.append(
                f"{prepared.note.entries[key].origin}: {key} = {str(said[key])!r:.80}, but "
                f"{prepared.sample.files['readings']}, {part}, is of this sample by its name; leave it out, or "
                "say in the pairing file which is."
            )
    return settings


def _started(said: dict[str, Any]) -> dict[str, Any]:
    """With what 'sealtwin init' writes too: without a rest the jet, still falling, is taken for the sealant's level."""
    return {"solver.settle_s": STARTER["solver"]["settle_s"]} | _started_fluid(said) | said


def _started_fluid(said: Mapping[str, Any]) -> dict[str, Any]:
    """The starter's, of what nobody says: how thin the sealant is, and what holds its slope, either of two ways."""
    fluid = {f"fluid.{key}": value for key, value in STARTER["fluid"].items()}
    if "fluid.viscosity_pa_s" in said:
        del fluid["fluid.U"]
    if "fluid.freeze_after_s" in said:
        del fluid["fluid.yield_stress_pa"]
    return {key: value for key, value in fluid.items() if key not in said}


def _needed(readings: bool) -> list[tuple[str, Any, str]]:
    """What has no default and no photo shows: the setting, a stand-in, and what to write."""
    where_from = 'where they come from; write data = "measured" (or "reconstructed", "synthetic").'
    needed = [
        ("photo.data", "synthetic", f": {where_from}"),
        ("crack.depth_mm", 16.0, "; no photo shows it: write [crack] depth_mm = 16.0, or 'Depth [mm]' and 16.0."),
    ]
    if readings:
        role = 'write [readings] role = "held-out", or "calibrated-on" where they helped to choose the fluid.'
        needed += [("readings.data", "synthetic", f": {where_from}"), ("readings.role", "held-out", f": {role}")]
    return needed


def _confirmed(prepared: Prepared, role: Role, file: PurePath) -> str:
    """How the kept file is named in the trial; a note may name the file too, if it means the same one."""
    key = NAMED_FILES[role]
    named = prepared.note.entries.get(key)
    if named is not None and PurePath(str(named.value)).name != file.name:
        prepared.faults.append(
            f"{named.origin}: {key} = {str(named.value)!r:.80}, but {file} is of this sample by its name; "
            "leave it out, and say in the pairing file which is."
        )
    return kept_as(role, file)


def _where_to_say(prepared: Prepared) -> str:
    """The sample's note, or the name that one would get."""
    note, photo = prepared.sample.files.get("note"), prepared.sample.files["photo"]
    return str(note) if note is not None else f"{photo.with_name(f'{photo.stem}_notes.toml')} or lab.toml"


def _origin(folder: Path, prepared: Prepared, key: str) -> str:
    """Where a setting was said, or those of a table."""
    entries = prepared.note.entries
    told = [entry.origin for name, entry in entries.items() if key == name or key.startswith(f"{name}.")]
    told += [entry.origin for name, entry in entries.items() if name.startswith(f"{key}.")]
    if key.endswith(".data") and DATA in entries:
        told.append(entries[DATA].origin)
    return ", ".join(dict.fromkeys(told[::-1])) if told else str(folder / _where_to_say(prepared))


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
