"""What is said of a sample as the tables of a trial; what must be said and is not, and where a setting was said."""

from collections.abc import Mapping
from pathlib import Path, PurePath
from typing import Any

from sealtwin.errors import InputError
from sealtwin.lab.keys import ALTERNATIVES, DATA, OF_READINGS, OWN
from sealtwin.lab.naming import Role
from sealtwin.lab.notes import Note
from sealtwin.lab.pairing import LONGEST_NAME
from sealtwin.lab.prepared import PICTURES, Prepared, kept_as
from sealtwin.lab.starting import started
from sealtwin.store.settings_file import checked
from sealtwin.trials.trial import Trial

NAMED_FILES: Mapping[Role, str] = {**PICTURES, "readings": "readings.file"}


def tables_of(prepared: Prepared) -> dict[str, Any]:
    """Tables of a trial. What must be said and is not is a fault, and here a stand-in, so that the rest is checked."""
    said = started(_said(prepared))
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


def origin_of(folder: Path, prepared: Prepared, key: str) -> str:
    """Where a setting was said, or those of a table."""
    entries = prepared.note.entries
    told = [entry.origin for name, entry in entries.items() if key == name or key.startswith(f"{name}.")]
    told += [entry.origin for name, entry in entries.items() if name.startswith(f"{key}.")]
    if key.endswith(".data") and DATA in entries:
        told.append(entries[DATA].origin)
    return ", ".join(dict.fromkeys(told[::-1])) if told else str(folder / _where_to_say(prepared))


def faults_of_values(note: Note, path: Path) -> list[str]:
    """What no sample of a folder could hold of what lab.toml says."""
    said: dict[str, Any] = {"name": "all", "photo.file": "photo.jpg", "photo.data": "synthetic", "crack.depth_mm": 16.0}
    said |= {"readings.file": "readings.csv", "readings.data": "synthetic", "readings.role": "held-out"}
    said |= {key: entry.value for key, entry in note.entries.items() if key not in OWN}
    if not set[str]().union(*ALTERNATIVES[0]) & said.keys():
        said["photo.mm_per_px"] = 0.1
    try:
        checked(Trial, path, _tables(started(said)))
    except InputError as fault:
        return str(fault).splitlines()
    return []


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
