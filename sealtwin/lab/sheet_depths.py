"""Lines and columns of a sheet of readings that name the depth of the crack: they are asked about."""

import re
from pathlib import Path

from sealtwin.lab.notes import COLUMNS, DEPTH
from sealtwin.lab.pairing import PAIRING
from sealtwin.lab.sample_outcome import LONGEST_QUESTION, SampleOutcome
from sealtwin.trial.quick_trial import toml_value
from validate.readings.header_words import UNIT, crack_depth
from validate.readings.samples import sheets_of
from validate.readings.table_rows import columns_named, is_a_number, within

RANGE, LEVELS = (f"{COLUMNS}.{key}" for key in ("range", "levels"))
KEYS = (RANGE, LEVELS, "readings.sheet")
GIVES_LENGTH = re.compile(rf"\d\s?{UNIT}")
MOST_CELLS = 3  # Cells of a row that may be a title: word, value and unit
NUMBER = re.compile(r"\d+(?:[.,]\d+)?")


def ask_for_depths(folder: Path, outcome: SampleOutcome) -> None:
    """Add a question about each title, remark or name of a column with a depth of the crack that is not the trial's.

    A title without a value counts outside the range of the readings only: it is that of another table. There is no
    question if the depth comes from the pairing file, and none about columns of readings.
    """
    sample, note = outcome.sample, outcome.note
    file, entry = sample.files.get("readings"), note.entries.get(DEPTH)
    if file is None or (folder / file).is_symlink() or (entry is not None and entry.origin.startswith(PAIRING)):
        return
    span, levels, sheet = (note.entries[key].value if key in note.entries else None for key in KEYS)
    part = sample.part
    span, sheet = (part and part.cells) or span, (part and part.sheet) or sheet
    read = {at for level in levels or () for at in columns_named({}, f"{level}")}
    for grid in sheets_of(folder / file):
        is_other = sheet not in (None, grid.sheet)
        inside = {} if is_other else {row.number: row for row in within(grid.rows, span) if row.width}
        for row in grid.rows:
            texts = [cell.text for cell in row.cells if cell.text]
            line, has_number = " ".join(texts), any(map(is_a_number, row.cells))
            has_value = len(texts) <= MOST_CELLS and (has_number or GIVES_LENGTH.search(line) is not None)
            own = read if row.number in inside else set[int]()
            others = (
                cell.text for at, cell in enumerate(row.cells) if at not in own and cell.text not in (levels or ())
            )
            named = [text for text in others if crack_depth(text)]
            if has_value and len(line) <= LONGEST_QUESTION and crack_depth(line):
                values = [float(number.replace(",", ".")) for number in NUMBER.findall(line)]
                if entry is not None and entry.value in values:
                    continue
            elif not named or has_number or not (len(texts) > 1 or row.number not in inside):
                continue
            note.meant.add(DEPTH)
            other = "no note gives it" if entry is None else f"{entry.origin} has {toml_value(entry.value)}"
            note.faults.append(
                f"{file}, row {row.number}: {(named or [line])[0]!r} may be the depth of the crack, but {other}. Write "
                f"it into the column settings of {PAIRING}, such as {DEPTH} = 9.0, or {DEPTH} = [[s, depth], ...]."
            )
