"""Parts of files: tables, rows and columns of a sheet that belong to different samples."""

import re
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path, PurePath

from sealtwin.lab.found_files import DIGIT, FREE_TEXT, TABLE_SUFFIXES, TABLES, WORD, FilePlace, as_label, read_name
from sealtwin.lab.sheets import kind_of_text
from validate.readings.header_words import crack_depth, sample_key
from validate.readings.samples import SamplePart, part_of, parts_of, sheets_of
from validate.readings.table_rows import within
from validate.readings.text_table import WORDS as LAB_WORDS
from validate.readings.text_table import plain_letters

SAMPLE_WORDS = LAB_WORDS["columns"]["sample"].split()
OF_SAMPLES = frozenset(SAMPLE_WORDS + LAB_WORDS["columns"]["counter"].split())
TITLE = re.compile(
    rf"(?:(?:{'|'.join(SAMPLE_WORDS)})\W+(?P<after>[\w.-]*\d[\w.-]*)|(?P<alone>(?=[\w-]*[^\W\d])[\w-]*\d[\w-]*))(?:\W.*)?",
    re.IGNORECASE,
)
"""Title of a table that may contain the name of a sample, such as S13 in "Probe S13, links". That sample may have no
photo."""
LEAST_BESIDE = 3  # Rows of numbers outside of all given ranges from which they may be another table
MOST_WORDS = 5  # Words of a sample's name in a title


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


def divide(
    folder: Path, named: Mapping[PurePath, FilePlace], photographed: Set[str], *, has_range: bool = False
) -> dict[Piece, FilePlace]:
    """Return the pieces of all files: the parts of a table with readings of several samples, otherwise the whole file.

    A column of sample names always divides a table. The name of a worksheet, or a title above one of several tables of
    a sheet, does so if it is in ``photographed``, the keys of samples with a photo; the other tables of this workbook
    then become questions. So do several tables of a sheet without any name, unless the folder's settings have a range
    (``has_range``) and the file has the name of a sample.
    """
    pieces: dict[Piece, FilePlace] = {}
    for file, place in named.items():
        if (folder / file).is_symlink():
            pieces[Piece(file)] = place
            continue
        is_text, is_table = file.suffix.lower() in FREE_TEXT, file.suffix.lower() in TABLE_SUFFIXES
        looked_at = is_text or (is_table and not (place.stated and place.role == "note"))
        kind = kind_of_text(folder / file) if looked_at else None
        # A fill is recognised by its columns.
        if kind == "fill" or (kind is not None and is_text and not (place.stated and place.role in TABLES)):
            place = replace(place, role=kind)
        if place.role == "readings":
            pieces |= _divided(folder, file, place, photographed, has_range)
        else:
            pieces[Piece(file)] = place
    return pieces


def with_parts(
    folder: Path, pieces: Mapping[Piece, FilePlace], decisions: Mapping[tuple[PurePath, str], FilePlace]
) -> dict[Piece, FilePlace]:
    """Return ``pieces`` with the ranges of files that only the user named, in place of these files as a whole."""
    files, present = {piece.file for piece in pieces}, {(piece.file, piece.part_name) for piece in pieces}
    added = dict[Piece, FilePlace]()
    for (file, name), place in decisions.items():
        if file in files and (file, name) not in present and (part := part_of(folder / file, name)) is not None:
            added[Piece(file, part)] = place
    divided = {piece.file for piece in added}
    return {piece: place for piece, place in pieces.items() if piece.part or piece.file not in divided} | added


def beside_ranges(
    folder: Path, pieces: Mapping[Piece, FilePlace], decisions: Mapping[tuple[PurePath, str], FilePlace]
) -> dict[Piece, FilePlace]:
    """Return rows of numbers that are in none of the ranges which the user gave for a file, without a sample.

    The samples of these ranges are not sound until the user decides.
    """
    files, present = {piece.file for piece in pieces}, {(piece.file, piece.part_name) for piece in pieces}
    ranges, owners = defaultdict[PurePath, list[SamplePart]](list), defaultdict[PurePath, list[str]](list)
    for (file, name), place in decisions.items():
        if file in files and (not name or (file, name) not in present):
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


