"""The rule by which a claim of the paper agrees, is open or disagrees, whatever it is about."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, Literal, TypeVar

import numpy as np

Judgement = Literal["agrees", "open", "disagrees"]
"""A shape agrees where it holds as seen and with at least 95 of 100 draws; it disagrees where it holds with fewer than
5 of 100 and not as seen. A shape that the paper claims for each of several values agrees where it does for every one,
and disagrees where it does for any. A number disagrees where the paper's lies outside the middle 95 of 100 of ours, all
to the digits in which the paper gives it. All else is open. So a number never agrees: that a wide range holds it proves
little.

A draw is one set of redrawn readings and one more scatter of the runs.
"""
SURE, RARE = 0.95, 0.05
NOT_COMPUTED = "not computed yet"
Evidence = TypeVar("Evidence")


@dataclass(frozen=True)
class Claim:
    """A claim of the paper, and how it is measured on ours."""

    name: str
    words: str
    """The paper's own."""
    place: str
    how: str
    """What is computed here."""


@dataclass(frozen=True)
class Number(Claim, Generic[Evidence]):
    """A claim about a number."""

    paper: float
    unit: str
    digits: int
    """Behind the point, in which the paper gives it."""
    of: Callable[[Evidence], float]

    @property
    def stated(self) -> str:
        return f"{self.paper:.{self.digits}f} {self.unit}"


@dataclass(frozen=True)
class Shape(Claim, Generic[Evidence]):
    """A claim that holds or does not."""

    stated: str
    """The paper's, in few words."""
    seen: Callable[[Evidence], str]
    """What ours does, in figures."""
    holds: Callable[[Evidence], bool]


@dataclass(frozen=True)
class ShapeAtEach(Claim, Generic[Evidence]):
    """A claim that holds or does not at each value of a setting."""

    stated: str
    seen: Callable[[Evidence], str]
    holds: Callable[[Evidence], Sequence[bool]]
    """An answer for each value, in one order."""
    values: str
    """Their name, for example "D"."""


AnyClaim = Number[Evidence] | Shape[Evidence] | ShapeAtEach[Evidence]


@dataclass(frozen=True)
class Finding:
    """A claim against one study."""

    claim: Claim
    paper: str
    ours: str
    redrawn: str
    """What the draws make of it."""
    judgement: Judgement

    @property
    def name(self) -> str:
        return self.claim.name


def judge(claim: AnyClaim[Evidence], seen: Evidence, draws: Sequence[Evidence]) -> Finding:
    """Hold a claim against what was seen, and against ``draws`` of it."""
    match claim:
        case Number():
            return _number(claim, seen, draws)
        case Shape():
            holds, share = claim.holds(seen), float(np.mean([claim.holds(each) for each in draws]))
            redrawn = f"holds with {100 * share:.1f} %; as seen: {'yes' if holds else 'no'}"
            return Finding(claim, claim.stated, claim.seen(seen), redrawn, judge_shape(holds, share))
        case ShapeAtEach():
            return _at_each(claim, seen, draws)


def judge_shape(holds: bool, share: float) -> Judgement:
    """Judge a shape that holds as seen or not, and with a share of the draws."""
    if holds and share >= SURE:
        return "agrees"
    return "disagrees" if not holds and share < RARE else "open"


def not_computed(claim: AnyClaim[Evidence]) -> Finding:
    return Finding(claim, claim.stated, NOT_COMPUTED, NOT_COMPUTED, "open")


def _number(claim: Number[Evidence], seen: Evidence, draws: Sequence[Evidence]) -> Finding:
    ends = np.quantile([claim.of(each) for each in draws], (RARE / 2, 1 - RARE / 2))
    # As the table shows them, so that nobody needs to take the judgement on trust.
    ours, low, high = (f"{value:.{claim.digits}f}" for value in (claim.of(seen), *ends))
    within = float(low) <= claim.paper <= float(high)
    judgement: Judgement = "open" if within else "disagrees"
    return Finding(claim, claim.stated, f"{ours} {claim.unit}", f"{low} to {high} {claim.unit}", judgement)


def _at_each(claim: ShapeAtEach[Evidence], seen: Evidence, draws: Sequence[Evidence]) -> Finding:
    holds = claim.holds(seen)
    shares = np.mean([claim.holds(each) for each in draws], axis=0)
    each = [judge_shape(bool(one), float(share)) for one, share in zip(holds, shares, strict=True)]
    counts = ", ".join(f"{word} at {each.count(word)}" for word in ("agrees", "open", "disagrees"))
    redrawn = f"{counts} of {len(each)} {claim.values}; as seen it holds at {sum(map(bool, holds))}"
    judgement: Judgement = "open"
    if all(word == "agrees" for word in each):
        judgement = "agrees"
    elif "disagrees" in each:
        judgement = "disagrees"
    return Finding(claim, claim.stated, claim.seen(seen), redrawn, judgement)
