"""Keys of results: hashes of everything that a result depends on, including the numbers of the stages that compute it.

A stage number is raised whenever the same input gives another figure in the stage's results. Each stage defines its
own number.
"""

import hashlib
import json
from collections.abc import Mapping
from functools import cache
from importlib.metadata import version
from typing import Any

UNNUMBERED = 0
"""Number of a stage that a result does not record, such as validate in a study without readings."""


def stage_key(inputs: Mapping[str, str], settings: Mapping[str, Any], numbers: Mapping[str, int]) -> str:
    """Return the key of a result, made from its inputs, its settings, the package version and the stage numbers."""
    return content_key(
        {"inputs": dict(inputs), "settings": dict(settings), "version": _own_version(), "numbers": dict(numbers)}
    )


def content_key(content: Mapping[str, Any]) -> str:
    """Return a hash of JSON content, to compare within one call. It is not stored."""
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def number_words(numbers: Mapping[str, int]) -> str:
    """Return "digitise 1, simulate 2", with "unknown" for a number that is not recorded."""
    return ", ".join(f"{stage} {number or 'unknown'}" for stage, number in numbers.items()) or "unknown"


def other_numbers(recorded: Mapping[str, int], own: Mapping[str, int]) -> str:
    """Return how ``recorded`` stage numbers differ from ``own``, in words to follow "computed by". "" if equal."""
    numbers = {stage: recorded.get(stage, UNNUMBERED) for stage in own}
    before = {stage: number for stage, number in numbers.items() if number != own[stage]}
    now = {stage: own[stage] for stage in before}
    return f"{number_words(before)}, while this version has {number_words(now)}" if before else ""


@cache
def _own_version() -> str:
    """Return the package's version. Its metadata take a millisecond to parse, and a study has 20,000 keys."""
    return version("sealtwin")
