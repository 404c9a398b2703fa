"""One photo, or one table of readings, in several samples: most often a copy under a wrong name."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from pathlib import PurePath

from sealtwin.lab.catalogue import Catalogue
from sealtwin.lab.naming import Role
from sealtwin.lab.pieces import Piece
from sealtwin.lab.prepared import Prepared

LOOKED_AT: Mapping[Role, str] = {"photo": "photo", "readings": "table of readings"}
MOST_TOLD = 3


def twins(prepared: Sequence[Prepared], catalogue: Catalogue) -> dict[str, tuple[str, ...]]:
    """What is to be remarked about samples, by their keys: which share bytes with another one, here or in the lab."""
    holders: dict[tuple[Role, str], dict[str, str]] = defaultdict(dict)
    for each in prepared:
        for raw in each.raw:
            if raw.role in LOOKED_AT:
                part = each.sample.part if raw.role == "readings" else None
                piece = Piece(PurePath(raw.original), part)
                holders[raw.role, raw.sha256 if part is None else part.sha256][each.sample.key] = str(piece)
    remarks: dict[str, list[str]] = defaultdict(list)
    for (role, sha256), here in holders.items():
        files = {**catalogue.holders(sha256), **here}
        if len(files) > 1:
            told = [f"{name} of {key}" if key not in here else name for key, name in sorted(files.items())]
            more = f" and {len(told) - MOST_TOLD} more" if len(told) > MOST_TOLD else ""
            where = f"{', '.join(told[:MOST_TOLD])}{more}"
            for key in here:
                remarks[key].append(f"one {LOOKED_AT[role]} in {len(told)} samples: {where}. Is each of its own?")
    return {key: tuple(sentences) for key, sentences in remarks.items()}
