"""Find the photographed sample that a file belongs to, by the words and the numbers of its name."""

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import PurePath
from typing import TypeVar

from sealtwin.lab.file_parts import Piece
from sealtwin.lab.found_files import DIGIT, LAB_WORDS, WORD, WORDS, FilePlace
from validate.readings.header_words import sample_key
from validate.readings.text_table import plain_letters

REVISION = re.compile(LAB_WORDS["revision"]["word"])
"""Pattern of a word such as v2. Its number is not part of a sample's name."""
ROLE_WORDS = frozenset[str]().union(*WORDS.values())
MONTH, DAY, YEAR = "(?:0[1-9]|1[0-2])", r"(?:0[1-9]|[12]\d|3[01])", r"(?:19[89]|20[0-4])\d"
HOUR, SIXTY = r"(?:[01]\d|2[0-3])", r"[0-5]\d"
DATE_OR_TIME = re.compile(
    rf"""(?<![^\W_])(?:
        {YEAR}(?P<sep>[-_.\ ]?){MONTH}(?P=sep){DAY}
            (?:[-_\ T]?{HOUR}{SIXTY}{SIXTY}|[_\ T]{HOUR}[-.h]{SIXTY}(?:[-.]{SIXTY})?)?
        |(?P<day_first>(?:0?[1-9]|[12]\d|3[01])\.(?:0?[1-9]|1[0-2])\.{YEAR}|{DAY}-{MONTH}-{YEAR})
        |{DAY}{MONTH}{YEAR}
        |[23]\d{MONTH}{DAY}
        |(?!0[0-4]){HOUR}{SIXTY}{SIXTY}
        |{YEAR}
    )(?![^\W_])""",
    re.VERBOSE,
)
"""Date, time or year in a file's name. 000123 is a counter: six digits alone are a time from 05 h on."""

Key = TypeVar("Key")
Decisions = Mapping[tuple[PurePath, str], FilePlace]
"""The user's decisions by file and by the name of its part; "" means the whole file."""


def with_owners(named: Mapping[Key, FilePlace], photos: Sequence[str]) -> dict[Key, FilePlace]:
    """Return the files, each with its own name for a sample replaced by that of a photo that it certainly belongs to.

    Such a file's name, or the photo's, has only words without a number, dates and times besides the other one:
    l08_misure_2026-05-12.csv belongs to L08.jpg. If other numbers or several photos leave a doubt, the photos' samples
    become ``likely``.
    """
    keys = {sample_key(photo) for photo in photos}
    owned: dict[Key, FilePlace] = {}
    for key, place in named.items():
        owned[key] = place
        if place.role in ("photo", "ignore") or sample_key(place.sample) in keys:
            continue
        sure = _hosts(place.sample, photos, certain=True)
        if len(set(map(sample_key, sure))) == 1 and not any(
            _is_within(sure[0], other) for other in photos if other not in sure
        ):
            owned[key] = replace(place, sample=sure[0], likely=())
        else:
            likely = sure or _hosts(place.sample, photos, certain=False)
            owned[key] = replace(place, likely=tuple({sample_key(one): one for one in likely}.values()))
    return owned


def place_files(named: Mapping[Piece, FilePlace], decisions: Decisions) -> dict[Piece, FilePlace]:
    """Return the sample and role of each piece. The user's decision on it or its file comes first, then its name.

    A file that is likely to belong to one photo without a file of its role is read as that sample's, if no other file
    is. The question about it remains.
    """
    placed: dict[Piece, FilePlace] = {}
    for piece, place in named.items():
        if (piece.file, "") in decisions:
            piece = Piece(piece.file)
        decision = decisions.get((piece.file, piece.part_name), place)
        is_open = sample_key(decision.sample) == sample_key(place.sample)
        placed[piece] = replace(decision, likely=place.likely if is_open else ())
    photos = sorted({place.sample for place in placed.values() if place.role == "photo"})
    undecided = {piece: one for piece, one in placed.items() if (piece.file, piece.part_name) not in decisions}
    placed |= with_owners(undecided, photos)
    taken = {(sample_key(place.sample), place.role) for place in placed.values()}
    for piece, place in placed.items():
        free = (name for name in place.likely if (sample_key(name), place.role) not in taken)
        placed[piece] = replace(place, likely=() if place.role in ("photo", "ignore") else tuple(free))
    wanted = Counter((sample_key(name), place.role) for place in placed.values() for name in place.likely)
    for piece, place in placed.items():
        if len(place.likely) == 1 and place.role != "text" and wanted[sample_key(place.likely[0]), place.role] == 1:
            placed[piece] = replace(place, read_as=place.likely[0])
    return placed


def _hosts(name: str, photos: Sequence[str], *, certain: bool) -> list[str]:
    """Return the photos' samples whose names are within ``name``, or have it within, except short for longer ones."""

    def fits(inner: str, outer: str) -> bool:
        return _is_within(inner, outer, certain=certain)

    hosts = [photo for photo in photos if fits(photo, name) or fits(name, photo)]
    return hosts if certain else [one for one in hosts if not any(fits(one, other) for other in hosts if other != one)]


def _is_within(inner: str, outer: str, *, certain: bool = True) -> bool:
    """Return True if consecutive words of ``outer`` are the name ``inner``.

    If ``certain``, its other words must have no numbers but dates and times, and no date if ``inner`` is a number.
    """
    own, words = _own_words(inner), _own_words(outer)
    key = sample_key(" ".join(word for word, _ in own))
    for start in range(len(words)):
        for end in range(start + 1, len(words) + 1):
            if key == sample_key(" ".join(word for word, _ in words[start:end])):
                before, after = outer[: words[start][1]], outer[words[end - 1][1] + len(words[end - 1][0]) :]
                if not certain or not (_has_number(before, key) or _has_number(after, key)):
                    return True
    return False


@cache
def _own_words(name: str) -> list[tuple[str, int]]:
    """Return the words of a name with their places, without words for a role or a version."""
    words = ((word.group(), word.start()) for word in WORD.finditer(name))
    return [(word, at) for word, at in words if not _is_beside(word)]


def _is_beside(word: str) -> bool:
    plain = plain_letters(word)
    return plain in ROLE_WORDS or REVISION.fullmatch(plain) is not None


def _has_number(text: str, key: str) -> bool:
    """Return True if a text beside the name of a sample has a number that is neither of a date nor of a version."""

    def without_date(match: re.Match[str]) -> str:
        # In P1-12-05-2026, 12 may belong to the sample.
        before = text[: match.start()][-1:]
        is_chained = match["day_first"] is not None and before != "" and before in match[0]
        return match[0] if is_chained else " "

    rest = text if key.isdigit() else DATE_OR_TIME.sub(without_date, text)
    return any(DIGIT.search(word) and not _is_beside(word) for word in WORD.findall(rest))