def _divided(
    folder: Path, file: PurePath, place: FilePlace, photographed: Set[str], has_range: bool
) -> dict[Piece, FilePlace]:
    samples = {part: _sample(file, part, photographed) for part in parts_of(folder / file)}
    # Columns are parts only if they name several samples. The whole sheet is then no part.
    levels = defaultdict[str | None, set[str]](set)
    for part, sample in samples.items():
        if part.levels:
            levels[part.sheet].add(sample_key(sample))
    by_level = {sheet for sheet, keys in levels.items() if len(keys) > 1 and keys & photographed}
    samples = {part: one for part, one in samples.items() if bool(part.levels) == (part.sheet in by_level)}
    columns = [sample for part, sample in samples.items() if part.levels]
    # A worksheet or a table with the name of a sample is used although it has no readings: reading it reports why.
    samples = {
        part: sample
        for part, sample in samples.items()
        if part.headed or part.levels or sample_key(sample) in photographed
    }
    naming = [
        part for part, sample in samples.items() if part.rows_of is not None or sample_key(sample) in photographed
    ]
    keys, own = {sample_key(samples[part]) for part in naming}, sample_key(place.sample)
    is_divided = len(samples) > 1 and any(part.headed for part in naming)
    is_divided = is_divided or (bool(columns) and all(columns))
    tables = [part for part in samples if part.cells is not None and not any(map(crack_depth, part.title))]
    unnamed = not naming and len(tables) > 1 and not (has_range and own in photographed)
    if unnamed:
        samples = {part: sample for part, sample in samples.items() if part.cells is None or part in tables}
    if not unnamed and (not naming or (keys == {own} and not is_divided)):
        return {Piece(file): place}
    if own in photographed and own not in keys and all(samples.values()):
        # The file's name and its rows contradict each other: reading the file as that sample's reports it.
        by_column = next((part for part in naming if part.rows_of is not None), None)
        return {Piece(file, by_column and replace(by_column, rows_of=place.sample)): place}
    return {Piece(file, part): FilePlace(sample, "readings") for part, sample in _joined(samples).items()}


def _joined(samples: Mapping[SamplePart, str]) -> dict[SamplePart, str]:
    """Return the parts with their samples; columns of one sample become one part if their names differ."""
    joined: dict[object, tuple[SamplePart, str]] = {}
    alike = Counter((part.sheet, part.names, part.title) for part in samples if part.levels)
    for part, sample in samples.items():
        is_joined = part.levels is not None and alike[part.sheet, part.names, part.title] == 1
        key = (part.sheet, sample_key(sample)) if is_joined else part
        joined[key] = (joined[key][0].with_columns_of(part), sample) if key in joined else (part, sample)
    return dict(joined.values())


def _sample(file: PurePath, part: SamplePart, photographed: Set[str]) -> str:
    """Return the sample that a part of a file names; "" if it names none or several."""
    if (part.cells is None and part.levels is None) or part.rows_of is not None:
        return _sample_called(file, part.rows_of or part.sheet or "", photographed)
    named = [_samples_in(file, line, photographed) for line in (" ".join(part.title), *part.names)]
    # A column may be called P1 for its first repeat: a header names a sample only if all its columns do.
    samples = named[0] or (named[1] if len({tuple(one) for one in named[1:]}) == 1 else {})
    if samples:
        return next(iter(samples.values())) if len(samples) == 1 else ""
    titles = (match for line in part.title[::-1] if (match := TITLE.fullmatch(line.strip())))
    return _sample_called(file, next((title["after"] or title["alone"] for title in titles), ""), photographed)


def _samples_in(file: PurePath, text: str, photographed: Set[str]) -> dict[str, str]:
    """Return the samples with a photo that a line names, by their keys. A number alone must follow "sample"."""
    words, samples, end = list(WORD.finditer(text)), dict[str, str](), 0
    for start, first in enumerate(words):
        for last in words[start : start + MOST_WORDS][::-1]:
            name = text[first.start() : last.end()]
            sample = _sample_called(file, name, photographed)
            follows = start > 0 and plain_letters(words[start - 1].group()) in OF_SAMPLES
            is_name = follows or name == text.strip() or (DIGIT.search(name) and not name.isdecimal())
            if is_name and first.start() >= end and sample_key(sample) in photographed:
                samples[sample_key(sample)] = sample
                end = last.end()
                break
    return samples


def _sample_called(file: PurePath, name: str, photographed: Set[str]) -> str:
    """Return the sample with a name in a file.

    The name is read like that of a file in the same folder: P01 in May/all.csv means the sample May-P01. If May-P01 has
    no photo but P01 has one, it means P01.
    """
    path = PurePath(f"{as_label(name)}.csv")
    there, alone = (read_name(folder / path, camera_counts=True) for folder in (file.parent, PurePath()))
    place = alone if alone is not None and sample_key(alone.sample) in photographed else there
    place = there if there is not None and sample_key(there.sample) in photographed else place
    return place.sample if place is not None and name else ""
