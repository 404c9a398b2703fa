"""What of a lab's file is one sample's: the whole, or a part where several samples share a table of readings."""

from collections.abc import Iterator, Mapping, Set
from dataclasses import dataclass, replace
from pathlib import Path, PurePath

from sealtwin.lab.naming import Said, as_label, read_name
from validate.sheets.samples import Part, parts_of, sample_key


@dataclass(frozen=True)
class Piece:
    file: PurePath
    """Relative to the lab's folder."""
    part: Part | None = None
    """None: all of it."""

    @property
    def part_name(self) -> str:
        """As the pairing file says it."""
        return "" if self.part is None else str(self.part)

    def __str__(self) -> str:
        return f"{self.file}, {self.part}" if self.part else str(self.file)


def divide(folder: Path, named: Mapping[PurePath, Said], known: Set[str]) -> dict[Piece, Said]:
    """Each file as a whole, but for tables of readings that name samples themselves: these in parts.

    A column that names samples counts always, a worksheet's name where it is that of a sample in ``known``, the keys of
    samples with a photo; the other tables of such a workbook are then asked about, and what holds none is passed over.
    A worksheet of a known sample is its own though no readings are found in it: reading it tells why. Where a file's
    own name is that of a known sample, and nothing in it is, the file stays whole: reading it as that sample's then
    tells the contradiction.
    """
    return {
        piece: said_of_it
        for file, said in named.items()
        for piece, said_of_it in (
            _divided(folder, file, said, known) if said.role == "readings" else _whole(file, said)
        )
    }


def _whole(file: PurePath, said: Said) -> Iterator[tuple[Piece, Said]]:
    yield Piece(file), said


def _divided(folder: Path, file: PurePath, said: Said, known: Set[str]) -> Iterator[tuple[Piece, Said]]:
    all_labels = {part: _label(file, part) for part in parts_of(folder / file)}
    labels = {part: label for part, label in all_labels.items() if part.headed or sample_key(label) in known}
    naming = {part: label for part, label in labels.items() if part.rows_of is not None or sample_key(label) in known}
    keys, own = {sample_key(label) for label in naming.values()}, sample_key(said.sample)
    told_apart = len(labels) > 1 and any(part.headed for part in naming)
    if not naming or (keys == {own} and not told_apart):
        yield from _whole(file, said)
    elif own in known and own not in keys:
        by_column = next((part for part in naming if part.rows_of is not None), None)
        yield Piece(file, by_column and replace(by_column, rows_of=said.sample)), said
    else:
        yield from ((Piece(file, part), Said(label, "readings")) for part, label in labels.items())


def _label(file: PurePath, part: Part) -> str:
    """The sample that a part names, as if a file of that name lay there: in May/all.csv, P01 is May-P01."""
    said = read_name(file.parent / f"{as_label(part.rows_of or part.sheet or '')}.csv", camera_counts=True)
    return said.sample if said is not None else ""
