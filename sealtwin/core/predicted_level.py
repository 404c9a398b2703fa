"""Records of a level that was predicted and not read: what prediction.json holds, key by key."""

from sealtwin.core.comparison import InputEffect
from sealtwin.core.records import Floats, JsonRecord


class PredictedPart(JsonRecord):
    """One error of a predicted level, and its standard uncertainty: half the half-width of 95 % by it alone."""

    name: str
    """Name in words."""
    kind: str
    """numerics or inputs."""
    setting: str
    """Key of the trial file that declares it; empty for an error that none declares."""
    mean_level_mm: float
    """Standard uncertainty of the mean level."""
    place_mm: float
    """Standard uncertainty of the level at a place, root mean square along the crack."""


class PredictedLevel(JsonRecord):
    """The level of a run without readings, with its band by the numerics and by the declared inputs."""

    s_mm: Floats
    """Places along the crack; the next five are at them."""
    level_mm: Floats
    """Predicted level, from the face."""
    band_95_mm: Floats
    """Half-width of the 95 % band at each place by itself."""
    profile_band_95_mm: Floats
    """Half-width of the band that holds the whole level in 95 %."""
    numerics_mm: Floats | None
    """Standard uncertainty by the numerics; None where they are not known."""
    inputs_mm: Floats | None
    """Standard uncertainty by the inputs; None where none is declared."""
    mean_level_mm: float
    """Mean level along the crack."""
    mean_level_95_mm: tuple[float, float]
    """Ends of its 95 % interval."""
    parts: tuple[PredictedPart, ...]
    """All errors that the band is made of, each alone."""
    inputs: tuple[InputEffect, ...]
    """Effects of the inputs that were moved."""
    inputs_left_out: tuple[str, ...]
    """Names of the inputs without a declared uncertainty."""
    unfit: tuple[str, ...]
    """Reasons why the case is outside the domain of the fast model that moved the inputs."""
