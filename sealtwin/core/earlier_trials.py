"""Records of how far a lab's earlier trials were off, and of what that makes of a new computed level."""

from typing import Literal

from sealtwin.core.records import JsonRecord

Quantity = Literal["mean_level_mm", "fill_ratio", "heap_mm2"]
"""Name of a quantity that is computed and read: mean level; share of the room below the face that is filled; heap above
the face in mm³ on each mm of crack."""


class EarlierTrial(JsonRecord):
    """A trial whose readings were measured and held out: what was computed and what was read, over the same length."""

    name: str
    """Name of the sample."""
    level_error_mm: float
    """Mean of computed minus read level."""
    computed_fill_ratio: float
    """Share of the room below the face that the computed level fills."""
    read_fill_ratio: float
    """The same of the read level."""
    computed_heap_mm2: float
    """Heap above the face by the computed level, in mm³ on each mm of crack."""
    read_heap_mm2: float
    """The same by the read level."""


class Bias(JsonRecord):
    """Error of one quantity over several trials."""

    quantity: Quantity
    """mean_level_mm, fill_ratio or heap_mm2."""
    relative: bool
    """True where bias is a factor and scatter a share; else both are in the quantity's unit."""
    bias: float
    """Computed minus read, mean over the trials; where relative, computed over read, geometric mean."""
    scatter: float
    """Standard deviation of that from trial to trial; where relative, of its logarithm. Errors of readings included."""
    trials: int
    """Number of trials."""


class Expectation(Bias):
    """Value of a quantity that the readings of a new trial should find."""

    computed: float
    """Value that was computed for this trial."""
    expected: float
    """The same less the bias, or over it where it is a factor."""
    expected_95: tuple[float, float]
    """Ends of the 95 % interval for the next trial's readings, by Student's t."""


class EarlierTrials(JsonRecord):
    """A lab's earlier trials, and what they make of this one."""

    trials: tuple[EarlierTrial, ...]
    """Latest trial of each other sample of the lab that counts."""
    expectations: tuple[Expectation, ...]
    """Value that each quantity should have by them."""
