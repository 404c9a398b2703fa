"""A sample's notes and files read, and the trial that they make; or all that keeps them from it."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path, PurePath
from textwrap import shorten
from typing import Any

from digitise.settings import DEEPEST_MM, LARGEST_FILE_BYTES
from sealtwin.core import files
from sealtwin.core.errors import InputError
from sealtwin.core.settings import checked
from sealtwin.lab.found_files import DEFAULTS, Role
from sealtwin.lab.note_sentences import quantities, read_sentences
from sealtwin.lab.note_words import OF_READINGS, is_unit, of_columns
from sealtwin.lab.notes import Note, NoteEntry, OfNote, read_cell, read_note, seems_to_say
from sealtwin.lab.pairing import PAIRING, SampleFiles, as_columns
from sealtwin.lab.sample_outcome import LONGEST_QUESTION, KeptFile, SampleOutcome, kept_as, note_of
from sealtwin.lab.trial_tables import ANGLE, PICTURES, assumed_of, origin_of, rest_of, tables_of
from sealtwin.trial.job import LARGEST_SHEET_BYTES
from sealtwin.trial.quick_trial import toml_value
from sealtwin.trial.trial_file import Trial
from validate.readings.read_readings import read_readings
from validate.readings.samples import read_cells
from validate.readings.sheet import SheetFaults
from validate.settings import Declared

MOST_CELLS = 3  # Cells of a row that holds a title: word, value and unit


def gather(folder: Path, sample: SampleFiles, defaults: Note) -> SampleOutcome:
    """Read a sample's notes and hash its files; their content is not looked at yet."""
    outcome = SampleOutcome(sample, faults=[*sample.questions])
    _read_texts(folder, outcome)
    if sample.questions:
        return outcome
    texts: list[tuple[Role, PurePath]] = [("text", text) for text in sample.texts]
    for role, file in (*sorted(sample.files.items()), *texts):
        path = folder / file
        if path.is_symlink() or not path.is_file():
            outcome.faults.append(f"{path}: a link, or no plain file; links are not followed: copy the file itself.")
            continue
        limit = LARGEST_FILE_BYTES if role in PICTURES else LARGEST_SHEET_BYTES
        size = path.stat().st_size
        if size > limit:
            outcome.faults.append(
                f"{path}: {size / 1e6:,.0f} MB; at most {limit / 1e6:,.0f} MB of such a file are read."
            )
        else:
            name = kept_as(role if role != "text" else f"text-{1 + texts.index((role, file))}", file)
            outcome.raw.append(KeptFile(role, file.as_posix(), name, files.sha256(path), size))
    cells = {
        role: read_cell(said.get("settings", ""), f"{PAIRING}, {sample.files[role]}")
        for role, said in sample.answers.items()
    }
    about = OfNote(
        sample.name,
        sample.others,
        tuple(part.strip() for part in sample.answers.get("note", {}).get("skip", "").split(";")),
        {key: entry.value for cell in cells.values() for key, entry in cell.entries.items()},
    )
    notes = (read_note(folder / raw.original, defaults.words, about) for raw in outcome.raw if raw.role == "note")
    own = next(notes, Note())
    if "readings" not in sample.files:
        # What the folder says of readings concerns other samples.
        kept = {key: entry for key, entry in defaults.entries.items() if not key.startswith(OF_READINGS)}
        defaults = replace(defaults, entries=kept)
        outcome.faults += [
            f"{entry.origin}: {key} of a sample without readings; add its sheet, or leave {key} out."
            for key, entry in sorted(own.entries.items())
            if key.startswith(OF_READINGS)
        ]
    if "fill" in sample.files:
        defaults = replace(defaults, entries={key: one for key, one in defaults.entries.items() if key != ANGLE})
    outcome.note = own.over(defaults)
    outcome.remarks += [
        f"{entry.origin}: {key} = {toml_value(entry.value)}, in place of {toml_value(theirs.value)} in {DEFAULTS}."
        for key, entry in own.entries.items()
        if (theirs := defaults.entries.get(key)) is not None and theirs.value != entry.value
    ]
    outcome.remarks += [
        f"{file}: its name has {', '.join(found)}, and a name is no setting."
        for file in sample.files.values()
        if (found := _numbers_in(file))
    ]
    for cell in cells.values():
        outcome.note = cell.over(outcome.note)
    given = {
        key: text
        for role, said in sample.answers.items()
        for key, text in said.items()
        if role != "fill" and (role, key) != ("note", "skip")
    }
    said = of_columns(as_columns(given))
    if "crack" in given:
        said["photo.crack"] = int(given["crack"]) if given["crack"].isdecimal() else given["crack"]
    outcome.note.entries |= {key: NoteEntry(value, PAIRING) for key, value in said.items()}
    outcome.faults += outcome.note.faults
    outcome.remarks += outcome.note.remarks
    return outcome


