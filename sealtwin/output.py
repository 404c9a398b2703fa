"""What a fluid run shows of itself: the table [output] of a trial file."""

from pathlib import Path
from typing import Annotated

from pydantic import Field

from sealtwin.settings import Settings

CHECKPOINT = "checkpoint.npz"
"""Of a run that is not finished."""
FRAMES = Path("frames", "fill.pvd")
SNAPSHOTS = Path("snapshots", "snapshots.pvd")
"""In a run folder, beside the frames that they list."""

PAST_THE_END = 1.02
"""A moment so little after a run's end is its end: the paper looks at 15 s, our trial's nozzle is done after 14.8 s."""

Moment = Annotated[float, Field(ge=0, le=9999)]


class Output(Settings):
    """Pictures and frames of a run. They change nothing of it: with other ones its result stays the same."""

    frames_every_s: float | None = Field(default=None, ge=1e-3, le=9999)
    """Simulated time from one frame in frames/ to the next, for ParaView and 'sealtwin film'; left out, none are
    written. A film of a pour of 15 s wants 0.1: 150 frames of up to 0.7 MB in the paper's trial.
    """
    snapshots_s: tuple[Moment, ...] = Field(default=(0.5, 7.0, 15.0), max_length=100)
    """Moments of which snapshots/ gets pictures; the paper's. [] for none."""
