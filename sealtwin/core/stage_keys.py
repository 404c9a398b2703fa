"""Keys of results: hashes of all that a result depends on, with the numbers of the stages that compute it.

A stage number is raised whenever the same input gives another number in the stage's results. The stages state their
own; this module only composes what it is given.
"""

import hashlib
import json
from collections.abc import Mapping
from functools import cache
from importlib.metadata import version
from typing import Any

UNNUMBERED = 0
"""Number of a stage that a result does not record, as of validate in a study without readings."""


def stage_key(inputs: Mapping[str, str], settings: Mapping[str, Any], numbers: Mapping[str, int]) -> str:
    """Return the key of a result: of its inputs, its settings, the package version and the ``numbers`` of stages."""
    return content_key(
        {"inputs": dict(inputs), "settings": dict(settings), "version": _own_version(), "numbers": dict(numbers)}
    )


def content_key(content: Mapping[str, Any]) -> str:
    """Return a hash of JSON content, for what is compared within one call and not kept."""
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def number_words(numbers: Mapping[str, int]) -> str:
    """Return "digitise 1, simulate 2"; a number that is not recorded is "unknown"."""
    return ", ".join(f"{stage} {number or 'unknown'}" for stage, number in numbers.items()) or "unknown"


def other_numbers(recorded: Mapping[str, int], own: Mapping[str, int]) -> str:
    """Return how the ``recorded`` stage numbers of a result differ from this version's ``own``; empty if they do not.

    The words follow "computed by".
    """
    known = {stage: recorded.get(stage, UNNUMBERED) for stage in own}
    before = {stage: number for stage, number in known.items() if number != own[stage]}
    now = {stage: own[stage] for stage in before}
    return f"{number_words(before)}, while this version has {number_words(now)}" if before else ""


@cache
def _own_version() -> str:
    """Return the package's version, whose metadata take a millisecond to parse: a study has 20,000 keys."""
    return version("sealtwin")
