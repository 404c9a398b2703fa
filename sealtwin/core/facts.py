"""Facts: statements of a stage, a run or a comparison about its result.

Code compares the key, the kind or the level of a fact, never its sentence. The page, the PDF, the JSON file and the
terminal choose facts by their keys and print their sentences unchanged.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import ClassVar, Literal

Kind = Literal["figure", "finding", "doubt", "assumption", "remedy"]
"""Kind of a fact.

figure: a number of the result; finding: a conclusion from figures; doubt: a reason why the result may be wrong;
assumption: something that was assumed or neglected; remedy: what the user can do.
"""

Level = Literal["plain", "caution", "fault"]
"""Importance of a fact.

plain: read it with the result; caution: read it before the result; fault: there is no valid result.
"""


@dataclass(frozen=True)
class Fact:
    """A statement about a result: the sentence, and its parts for programs."""

    # pydantic reads this attribute. Importing pydantic here would take a tenth of a second.
    __pydantic_config__: ClassVar = {"extra": "forbid"}

    key: str
    """Subject as a dotted name, such as "walls.band". It does not depend on the value."""
    text: str
    """Sentence with its numbers and units."""
    value: float | int | str | None = None
    """Main number or name in the sentence, or None."""
    unit: str = ""
    """Unit of ``value``. Empty for a pure number or a name."""
    kind: Kind = "finding"
    """Kind of the fact: figure, finding, doubt, assumption or remedy."""
    level: Level = "plain"
    """Importance: plain; caution: read it before the result; fault: there is no valid result."""

    def __str__(self) -> str:
        return self.text


Facts = tuple[Fact, ...]


def doubt(
    key: str, text: str, value: float | int | str | None = None, unit: str = "", level: Level = "caution"
) -> Fact:
    """Return a fact of the kind "doubt", a warning about the result. Its default level is "caution"."""
    return Fact(key, text, value, unit, "doubt", level)


def texts(facts: Iterable[Fact]) -> tuple[str, ...]:
    """Return the sentence of each fact."""
    return tuple(fact.text for fact in facts)


def without(facts: Iterable[Fact], *keys: str) -> Facts:
    """Return the facts with none of the keys. The key "walls" also excludes "walls.band" and all other "walls.*"."""
    return tuple(fact for fact in facts if not _is_of(fact.key, keys))


def of_keys(facts: Iterable[Fact], *keys: str) -> Facts:
    """Return the facts with one of the keys. The key "walls" also includes "walls.band" and all other "walls.*"."""
    return tuple(fact for fact in facts if _is_of(fact.key, keys))


def _is_of(key: str, keys: tuple[str, ...]) -> bool:
    return any(f"{key}.".startswith(f"{start}.") for start in keys)
