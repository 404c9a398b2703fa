"""Facts: what a stage, a run or a comparison states about its result.

A program compares the key, the kind or the level of a fact, never its sentence. Page, PDF, JSON and terminal print the
sentence as it is, and choose facts by their keys.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import ClassVar, Literal

Kind = Literal["figure", "finding", "doubt", "assumption", "remedy"]
"""Kind of a fact.

figure: a number of the result; finding: a conclusion from figures; doubt: something that may make the result wrong;
assumption: something that was taken for granted or left out; remedy: what to do.
"""

Level = Literal["plain", "caution", "fault"]
"""Weight of a fact.

plain: to be read with the result; caution: to be read before it; fault: there is no valid result.
"""


@dataclass(frozen=True)
class Fact:
    """A statement about a result, in parts and as a sentence."""

    # Set without pydantic, which takes a tenth of a second to import.
    __pydantic_config__: ClassVar = {"extra": "forbid"}

    key: str
    """Subject, with dots, such as "walls.band"; the same for all values."""
    text: str
    """The sentence, with its numbers and units."""
    value: float | int | str | None = None
    """Main number or name in the sentence; None if there is none."""
    unit: str = ""
    """Unit of a number; empty for a pure number or a name."""
    kind: Kind = "finding"
    """figure, finding, doubt, assumption or remedy."""
    level: Level = "plain"
    """plain; caution: to be read before the result; fault: there is no valid result."""

    def __str__(self) -> str:
        return self.text


Facts = tuple[Fact, ...]


def doubt(
    key: str, text: str, value: float | int | str | None = None, unit: str = "", level: Level = "caution"
) -> Fact:
    """Return a doubt, to be read before the result unless ``level`` says otherwise."""
    return Fact(key, text, value, unit, "doubt", level)


def texts(facts: Iterable[Fact]) -> tuple[str, ...]:
    """Return the sentences of facts."""
    return tuple(fact.text for fact in facts)


def without(facts: Iterable[Fact], *keys: str) -> Facts:
    """Return the facts that have none of the keys. A key also stands for those that begin with it and a dot."""
    return tuple(fact for fact in facts if not _is_of(fact.key, keys))


def of_keys(facts: Iterable[Fact], *keys: str) -> Facts:
    """Return the facts that have one of the keys, as in ``without``."""
    return tuple(fact for fact in facts if _is_of(fact.key, keys))


def _is_of(key: str, keys: tuple[str, ...]) -> bool:
    return any(f"{key}.".startswith(f"{each}.") for each in keys)
