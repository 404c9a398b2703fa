"""Which files are of one sample: by their names, as the user corrects it. What is in doubt is asked, never decided."""

from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import PurePath

from sealtwin.lab.naming import Role, Said, read_name, sample_key, within_one_letter

MOST_TOLD = 3
"""Names in one question; whoever has more sees them in the pairing file."""
LONGEST_NAME = 80
"""Of a sample, as of a trial."""


@dataclass(frozen=True)
class Placed:
    """A file with its place: of which sample it is, and what of it."""

    file: PurePath
    """Relative to the lab's folder."""
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

    @property
    def key(self) -> str:
        return sample_key(self.name)


def place_files(named: Mapping[PurePath, Said], decided: Mapping[PurePath, Placed]) -> list[Placed]:
    """Each file by the user's decision, or else by what its name says."""
    return [decided.get(file) or Placed(file, said.role, said.sample) for file, said in named.items()]


def pair(placed: Sequence[Placed]) -> list[Sample]:
    """Samples in the order of their names; files to be ignored are of none."""
    groups: dict[str, list[Placed]] = defaultdict(list)
    for item in placed:
        if item.role != "ignore":
            groups[item.key].append(item)
    near = _near_names(groups)
    samples = [
        Sample(_name(group), _files(group), tuple(_questions(key, group, groups, near)))
        for key, group in groups.items()
    ]
    return sorted(samples, key=lambda sample: sample.key)


def _name(group: Sequence[Placed]) -> str:
    """As the photo spells it."""
    return next((item.sample for item in group if item.role == "photo"), group[0].sample)


def _files(group: Sequence[Placed]) -> dict[Role, PurePath]:
    """Those that are alone in their role."""
    roles = Counter(item.role for item in group)
    return {item.role: item.file for item in group if roles[item.role] == 1}


def _questions(
    key: str, group: Sequence[Placed], groups: Mapping[str, Sequence[Placed]], near: Mapping[str, Sequence[str]]
) -> list[str]:
    if not key:
        return [f"{item.file}: its name says no sample; rename it, or give it a sample." for item in group]
    by_role: dict[Role, list[PurePath]] = defaultdict(list)
    for item in group:
        by_role[item.role].append(item.file)
    several = [
        f"{len(files)} files are its {_words(role)}: {_told(files)}; keep one, and give the others the role ignore."
        for role, files in by_role.items()
        if len(files) > 1
    ]
    alike = [groups[other] for other in near.get(key, ())]
    if "photo" not in by_role:
        orphan = f"{_told([item.file for item in group])}: no photo of sample {_name(group)}."
        if not alike:
            return [*several, f"{orphan} Add it, give it the sample's name, or give this the role ignore."]
        likely = [item.file for other in alike for item in other if item.role == "photo"]
        return [*several, f"{orphan} Is it of {_told(likely)}? Name both alike, or give this the role ignore."]
    for orphan in alike:
        other = _told([item.file for item in orphan])
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
            said = read_name(PurePath(item.file.name))
            last[sample_key(said.sample) if said else ""].add(key)
    for stem, keys in last.items():
        if stem and len(keys) <= MOST_TOLD:
            for key in keys - {""}:
                alike[key] = alike.get(key, set()) | keys - {key, ""}
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


def _told(files: Sequence[PurePath]) -> str:
    more = len(files) - MOST_TOLD
    return ", ".join(map(str, files[:MOST_TOLD])) + (f" and {more} more" if more > 0 else "")
