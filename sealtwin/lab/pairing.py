"""Which files are of one sample: by their names, as the user corrects it. What is in doubt is asked, never decided."""

from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import PurePath

from sealtwin.lab.naming import Role, Said, read_name, shorter_keys, within_one_letter
from sealtwin.lab.pieces import Piece
from validate.sheets.samples import Part, sample_key

MOST_TOLD = 3
"""Names in one question; whoever has more sees them in the pairing file."""
LONGEST_NAME = 80
"""Of a sample, as of a trial."""

Decisions = Mapping[tuple[PurePath, str], Said]
"""What the user has said of files, and of parts of them by their names; "" is the whole file."""


@dataclass(frozen=True)
class Placed:
    """A file, or a part of one, with its place: of which sample it is, and what of it."""

    piece: Piece
    role: Role
    sample: str
    by_user: bool = False
    """Otherwise by its name."""

    @property
    def key(self) -> str:
        return sample_key(self.sample)


@dataclass(frozen=True)
class Sample:
    """Files of one sample, and what is in doubt about them."""

    name: str
    files: Mapping[Role, PurePath]
    """One of a role; a photo among them, if ``questions`` is empty."""
    questions: tuple[str, ...]
    part: Part | None = None
    """Of the file of readings, where that is shared."""
    lost: tuple[str, ...] = ()
    """Files of its own that take no part, a sentence each, where no other stands in for them."""

    @property
    def key(self) -> str:
        return sample_key(self.name)


def place_files(named: Mapping[Piece, Said], decided: Decisions) -> list[Placed]:
    """Each piece by the user's decision, on it or on all of its file, or else by what its name says."""
    placed: dict[Piece, Placed] = {}
    for piece, said in named.items():
        whole = (piece.file, "") in decided
        placed_piece = Piece(piece.file) if whole else piece
        decision = decided.get((piece.file, "" if whole else piece.part_name))
        by = decision or said
        placed[placed_piece] = Placed(placed_piece, by.role, by.sample, by_user=decision is not None)
    return list(placed.values())


def pair(placed: Sequence[Placed]) -> list[Sample]:
    """Samples in the order of their names; files to be ignored are of none."""
    groups: dict[str, list[Placed]] = defaultdict(list)
    for item in placed:
        if item.role != "ignore":
            groups[item.key].append(item)
    near = _near_names(groups)
    samples = [
        Sample(_name(group), _files(group), tuple(_questions(key, group, groups, near)), _part(group))
        for key, group in groups.items()
    ]
    return sorted(samples, key=lambda sample: sample.key)


def _name(group: Sequence[Placed]) -> str:
    """As the photo spells it."""
    return next((item.sample for item in group if item.role == "photo"), group[0].sample)


def _files(group: Sequence[Placed]) -> dict[Role, PurePath]:
    """Those that are alone in their role."""
    roles = Counter(item.role for item in group)
    return {item.role: item.piece.file for item in group if roles[item.role] == 1}


def _part(group: Sequence[Placed]) -> Part | None:
    parts = [item.piece.part for item in group if item.role == "readings"]
    return parts[0] if len(parts) == 1 else None


def _questions(
    key: str, group: Sequence[Placed], groups: Mapping[str, Sequence[Placed]], near: Mapping[str, Sequence[str]]
) -> list[str]:
    if not key:
        return [f"{item.piece}: its name says no sample; rename it, or give it a sample." for item in group]
    by_role: dict[Role, list[Piece]] = defaultdict(list)
    for item in group:
        by_role[item.role].append(item.piece)
    several = [
        f"{len(files)} files are its {_words(role)}: {_told(files)}; keep one, and give the others the role ignore."
        for role, files in by_role.items()
        if len(files) > 1
    ]
    alike = [groups[other] for other in near.get(key, ())]
    if "photo" not in by_role:
        orphan = f"{_told([item.piece for item in group])}: no photo of sample {_name(group)}."
        if not alike:
            return [*several, f"{orphan} Add it, give it the sample's name, or give this the role ignore."]
        likely = [item.piece for other in alike for item in other if item.role == "photo"]
        return [*several, f"{orphan} Is it of {_told(likely)}? Name both alike, or give this the role ignore."]
    for orphan in alike:
        other = _told([item.piece for item in orphan])
        several.append(f"{_told(by_role['photo'])}: {other} has no photo and nearly its name; decide about it first.")
    return several


def _near_names(groups: Mapping[str, Sequence[Placed]]) -> dict[str, list[str]]:
    """For each sample without a photo those with one that it may belong to by a slip of the pen; and the other way."""
    with_photo = {key: any(item.role == "photo" for item in group) for key, group in groups.items()}
    if all(with_photo.values()):
        return {}
    alike = within_one_letter([key for key in groups if 0 < len(key) <= LONGEST_NAME])
    # May/P01.jpg and sheets/P01.csv: the last part of both names is the same.
    last: dict[str, set[str]] = defaultdict(set)
    for key, group in groups.items():
        for item in group:
            part = item.piece.part
            said = read_name(PurePath(item.piece.file.name if part is None else f"{part.rows_of or part.sheet}.csv"))
            last[sample_key(said.sample) if said else ""].add(key)
    for stem, keys in last.items():
        if stem and len(keys) <= MOST_TOLD:
            for key in keys - {""}:
                alike[key] = alike.get(key, set()) | keys - {key, ""}
    # P02_xyz.csv may be of P02.
    for key, group in groups.items():
        if not with_photo[key]:
            longer = {other for item in group for other in shorter_keys(item.sample)} & with_photo.keys() - {key}
            alike[key] = alike.get(key, set()) | longer
    near: dict[str, list[str]] = {}
    for key, keys in alike.items():
        if not with_photo[key]:
            near[key] = sorted(other for other in keys if with_photo[other] and _waits_for(groups[other], groups[key]))
    for orphan, keys in list(near.items()):
        # Of several that may be meant none is singled out.
        if len(keys) == 1:
            near.setdefault(keys[0], []).append(orphan)
    return near


def _waits_for(group: Sequence[Placed], orphan: Sequence[Placed]) -> bool:
    """Whether a sample lacks all that the orphan has."""
    return not {item.role for item in group} & {item.role for item in orphan}


def _words(role: Role) -> str:
    return role.replace("_", " ")


def _told(pieces: Sequence[Piece]) -> str:
    more = len(pieces) - MOST_TOLD
    return ", ".join(map(str, pieces[:MOST_TOLD])) + (f" and {more} more" if more > 0 else "")
