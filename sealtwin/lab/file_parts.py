"""Files and the parts of them that the user gives to different samples."""

import re
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path, PurePath

from sealtwin.lab.found_files import DIGIT, FREE_TEXT, TABLE_SUFFIXES, TABLES, WORD, FilePlace
from sealtwin.lab.sheets import kind_of_text
from validate.readings.header_words import COUNTER, SAMPLE, sample_key
from validate.readings.samples import SamplePart, part_of, sheets_of
from validate.readings.table_rows import is_a_number, within
from validate.readings.text_table import plain_letters

OF_SAMPLES = SAMPLE | COUNTER
LEAST_BESIDE = 3  # Rows of numbers outside of all given ranges from which they may be another table


@dataclass(frozen=True)
class Piece:
    file: PurePath  # Relative to the lab's folder
    part: SamplePart | None = None  # None: all of it

    @property
    def part_name(self) -> str:
        """Name of the part in the pairing file; "" for the whole file."""
        return "" if self.part is None else str(self.part)

    def __str__(self) -> str:
        return f"{self.file}, {self.part}" if self.part else str(self.file)


def in_roles(folder: Path, named: Mapping[PurePath, FilePlace]) -> dict[Piece, FilePlace]:
    """Return all files as pieces, in the role that their content has: a table of readings or of a fill, or a text."""
    pieces: dict[Piece, FilePlace] = {}
    for file, place in named.items():
        is_text, is_table = file.suffix.lower() in FREE_TEXT, file.suffix.lower() in TABLE_SUFFIXES
        looked_at = is_text or (is_table and not (place.stated and place.role == "note"))
        kind = kind_of_text(folder / file) if looked_at and not (folder / file).is_symlink() else None
        # A fill is recognised by its columns.
        if kind == "fill" or (kind is not None and is_text and not (place.stated and place.role in TABLES)):
            place = replace(place, role=kind)
        pieces[Piece(file)] = place
    return pieces


def with_parts(
    folder: Path, pieces: Mapping[Piece, FilePlace], decisions: Mapping[tuple[PurePath, str], FilePlace]
) -> dict[Piece, FilePlace]:
    """Return files with the parts that the user named, in place of these files as a whole."""
    files, added = {piece.file for piece in pieces}, dict[Piece, FilePlace]()
    for (file, name), place in decisions.items():
        if file in files and (part := part_of(folder / file, name)) is not None:
            added[Piece(file, part)] = place
    divided = {piece.file for piece in added}
    return {piece: place for piece, place in pieces.items() if piece.file not in divided} | added


def beside_ranges(
    folder: Path, pieces: Mapping[Piece, FilePlace], decisions: Mapping[tuple[PurePath, str], FilePlace]
) -> dict[Piece, FilePlace]:
    """Return rows of numbers that are in none of the ranges which the user gave for a file, without a sample.

    The samples of these ranges are not sound until the user decides.
    """
    files = {piece.file for piece in pieces}
    ranges, owners = defaultdict[PurePath, list[SamplePart]](list), defaultdict[PurePath, list[str]](list)
    for (file, name), place in decisions.items():
        if file in files:
            given = part_of(folder / file, name or place.answers.get("range", ""))
            ranges[file] += [] if given is None else [given]
            # With this answer, what is outside of the range is none of this sample.
            owners[file] += [] if "range" in place.answers.get("as_written", "").lower() else [place.sample]
    return {
        Piece(file, part): FilePlace("", "readings", rest_of=tuple(owners[file]))
        for file, given in ranges.items()
        for part in _beside(folder / file, given)
        if (file, str(part)) not in decisions
    }


def _beside(path: Path, ranges: Sequence[SamplePart]) -> Iterator[SamplePart]:
    """Yield rows of numbers that are in none of the ranges which the user gave: they may be another sample's."""
    if not ranges or any(part.cells is None for part in ranges):
        return
    grids = sheets_of(path)
    for grid in (grid for grid in grids if len(grids) == 1 or grid.sheet in {part.sheet for part in ranges}):
        given = [part.cells for part in ranges if part.sheet in (None, grid.sheet)]
        covered = {row.number for cells in given for row in within(grid.rows, cells) if any(c.text for c in row.cells)}
        for is_covered, group in groupby(grid.rows, key=lambda row: row.number in covered):
            rows = list(group)
            of_numbers = [row.number for row in rows if sum(bool(DIGIT.search(cell.text)) for cell in row.cells) > 1]
            if not is_covered and len(of_numbers) >= LEAST_BESIDE:
                sheet = f"sheet {grid.sheet}, " if len(grids) > 1 else ""
                if (part := part_of(path, f"{sheet}{rows[0].number}:{of_numbers[-1]}")) is not None:
                    yield part


def texts_of(path: Path, worksheet: str | None) -> Iterator[str]:
    """Yield the names of the worksheets of a file, or only of one of them, and the texts in them."""
    grids = [grid for grid in sheets_of(path) if worksheet in (None, grid.sheet)]
    for grid in grids:
        yield from [grid.sheet] if grid.sheet is not None and len(grids) > 1 else []
        yield from (cell.text for row in grid.rows for cell in row.cells if cell.text and not is_a_number(cell))


def without_name(text: str, sample: str) -> str:
    """Return a text without a sample's name, also without that of its folder.

    A name without a digit, or a number, must be all of the text, but words for a sample.
    """
    words = sample_key(" ".join(word for word in WORD.findall(text) if plain_letters(word) not in OF_SAMPLES))
    for name in {sample, sample.rpartition("-")[2]}:
        key = sample_key(name)
        if DIGIT.search(key) and not key.isdecimal():
            spelt = r"[\W_]?".join(key.replace("-", ""))
            text = re.sub(rf"(?<![^\W_]){spelt}(?![^\W_])", " ", text, flags=re.IGNORECASE)
        elif words == key and (name == sample or not key.isdecimal()):
            return ""
    return text
