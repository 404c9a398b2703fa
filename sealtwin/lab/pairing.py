"""Pair files with photos by their names and by the user's rows in the pairing file. All else is a question there."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from pathlib import Path, PurePath

from sealtwin.core.errors import InputError
from sealtwin.core.files import as_text_cell, sheet_text
from sealtwin.lab.files import ROLES, TABLES, FilePlace, Placed, as_label, roles_of
from sealtwin.lab.notes import ANSWERS
from sealtwin.lab.sample import PAIRING, LabSample
from validate.readings.files import table_of
from validate.readings.grid import listed

SHEET_ALONE = (
    "Write its sample into the column sample; if it has several, add a row of this file for each, with its own range, "
    "sheet or levels; if it has none, set the role to ignore."
)
NOTE_ALONE = (
    "Write its sample into the column sample, and settings that are not lines key = value into the column settings; if "
    "it has readings, set its role to readings; if it has no sample, to ignore."
)
ONE_OF_SEVERAL = "Keep one, and set the role of the others to ignore."


NAMES = ("file", "role", "sample")
COLUMNS = (*NAMES, *ANSWERS, "question")
PART = ("sheet", "range", "s", "levels")  # Answers that say which part of a file a row is about


def pair(folder: Path, placed: Placed, lost: Sequence[str]) -> list[LabSample]:
    """Return the samples, sorted by name, and behind them the files without a photo. Ignored files are omitted.

    ``lost`` names files that cannot be read. While a sheet has no photo, or one of these may be a sheet, photos without
    a sheet are held back.
    """
    samples = dict[str, LabSample]()
    for file, place in _rows(placed):
        if place.role != "ignore":
            sample = samples.setdefault(place.key, LabSample(folder, place.sample))
            sample.files.setdefault(place.role, []).append(file)
            sample.answers[place.role, file] = place.answers
    order = sorted(samples.values(), key=lambda sample: "photo" not in sample.files)
    lacking = [sample for sample in order if "photo" in sample.files and "readings" not in sample.files]
    without = listed([f"{sample.files['photo'][0]}" for sample in lacking]) or "none"
    waiting = [*lost]
    for sample in order:
        for role, files in sample.files.items():
            names = [*map(str, files)]
            if "photo" not in sample.files:
                remedy = f"Photos without a sheet: {without}. {SHEET_ALONE}" if role in TABLES else NOTE_ALONE
                sample.ask(*(f"{name}: no photo is called {sample.name!r}. {remedy}" for name in names))
                waiting += names if role in TABLES else []
            elif len(files) > 1 and role != "note":
                sample.ask(f"{listed(names)}: {len(files)} files are its {role}. {ONE_OF_SEVERAL}")
    for sample in lacking if waiting else ():
        sample.files["readings"] = []
        sample.ask(f"{PAIRING}: {listed(waiting)} may be the sheet of a photo that has none, so these photos wait.")
    return order


def _rows(placed: Placed) -> list[tuple[PurePath, FilePlace]]:
    """Return the rows of the pairing file, sorted by sample, role and file."""
    rows = [(file, place) for file, places in placed.items() for place in places]
    return sorted(rows, key=lambda row: (row[1].key, ROLES.index(row[1].role), row[0]))


def pairing_text(placed: Placed, samples: Sequence[LabSample]) -> str:
    """Return the text of the pairing file: a row for each file and sample, sorted by sample, with its questions."""
    questions, used = defaultdict[tuple[PurePath, str], list[str]](list), {*NAMES, "question"}
    for sample in samples:
        used |= sample.columns
        for sentence, files in sample.questions.items():
            for file in files:
                questions[file, sample.key].append(sentence)
    rows = list[dict[str, str]]()
    for file, place in _rows(placed):
        text = " ".join(questions[file, place.key])
        named = {"file": file.as_posix(), "role": place.role, "sample": place.sample, "question": text}
        rows.append({**named, **place.answers})
        used.update(place.answers)
    columns = [name for name in COLUMNS if name in used]
    return sheet_text(columns, [[row.get(name, "") for name in columns] for row in rows])


def read_decisions(path: Path, named: Mapping[PurePath, FilePlace]) -> Placed:
    """Return the user's decisions: the rows of a pairing file that differ from what the names of the files give.

    The file may be as any spreadsheet program saves it. Raises InputError with every fault: an unknown column, a file
    that does not exist or is not read, rows of a file that are not of different parts, a role that is not possible.
    """
    if not path.is_file():
        raise InputError(f"{path}: no such file; 'sealtwin ingest FOLDER --out LAB' writes LAB/{PAIRING}.")
    faults = list[str]()
    by_name = {file.as_posix(): file for file in named}
    decisions: Placed = {}
    for line, texts in table_of(path)[1]:
        # Without the mark that stops a spreadsheet from calculating a cell.
        bare = ((name, text[as_text_cell(text[1:]) == text :]) for name, text in texts)
        where, cells = f"{path}, line {line}", {name: text for name, text in bare if text}
        faults += [
            f"{where}: {cells[name]!r:.80} is in a column {name!r:.80}; allowed are {', '.join(COLUMNS)}."
            for name in cells.keys() - {*COLUMNS}
        ]
        written, role = cells.get("file", ""), cells.get("role", "")
        if (file := by_name.get(written)) is None:
            faults.append(f"{where}: {written!r:.80} is no file that is read; correct or delete the row.")
        elif role not in (possible := (*roles_of(file), "ignore")):
            faults.append(f"{where}: {file} cannot be {role!r:.40}; write one of {', '.join(possible)}.")
        else:
            answers = {name: cells[name] for name in ANSWERS if name in cells}
            sample = as_label(cells.get("sample", named[file].sample))
            decisions.setdefault(file, []).append(FilePlace(sample, ROLES[ROLES.index(role)], answers))
    for file, places in decisions.items():
        parts = {"".join(place.answers.get(name, "") for name in PART).upper() for place in places} - {""}
        if len(parts) < len(places) != 1:
            faults.append(f"{path}: {file} has several rows; keep one, or give each its own range, sheet or levels.")
    if faults:
        raise InputError("\n".join(faults))
    return {file: places for file, places in decisions.items() if places != [named[file]]}