def _numbers_in(file: PurePath) -> list[str]:
    """Return numbers in a file's name, and its folders', with a unit that a setting of a trial has."""
    name = file.with_suffix("").as_posix().replace("_", " ").replace("/", "; ")
    return [name[one.start : one.end] for one in quantities(name) if one.unit and is_unit(one.unit)]


def _read_texts(folder: Path, outcome: SampleOutcome) -> None:
    for text in (text for text in outcome.sample.texts if not (folder / text).is_symlink()):
        told = f"{text} is kept as text, and not read"
        if found := seems_to_say(folder / text, outcome.sample.name):
            told += f"; {found}: if that is of the sample, give it the role note in {PAIRING}, else leave it"
            outcome.asked[text] = [shorten(f"{told}.", LONGEST_QUESTION, placeholder="...")]
        outcome.remarks.append(f"{told}.")


def prepare(folder: Path, outcome: SampleOutcome) -> None:
    """Look at what ``gather`` found: give ``outcome`` its settings and its dialect, or its faults."""
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
        outcome.remarks.append(f"{assumed} Write your own, best into {DEFAULTS}.")
    if trial.fluid is not None and trial.fluid.freeze_after_s == "never" and trial.fluid.most_yield_stress_pa == 0:
        nothing = "nothing holds the sealant's slope, neither fluid.yield_stress_pa nor fluid.freeze_after_s"
        outcome.remarks.append(f"{nothing}: it ends level.")
    if trial.photo is not None and not (trial.photo.ends_px or trial.photo.mask or trial.photo.crack):
        outcome.remarks.append("no ends_px: the crack is searched for; 'sealtwin trace' lets you click its ends.")


def _look_at(path: Path, role: Role, content: Mapping[str, Any], deepest_mm: float, outcome: SampleOutcome) -> None:
    """Decode a picture, or read readings as the pipeline does, whose crack's length is not known yet."""
    if role in PICTURES:
        from digitise.image.decoding import read_photo

        read_photo(path, PICTURES[role])
    elif role == "readings":
        readings = content["readings"]
        try:
            # How it is written; what else is said of the readings may be wrong, and keeps no fault of the sheet back.
            keys = Declared.model_fields.keys() & readings.keys()
            declared = checked(Declared, path, {key: readings[key] for key in keys})
        except InputError:
            return  # Told of already, by the key that is at fault.
        outcome.faults += _contradictions(path, declared, content, outcome)
        try:
            profile = read_readings(path, declared, None, deepest_mm)
        except SheetFaults as fault:
            outcome.columns["readings"] = fault.columns
            raise
        outcome.dialect, outcome.columns["readings"] = profile.dialect, profile.columns
        # A sheet is judged by the crack's own depth.
        if "crack.depth_mm" in outcome.note.entries:
            outcome.faults += [f"{doubt} It goes into {note_of(outcome)}, or {PAIRING}." for doubt in profile.doubts]


def _contradictions(path: Path, declared: Declared, content: Mapping[str, Any], outcome: SampleOutcome) -> list[str]:
    """Return titles and remarks of a sheet that say another value of a setting than the one that would run.

    What the pairing file says of that setting is the answer.
    """
    told, assumed = list[str](), rest_of(outcome)
    try:
        rows = read_cells(path, declared).rows
    except InputError:
        return told  # Told of by whoever reads the readings.
    for row in rows:
        texts = [cell.text for cell in row.cells if cell.text]
        if len(texts) > MOST_CELLS or len(" ".join(texts)) > LONGEST_QUESTION:
            continue
        for key, (value, words) in read_sentences(" ".join(texts), outcome.sample.name).settings.items():
            table, _, name = key.rpartition(".")
            runs, entry = content.get(table, {}).get(name, assumed.get(key)), outcome.note.entries.get(key)
            if value == runs or key.startswith(OF_READINGS) or (entry and entry.origin.startswith(PAIRING)):
                continue
            # Date and operator are of no table: a run does not depend on them.
            if not table and entry is None:
                continue
            other = f"{entry.origin} says {toml_value(entry.value)}" if entry else "no note says so"
            told.append(
                f"{path}, row {row.number}: {words!r} says {key} = {toml_value(value)}, and {other}. Write the "
                f"right one into settings of {PAIRING}: {key} = {toml_value(value)}."
            )
    return told
