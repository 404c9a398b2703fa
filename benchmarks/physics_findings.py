"""What a physics benchmark finds: a figure beside its reference, where that comes from, and how far off it may be."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Finding:
    """One line of the table. A tolerance comes from a source or from a reason, never from what was measured."""

    name: str
    measured: float
    unit: str
    reference: str
    source: str
    low: float | None = None
    """Without bounds the figure is reported and judges nothing."""
    high: float | None = None

    @property
    def met(self) -> bool:
        return (self.low is None or self.measured >= self.low) and (self.high is None or self.measured <= self.high)

    @property
    def judged(self) -> bool:
        return self.low is not None or self.high is not None

    @property
    def tolerance(self) -> str:
        if self.low is None and self.high is None:
            return "reported"
        if self.low is None or self.high is None:
            return f"<= {self.high:.4g}" if self.low is None else f">= {self.low:.4g}"
        return f"{self.low:.4g}" if self.low == self.high else f"{self.low:.4g} to {self.high:.4g}"


def within(
    name: str, measured: float, unit: str, reference: float, off: float, source: str, share: bool = True
) -> Finding:
    """A figure that may be off its reference by a share of it, or by an amount."""
    far = abs(reference) * off if share else off
    return Finding(name, measured, unit, f"{reference:.4g}", source, reference - far, reference + far)


Case = Callable[[], Sequence[Finding]]
